// SPDX-License-Identifier: Apache-2.0
// White furnace tests: in a uniform white environment, a white surface is invisible and no surface
// is brighter than the environment.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "support/capture.h"
#include "support/lights.h"

namespace peeler::test {
namespace {

/// Minimum and maximum colour component over all pixels of a sphere in a white environment.
struct Range {
    float least = 1e9F, greatest = 0;
    int fragments = 0;
};
std::vector<Range> inFurnace(const std::vector<Material>& materials) {
    SceneBuilder builder;
    builder.scene().environment = uniformEnvironment(glm::vec3(1));
    const auto count = static_cast<float>(materials.size());
    for (std::size_t i = 0; i < materials.size(); ++i) {
        const int index = builder.lit(builder.material({1, 1, 1, 1}, AlphaMode::kOpaque, false));
        builder.scene().materials[static_cast<std::size_t>(index)] = materials[i];
        builder.sphere({(static_cast<float>(i) + 0.5F) * 2 - count, 0, -20}, 0.95F, index);
    }
    View view = testView(48 * static_cast<int>(materials.size()), 48);
    view.projection.perspective = false;
    view.projection.far = 100;
    view.projection.half_height = 1;
    view.projection.half_width = static_cast<double>(count);
    CaptureSettings s;
    s.color_type = PixelType::kFloat;
    const LayeredImage image = capture(builder.scene(), view, s).image;
    std::vector<Range> ranges(materials.size());
    for (std::size_t p = 0; p + 1 < image.offsets.size(); ++p) {
        Range& range = ranges[p % static_cast<std::size_t>(view.width) / 48];
        for (std::uint32_t f = image.offsets[p]; f < image.offsets[p + 1]; ++f) {
            ++range.fragments;
            for (int c = 0; c < 3; ++c) {
                range.least = std::min(range.least, color(image, f)[c]);
                range.greatest = std::max(range.greatest, color(image, f)[c]);
            }
        }
    }
    for (const Range& range : ranges)
        EXPECT_GT(range.fragments, 1500) << "the test sees nothing";
    return ranges;
}

Material white(float metallic, float roughness) {
    Material m;
    m.metallic = metallic;
    m.roughness = roughness;
    return m;
}

/// Returns white materials, metal and dielectric, with several roughnesses. `change` modifies each.
std::vector<Material> materials(const std::function<void(Material&, float)>& change) {
    std::vector<Material> all;
    for (const float metallic : {0.0F, 1.0F}) {
        for (const float roughness : {0.0F, 0.5F, 1.0F}) {
            all.push_back(white(metallic, roughness));
            change(all.back(), roughness);
        }
    }
    return all;
}

void expectWithin(const std::vector<Material>& tested, float least, float greatest) {
    const auto ranges = inFurnace(tested);
    for (std::size_t i = 0; i < ranges.size(); ++i) {
        EXPECT_GE(ranges[i].least, least) << "material " << i;
        EXPECT_LE(ranges[i].greatest, greatest) << "material " << i;
    }
}

TEST(Furnace, WhiteSpheresVanish) {
    std::vector<Material> all;
    for (const float metallic : {0.0F, 1.0F})
        for (int step = 0; step <= 5; ++step)
            all.push_back(white(metallic, static_cast<float>(step) * 0.2F));
    expectWithin(all, 0.98F, 1.02F);
}

TEST(Furnace, SpheresBetweenMetalAndDielectricVanish) {
    for (const float metallic : {0.25F, 0.5F, 0.75F}) {
        std::vector<Material> all;
        for (int step = 1; step <= 10; ++step)
            all.push_back(white(metallic, static_cast<float>(step) * 0.1F));
        expectWithin(all, 0.98F, 1.02F);
    }
}

TEST(Furnace, GreySpheresAreDarker) {
    Material grey = white(0, 1);
    grey.base_color = {0.5F, 0.5F, 0.5F, 1};
    const auto ranges = inFurnace({grey});
    EXPECT_LT(ranges[0].least, 0.6F);
    EXPECT_GT(ranges[0].least, 0.48F);
    EXPECT_LT(ranges[0].greatest, 0.8F);
}

TEST(Furnace, SpheresWithClearcoatVanish) {
    expectWithin(materials([](Material& m, float r) {
                     m.clearcoat.factor = 1;
                     m.clearcoat.roughness = 1 - r;
                 }),
                 0.98F, 1.02F);
}

TEST(Furnace, NoSheenIsBrighterThanWhite) {
    expectWithin(materials([](Material& m, float r) {
                     m.sheen.color = {1, 1, 1};
                     m.sheen.roughness = 1 - r;
                 }),
                 0.98F, 1.02F);
    expectWithin(materials([](Material& m, float r) {
                     m.sheen.color = {0.9F, 0.2F, 0.5F};
                     m.sheen.roughness = 0.5F + r / 2;
                 }),
                 0.3F, 1.02F);
}

TEST(Furnace, NoTintedReflectionIsBrighterThanWhite) {
    expectWithin(materials([](Material& m, float r) {
                     m.ior = 1.1F + r;
                     m.specular.color = {3, 0.5F, 1};
                     m.specular.factor = 0.8F;
                 }),
                 0.3F, 1.02F);
    expectWithin(materials([](Material& m, float) { m.ior = 2.4F; }), 0.98F, 1.02F);
}

TEST(Furnace, StretchedHighlightsAndFilmsKeepTheLight) {
    expectWithin(materials([](Material& m, float) {
                     m.anisotropy.strength = 1;
                     m.anisotropy.rotation = 0.5F;
                 }),
                 0.98F, 1.02F);
    expectWithin(materials([](Material& m, float r) {
                     m.iridescence.factor = 1;
                     m.iridescence.thickness_max = 300 + 200 * r;
                 }),
                 0.15F, 1.02F);
}

TEST(Furnace, AllTogetherIsNotBrighterThanWhite) {
    expectWithin(materials([](Material& m, float r) {
                     m.clearcoat.factor = 0.7F;
                     m.sheen.color = {0.5F, 0.7F, 0.2F};
                     m.sheen.roughness = r;
                     m.anisotropy.strength = 0.5F;
                     m.iridescence.factor = 0.5F;
                     m.specular.color = {2, 1, 0.1F};
                 }),
                 0.15F, 1.02F);
}

TEST(Environment, ReplacesTheBuiltInLight) {
    SceneBuilder builder;
    builder.rectangle(4, 4, -4, builder.lit(builder.material({1, 1, 1, 1}, AlphaMode::kOpaque)));
    builder.scene().environment = uniformEnvironment(glm::vec3(0));
    EXPECT_EQ(color(capture(builder.scene(), testView(8, 8)).image, 0), glm::vec4(0, 0, 0, 1));
    builder.scene().environment = uniformEnvironment({3, 2, 0.5F});
    const glm::vec4 lit = color(capture(builder.scene(), testView(8, 8)).image, 0);
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(lit[c], glm::vec3(3, 2, 0.5F)[c], 5e-3);
}

TEST(Environment, IsAddedToTheScenesLights) {
    SceneBuilder builder;
    builder.rectangle(4, 4, -4, builder.lit(builder.material({1, 1, 1, 1}, AlphaMode::kOpaque)));
    Light lamp;
    lamp.intensity = 3;
    builder.light(lamp, glm::dmat4(1));
    const auto center = [&] {
        CaptureSettings s;
        s.color_type = PixelType::kFloat;
        return color(capture(builder.scene(), testView(65, 65), s).image, 32 * 65 + 32).g;
    };
    builder.scene().environment = uniformEnvironment(glm::vec3(0));
    const float alone = center();
    EXPECT_NEAR(alone, 3 * (0.96 + 0.04 / 4) / 3.14159265, 1e-5);
    builder.scene().environment = uniformEnvironment(glm::vec3(1));
    EXPECT_NEAR(center() - alone, 1, 0.01F);
}

TEST(Environment, LightsASphereLikeTheHemisphereAboveIt) {
    SceneBuilder builder;
    const int white_paint = builder.lit(builder.material({1, 1, 1, 1}, AlphaMode::kOpaque, false));
    Material& m = builder.scene().materials[static_cast<std::size_t>(white_paint)];
    m.specular.factor = 0;  // leaves only diffuse light
    builder.sphere({0, 0, -3}, 1, white_paint);
    Environment above;
    above.width = 256;
    above.height = 128;
    above.radiance.assign(256 * 128, glm::vec3(0));
    std::fill_n(above.radiance.begin(), 256 * 64, glm::vec3(1));
    builder.scene().environment = above;
    View view = testView(33, 33);
    view.projection.perspective = false;
    view.projection.far = 100;
    view.projection.half_width = view.projection.half_height = 1;
    const LayeredImage image = capture(builder.scene(), view).image;
    int seen = 0;
    for (int y = 0; y < 33; ++y) {
        for (int x = 0; x < 33; ++x) {
            const std::size_t p = image.pixelIndex(x, y);
            const double nx = (x + 0.5) / 33 * 2 - 1, ny = 1 - (y + 0.5) / 33 * 2;
            if (image.count(p) == 0 || nx * nx + ny * ny > 0.95) continue;
            EXPECT_NEAR(color(image, image.offsets[p]).g, 0.5 + 0.5 * ny, 0.012) << x << ", " << y;
            ++seen;
        }
    }
    EXPECT_GT(seen, 600);
}

TEST(Environment, IsMirroredWhereItIs) {
    // A mirror that faces the viewer shows the environment behind the viewer, along +Z.
    SceneBuilder builder;
    const int index = builder.lit(builder.material({1, 1, 1, 1}, AlphaMode::kOpaque));
    Material& mirror = builder.scene().materials[static_cast<std::size_t>(index)];
    mirror.metallic = 1;
    mirror.roughness = 0;
    builder.rectangle(4, 4, -4, index);
    Environment columns;
    columns.width = 4;
    columns.height = 2;
    // +Z is the middle of the picture, between the second and the third column.
    for (int row = 0; row < 2; ++row)
        for (const glm::vec3& rgb : {glm::vec3(1, 0, 0), {0, 1, 0}, {0, 1, 0}, {0, 0, 1}})
            columns.radiance.push_back(rgb);
    const auto middle = [&](double degrees) {
        columns.rotation = degrees * 3.14159265358979 / 180;
        builder.scene().environment = columns;
        return color(capture(builder.scene(), testView(9, 9)).image, 40);
    };
    EXPECT_GT(middle(0).g, 0.95F);
    EXPECT_LT(middle(0).r + middle(0).b, 0.05F);
    // A rotation by 90 degrees moves the former −X, at u = 0.75 between green and blue, to +Z.
    EXPECT_NEAR(middle(90).g, middle(90).b, 0.02F);
    EXPECT_NEAR(middle(-90).g, middle(-90).r, 0.02F);
    EXPECT_LT(middle(180).g, 0.05F);
}

}  // namespace
}  // namespace peeler::test
