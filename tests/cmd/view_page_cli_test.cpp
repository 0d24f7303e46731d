// SPDX-License-Identifier: Apache-2.0
// peeler view -o page.html: what a browser shows of it. See view_page_test.py.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

class ViewPage : public testing::Test {
  protected:
    Outcome run(const std::vector<std::string>& arguments) const {
        return runPeelerProcess(arguments, {}, scratch_.path());
    }
    void render(const std::string& scene, const std::string& size) const {
        const auto file = sourceDir() / "examples" / "scenes" / scene;
        const auto result = run({"render", file, "-o", "layers.exr", "--size", size});
        ASSERT_EQ(result.exit_code, 0) << result.err;
    }
    double psnr(const std::string& a, const std::string& b) const {
        const auto picture = [&](const std::string& name) {
            OIIO::ImageBuf image((scratch_ / (name + ".png")).string());
            EXPECT_TRUE(image.read(0, 0, true, OIIO::TypeDesc::FLOAT)) << image.geterror();
            return OIIO::ImageBufAlgo::channels(image, 3, {});
        };
        const auto result = OIIO::ImageBufAlgo::compare(picture(a), picture(b), 1, 1);
        return -20 * std::log10(std::max(result.rms_error, 1e-6));
    }

    /// Has the browser use the page; exit code 77: there is no browser.
    Outcome use(const std::string& page) const {
        // Debian's Python has Debian's Selenium, whatever other Python is first in the path.
        const auto script = sourceDir() / "tests" / "cmd" / "view_page_test.py";
        return runCommand({"/usr/bin/python3", script, page, "."}, {"SE_AVOID_STATS=true"},
                          scratch_.path());
    }

    ScratchDir scratch_;
};

TEST_F(ViewPage, OfColouredGlassFiltersColourByColour) {
    writeScene(scratch_.path(), tintedPanes());
    for (const std::vector<std::string>& verb :
         {std::vector<std::string>{"render", "scene.gltf", "-o", "layers.exr", "--camera", "front",
                                   "--size", "256x144"},
          {"view", "layers.exr", "-o", "page.html", "--background", "#dbdbdb"},
          {"flatten", "layers.exr", "-o", "all.png", "--background", "#dbdbdb"},
          {"render", "scene.gltf", "-o", "milky.png", "--camera", "front", "--size", "256x144",
           "--transmission", "alpha", "--background", "#dbdbdb"}}) {
        const auto result = run(verb);
        ASSERT_EQ(result.exit_code, 0) << result.err;
    }
    const auto browser = use("page.html");
    if (browser.exit_code == 77) GTEST_SKIP() << browser.out;
    ASSERT_EQ(browser.exit_code, 0) << browser.out << browser.err;
    EXPECT_EQ(bytesOf(scratch_ / "console.json"), "[]") << "no word on the console";
    const double found = psnr("original", "all");
    std::printf("the page of coloured glass against the composite: %.1f dB\n", found);
    EXPECT_GE(found, 44);
    EXPECT_LT(psnr("milky", "all"), 30);
    EXPECT_LT(psnr("depth", "original"), 20);
    EXPECT_GE(psnr("reset", "original"), 100);
}

TEST_F(ViewPage, InABrowser) {
    // Transparent and opaque surfaces, 15 layers.
    render("engine.glb", "256x144");
    for (const std::vector<std::string>& verb :
         {std::vector<std::string>{"view", "layers.exr", "-o", "page.html"},
          {"flatten", "layers.exr", "-o", "all.png"},
          {"flatten", "layers.exr", "-o", "first.png", "--layers", "1"}}) {
        auto arguments = verb;
        // Of one curve: a page has it fragment by fragment, and a composite as a whole.
        arguments.insert(arguments.end(), {"--background", "#dbdbdb", "--tone-map", "none"});
        const auto result = run(arguments);
        ASSERT_EQ(result.exit_code, 0) << result.err;
    }
    const auto browser = use("page.html");
    if (browser.exit_code == 77) GTEST_SKIP() << browser.out;
    ASSERT_EQ(browser.exit_code, 0) << browser.out << browser.err;
    EXPECT_EQ(bytesOf(scratch_ / "console.json"), "[]") << "no word on the console";

    // 8-bit colours, blended in another precision; a pixel here and there of two surfaces that
    // meet goes to the other one, since depths have 16 bits.
    const double all = psnr("original", "all"), first = psnr("one_layer", "first");
    std::printf("the page against the composite: %.1f dB; of one layer: %.1f dB\n", all, first);
    EXPECT_GE(all, 44) << "40 would be the transparent ones in the wrong order";
    EXPECT_GE(first, 60);
    EXPECT_LT(psnr("one_layer", "original"), 30);
    EXPECT_LT(psnr("depth", "original"), 20);
    EXPECT_LT(psnr("dragged", "original"), 30);
    EXPECT_LT(psnr("keys", "dragged"), 35);
    EXPECT_LT(psnr("nearer", "keys"), 30);
    EXPECT_GE(psnr("reset", "original"), 100);
}

TEST_F(ViewPage, NeedsNothingElse) {
    render("coincident.glb", "64x36");
    ASSERT_EQ(run({"view", "layers.exr", "-o", "page.html", "--exposure", "0"}).exit_code, 0);
    const std::string page = bytesOf(scratch_ / "page.html");
    for (const char* sign : {"http:", "https:", "src=", "@import", "url("})
        EXPECT_EQ(page.find(sign), std::string::npos) << sign;
    EXPECT_EQ(page.find("{{"), std::string::npos) << "a field was left open";
    // render writes the same one at once.
    const auto file = sourceDir() / "examples" / "scenes" / "coincident.glb";
    ASSERT_EQ(run({"render", file, "-o", "direct.html", "--size", "64x36", "--exposure", "0",
                   "--environment", "none"})
                  .exit_code,
              0);
    EXPECT_TRUE(bytesOf(scratch_ / "direct.html") == page);
}

TEST_F(ViewPage, ATitleIsTextAndNoTag) {
    const auto scene = sourceDir() / "examples" / "scenes" / "panes.glb";
    std::filesystem::copy_file(scene, scratch_ / "<script>&\xff.glb");
    ASSERT_EQ(run({"render", "<script>&\xff.glb", "-o", "layers.exr", "--size", "32x18"}).exit_code,
              0);
    ASSERT_EQ(run({"view", "layers.exr", "-o", "page.html"}).exit_code, 0);
    const std::string page = bytesOf(scratch_ / "page.html");
    EXPECT_EQ(page.find("<script>&"), std::string::npos);
    EXPECT_NE(page.find("\\u003cscript>&"), std::string::npos);
}

}  // namespace
}  // namespace peeler::test
