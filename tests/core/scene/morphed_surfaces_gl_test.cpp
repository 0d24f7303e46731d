// SPDX-License-Identifier: Apache-2.0
// Tests morphed colours and texture coordinates, on the GPU and the CPU.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/capture.h"

namespace peeler::test {
namespace {

/// Returns a wall of colour (1, 0, 1). A morph target changes the colour to (0, 1, 1), and shifts
/// the texture from a white to a yellow texel.
Scene wall(AlphaMode mode = AlphaMode::kOpaque) {
    SceneBuilder builder;
    builder.rectangle(1, 1, -2, builder.material({1, 1, 1, 1}, mode));
    Scene& scene = builder.scene();
    scene.images = {{"texels", 2, 1, {255, 255, 255, 255, 255, 255, 0, 255}}};
    TextureRef& texture = scene.materials.back().base_color_texture;
    texture.image = 0;
    texture.sampler.mag_filter = texture.sampler.min_filter = 9728;  // GL_NEAREST
    Primitive& primitive = scene.meshes[0].primitives[0];
    const std::size_t vertices = primitive.positions.size();
    primitive.colors.assign(vertices, {1, 0, 1, 1});
    primitive.texcoords[0].assign(vertices, {0.25F, 0.5F});
    MorphTarget& target = primitive.targets.emplace_back();
    target.colors.assign(vertices, {-1, 1, 0, mode == AlphaMode::kMask ? -1 : 0});
    target.texcoords[0].assign(vertices, {0.5F, 0});
    return scene;
}

PosedScene at(const Scene& scene, double weight) {
    Pose pose = restPose(scene);
    pose.weights[0] = {weight};
    return {scene, scene.default_scene, pose};
}

CaptureSettings floats() {
    CaptureSettings settings;
    settings.color_type = PixelType::kFloat;
    return settings;
}

TEST(MorphedSurfaces, HaveDisplacedColorsAndTexcoords) {
    const Scene scene = wall();
    const View view = testView(8, 8);
    GlRenderer renderer(sharedContext(), at(scene, 0));
    const auto shown = [&](double weight) {
        renderer.setPose(at(scene, weight));
        const LayeredImage image = capture(renderer, view, floats()).image;
        return color(image, image.offsets[image.pixelIndex(4, 4)]);
    };
    EXPECT_EQ(shown(0), glm::vec4(1, 0, 1, 1));
    EXPECT_EQ(shown(1), glm::vec4(0, 1, 0, 1));  // the target's colour on the yellow texel
    // The colour is clamped. The texture repeats, which gives the white texel again.
    EXPECT_EQ(shown(2), glm::vec4(0, 1, 1, 1));
    EXPECT_EQ(shown(0.25), glm::vec4(0.75F, 0.25F, 1, 1));
}

/// Returns the values of all channels at the first hit; none without a hit.
std::vector<float> firstHit(const std::string& engine, const PosedScene& posed) {
    CaptureSettings settings = floats();
    settings.hit_mode = HitMode::kRefined;
    settings.channels = {Channel::kUv, Channel::kBaseColor};
    std::ranges::sort(settings.channels);
    const LayeredImage hits = capture(*openHits(engine, posed), testView(8, 8), settings).image;
    std::vector<float> numbers;
    for (const FragmentArray& array : hits.extra)
        for (std::size_t c = 0; c < array.components() && hits.fragments() > 0; ++c)
            numbers.push_back(FragmentChannel(array, c).value(0));
    return numbers;
}

TEST(MorphedSurfaces, AreTheSameOnTheCpu) {
    for (const AlphaMode mode : {AlphaMode::kOpaque, AlphaMode::kMask}) {
        const Scene scene = wall(mode);
        const bool gone = mode == AlphaMode::kMask;  // at weight 1, alpha is 0, below the cutoff
        EXPECT_EQ(firstHit("cpu", at(scene, 1)).empty(), gone);
        for (const double weight : {0.0, 0.75, 1.0})
            EXPECT_EQ(firstHit("cpu", at(scene, weight)), firstHit("gl", at(scene, weight)));
        EXPECT_NE(firstHit("cpu", at(scene, 0)), firstHit("cpu", at(scene, 1)));
    }
}

}  // namespace
}  // namespace peeler::test
