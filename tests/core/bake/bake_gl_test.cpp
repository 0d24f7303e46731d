// SPDX-License-Identifier: Apache-2.0
// Tests baked values against analytic answers.
#include "core/bake/bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>
#include <string>
#include <vector>

#include <peeler/error.h>
#include "core/bake/receivers.h"
#include "core/base/process_memory.h"
#include "support/capture.h"
#include "support/numbers.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

const glm::vec3 kUp(0, 1, 0), kDown(0, -1, 0);

BakeSettings settingsOf(BakeQuantity quantity, int directions = 512) {
    BakeSettings settings;
    settings.quantity = quantity;
    settings.directions = directions;
    settings.resolution = 192;
    return settings;
}

class Bakery {
  public:
    Bakery(const std::string& engine, const Scene& scene)
        : scene_(scene), shown_(scene), source_(openHits(engine, shown_)), vertices_(shown_) {}

    const PosedScene& shown() const { return shown_; }
    const VertexReceivers& vertices() const { return vertices_; }

    std::vector<float> operator()(const Receivers& receivers, const BakeSettings& settings,
                                  const SurfaceLookup& lookup = {}, std::uint64_t memory = 0) {
        CaptureSettings capture;
        capture.faces = Faces::kBoth;
        capture.memory = memory;
        return bake(*source_, receivers, settings, capture, lookup, {});
    }
    std::vector<float> atVertices(const BakeSettings& settings) {
        return (*this)(vertices_.receivers(), settings, vertices_.lookup());
    }

  private:
    const Scene& scene_;
    PosedScene shown_;
    std::unique_ptr<HitSource> source_;
    VertexReceivers vertices_;
};

/// Adds a horizontal square around a point. It faces +Y or, with `down`, −Y.
int plate(SceneBuilder& builder, const glm::vec3& center, float half, int material,
          bool down = false) {
    const float s = down ? -half : half;
    return builder.quad(center + glm::vec3(-half, 0, s), center + glm::vec3(half, 0, s),
                        center + glm::vec3(half, 0, -s), center + glm::vec3(-half, 0, -s),
                        material);
}

/// Adds the sides of a box around the origin. They face outward or, with `inward`, inward.
void box(SceneBuilder& builder, const glm::vec3& half, int material, bool inward = false) {
    for (int axis = 0; axis < 3; ++axis) {
        for (const float sign : {-1.0F, 1.0F}) {
            glm::vec3 out(0), a(0), b(0);
            out[axis] = sign * half[axis];
            a[(axis + 1) % 3] = half[(axis + 1) % 3];
            b[(axis + 2) % 3] = half[(axis + 2) % 3];
            if ((sign < 0) != inward) std::swap(a, b);
            builder.quad(out - a - b, out + a - b, out + a + b, out - a + b, material);
        }
    }
}

/// Adds a polygon parallel to the floor. Its area is that of a circle of this radius.
void disc(SceneBuilder& builder, float height, double radius, int material) {
    constexpr int kSides = 90;
    const double wedge = 2 * kPi / kSides;
    const double corner = radius * std::sqrt(wedge / std::sin(wedge));
    std::vector<glm::vec3> positions;
    const auto at = [&](int i) {
        return glm::vec3(corner * std::cos(wedge * i), height, corner * std::sin(wedge * i));
    };
    for (int i = 0; i < kSides; ++i)
        positions.insert(positions.end(), {glm::vec3(0, height, 0), at(i + 1), at(i)});
    builder.triangles(positions, material);
}

/// Adds a sphere of radius 1 that faces inward and has no top: the part within `opening` radians of
/// +Y is missing.
void bowl(SceneBuilder& builder, double opening, int material) {
    constexpr std::uint32_t kRows = 64, kColumns = 128;
    Primitive p;
    p.material = material;
    for (std::uint32_t row = 0; row <= kRows; ++row) {
        const double polar = opening + (kPi - opening) * row / kRows;
        for (std::uint32_t column = 0; column <= kColumns; ++column) {
            const double around = 2 * kPi * column / kColumns;
            p.positions.emplace_back(std::sin(around) * std::sin(polar), std::cos(polar),
                                     std::cos(around) * std::sin(polar));
            p.normals.push_back(-p.positions.back());
            if (row == kRows || column == kColumns) continue;
            const std::uint32_t a = row * (kColumns + 1) + column, b = a + kColumns + 1;
            p.indices.insert(p.indices.end(), {a, a + 1, b, a + 1, b + 1, b});
        }
    }
    builder.scene().meshes.push_back({"bowl", {p}});
    builder.instance(static_cast<int>(builder.scene().meshes.size()) - 1, glm::dmat4(1));
}

int emitter(SceneBuilder& builder, float albedo, float radiance, bool double_sided = true) {
    const int material = builder.lit(
        builder.material(glm::vec4(albedo, albedo, albedo, 1), AlphaMode::kOpaque, double_sided));
    builder.scene().materials[static_cast<std::size_t>(material)].emissive = glm::vec3(radiance);
    return material;
}

void useUniformSky(SceneBuilder& builder, float radiance) {
    builder.scene().environment =
        Environment{8, 4, std::vector<glm::vec3>(32, glm::vec3(radiance)), 0, 1};
}

void expectAll(const std::vector<float>& values, double expected, double tolerance) {
    ASSERT_FALSE(values.empty());
    const auto [least, most] = std::ranges::minmax(values);
    EXPECT_NEAR(least, expected, tolerance);
    EXPECT_NEAR(most, expected, tolerance);
}

double mean(const std::vector<float>& values) {
    double sum = 0;
    for (const float value : values)
        sum += static_cast<double>(value);
    return sum / static_cast<double>(values.size());
}

/// Instantiated for each engine (--engine).
class Bake : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(By, Bake, testing::Values("cpu", "gl"),
                         [](const auto& row) { return std::string(row.param); });

TEST_P(Bake, NothingOccludesAConvexBody) {
    for (const bool round : {true, false}) {
        SceneBuilder builder;
        const int white = builder.material(glm::vec4(1), AlphaMode::kOpaque);
        if (round)
            builder.sphere({1, 2, 3}, 5, white);
        else
            box(builder, {1, 2, 3}, white);
        Bakery bakery(GetParam(), builder.scene());
        const auto ao = bakery.atVertices(settingsOf(BakeQuantity::kAmbientOcclusion, 256));
        SCOPED_TRACE(round ? "sphere" : "box");
        // A bundle samples facets only at its rays, so a facet may seem to extend beyond its edges.
        // The tolerance for this error is larger for the sphere, which has more edges than the box.
        expectAll(ao, 1, round ? 0.03 : 5e-4);
        EXPECT_GT(mean(ao), 0.998);
    }
}

TEST_P(Bake, FarFromTheOriginTheSameIsSeen) {
    const auto baked = [](double offset) {
        SceneBuilder builder;
        const int white = builder.material(glm::vec4(1), AlphaMode::kOpaque);
        builder.sphere({0, 0, 0}, 1, white);
        plate(builder, glm::vec3(0, -1, 0), 3, white);
        for (Node& node : builder.scene().nodes)
            node.local = glm::translate(glm::dmat4(1), glm::dvec3(offset)) * node.local;
        Bakery bakery(GetParam(), builder.scene());
        return bakery.atVertices(settingsOf(BakeQuantity::kAmbientOcclusion, 64));
    };
    const std::vector<float> near = baked(0), far = baked(1 << 20);
    ASSERT_EQ(near.size(), far.size());
    double squares = 0;
    for (std::size_t i = 0; i < near.size(); ++i) {
        const double difference = static_cast<double>(near[i] - far[i]);
        squares += difference * difference;
    }
    EXPECT_LT(std::sqrt(squares / static_cast<double>(near.size())), 0.005);
}

/// A floor with a disc as a roof above its middle.
class UnderARoof : public testing::TestWithParam<const char*> {
  protected:
    void build(double radius, float height, float floor = 2) {
        const int white = builder_.material(glm::vec4(1), AlphaMode::kOpaque);
        plate(builder_, glm::vec3(0), floor, white);
        disc(builder_, height, radius, white);
    }
    float value(const BakeSettings& settings) {
        Bakery bakery(GetParam(), builder_.scene());
        return bakery({{glm::dvec3(0)}, {kUp}}, settings).front();
    }
    SceneBuilder builder_;
};
INSTANTIATE_TEST_SUITE_P(By, UnderARoof, testing::Values("cpu", "gl"),
                         [](const auto& row) { return std::string(row.param); });

TEST_P(UnderARoof, ADiscHidesItsFormFactor) {
    build(1, 0.75F);
    // With the disc's radius R and height h, the unoccluded share is 1 − R² / (R² + h²), by
    // Howell's catalogue of configuration factors, B-12.
    EXPECT_NEAR(value(settingsOf(BakeQuantity::kAmbientOcclusion, 1024)), 0.36, 0.01);
    // Sky visibility equals ambient occlusion here because the receiver's normal points straight
    // up.
    EXPECT_NEAR(value(settingsOf(BakeQuantity::kSkyVisibility, 1024)), 0.36, 0.01);
}

TEST_P(UnderARoof, AnInfinitePlateHidesAll) {
    build(40, 0.4F, 40);
    EXPECT_NEAR(value(settingsOf(BakeQuantity::kAmbientOcclusion)), 0.0001, 0.002);
}

TEST_P(UnderARoof, WhatIsFartherThanTheLargestDistanceHidesNothing) {
    build(1, 0.5F);
    BakeSettings settings = settingsOf(BakeQuantity::kAmbientOcclusion, 1024);
    settings.max_distance = 0.8;  // rays reach the disc only within R of its centre: R² = D² − h²
    EXPECT_NEAR(value(settings), 0.25 / 0.64, 0.01);
    settings.max_distance = 0.49;
    // On a GPU, rounded depths may let the floor occlude itself at grazing angles; hence the
    // tolerance.
    EXPECT_NEAR(value(settings), 1, 5e-5);
}

TEST_P(Bake, EveryPointOfABowlSeesAsMuchOfItsOpening) {
    // Inside a sphere, the form factor of a part is its share of the sphere's area, as seen from
    // any point.
    for (const double opening : {kPi / 2, kPi / 3}) {
        SceneBuilder builder;
        bowl(builder, opening, builder.material(glm::vec4(1), AlphaMode::kOpaque));
        Bakery bakery(GetParam(), builder.scene());
        std::vector<float> ao = bakery.atVertices(settingsOf(BakeQuantity::kAmbientOcclusion, 512));
        // Skip the rim, where a ray may see either side of the bowl.
        ao.erase(ao.begin(), ao.begin() + std::ptrdiff_t{2} * 129);
        const double expected = (1 - std::cos(opening)) / 2;
        EXPECT_NEAR(mean(ao), expected, 0.005);
        expectAll(ao, expected, 0.03);
    }
}

TEST_P(Bake, APlainSeesTheWholeSkyAndAWallHalfOfIt) {
    SceneBuilder builder;
    const int white = builder.material(glm::vec4(1), AlphaMode::kOpaque);
    plate(builder, glm::vec3(0), 3, white);
    builder.rectangle(3, 3, 0, white);
    Bakery bakery(GetParam(), builder.scene());
    const Receivers receivers{{{0, 0, 3}, {0, 1, 0}, {0, 3, 0}}, {kUp, {0, 0, 1}, {0, 0, 1}}};
    const auto sky = bakery(receivers, settingsOf(BakeQuantity::kSkyVisibility));
    const auto open = bakery(receivers, settingsOf(BakeQuantity::kAmbientOcclusion));
    EXPECT_LT(sky[0], 0.95);  // the wall hides some of the sky
    EXPECT_NEAR(sky[1], 0.5, 0.01);
    EXPECT_NEAR(sky[2], 0.5, 0.01);
    EXPECT_GT(open[1], 0.6);  // ambient occlusion also counts unoccluded rays below the horizon
    SceneBuilder plain;
    plate(plain, glm::vec3(0), 3, plain.material(glm::vec4(1), AlphaMode::kOpaque));
    Bakery lone(GetParam(), plain.scene());
    EXPECT_EQ(lone({{glm::dvec3(0)}, {kUp}}, settingsOf(BakeQuantity::kSkyVisibility)).front(), 1);
    EXPECT_EQ(lone({{glm::dvec3(0)}, {kDown}}, settingsOf(BakeQuantity::kSkyVisibility)).front(),
              0);
}

TEST_P(Bake, BentNormalsLeanAwayFromWalls) {
    SceneBuilder builder;
    const int white = builder.material(glm::vec4(1), AlphaMode::kOpaque);
    plate(builder, glm::vec3(0), 8, white);
    builder.rectangle(8, 8, 0, white);
    Bakery bakery(GetParam(), builder.scene());
    const Receivers receivers{{{0, 0, 0.2F}, {0, 0, -0.2F}}, {kUp, kDown}};
    const auto bent = bakery(receivers, settingsOf(BakeQuantity::kBentNormal, 1024));
    // Over half a hemisphere, the cosine-weighted sum of directions is 2/3 across the normal and
    // π/3 along the normal.
    const double slope = 2 / kPi, along = 1 / std::hypot(1, slope);
    EXPECT_NEAR(bent[0], 0, 0.02);
    EXPECT_NEAR(bent[1], along, 0.02);
    EXPECT_NEAR(bent[2], along * slope, 0.02);
    EXPECT_NEAR(glm::length(glm::vec3(bent[3], bent[4], bent[5])), 1, 1e-6);
    EXPECT_NEAR(bent[4], -along, 0.02);
    EXPECT_NEAR(bent[5], -along * slope, 0.02);
}

TEST_P(Bake, ThicknessOfASlabIsTheMeanOfItsDepthOverTheCosine) {
    SceneBuilder builder;
    box(builder, {5, 0.5F, 5}, builder.material(glm::vec4(1), AlphaMode::kOpaque));
    Bakery bakery(GetParam(), builder.scene());
    const Receivers receivers{{{0, 0.5F, 0}, {0.3F, -0.5F, 0.2F}}, {kUp, kDown}};
    BakeSettings settings = settingsOf(BakeQuantity::kThickness, 512);
    for (const double most : {1.0, 2.0, 4.0}) {
        settings.max_distance = most;
        // The mean capped thickness is ∫ min(h / cos, D) cos dω / π.
        expectAll(bakery(receivers, settings), 2 - 1 / most, 0.01);
    }
}

TEST_P(Bake, ThicknessOfASphereIsTheMeanOfItsChords) {
    SceneBuilder builder;
    builder.sphere({0, 1, 0}, 3, builder.material(glm::vec4(1), AlphaMode::kOpaque));
    Bakery bakery(GetParam(), builder.scene());
    // The cosine-weighted mean chord from a point of a sphere is 4 r / 3.
    expectAll(bakery.atVertices(settingsOf(BakeQuantity::kThickness)), 4, 0.06);
}

TEST_P(Bake, InAFurnaceAllIsAsBright) {
    for (const int bounces : {0, 1, 3}) {
        SceneBuilder builder;
        box(builder, {2, 1, 1.5F}, emitter(builder, 0.5F, 3, false), true);
        Bakery bakery(GetParam(), builder.scene());
        BakeSettings settings = settingsOf(BakeQuantity::kIrradiance, 64);
        settings.bounces = bounces;
        double series = 0;
        for (int k = 0; k <= bounces; ++k)
            series += std::pow(0.5, k);
        const Receivers inside{{{0, -1, 0}, {2, 0.3F, 0.4F}, {-1, 0.2F, 1.5F}, {0, 0, 0}},
                               {kUp, {-1, 0, 0}, {0, 0, -1}, glm::normalize(glm::vec3(1, 2, 3))}};
        const SurfaceLookup first = [](std::span<const float> values, std::uint32_t,
                                       const glm::vec2&) {
            return glm::vec3(values[0], values[1], values[2]);
        };
        expectAll(bakery(inside, settings, first), 3 * kPi * series, 1e-4);
    }
}

TEST_P(Bake, LightBouncesInABowlByItsFormFactor) {
    SceneBuilder builder;
    bowl(builder, kPi / 2, emitter(builder, 1, 0, false));
    useUniformSky(builder, 2);
    Bakery bakery(GetParam(), builder.scene());
    BakeSettings settings = settingsOf(BakeQuantity::kIrradiance, 64);
    float before = 0;
    for (const int bounces : {0, 1, 2}) {
        settings.bounces = bounces;
        const auto light = bakery.atVertices(settings);
        // Every point of the white bowl sees half of the sky and half of the bowl.
        EXPECT_NEAR(mean(light), 2 * kPi * (1 - std::pow(0.5, bounces + 1)), 0.02 * 2 * kPi);
        const float most = std::ranges::max(light);
        EXPECT_LT(most, 2 * kPi * 1.0001);  // no reflection is brighter than the sky
        EXPECT_GT(mean(light), before);
        before = static_cast<float>(mean(light));
    }
}

TEST_P(Bake, OnlyFrontsOfSingleSidedSurfacesShine) {
    for (const bool double_sided : {false, true}) {
        SceneBuilder builder;
        plate(builder, glm::vec3(0), 3, builder.material(glm::vec4(0, 0, 0, 1)));
        // The disc faces up, away from the receiver.
        disc(builder, 1, 1, emitter(builder, 0, 1, double_sided));
        Bakery bakery(GetParam(), builder.scene());
        BakeSettings settings = settingsOf(BakeQuantity::kIrradiance, 256);
        settings.bounces = 0;
        const auto light = bakery({{glm::dvec3(0)}, {kUp}}, settings);
        expectAll(light, double_sided ? kPi / 2 : 0, 0.03);
    }
}

/// Returns a hilly square with a vertex at every texel centre of a grid.
Scene hills(std::uint32_t size) {
    SceneBuilder builder;
    Primitive p;
    p.material = builder.material(glm::vec4(1), AlphaMode::kOpaque);
    for (std::uint32_t y = 0; y < size; ++y) {
        for (std::uint32_t x = 0; x < size; ++x) {
            const glm::vec2 uv((static_cast<float>(x) + 0.5F) / static_cast<float>(size),
                               (static_cast<float>(y) + 0.5F) / static_cast<float>(size));
            p.texcoords[0].push_back(uv);
            p.positions.emplace_back(4 * uv.x, std::sin(9 * uv.x) * std::cos(9 * uv.y), 4 * uv.y);
            p.normals.push_back(
                glm::normalize(glm::vec3(-2.25F * std::cos(9 * uv.x) * std::cos(9 * uv.y), 1,
                                         2.25F * std::sin(9 * uv.x) * std::sin(9 * uv.y))));
            if (x + 1 == size || y + 1 == size) continue;
            const std::uint32_t a = y * size + x, b = a + size;
            p.indices.insert(p.indices.end(), {a, b, a + 1, a + 1, b, b + 1});
        }
    }
    builder.scene().meshes.push_back({"hills", {p}});
    builder.instance(0, glm::dmat4(1));
    return builder.scene();
}

TEST_P(Bake, VerticesAndTexelsAgree) {
    const Scene scene = hills(64);
    Bakery bakery(GetParam(), scene);
    TexelSettings texel_settings;
    texel_settings.size = 64;
    const TexelReceivers texels(bakery.shown(), bakery.vertices(), texel_settings);
    const BakeSettings settings = settingsOf(BakeQuantity::kAmbientOcclusion, 256);
    const auto at_vertices = bakery.atVertices(settings);
    const auto at_texels =
        texels.pixels(texels.atlases().front(), bakery(texels.receivers(), settings), 1, 0);
    ASSERT_EQ(at_texels.size(), at_vertices.size());
    double squares = 0;
    for (std::size_t i = 0; i < at_texels.size(); ++i)
        squares += std::pow(static_cast<double>(at_texels[i] - at_vertices[i]), 2);
    EXPECT_LT(std::sqrt(squares / static_cast<double>(at_texels.size())), 0.002);
    const auto [least, most] = std::ranges::minmax(at_vertices);
    EXPECT_LT(least, 0.7F);
    EXPECT_GT(most, 0.98F);
}

TEST_P(Bake, BandsDoNotShow) {
    if (kShadowMemory) GTEST_SKIP() << "its memory is not the product's";
    const Scene scene = hills(64);
    Bakery bakery(GetParam(), scene);
    BakeSettings settings = settingsOf(BakeQuantity::kAmbientOcclusion, 16);
    settings.resolution = 1024;
    const Receivers& receivers = bakery.vertices().receivers();
    const auto at_once = bakery(receivers, settings);
    const auto tight = residentBytes() + (120ULL << 20);
    EXPECT_EQ(bakery(receivers, settings, {}, tight), at_once);
}

TEST_P(Bake, SumsOfReceiversCountUnderABudget) {
    const Scene scene = hills(4);
    Bakery bakery(GetParam(), scene);
    const BakeSettings settings = settingsOf(BakeQuantity::kIrradiance, 16);
    Receivers receivers;
    receivers.positions.resize(1 << 20);
    receivers.normals.resize(1 << 20);
    const std::uint64_t before = residentBytes();
    try {
        bakery(receivers, settings, {}, before + (32ULL << 20));
        FAIL() << "40 MB of sums and values in 32 MB";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kMemory);
        EXPECT_NE(std::string(error.what()).find("1048576 receivers"), std::string::npos);
        EXPECT_NE(error.where().find("`memory`"), std::string::npos);
        EXPECT_FALSE(error.hint().empty());
    }
    EXPECT_LT(residentBytes(), before + (16ULL << 20));  // refused before allocating the sums
}

}  // namespace
}  // namespace peeler::test
