// SPDX-License-Identifier: Apache-2.0
// Compares the albedo table with independently computed integrals.
#include "core/shading/albedo_table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/numbers.h"

namespace peeler::test {
namespace {

constexpr int kLast = kAlbedoTableSize - 1;

glm::vec4 entry(const std::vector<glm::vec4>& table, int row, int column) {
    return table[static_cast<std::size_t>(row * kAlbedoTableSize + column)];
}

/// Returns the albedo of GGX with Schlick's Fresnel term, integrated over the light directions of
/// the hemisphere.
double ggxAlbedo(double f0, double roughness, double n_dot_v) {
    const double a2 = std::pow(roughness, 4), v_sine = std::sqrt(1 - n_dot_v * n_dot_v);
    constexpr int kSteps = 300;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
            const double theta = (i + 0.5) / kSteps * kPi / 2, phi = (j + 0.5) / kSteps * kPi;
            const double n_dot_l = std::cos(theta);
            const double l_dot_v = std::sin(theta) * v_sine * std::cos(phi) + n_dot_l * n_dot_v;
            const double half = std::sqrt(2 + 2 * l_dot_v);
            const double n_dot_h = (n_dot_l + n_dot_v) / half, v_dot_h = (1 + l_dot_v) / half;
            const double d = n_dot_h * n_dot_h * (a2 - 1) + 1;
            const auto lambda = [&](double c) {
                return 0.5 * (std::sqrt(1 + a2 * (1 - c * c) / (c * c)) - 1);
            };
            const double g2 = 1 / (1 + lambda(n_dot_l) + lambda(n_dot_v));
            const double fresnel = f0 + (1 - f0) * std::pow(1 - v_dot_h, 5);
            // The BRDF times the cosine is D G F / (4 n·l n·v) n·l.
            sum += a2 / (kPi * d * d) * g2 * fresnel / (4 * n_dot_v) * std::sin(theta);
        }
    }
    return sum * 2 * (kPi / 2 / kSteps) * (kPi / kSteps);
}

TEST(AlbedoTable, IsSchlicksTermForAMirror) {
    const auto table = albedoTable();
    // Skip grazing angles, because the table's minimum roughness is not quite 0.
    for (int column = 6; column <= kLast; ++column) {
        const double cosine = static_cast<double>(column) / kLast;
        EXPECT_NEAR(entry(table, 0, column).y, std::pow(1 - cosine, 5), 1e-3);
        EXPECT_NEAR(entry(table, 0, column).x + entry(table, 0, column).y, 1, 1e-3);
    }
}

TEST(AlbedoTable, IsTheIntegralOfGgx) {
    const auto table = albedoTable();
    for (const int row : {25, 40, 63}) {
        for (const int column : {12, 31, 63}) {
            const glm::vec4 found = entry(table, row, column);
            for (const double f0 : {0.04, 0.5, 1.0})
                EXPECT_NEAR(f0 * double(found.x) + double(found.y),
                            ggxAlbedo(f0, double(row) / kLast, double(column) / kLast), 0.004)
                    << row << ", " << column;
        }
    }
}

TEST(AlbedoTable, NeverReflectsMoreThanArrives) {
    for (const glm::vec4& value : albedoTable()) {
        EXPECT_GE(value.x, 0);
        EXPECT_GE(value.y, 0);
        EXPECT_LE(value.x + value.y, 1 + 1e-6F);
        EXPECT_GE(value.z, 0);
        EXPECT_LE(value.z, 1);
    }
}

TEST(AlbedoTable, OfSheenGrowsTowardGrazingAngles) {
    const auto table = albedoTable();
    for (const int row : {20, 40, 63})
        EXPECT_GT(entry(table, row, 6).z, entry(table, row, 60).z + 0.05F) << row;
}

/// Returns the mean direction of GGX's reflection, integrated over the hemisphere, for a viewer in
/// the XZ plane on the side of -X. Takes the mean over the part of the reflection that F0 scales
/// or, with `bias`, over the part that F90 scales.
glm::dvec3 meanDirection(bool bias, double roughness, double n_dot_v) {
    const double a2 = std::pow(roughness, 4);
    const glm::dvec3 v(-std::sqrt(1 - n_dot_v * n_dot_v), 0, n_dot_v);
    constexpr int kSteps = 300;
    double sum = 0;
    glm::dvec3 moment(0);
    for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
            const double theta = (i + 0.5) / kSteps * kPi / 2, phi = (j + 0.5) / kSteps * kPi;
            const glm::dvec3 l(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                               std::cos(theta));
            const glm::dvec3 h = glm::normalize(l + v);
            const double d = h.z * h.z * (a2 - 1) + 1;
            const auto lambda = [&](double c) {
                return 0.5 * (std::sqrt(1 + a2 * (1 - c * c) / (c * c)) - 1);
            };
            const double schlick = std::pow(1 - glm::dot(l, h), 5);
            const double share = (bias ? schlick : 1 - schlick) / (d * d) /
                                 (1 + lambda(l.z) + lambda(n_dot_v)) * std::sin(theta);
            sum += share;
            moment += share * glm::dvec3(l.x, 0, l.z);
        }
    }
    return moment / sum;
}

/// Returns the mean cosine between the normal and the directions that are averaged into a
/// prefiltered level of this roughness.
double levelCosine(double roughness) {
    const double a2 = std::pow(roughness, 4);
    constexpr int kSteps = 20000;
    double sum = 0, moment = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double t = (i + 0.5) / kSteps, theta = t * t * kPi / 2;
        const double d = std::pow(std::cos(theta / 2), 2) * (a2 - 1) + 1;
        const double weight = t * std::cos(theta) * std::sin(theta) / (d * d);
        sum += weight;
        moment += weight * std::cos(theta);
    }
    return moment / sum;
}

TEST(LobeTable, HasMeanDirectionAndMeanCosineOfTheLobe) {
    const auto table = lobeTable();
    for (const int row : {25, 40, 55}) {
        for (const int column : {12, 31, 55}) {
            const double roughness = double(row) / kLast, n_dot_v = double(column) / kLast;
            const glm::vec4 found = entry(table, row, column);
            const glm::dvec3 mirrored(std::sqrt(1 - n_dot_v * n_dot_v), 0, n_dot_v);
            for (const bool bias : {false, true}) {
                const glm::dvec3 expected = meanDirection(bias, roughness, n_dot_v);
                const double turn = double(bias ? found.z : found.x);
                const double width = double(bias ? found.w : found.y);
                const glm::dvec3 looked =
                    glm::normalize(glm::mix(glm::dvec3(0, 0, 1), mirrored, turn));
                EXPECT_GT(glm::dot(looked, glm::normalize(expected)), std::cos(0.02))
                    << row << ", " << column << ", " << bias;
                EXPECT_NEAR(levelCosine(std::min(1.0, roughness * width)),
                            std::max(glm::length(expected), levelCosine(1)), 0.012)
                    << row << ", " << column << ", " << bias;
            }
        }
    }
}

TEST(LobeTable, OfMirrorsLooksAlongTheMirroredView) {
    const auto table = lobeTable();
    for (int column = 3; column <= kLast; ++column)
        EXPECT_NEAR(entry(table, 0, column).x, 1, 1e-3) << column;
    // The lobe is as wide as the filter of its mip level.
    EXPECT_NEAR(entry(table, 0, kLast).y, 1, 0.05);
}

}  // namespace
}  // namespace peeler::test
