// SPDX-License-Identifier: Apache-2.0
// Tests pictures in the studio environment: its embedded maps must equal freshly prefiltered ones.
#include <gtest/gtest.h>

#include "core/shading/constants.h"
#include "support/capture.h"

namespace peeler::test {
namespace {

/// Returns a picture of spheres (smooth metal, rough metal, cloth) in an environment.
LayeredImage spheresIn(const Environment& environment) {
    SceneBuilder builder;
    for (const int i : {0, 1, 2}) {
        const int index = builder.lit(builder.material({1, 1, 1, 1}, AlphaMode::kOpaque, false));
        Material& material = builder.scene().materials[static_cast<std::size_t>(index)];
        material.metallic = i < 2 ? 1 : 0;
        material.roughness = i == 0 ? 0.1F : 0.6F;
        if (i == 2) material.sheen.color = glm::vec3(1);
        builder.sphere({static_cast<float>(i) * 2 - 2, 0, -8}, 0.95F, index);
    }
    builder.scene().environment = environment;
    CaptureSettings settings;
    settings.color_type = PixelType::kFloat;
    LayeredImage image = capture(builder.scene(), testView(96, 32), settings).image;
    EXPECT_GT(image.fragments(), 100U);
    return image;
}

TEST(StudioPictures, AreTheSameWithMapsCalculatedNow) {
    Environment studio = embeddedStudio();
    ASSERT_TRUE(studio.is_studio);
    const LayeredImage embedded = spheresIn(studio);
    studio.is_studio = false;
    EXPECT_EQ(embedded.color.data, spheresIn(studio).color.data);
}

TEST(StudioPictures, TurnWithTheStudio) {
    Environment studio = embeddedStudio();
    const LayeredImage straight = spheresIn(studio);
    studio.rotation = 1;
    const LayeredImage turned = spheresIn(studio);
    EXPECT_NE(turned.color.data, straight.color.data);
    studio.is_studio = false;
    EXPECT_EQ(turned.color.data, spheresIn(studio).color.data);
}

}  // namespace
}  // namespace peeler::test
