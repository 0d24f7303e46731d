// SPDX-License-Identifier: Apache-2.0
// Tests filtered textures: against GL's rules, and against 64 rays a pixel through a fisheye.
#include "core/raster/texture_levels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "core/raster/hit_rasterizer.h"
#include "core/raster/surface_values.h"
#include "core/scene/view.h"
#include "core/shading/materials.h"
#include "core/trace/traced_hits.h"
#include "support/one_mesh.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

Image noise(int width, int height) {
    std::mt19937 random(5);
    Image image;
    image.width = width;
    image.height = height;
    image.rgba.resize(static_cast<std::size_t>(4 * width * height));
    for (std::uint8_t& byte : image.rgba)
        byte = static_cast<std::uint8_t>(random());
    return image;
}

TextureRef textureOf(int image, int min_filter = 9987) {
    TextureRef texture;
    texture.image = image;
    texture.sampler.min_filter = min_filter;
    return texture;
}

TEST(TextureLevels, MagnifiedAreTheTexelsOfTheImage) {
    Scene scene;
    scene.images = {noise(16, 8)};
    const TextureLevels levels(scene);
    TextureRef texture = textureOf(0);
    texture.transform = glm::mat3(glm::vec3(0.5F, 0, 0), glm::vec3(0, 2, 0), glm::vec3(0.1F, 0, 1));
    for (int i = 0; i < 50; ++i) {
        const glm::dvec2 uv(0.37 * i, 1 - 0.21 * i);
        // A texel is 1/8 wide and 1/16 high in this UV set.
        const TextureFootprint footprint{{0.08, 0.03}, {-0.04, 0.04}};
        for (const bool srgb : {false, true})
            EXPECT_EQ(levels.sample(texture, uv, footprint, srgb),
                      texelAt(scene.images[0], texture, uv, srgb));
    }
}

/// A footprint of 2^k texels of the image is a texel of mipmap k.
TEST(TextureLevels, MinifiedAreTheTexelsOfMipmaps) {
    Scene scene;
    scene.images = {noise(32, 32)};
    const TextureLevels levels(scene);
    Image level = scene.images[0];
    for (int k = 0; k < 6; ++k) {
        const int size = 32 >> k;
        for (const int filter : {9984, 9985, 9986, 9987}) {
            const glm::dvec2 uv((size / 2 + 0.5) / size, (size / 3 + 0.5) / size);
            const double texel = 1.0 / size;
            const glm::dvec4 sampled =
                levels.sample(textureOf(0, filter), uv, {{texel, 0}, {0, -texel}}, true);
            const auto* const expected = level.rgba.data() + 4 * (size / 3 * size + size / 2);
            for (int c = 0; c < 4; ++c) {
                const double value = expected[c] / 255.0;
                const double linear = c == 3             ? value
                                      : value <= 0.04045 ? value / 12.92
                                                         : std::pow((value + 0.055) / 1.055, 2.4);
                EXPECT_NEAR(sampled[c], linear, 1e-12) << k << ' ' << filter;
            }
        }
        level = halved(level, true);
    }
    // Without mipmaps, the filter takes the image itself.
    const glm::dvec2 uv(0.31, 0.77);
    EXPECT_EQ(levels.sample(textureOf(0, 9729), uv, {{0.5, 0}, {0, 0.5}}, false),
              texelAt(scene.images[0], textureOf(0), uv));
    // An endless footprint has the mean colour.
    const glm::dvec4 mean = levels.sample(textureOf(0), uv, {{1e300, 0}, {0, 1}}, true);
    EXPECT_NEAR(mean.a, level.rgba[3] / 255.0, 1e-12);
}

/// A checkerboard of squares with sides of 0.5 on the plane Z = −2, repeated over the plane.
Scene checkerboard() {
    Primitive plane;
    constexpr float kHalf = 500;
    plane.positions = {
        {-kHalf, -kHalf, -2}, {kHalf, -kHalf, -2}, {kHalf, kHalf, -2}, {-kHalf, kHalf, -2}};
    plane.texcoords[0] = {{-kHalf, -kHalf}, {kHalf, -kHalf}, {kHalf, kHalf}, {-kHalf, kHalf}};
    plane.indices = {0, 1, 2, 0, 2, 3};
    Scene scene = oneMesh({plane});
    Image image;
    image.width = image.height = 64;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            for (int c = 0; c < 4; ++c)
                image.rgba.push_back(c == 3 || (x / 32 + y / 32) % 2 == 0 ? 255 : 0);
    scene.images = {image};
    scene.materials[0].base_color_texture.image = 0;
    return scene;
}

/// Returns the view of a fisheye of 170° that looks at the board.
View fisheye() {
    View view;
    view.width = view.height = 64;
    view.crop = {0, 0, 64, 64};
    view.projection.near = 0;
    const double focal = 32 / glm::radians(85.0);
    view.rays = lensPicture({Lens{"fisheye"}, {focal, focal, 31.5, 31.5}}, {64, 64});
    return view;
}

/// Calls use(pixel, red) for the pixels of fisheye() that see the board well above its horizon.
template <class Use>
void forEachColor(const Scene& scene, Use&& use) {
    const View view = fisheye();
    peeler::TracedHits source{PosedScene(scene)};
    LayeredImage image = trace(source, view).image;
    SurfaceColors(PosedScene(scene)).addTo(view, image);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            if (std::hypot(x - 31.5, y - 31.5) > 31.5) continue;
            const std::size_t pixel = image.pixelIndex(x, y);
            ASSERT_EQ(image.count(pixel), 1U);
            use(glm::dvec2(x, y),
                static_cast<double>(image.color.as<glm::vec4>()[image.offsets[pixel]].r));
        }
    }
}

TEST(TextureLevels, CheckerboardThroughAFisheyeIsThatOf64RaysAPixel) {
    const Scene scene = checkerboard();
    const View view = fisheye();
    const auto colorAt = [&](const glm::dvec2& at) {
        const Ray ray = rayOf(view, at);
        const double t = -2 / ray.direction.z;
        const glm::dvec2 uv(t * ray.direction.x, t * ray.direction.y);
        return texelAt(scene.images[0], scene.materials[0].base_color_texture, uv, true).r;
    };
    double error = 0, largest = 0, of_one_ray = 0;
    int pixels = 0;
    forEachColor(scene, [&](const glm::dvec2& pixel, double value) {
        double mean = 0;
        for (int i = 0; i < 64; ++i)
            mean += colorAt(pixel + glm::dvec2(i % 8 + 0.5, i / 8 + 0.5) / 8.0) / 64;
        error += std::abs(value - mean);
        largest = std::max(largest, std::abs(value - mean));
        of_one_ray += std::abs(colorAt(pixel + 0.5) - mean);
        ++pixels;
    });
    EXPECT_GT(pixels, 3000);
    EXPECT_LT(error / pixels, 0.03);
    EXPECT_LT(largest, 0.3);
    EXPECT_LT(error, of_one_ray / 6);
}

TEST(TextureLevels, FineCheckerboardIsGrey) {
    Scene scene = checkerboard();
    // Every pixel sees more than a period.
    scene.materials[0].base_color_texture.transform =
        glm::mat3(glm::vec3(16, 0, 0), glm::vec3(0, 16, 0), glm::vec3(0, 0, 1));
    forEachColor(scene, [](const glm::dvec2&, double value) { EXPECT_NEAR(value, 0.5, 0.02); });
}

/// Returns the colour of the hits on a square with this material.
glm::vec4 colorOf(const Material& material) {
    Scene scene = oneMesh({square(0, 0, 8, 8, -2)});
    scene.materials[0] = material;
    HitRasterizer source{PosedScene(scene)};
    const View view = parallelView(8, 8);
    LayeredImage image = trace(source, view).image;
    SurfaceColors(PosedScene(scene)).addTo(view, image);
    return image.color.as<glm::vec4>()[20];
}

void expectColor(const glm::vec4& color, const glm::vec4& expected) {
    for (int c = 0; c < 4; ++c)
        EXPECT_NEAR(color[c], expected[c], 1e-6F) << c;
}

TEST(SurfaceColors, AreBaseColorAndOpacity) {
    Material material;
    material.base_color = {0.5F, 0.25F, 1, 0.5F};
    expectColor(colorOf(material), {0.5F, 0.25F, 1, 1});
    material.alpha_mode = AlphaMode::kMask;
    expectColor(colorOf(material), {0.5F, 0.25F, 1, 1});
    material.alpha_mode = AlphaMode::kBlend;
    expectColor(colorOf(material), {0.25F, 0.125F, 0.5F, 0.5F});
    material.alpha_mode = AlphaMode::kOpaque;
    material.metallic = 0;
    material.transmission.factor = 0.5F;
    const float left = 1 - 0.5F * (0.5F + 0.25F + 1) / 3;
    expectColor(colorOf(material), {0.5F * left, 0.25F * left, left, left});
    // A volume of thickness 2, which lets 1/4 of the light pass in a distance of 2.
    material.base_color = {1, 1, 1, 1};
    material.transmission.factor = 1;
    material.transmission.thickness = material.transmission.attenuation_distance = 2;
    material.transmission.attenuation_color = glm::vec3(0.25F);
    expectColor(colorOf(material), {0.1875F, 0.1875F, 0.1875F, 0.75F});
    material.metallic = 1;  // metals transmit nothing
    expectColor(colorOf(material), {0.25F, 0.25F, 0.25F, 1});
}

/// Differentials are the differences of neighbouring rays.
TEST(PictureRays, DifferentialsAreDerivatives) {
    const auto lens =
        lensPicture({Lens{"opencv", {-0.1, 0.02, 1e-3, 2e-3}}, {90, 95, 50, 40}}, {100, 80});
    glm::dmat4 end(1);
    end[3] = glm::dvec4(3, 1, 2, 1);
    for (const auto& rays : {lens, mappedPicture(lens, {-7, 5}, {1, 1}),
                             shutterPicture(lens, {glm::dmat4(1), end}, 80)}) {
        const glm::dvec2 pixel(33.5, 61.5);
        const RayDifferentials found = rays->differentials(pixel);
        const auto compare = [&](const Ray& change, const glm::dvec2& step) {
            const Ray before = rays->at(pixel - step), after = rays->at(pixel + step);
            EXPECT_LT(glm::length(change.origin - (after.origin - before.origin) * 50.0), 1e-9);
            EXPECT_LT(glm::length(change.direction - (after.direction - before.direction) * 50.0),
                      1e-5);
        };
        compare(found.per_x, {0.01, 0});
        compare(found.per_y, {0, 0.01});
    }
    View pinhole_view = pinhole({1, 2, 3}, 64);
    const RayDifferentials linear = differentialsOf(pinhole_view, {10, 20});
    const Ray here = rayOf(pinhole_view, {10, 20}), there = rayOf(pinhole_view, {15, 20});
    EXPECT_LT(glm::length(here.direction + 5.0 * linear.per_x.direction - there.direction), 1e-12);
}

}  // namespace
}  // namespace peeler::test
