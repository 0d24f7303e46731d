// SPDX-License-Identifier: Apache-2.0
// Compares prefiltered environments with known integrals.
#include "core/shading/environment_maps.h"
#include "core/shading/studio.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

#include "core/base/parallel.h"
#include "support/numbers.h"

namespace peeler::test {
namespace {

/// Returns a picture of `width` x `width / 2` pixels. radiance(u, v) gives the radiance at a
/// pixel's centre.
Environment environmentOf(int width, const std::function<glm::vec3(float, float)>& radiance) {
    Environment result;
    result.width = width;
    result.height = width / 2;
    for (int y = 0; y < result.height; ++y)
        for (int x = 0; x < width; ++x)
            result.radiance.push_back(
                radiance((static_cast<float>(x) + 0.5F) / static_cast<float>(width),
                         (static_cast<float>(y) + 0.5F) / static_cast<float>(result.height)));
    return result;
}

void forEachTexel(const CubeMap& cube, const std::function<void(glm::vec3, glm::vec3)>& check) {
    std::size_t i = 0;
    for (int face = 0; face < 6; ++face)
        for (int y = 0; y < cube.size; ++y)
            for (int x = 0; x < cube.size; ++x)
                check(cubeDirection(face, x, y, cube.size), cube.texels[i++]);
}

/// Returns the direction of the brightest texel.
glm::vec3 brightest(const CubeMap& cube) {
    glm::vec3 found(0);
    float most = 0;
    forEachTexel(cube, [&](glm::vec3 direction, glm::vec3 radiance) {
        if (radiance.g > most) found = direction, most = radiance.g;
    });
    return found;
}

TEST(EnvironmentMaps, FacesAreOpenGLs) {
    const glm::vec3 axes[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    for (int face = 0; face < 6; ++face)
        EXPECT_GT(glm::dot(cubeDirection(face, 4, 4, 9), axes[face]), 0.9999F);
    // The first texel of +X points up and toward +Z.
    EXPECT_GT(cubeDirection(0, 0, 0, 9).y, 0.5F);
    EXPECT_GT(cubeDirection(0, 0, 0, 9).z, 0.5F);
}

TEST(EnvironmentMaps, AWhiteOneStaysWhite) {
    const auto maps =
        prefilter(environmentOf(64, [](float, float) { return glm::vec3(1, 2, 0.5F); }));
    ASSERT_EQ(maps.radiance.size(), 4U);
    for (const CubeMap& level : maps.radiance)
        forEachTexel(level, [](glm::vec3, glm::vec3 radiance) {
            for (int c = 0; c < 3; ++c)
                ASSERT_NEAR(radiance[c], glm::vec3(1, 2, 0.5F)[c], 1e-5);
        });
    forEachTexel(maps.irradiance,
                 [](glm::vec3, glm::vec3 value) { ASSERT_NEAR(value.g, 2, 1e-4); });
}

TEST(EnvironmentMaps, HalfWhiteHalfBlackHasTheIrradianceOfAHemisphere) {
    const auto maps =
        prefilter(environmentOf(256, [](float, float v) { return glm::vec3(v < 0.5F ? 1 : 0); }));
    forEachTexel(maps.irradiance, [](glm::vec3 n, glm::vec3 value) {
        ASSERT_NEAR(value.g, 0.5 + 0.5 * double(n.y), 0.01);
    });
    // A lobe around a horizontal axis covers both halves equally, for any width.
    for (const CubeMap& level : maps.radiance) {
        const auto row = static_cast<std::size_t>(level.size / 2 * level.size);
        const double mean = 0.5 * double(level.texels[row].g + level.texels[row - 1].g);
        EXPECT_NEAR(mean, 0.5, 0.02) << level.size;
    }
    // The texel straight up sees only white: even the roughest lobe ends at the horizon.
    EXPECT_NEAR(maps.radiance.back().texels[2 * 64 + 3 * 8 + 3].g, 1, 0.02);
}

TEST(EnvironmentMaps, OneBrightPixelIsASmallLamp) {
    constexpr int kWidth = 256, kX = 40, kY = 50;
    const auto maps = prefilter(environmentOf(kWidth, [](float u, float v) {
        const bool lit = static_cast<int>(u * kWidth) == kX && static_cast<int>(v * 128) == kY;
        return glm::vec3(lit ? 1000 : 0);
    }));
    const double longitude = (0.5 - (kX + 0.5) / kWidth) * 2 * kPi;
    const double latitude = (0.5 - (kY + 0.5) / 128) * kPi;
    const glm::vec3 lamp(std::sin(longitude) * std::cos(latitude), std::sin(latitude),
                         std::cos(longitude) * std::cos(latitude));
    const double solid_angle = 2 * kPi / kWidth * kPi / 128 * std::cos(latitude);
    forEachTexel(maps.irradiance, [&](glm::vec3 n, glm::vec3 value) {
        const double expected = 1000 * solid_angle * std::max(0.0F, glm::dot(n, lamp)) / kPi;
        ASSERT_NEAR(value.g, expected, 0.02 * 1000 * solid_angle / kPi);
    });
    EXPECT_GT(glm::dot(brightest(maps.radiance.front()), lamp), 0.999F);
}

TEST(EnvironmentMaps, TurnAboutTheVertical) {
    // A bright spot in the middle of the picture is in the direction +Z.
    Environment source = environmentOf(64, [](float u, float v) {
        return glm::vec3(std::abs(u - 0.5F) < 0.03F && std::abs(v - 0.5F) < 0.05F ? 1 : 0);
    });
    const auto seenAt = [&](double degrees) {
        source.rotation = degrees * kPi / 180;
        return brightest(prefilter(source).irradiance);
    };
    EXPECT_GT(glm::dot(seenAt(0), glm::vec3(0, 0, 1)), 0.99F);
    EXPECT_GT(glm::dot(seenAt(90), glm::vec3(1, 0, 0)), 0.99F);
    EXPECT_GT(glm::dot(seenAt(-90), glm::vec3(-1, 0, 0)), 0.99F);
    const float half = std::sqrt(0.5F);
    EXPECT_GT(glm::dot(seenAt(135), glm::vec3(half, 0, -half)), 0.99F);
}

TEST(EnvironmentMaps, TheLeftOfTheMiddleIsAlongX) {
    const auto maps = prefilter(environmentOf(64, [](float u, float v) {
        return glm::vec3(std::abs(u - 0.25F) < 0.03F && std::abs(v - 0.5F) < 0.05F ? 1 : 0);
    }));
    EXPECT_GT(glm::dot(brightest(maps.irradiance), glm::vec3(1, 0, 0)), 0.99F);
}

/// Integrates light that increases toward +X over a GGX lobe by brute force. The lobe is seen along
/// the normal and weighted by the cosine.
double blurredSlope(double roughness, double inclination) {
    const double a2 = std::pow(roughness, 4);
    double sum = 0, weights = 0;
    constexpr int kSteps = 400;
    for (int i = 0; i < kSteps; ++i) {
        const double theta = (i + 0.5) / kSteps * kPi / 2;  // polar angle of the mirrored direction
        const double cosine_h = std::cos(theta / 2);
        const double d = cosine_h * cosine_h * (a2 - 1) + 1;
        const double weight = a2 / (d * d) * std::cos(theta) * std::sin(theta);
        // The average of a linear function around the lobe's axis is its component along the axis.
        sum += weight * (1 + std::cos(theta) * std::sin(inclination));
        weights += weight;
    }
    return sum / weights;
}

TEST(EnvironmentMaps, LevelsAreTheConvolutionWithGgx) {
    // The radiance is 1 + x, linear in the direction, so the integral is easy.
    const auto maps = prefilter(environmentOf(256, [](float u, float v) {
        const double longitude = (0.5 - double(u)) * 2 * kPi, latitude = (0.5 - double(v)) * kPi;
        return glm::vec3(static_cast<float>(1 + std::sin(longitude) * std::cos(latitude)));
    }));
    for (std::size_t level = 0; level < maps.radiance.size(); ++level) {
        const double roughness =
            levelRoughness(static_cast<int>(level), static_cast<int>(maps.radiance.size()));
        forEachTexel(maps.radiance[level], [&](glm::vec3 n, glm::vec3 radiance) {
            const double inclination = std::asin(std::clamp(double(n.x), -1.0, 1.0));
            const double expected =
                roughness > 0 ? blurredSlope(roughness, inclination) : 1 + double(n.x);
            // Only some texels are compared, because brute force is slow.
            if (std::abs(n.y) > 0.1F || std::abs(n.z) < 0.6F) return;
            ASSERT_NEAR(radiance.g, expected, 0.015) << roughness;
        });
    }
}

/// Integrates a lamp over a GGX lobe about `n` by brute force. The lamp has radiance 1 within
/// `angle` of the direction `lamp`. The lobe is seen along the normal and weighted by the cosine.
double blurredLamp(double roughness, const glm::dvec3& n, const glm::dvec3& lamp, double angle) {
    const double a2 = std::pow(roughness, 4), cosine_lamp = glm::dot(n, lamp);
    const double sine_lamp = std::sqrt(std::max(0.0, 1 - cosine_lamp * cosine_lamp));
    double sum = 0, weights = 0;
    constexpr int kSteps = 600;
    for (int i = 0; i < kSteps; ++i) {
        // Steps are finer toward the lobe's axis.
        const double t = (i + 0.5) / kSteps, theta = t * t * kPi / 2;
        const double d = std::pow(std::cos(theta / 2), 2) * (a2 - 1) + 1;
        const double weight = t * a2 / (d * d) * std::cos(theta) * std::sin(theta);
        // `share` is the fraction of a circle about the axis that is inside the lamp.
        const double sines = std::sin(theta) * sine_lamp;
        const double bound = std::cos(angle) - std::cos(theta) * cosine_lamp;
        double share = bound < 0 ? 1 : 0;
        if (std::abs(bound) < sines) share = std::acos(bound / sines) / kPi;
        sum += weight * share;
        weights += weight;
    }
    return sum / weights;
}

TEST(EnvironmentMaps, ALampIsSeenAlikeAcrossTheEdgesOfFaces) {
    // Lamps near the edge between +X and +Z, and near a corner of the cube.
    for (const glm::dvec3& where : {glm::dvec3(1, 0.1, 0.97), glm::dvec3(1, 0.93, 1.05)}) {
        const glm::dvec3 lamp = glm::normalize(where);
        const double angle = 0.2;
        const auto maps = prefilter(environmentOf(512, [&](float u, float v) {
            const double longitude = (0.5 - double(u)) * 2 * kPi;
            const double latitude = (0.5 - double(v)) * kPi;
            const glm::dvec3 d(std::sin(longitude) * std::cos(latitude), std::sin(latitude),
                               std::cos(longitude) * std::cos(latitude));
            return glm::vec3(glm::dot(d, lamp) > std::cos(angle) ? 1 : 0);
        }));
        for (std::size_t level = 1; level < maps.radiance.size(); ++level) {
            const double roughness =
                levelRoughness(static_cast<int>(level), static_cast<int>(maps.radiance.size()));
            double most = 0;
            const double peak = blurredLamp(roughness, lamp, lamp, angle);
            forEachTexel(maps.radiance[level], [&](glm::vec3 n, glm::vec3 radiance) {
                const double expected = blurredLamp(roughness, n, lamp, angle);
                most = std::max(most, std::abs(static_cast<double>(radiance.g) - expected));
            });
            EXPECT_LT(most, 0.16 * peak) << roughness;
        }
    }
}

TEST(EnvironmentMaps, AreTheSameOnOneThread) {
    const Environment source =
        environmentOf(300, [](float u, float v) { return glm::vec3(u, v, u * v); });
    setThreadCount(1);
    const EnvironmentMaps alone = prefilter(source);
    setThreadCount(3);
    const EnvironmentMaps together = prefilter(source);
    setThreadCount(0);
    const auto same = [](const CubeMap& a, const CubeMap& b) {
        return a.texels.size() == b.texels.size() &&
               std::memcmp(a.texels.data(), b.texels.data(), a.texels.size() * sizeof(glm::vec3)) ==
                   0;
    };
    EXPECT_TRUE(same(alone.irradiance, together.irradiance));
    for (std::size_t i = 0; i < alone.radiance.size(); ++i)
        EXPECT_TRUE(same(alone.radiance[i], together.radiance[i]));
}

/// Returns the green light that a white diffuse surface with this normal reflects.
double whiteFacing(const EnvironmentMaps& maps, const glm::vec3& normal) {
    double nearest = -1, found = 0;
    forEachTexel(maps.irradiance, [&](glm::vec3 direction, glm::vec3 value) {
        const auto cosine = static_cast<double>(glm::dot(direction, normal));
        if (cosine > nearest) nearest = cosine, found = static_cast<double>(value.g);
    });
    return found;
}

TEST(Studio, BringsWhiteCloseToWhite) {
    const EnvironmentMaps maps = prefilter(studioEnvironment());
    EXPECT_NEAR(whiteFacing(maps, {0, 1, 0}), 1.12, 0.05);
    EXPECT_NEAR(whiteFacing(maps, {0, 0, 1}), 0.77, 0.06);
    // This normal points toward the key light.
    EXPECT_NEAR(whiteFacing(maps, glm::normalize(glm::vec3(-0.67F, 1, 0.74F))), 1.2, 0.05);
    // The far side and the underside are darker, so that there is some shading.
    EXPECT_NEAR(whiteFacing(maps, {1, 0, 0}), 0.44, 0.05);
    EXPECT_NEAR(whiteFacing(maps, {0, -1, 0}), 0.22, 0.05);
}

TEST(Studio, HasContrastForWhatMirrorsIt) {
    const Environment studio = studioEnvironment();
    std::size_t bright = 0, dark = 0;
    for (const glm::vec3& radiance : studio.radiance) {
        bright += radiance.g > 2 ? 1 : 0;
        dark += radiance.g < 0.2F ? 1 : 0;
    }
    const auto all = static_cast<double>(studio.radiance.size());
    EXPECT_NEAR(static_cast<double>(bright) / all, 0.06, 0.02);
    EXPECT_NEAR(static_cast<double>(dark) / all, 0.4, 0.15);
    // The floor has no pixel brighter than its grey.
    for (std::size_t p = studio.radiance.size() * 3 / 4; p < studio.radiance.size(); ++p)
        EXPECT_LT(studio.radiance[p].g, 0.41F);
}

TEST(Studio, IsTheSameOnOneThread) {
    setThreadCount(1);
    const Environment alone = studioEnvironment();
    setThreadCount(3);
    EXPECT_EQ(alone.radiance, studioEnvironment().radiance);
    setThreadCount(0);
}

TEST(EnvironmentMaps, LargePicturesKeepTheirMean) {
    // The picture is larger than the largest cube map, and its size is not a power of 2.
    const auto maps = prefilter(environmentOf(
        2500, [](float u, float) { return glm::vec3(std::fmod(u * 1250, 1.0F) * 2); }));
    EXPECT_EQ(maps.radiance.front().size, 512);
    forEachTexel(maps.irradiance,
                 [](glm::vec3, glm::vec3 value) { ASSERT_NEAR(value.g, 1, 0.02); });
}

}  // namespace
}  // namespace peeler::test
