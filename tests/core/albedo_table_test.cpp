// SPDX-License-Identifier: Apache-2.0
// The table against the integrals that it tabulates, done in another way.
#include "core/shading/environment_maps.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/numbers.h"

namespace peeler::test {
namespace {

constexpr int kLast = kAlbedoTableSize - 1;

glm::vec4 entry(const std::vector<glm::vec4>& table, int row, int column) {
    return table[static_cast<std::size_t>(row * kAlbedoTableSize + column)];
}

/// The albedo of GGX with Schlick's Fresnel term, light by light over the hemisphere.
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
            // fr cos: D G F / (4 n.l n.v) n.l
            sum += a2 / (kPi * d * d) * g2 * fresnel / (4 * n_dot_v) * std::sin(theta);
        }
    }
    return sum * 2 * (kPi / 2 / kSteps) * (kPi / kSteps);
}

TEST(AlbedoTable, IsSchlicksTermForAMirror) {
    const auto table = albedoTable(false);
    for (int column = 6; column <= kLast; ++column) {  // the least roughness is not quite 0
        const double cosine = static_cast<double>(column) / kLast;
        EXPECT_NEAR(entry(table, 0, column).y, std::pow(1 - cosine, 5), 1e-3);
        EXPECT_NEAR(entry(table, 0, column).x + entry(table, 0, column).y, 1, 1e-3);
    }
}

TEST(AlbedoTable, IsTheIntegralOfGgx) {
    const auto table = albedoTable(false);
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
    for (const glm::vec4& value : albedoTable(true)) {
        EXPECT_GE(value.x, 0);
        EXPECT_GE(value.y, 0);
        EXPECT_LE(value.x + value.y, 1 + 1e-6F);
        EXPECT_GE(value.z, 0);
        EXPECT_LE(value.z, 1);
    }
}

TEST(AlbedoTable, OfSheenGrowsTowardGrazingAngles) {
    const auto table = albedoTable(true);
    for (const int row : {20, 40, 63})
        EXPECT_GT(entry(table, row, 6).z, entry(table, row, 60).z + 0.05F) << row;
    EXPECT_EQ(entry(albedoTable(false), 40, 6).z, 0);
}

TEST(AlbedoTable, OfSheenLeansTowardTheViewer) {
    // What fibres reflect comes from where the viewer is; the smoother they are, the more so. Seen
    // along the normal there is no such side.
    const auto table = albedoTable(true);
    for (const int column : {10, 30, 50})
        EXPECT_GT(entry(table, 26, column).w, entry(table, 60, column).w + 0.1F) << column;
    EXPECT_GT(entry(table, 60, 30).w, 0.1F);
    EXPECT_NEAR(entry(table, 40, kLast).w, 0, 1e-3);
    // The mean of a lobe of the albedo's own integrand, done more finely.
    double sum = 0, along = 0;
    constexpr int kSteps = 300;
    for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
            const double cosine = (i + 0.5) / kSteps, azimuth = kPi * (j + 0.5) / kSteps;
            const double share = sheenLobe(40.0 / kLast, 30.0 / kLast, cosine, azimuth);
            sum += share;
            along += share * std::sqrt(1 - cosine * cosine) * std::cos(azimuth);
        }
    }
    EXPECT_NEAR(entry(table, 40, 30).w, along / sum, 0.01);
}

}  // namespace
}  // namespace peeler::test
