// SPDX-License-Identifier: Apache-2.0
// Tests coloured glass: transmission per channel, in the layers and composites of every method.
#include <gtest/gtest.h>

#include <cmath>

#include "core/capture/method.h"
#include "core/image/composite.h"
#include "support/capture.h"
#include "support/flat.h"
#include "support/hard_scenes.h"
#include "support/lights.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

CaptureSettings tintedSettings(PixelType type = PixelType::kFloat) {
    CaptureSettings s;
    s.color_type = type;
    s.tinted = true;
    return s;
}

/// Panes of clear unlit glass that fill the view. The first is at z = −1, the others behind it.
class Panes {
  public:
    explicit Panes(const std::vector<glm::vec4>& colors) {
        for (std::size_t i = 0; i < colors.size(); ++i) {
            const int index = builder_.material(colors[i], AlphaMode::kOpaque);
            material(i).metallic = 0;
            material(i).transmission.factor = 1;
            builder_.rectangle(9, 9, -1 - static_cast<float>(i), index);
        }
    }
    Scene& scene() { return builder_.scene(); }
    Material& material(std::size_t i) { return scene().materials[i + first_]; }
    /// Returns the composite of the middle pixel.
    TintedColor seen(CaptureSettings s = tintedSettings()) {
        s.composite = true;
        const LayeredImage image = capture(scene(), testView(5, 5), s).image;
        EXPECT_TRUE(image.tinted());
        return tintedColorOf(image, image.offsets[12]);
    }

  private:
    SceneBuilder builder_;
    std::size_t first_ = builder_.scene().materials.size();
};

void expectNear(const TintedColor& found, const TintedColor& expected, float tolerance,
                const std::string& what) {
    for (std::size_t c = 0; c < found.size(); ++c)
        EXPECT_NEAR(found[c], expected[c], tolerance) << what << ", component " << c;
}

TEST(TintedGlass, FiltersWhatIsBehindItColourByColour) {
    const glm::vec4 red(0.5F, 0.25F, 0.125F, 1), green(0.25F, 1, 0.5F, 1), blue(1, 0.5F, 1, 1);
    const glm::vec4 wall(0.5F, 0.25F, 0.75F, 1);
    for (const auto& method : peelMethods()) {
        if (!method.exact()) continue;
        for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
            Panes panes({red, green, blue, wall});
            CaptureSettings s = tintedSettings(type);
            s.method = method.name;
            // The wall is opaque: it contributes the only colour, which the panes filter.
            panes.material(3).transmission.factor = 0;
            const glm::vec4 through = red * green * blue * wall;
            EXPECT_EQ(panes.seen(s), (TintedColor{through.r, through.g, through.b, 1, 1, 1, 1}))
                << method.name;
        }
    }
}

TEST(TintedGlass, HasTheMeanOfItsOpacitiesForAlpha) {
    Panes panes({{0.75F, 0.5F, 0.25F, 1}});
    const TintedColor clear = panes.seen();
    EXPECT_EQ(clear, (TintedColor{0, 0, 0, 0.5F, 0.25F, 0.5F, 0.75F}));
    // The share of the pane that does not transmit is opaque and, because it is unlit, has the base
    // colour.
    panes.material(0).transmission.factor = 0.5F;
    EXPECT_EQ(panes.seen(), (TintedColor{0.375F, 0.25F, 0.125F, 0.75F, 0.625F, 0.75F, 0.875F}));
    // Coverage (alpha) multiplies both colour and opacity.
    panes.material(0).alpha_mode = AlphaMode::kBlend;
    panes.material(0).base_color.a = 0.5F;
    EXPECT_EQ(panes.seen(),
              (TintedColor{0.1875F, 0.125F, 0.0625F, 0.375F, 0.3125F, 0.375F, 0.4375F}));
}

TEST(TintedGlass, AbsorbsByBeersLaw) {
    Panes panes({{1, 1, 1, 1}});
    Transmission& t = panes.material(0).transmission;
    t.thickness = 0.5F;
    t.attenuation_distance = 2;
    t.attenuation_color = {0.5F, 0.25F, 1};
    const float r = std::pow(0.5F, 0.25F), g = std::pow(0.25F, 0.25F);
    expectNear(panes.seen(), {0, 0, 0, (2 - r - g) / 3, 1 - r, 1 - g, 0}, 1e-6F, "volume");
    // Thickness is in mesh units, so scaling the node by 2 doubles it.
    panes.scene().nodes[0].local = glm::dmat4(2);
    panes.scene().nodes[0].local[3] = {0, 0, 1, 1};
    expectNear(panes.seen(), {0, 0, 0, (2 - r * r - g * g) / 3, 1 - r * r, 1 - g * g, 0}, 1e-6F,
               "twice as thick");
    // The volume tints transmitted light but not diffuse light.
    t.factor = 0.5F;
    expectNear(panes.seen(),
               {0.5F, 0.5F, 0.5F, 1 - (r * r + g * g + 1) / 6, 1 - r * r / 2, 1 - g * g / 2, 0.5F},
               1e-6F, "half of it");
}

TEST(TintedGlass, ReflectsAtFullStrengthAndIsNothingThroughMetal) {
    Panes panes({{1, 0, 0, 1}});
    Material& m = panes.material(0);
    m.unlit = false;
    m.metallic = 0;
    m.roughness = 0;
    panes.scene().environment = uniformEnvironment(glm::vec3(1));
    // Only the specular reflection is visible, and it is colourless.
    const TintedColor clear = panes.seen();
    EXPECT_NEAR(clear[0], 0.04F, 2e-3F);
    EXPECT_NEAR(clear[0], clear[1], 1e-6F);
    EXPECT_NEAR(clear[4], 0, 1e-6F);
    EXPECT_NEAR(clear[5], 1, 1e-6F);
    m.metallic = 1;
    EXPECT_EQ(panes.seen()[3], 1);
    EXPECT_EQ(panes.seen()[4], 1);
}

TEST(TintedGlass, OfVerticesAndTexturesCounts) {
    Panes panes({{1, 1, 1, 1}});
    const auto has = [&] { return PosedScene(panes.scene()).hasTintedGlass(); };
    EXPECT_FALSE(has());
    Material& m = panes.material(0);
    m.base_color = {0.5F, 0.5F, 0.5F, 1};
    EXPECT_FALSE(has());  // grey glass absorbs all channels equally
    m.base_color.g = 0.25F;
    EXPECT_TRUE(has());
    m.metallic = 1;
    EXPECT_FALSE(has());
    m.metallic = 0;
    m.transmission.factor = 0;
    EXPECT_FALSE(has());
    m.transmission.factor = 1;
    m.base_color = {1, 1, 1, 1};
    m.transmission.attenuation_color = {1, 0.5F, 1};
    EXPECT_FALSE(has());  // glass without thickness has no volume
    m.transmission.attenuation_distance = 1;
    EXPECT_FALSE(has());
    m.transmission.thickness = 1;
    EXPECT_TRUE(has());
    m.transmission.thickness = 0;
    m.base_color_texture.image = 0;
    EXPECT_TRUE(has());
    m.base_color_texture = {};
    EXPECT_FALSE(has());
    Primitive& primitive = panes.scene().meshes[0].primitives[0];
    primitive.colors.assign(primitive.positions.size(), {1, 0.5F, 0.25F, 1});
    EXPECT_TRUE(has());
    expectNear(panes.seen(), {0, 0, 0, 1.25F / 3, 0, 0.5F, 0.75F}, 1e-6F, "vertex colours");
    panes.scene().nodes[0].visible = false;
    EXPECT_FALSE(has());
}

TEST(TintedGlass, IsTheSameInEveryExactMethod) {
    const Scene scene = glassScene();
    GlRenderer renderer(sharedContext(), PosedScene(scene));
    const View view = exhaustive() ? testView(100, 75) : testView(60, 45);
    for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
        for (const Surfaces surfaces : {Surfaces::kAll, Surfaces::kVisible}) {
            if (!exhaustive() && (type == PixelType::kHalf) != (surfaces == Surfaces::kAll))
                continue;
            CaptureSettings s = tintedSettings(type);
            s.surfaces = surfaces;
            const auto reference = capture(renderer, view, s);
            EXPECT_GT(reference.image.fragments(), 1000U);
            EXPECT_TRUE(reference.plan.tinted);
            EXPECT_EQ(reference.image.color.channels, colorNames(true));
            const CompositeImage expected = flat(reference.image);
            for (const auto& method : peelMethods()) {
                if (!method.exact()) continue;
                s.method = method.name;
                s.composite = false;
                s.band_bytes = exhaustive() ? 1 << 20 : 3 << 17;
                EXPECT_EQ(difference(reference.image, capture(renderer, view, s).image), "")
                    << method.name;
                s.composite = true;
                const CompositeImage found = flat(capture(renderer, view, s).image);
                EXPECT_EQ(found.rgba, expected.rgba) << method.name;
                EXPECT_EQ(found.opacity, expected.opacity) << method.name;
            }
        }
    }
}

TEST(TintedGlass, WithATailIsBlendedColourByColour) {
    const Scene scene = glassScene();
    const auto all = capture(scene, testView(100, 75), tintedSettings());
    for (const char* method : {"a-buffer", "dual", "back-to-front"}) {
        CaptureSettings s = tintedSettings();
        s.method = method;
        s.composite = true;
        s.max_layers = 2;
        s.tail = Tail::kBlend;
        CompositeImage expected;
        compositeNearest(all.image, 2, Tail::kBlend, expected);
        const CompositeImage found = flat(capture(scene, testView(100, 75), s).image);
        for (std::size_t p = 0; p < found.rgba.size(); ++p)
            expectNear(found.colorAt(p), expected.colorAt(p), 1e-5F, method);
    }
}

TEST(TintedGlass, IsApproximatedByTheFormulasColourByColour) {
    using TintedFormula =
        void (*)(const LayeredImage&, const std::array<float, 4>&, CompositeImage&);
    const std::pair<const char*, TintedFormula> formulas[] = {
        {"weighted-average", compositeWeightedAverage}, {"weighted-sum", compositeWeightedSum}};
    const Scene scene = glassScene();
    const auto layers = capture(scene, testView(100, 75), tintedSettings());
    for (const auto& [method, formula] : formulas) {
        CompositeImage expected;
        formula(layers.image, {}, expected);
        CaptureSettings s = tintedSettings();
        s.method = method;
        s.composite = true;
        const auto result = capture(scene, testView(100, 75), s);
        const CompositeImage found = flat(result.image);
        EXPECT_EQ(result.report.passes, 1);
        for (std::size_t p = 0; p < found.rgba.size(); ++p)
            expectNear(found.colorAt(p), expected.colorAt(p), 1e-4F, method);
    }
}

TEST(TintedGlass, IsApproximatedInFrontOfTheNearestOpaqueSurface) {
    // The draw order is: a wall, a far pane, a near pane, and a second wall, which is hidden.
    SceneBuilder builder;
    builder.rectangle(9, 9, -4, builder.material({0.5F, 1, 0.5F, 1}, AlphaMode::kOpaque));
    for (const float z : {-3.0F, -2.0F}) {
        const glm::vec4 tint = z < -2.5F ? glm::vec4(1, 0.5F, 0.25F, 1) : glm::vec4(0.5F, 1, 1, 1);
        builder.rectangle(9, 9, z, builder.material(tint, AlphaMode::kOpaque));
        builder.scene().materials.back().metallic = 0;
        builder.scene().materials.back().transmission.factor = 1;
    }
    builder.rectangle(9, 9, -5, builder.material({1, 0, 0, 1}, AlphaMode::kOpaque));
    // The panes' opacities are (0, .5, .75) and (.5, 0, 0); only the wall has colour.
    const auto squared = [](float a) { return (1 - a / 2) * (1 - a / 2); };
    const std::pair<const char*, glm::vec3> expected[] = {
        {"unsorted", {0.5F, 0.5F, 0.25F}},
        {"weighted-sum", {0.5F, 0.5F, 0.25F}},
        {"weighted-blended", {0.5F, 0.5F, 0.25F}},
        {"moment-based", {0.5F, 0.5F, 0.25F}},
        {"weighted-average", {squared(0.5F), squared(0.5F), squared(0.75F)}}};
    for (const auto& [method, through] : expected) {
        CaptureSettings s = tintedSettings();
        s.method = method;
        s.composite = true;
        s.surfaces = Surfaces::kVisible;
        const LayeredImage image = capture(builder.scene(), testView(5, 5), s).image;
        const glm::vec3 seen = through * glm::vec3(0.5F, 1, 0.5F);
        expectNear(tintedColorOf(image, 12), {seen.r, seen.g, seen.b, 1, 1, 1, 1}, 1e-6F, method);
    }
}

TEST(TintedGlass, IsBlendedInTheOrderOfDrawingIfItIsNotSorted) {
    SceneBuilder builder;  // the near surface is drawn first, so the far surface covers it
    builder.rectangle(9, 9, -2, builder.material({0.5F, 0.25F, 1, 1}, AlphaMode::kOpaque));
    builder.scene().materials.back().metallic = 0;
    builder.scene().materials.back().transmission.factor = 1;
    builder.rectangle(9, 9, -3, builder.material({1, 0.5F, 0.25F, 0.5F}));
    CaptureSettings s = tintedSettings();
    s.method = "unsorted";
    s.composite = true;
    const auto result = capture(builder.scene(), testView(5, 5), s);
    EXPECT_EQ(result.report.passes, 2);
    const TintedColor glass = {0, 0, 0, 1 - 1.75F / 3, 0.5F, 0.75F, 0},
                      veil = tinted({0.5F, 0.25F, 0.125F, 0.5F});
    expectNear(tintedColorOf(result.image, 12), over(veil, glass), 1e-6F, "unsorted");
}

TEST(TintedGlass, OfSeveralSamplesIsTheirMean) {
    const Scene scene = glassScene();
    CaptureSettings s = tintedSettings();
    s.samples = 4;
    const CompositeImage layers = flat(capture(scene, testView(60, 45), s).image);
    for (const char* method : {"a-buffer", "dual"}) {
        s.method = method;
        s.composite = true;
        const CompositeImage mean = flat(capture(scene, testView(60, 45), s).image);
        ASSERT_TRUE(mean.tinted());
        for (std::size_t p = 0; p < mean.rgba.size(); ++p)
            expectNear(layers.colorAt(p), mean.colorAt(p), 1e-5F, method);
    }
}

TEST(TintedGlass, LeavesEverythingElseAsItIs) {
    // Without coloured glass, each channel's opacity equals alpha, and the capture equals an
    // untinted capture bit for bit.
    Scene scene = glassScene();
    for (Material& m : scene.materials)
        if (m.transmission.factor > 0) m.base_color = glm::vec4(glm::vec3(m.base_color.g), 1);
    for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
        CaptureSettings s = tintedSettings(type);
        const LayeredImage tinted_image = capture(scene, testView(100, 75), s).image;
        s.tinted = false;
        const LayeredImage plain = capture(scene, testView(100, 75), s).image;
        ASSERT_EQ(tinted_image.offsets, plain.offsets);
        EXPECT_EQ(tinted_image.z, plain.z);
        for (std::size_t f = 0; f < plain.fragments(); ++f)
            ASSERT_EQ(tintedColorOf(tinted_image, f), tintedColorOf(plain, f)) << f;
    }
}

}  // namespace
}  // namespace peeler::test
