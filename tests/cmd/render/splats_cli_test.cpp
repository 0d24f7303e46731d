// SPDX-License-Identifier: Apache-2.0
// Tests how pictures of Gaussian splats blend, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/color.h"
#include "formats/exr/layered_input.h"
#include "formats/image/flat_image.h"
#include "formats/splats/splat_files.h"

namespace peeler::test {
namespace {

/// Returns a round splat on the axis, of one colour.
Splat splatOnAxis(double z, const glm::dvec3& srgb, double opacity) {
    constexpr double kHarmonic0 = 0.28209479177387814;
    Splat splat;
    splat.mean = {0, 0, z};
    splat.scale = glm::dvec3(0.5);
    splat.rotation = {0, 0, 0, 1};
    splat.opacity = opacity;
    splat.harmonics[0] = (srgb - 0.5) / kHarmonic0;
    return splat;
}

/// A red splat of opacity 0.6 in front of a grey one of 0.5, seen by an odd number of pixels, so
/// that the middle pixel sees both means.
class BlendedSplats : public testing::Test {
  protected:
    BlendedSplats() {
        writeFile(scratch_ / "a.ply",
                  splatPly({splatOnAxis(0, kFront, 0.6), splatOnAxis(-1, kBack, 0.5)}, 0));
    }
    Outcome render(const std::string& name, std::vector<std::string> more = {}) const {
        const std::vector<std::string> fixed{
            "render", scratch_ / "a.ply", "-o",    scratch_ / name, "--size", "33x33", "--eye",
            "0,0,3",  "--target",         "0,0,0", "--json"};
        more.insert(more.begin(), fixed.begin(), fixed.end());
        return runPeeler(more);
    }
    /// Returns the middle pixel: premultiplied, linear.
    std::array<float, 4> middle(const std::string& name) const {
        return readFlatImage(scratch_ / name).image.rgba[33 * 16 + 16];
    }
    /// Returns the wanted sum of the splats and an opaque background, or none: sRGB, premultiplied.
    static glm::dvec3 wanted(const glm::dvec3& behind = glm::dvec3(0)) {
        return 0.6 * kFront + 0.4 * 0.5 * kBack + 0.4 * 0.5 * behind;
    }
    static glm::dvec3 decoded(const glm::dvec3& c) {
        return {linearFromSrgb(c.r), linearFromSrgb(c.g), linearFromSrgb(c.b)};
    }
    static void expectNear(const std::array<float, 4>& found, const glm::dvec3& color, double alpha,
                           double tolerance) {
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(found[static_cast<std::size_t>(c)], color[c], tolerance) << c;
        EXPECT_NEAR(found[3], alpha, tolerance);
    }

    static constexpr glm::dvec3 kFront{0.9, 0.1, 0.2}, kBack{0.5, 0.5, 0.5};
    static constexpr double kAlpha = 0.8;
    ScratchDir scratch_;
};

TEST_F(BlendedSplats, AreBlendedInSrgbInDisplayPictures) {
    const Json result = Json::parse(render("a.png").out);
    EXPECT_EQ(result["samples"], 1);
    EXPECT_EQ(result["toneMap"], "none");
    expectNear(middle("a.png"), kAlpha * decoded(wanted() / kAlpha), kAlpha, 0.006);
    render("b.png", {"--background", "white"});
    expectNear(middle("b.png"), decoded(wanted(glm::dvec3(1))), 1, 0.006);
    render("c.jpg");
    expectNear(middle("c.jpg"), decoded(wanted()), 1, 0.02);
    render("d.png", {"--background", "#ffffff80"});
    const double alpha = kAlpha + 0.2 * 128 / 255;
    expectNear(middle("d.png"), alpha * decoded((wanted() + 0.2 * 128 / 255) / alpha), alpha,
               0.006);
}

TEST_F(BlendedSplats, AreBlendedInLinearLightInFiles) {
    const glm::dvec3 linear = 0.6 * decoded(kFront) + 0.4 * 0.5 * decoded(kBack);
    EXPECT_EQ(render("a.exr", {"--as", "composite"}).exit_code, 0);
    expectNear(middle("a.exr"), linear, kAlpha, 1e-3);
    EXPECT_EQ(render("b.exr", {"--as", "composite", "--splat-blending", "display"}).exit_code, 0);
    expectNear(middle("b.exr"), kAlpha * decoded(wanted() / kAlpha), kAlpha, 1e-3);
    EXPECT_EQ(render("c.png", {"--splat-blending", "linear"}).exit_code, 0);
    expectNear(middle("c.png"), linear, kAlpha, 0.006);

    const auto blendingOf = [&](const char* name) {
        const std::string text = readExrInfo(scratch_ / name).provenance.settings;
        return Json::parse(text)["splatBlending"];
    };
    EXPECT_EQ(render("layers.exr", {"--splat-order", "ray"}).exit_code, 0);
    EXPECT_EQ(blendingOf("layers.exr"), "linear");
    EXPECT_EQ(blendingOf("b.exr"), "display");
}

TEST_F(BlendedSplats, AreBlendedInSrgbOnlyInCompositesOfSplatsAlone) {
    const auto expectRefused = [&](const Outcome& outcome, const char* why) {
        EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
        EXPECT_TRUE(contains(outcome.err, why)) << outcome.err;
    };
    const std::vector<std::string> display{"--splat-blending", "display"};
    expectRefused(render("a.exr", display), "layers blend in linear light");
    expectRefused(render("b.exr", {"--as", "composite", "--splat-blending", "display",
                                   "--background", "white"}),
                  "blends the background in linear light");
    const std::string mesh = triangle().write(scratch_, "mesh.glb").string(),
                      picture = scratch_ / "c.png";
    expectRefused(runPeeler({"render", mesh, "-o", picture, "--splat-blending", "display"}),
                  "surfaces blend in linear light");
}

}  // namespace
}  // namespace peeler::test
