// SPDX-License-Identifier: Apache-2.0
// Tests peeler view -o page.html in a browser, controlled by view_page_test.py.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "cmd/tiny_gltf.h"
#include "formats/image/display.h"
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

    /// Runs a tour of the page in a browser. The exit code is 77 if there is no browser.
    Outcome use(const std::string& page, const std::string& tour = "look",
                const std::vector<std::string>& pixels = {}) const {
        // Selenium is a Debian package, so it belongs to Debian's Python. Another Python may come
        // first in PATH.
        const auto script = sourceDir() / "tests" / "cmd" / "view_page_test.py";
        std::vector<std::string> command = {"/usr/bin/python3", script, page, ".", tour};
        command.insert(command.end(), pixels.begin(), pixels.end());
        return runCommand(command, {"SE_AVOID_STATS=true"}, scratch_.path());
    }
    Json readings() const { return Json::parse(bytesOf(scratch_ / "readings.json")); }

    /// Returns layer `number` of "layers.exr", counted from 1.
    OIIO::ImageBuf layer(int number) const {
        OIIO::ImageBuf image((scratch_ / "layers.exr").string(), number, 0);
        EXPECT_TRUE(image.read(number, 0, true, OIIO::TypeDesc::FLOAT)) << image.geterror();
        return image;
    }
    static float valueAt(const OIIO::ImageBuf& image, const char* channel, int x, int y) {
        return image.getchannel(x, y, 0, image.spec().channelindex(channel));
    }
    /// Returns the colour of a picture's pixel, 0 to 255.
    std::array<int, 3> color(const std::string& name, int x, int y) const {
        OIIO::ImageBuf image((scratch_ / (name + ".png")).string());
        std::array<int, 3> bytes{};
        for (int c = 0; c < 3; ++c)
            bytes[static_cast<std::size_t>(c)] =
                static_cast<int>(std::lround(255 * image.getchannel(x, y, 0, c)));
        return bytes;
    }
    void expectColor(const std::string& name, int x, int y, const std::array<int, 3>& expected,
                     int tolerance = 1) const {
        const auto found = color(name, x, y);
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(found[c], expected[c], tolerance)
                << name << " at " << x << ", " << y << ", channel " << c;
    }

    ScratchDir scratch_;
};

struct Pixel {
    int x = 0, y = 0;
    std::string name() const { return std::to_string(x) + "," + std::to_string(y); }
    std::string place() const { return std::to_string(x) + ", " + std::to_string(y); }
};

/// Returns pixels inside a layer's surface where it folds most sharply. There, interpolation
/// between a cell's corners has the largest error in Z.
std::vector<Pixel> sharpestFolds(const OIIO::ImageBuf& layer, std::size_t count) {
    const int z = layer.spec().channelindex("Z");
    std::vector<std::pair<double, Pixel>> found;
    for (int y = layer.ybegin() + 1; y + 1 < layer.yend(); ++y) {
        for (int x = layer.xbegin() + 1; x + 1 < layer.xend(); ++x) {
            const double here = layer.getchannel(x, y, 0, z);
            const double left = layer.getchannel(x - 1, y, 0, z) - here;
            const double right = layer.getchannel(x + 1, y, 0, z) - here;
            const bool surface = std::max(std::abs(left), std::abs(right)) < 0.005 * here;
            if (surface) found.push_back({-std::abs(left + right), {x, y}});
        }
    }
    std::ranges::sort(found, {}, [](const auto& entry) { return entry.first; });
    std::vector<Pixel> folds;
    for (std::size_t i = 0; i < std::min(count, found.size()); ++i)
        folds.push_back(found[i].second);
    return folds;
}

TEST_F(ViewPage, OfColouredGlassFiltersColourByColour) {
    writeScene(scratch_.path(), tintedPanes());
    for (const std::vector<std::string>& verb :
         {std::vector<std::string>{"render", "scene.gltf", "-o", "layers.exr", "--camera", "front",
                                   "--size", "128x72"},
          // No tone curve: the page would apply it to each fragment, but `flatten` to the finished
          // composite.
          {"view", "layers.exr", "-o", "page.html", "--background", "#dbdbdb", "--tone-map",
           "none"},
          {"flatten", "layers.exr", "-o", "all.png", "--background", "#dbdbdb", "--tone-map",
           "none"},
          {"render", "scene.gltf", "-o", "milky.png", "--camera", "front", "--size", "128x72",
           "--transmission", "alpha", "--background", "#dbdbdb"}}) {
        const auto result = run(verb);
        ASSERT_EQ(result.exit_code, 0) << result.err;
    }
    const auto browser = use("page.html", "filter");
    if (browser.exit_code == 77) GTEST_SKIP() << browser.out;
    ASSERT_EQ(browser.exit_code, 0) << browser.out << browser.err;
    EXPECT_EQ(bytesOf(scratch_ / "console.json"), "[]") << "no word on the console";
    const double found = psnr("original", "all");
    std::printf("the page of coloured glass against the composite: %.1f dB\n", found);
    EXPECT_GE(found, 44);
    EXPECT_LT(psnr("milky", "all"), 30);
    // There is only one pane in the corner, so the alpha picture shows its opacity per channel.
    const OIIO::ImageBuf front = layer(1);
    std::array<int, 3> opacities{};
    for (std::size_t c = 0; c < 3; ++c)
        opacities[c] = static_cast<int>(
            std::lround(255 * valueAt(front, std::array{"AR", "AG", "AB"}[c], 3, 3)));
    EXPECT_GT(opacities[1], opacities[2] + 50);
    EXPECT_GT(opacities[2], opacities[0] + 50);
    expectColor("alpha", 3, 3, opacities);
    EXPECT_LT(psnr("depth", "original"), 20);
    EXPECT_LT(psnr("keys", "original"), 40);
    EXPECT_GE(psnr("reset", "original"), 100);
}

TEST_F(ViewPage, InABrowser) {
    // This scene has transparent and opaque surfaces, and 14 layers.
    render("engine.glb", "192x108");
    for (const std::vector<std::string>& verb :
         {std::vector<std::string>{"view", "layers.exr", "-o", "page.html"},
          {"flatten", "layers.exr", "-o", "all.png"},
          {"flatten", "layers.exr", "-o", "first.png", "--layers", "1"}}) {
        auto arguments = verb;
        // No tone curve: the page would apply it to each fragment, but `flatten` to the finished
        // composite.
        arguments.insert(arguments.end(), {"--background", "#dbdbdb", "--tone-map", "none"});
        const auto result = run(arguments);
        ASSERT_EQ(result.exit_code, 0) << result.err;
    }
    const OIIO::ImageBuf front = layer(1);
    const std::vector<Pixel> folds = sharpestFolds(front, 6);
    std::vector<std::string> places;
    for (const Pixel& pixel : folds)
        places.push_back(pixel.name());
    const auto browser = use("page.html", "look", places);
    if (browser.exit_code == 77) GTEST_SKIP() << browser.out;
    ASSERT_EQ(browser.exit_code, 0) << browser.out << browser.err;
    EXPECT_EQ(bytesOf(scratch_ / "console.json"), "[]") << "no word on the console";

    // The page has 8-bit colours, blended in another precision. Its depths have 16 bits, so a few
    // pixels where two surfaces touch show the wrong surface.
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
    const Json told = readings();
    for (const Pixel& pixel : folds) {
        const std::string text = told[pixel.name()];
        const double z = valueAt(front, "Z", pixel.x, pixel.y);
        EXPECT_TRUE(contains(text, "pixel " + pixel.place())) << text;
        EXPECT_TRUE(contains(text, "layer 0 ")) << text;
        EXPECT_FALSE(contains(text, "object")) << text << ": the file has no ids";
        EXPECT_NEAR(std::stod(text.substr(2)), z, 2e-5 * z) << text;
    }
}

/// Returns three unlit surfaces: a red pane, a green triangle rotated by 45 degrees behind it, and
/// a blue wall behind both.
Json threeSurfaces() {
    Json scene = stackScene(3);
    const Json primitive = scene["meshes"][0]["primitives"][0];
    const std::array<std::array<double, 4>, 3> colors = {
        {{1, 0.1, 0.1, 0.5}, {0.1, 0.6, 0.2, 1}, {0.1, 0.2, 0.9, 1}}};
    const std::array<const char*, 3> names = {"near <b>pane", "turned", "wall"};
    scene["materials"].clear();
    scene["meshes"].clear();
    for (std::size_t i = 0; i < 3; ++i) {
        scene["meshes"].push_back({{"primitives", {primitive}}});
        scene["meshes"][i]["primitives"][0]["material"] = i;
        scene["nodes"][i]["mesh"] = i;
        scene["nodes"][i]["name"] = names[i];
        scene["nodes"][i]["translation"] = {0, 0, std::array<int, 3>{0, -1, -3}[i]};
        scene["materials"].push_back({{"name", "paint of " + std::string(names[i])},
                                      {"doubleSided", true},
                                      {"alphaMode", i == 0 ? "BLEND" : "OPAQUE"},
                                      {"pbrMetallicRoughness", {{"baseColorFactor", colors[i]}}},
                                      {"extensions", {{"KHR_materials_unlit", Json::object()}}}});
    }
    scene["nodes"][0]["scale"] = {0.3, 0.3, 1};
    scene["nodes"][1]["scale"] = {1.5, 1.5, 1};
    scene["nodes"][1]["rotation"] = {0, 0.38268343, 0, 0.92387953};
    scene["extensionsUsed"] = {"KHR_materials_unlit"};
    return scene;
}

TEST_F(ViewPage, TellsWhatIsShown) {
    writeScene(scratch_.path(), threeSurfaces());
    for (const std::vector<std::string>& verb :
         {std::vector<std::string>{"render", "scene.gltf", "-o", "layers.exr", "--camera", "front",
                                   "--size", "96x64", "--channels", "id"},
          {"view", "layers.exr", "-o", "page.html", "--background", "#dbdbdb", "--tone-map",
           "none"}}) {
        const auto result = run(verb);
        ASSERT_EQ(result.exit_code, 0) << result.err;
    }
    const auto browser = use("page.html", "read", {"48,32", "40,32", "5,7", "54,30"});
    if (browser.exit_code == 77) GTEST_SKIP() << browser.out;
    ASSERT_EQ(browser.exit_code, 0) << browser.out << browser.err;
    EXPECT_EQ(bytesOf(scratch_ / "console.json"), "[]") << "no word on the console";
    const Json told = readings();

    // The page shows the surface under the pointer. Pane and wall have exact Z; the triangle's Z is
    // that of the file to five digits, the precision of the page's depths.
    const std::string of_pane = "object near <b>pane material paint of near <b>pane";
    EXPECT_EQ(told["48,32"], "Z 3.0000 layer 0 pixel 48, 32 " + of_pane);
    EXPECT_EQ(told["5,7"], "Z 6.0000 layer 0 pixel 5, 7 object wall material paint of wall");
    const std::string turned = "object turned material paint of turned";
    for (const int x : {40, 54}) {
        const int y = x == 40 ? 32 : 30;
        const std::string place = std::to_string(x) + ", " + std::to_string(y);
        const std::string text = told[std::to_string(x) + "," + std::to_string(y)];
        EXPECT_TRUE(text.ends_with(" layer 0 pixel " + place + " " + turned)) << text;
        EXPECT_NEAR(std::stod(text.substr(2)), valueAt(layer(1), "Z", x, y), 7e-5) << text;
    }
    EXPECT_EQ(told["middle"], told["48,32"]);
    EXPECT_EQ(told["nowhere"], "Point at the picture to read depth, layer, pixel and object.");

    // The page shows a single layer.
    EXPECT_EQ(told["of all"], "3 of 3");
    EXPECT_EQ(told["two"], "2 of 3");
    EXPECT_EQ(told["second"], "layer 1");
    const std::string second = told["only 1"];
    EXPECT_TRUE(second.ends_with("layer 1 pixel 48, 32 " + turned)) << second;
    EXPECT_NEAR(std::stod(second.substr(2)), valueAt(layer(2), "Z", 48, 32), 7e-5) << second;
    const OIIO::ImageBuf behind = layer(2);
    int there = 0;
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 96; ++x) {
            std::array<int, 3> expected = {0xdb, 0xdb, 0xdb};
            if (std::isfinite(valueAt(behind, "Z", x, y)) && valueAt(behind, "A", x, y) > 0) {
                ++there;
                for (std::size_t c = 0; c < 3; ++c)
                    expected[c] = static_cast<int>(std::lround(
                        255 * encodeSrgb(valueAt(behind, std::array{"R", "G", "B"}[c], x, y))));
            }
            ASSERT_NO_FATAL_FAILURE(expectColor("only_2", x, y, expected));
        }
    }
    EXPECT_GT(there, 100);

    // Channels of the second layer, of the first, and of all.
    EXPECT_EQ(told["ramp from"], "0");
    EXPECT_EQ(told["ramp to"], "2");
    expectColor("layer_2", 48, 32, {35, 144, 139});  // the colour at the middle of viridis
    expectColor("layer_2", 5, 7, {0, 0, 0});
    expectColor("alpha_1", 48, 32, {128, 128, 128});
    expectColor("alpha_1", 5, 7, {255, 255, 255});
    expectColor("layer", 48, 32, {0xfd, 0xe7, 0x25});
    expectColor("depth", 48, 32, {0xfc, 0xff, 0xa4});  // the colour near the end of inferno
    expectColor("depth", 5, 7, {0x21, 0x0c, 0x4a});
    expectColor("normal", 48, 32, {128, 128, 255});  // 0.5 + 0.5 (0, 0, 1)
    expectColor("normal", 5, 7, {128, 128, 255});
    expectColor("normal", 40, 32, {218, 128, 218}, 3);  // 0.5 + 0.5 (1, 0, 1) / sqrt 2
    const std::set<std::array<int, 3>> objects = {color("object", 48, 32), color("object", 40, 32),
                                                  color("object", 5, 7)};
    EXPECT_EQ(objects.size(), 3U);
    EXPECT_EQ(color("object", 90, 60), color("object", 5, 7)) << "one object";
    EXPECT_EQ(told["cycle"], Json({"alpha", "depth", "layer", "object", "normal", "color"}));

    // Dragging moves the surface at the viewing distance by the same number of pixels. It moves the
    // wall, which is farther away, by proportionally less. After a drag of 20 pixels right and 10
    // up, pixel (30, 40) must show the surface that was at pixel `before`.
    const std::string page = bytesOf(scratch_ / "page.html");
    const double share = std::stod(page.substr(page.find("\"distance\":") + 11)) / 6;
    ASSERT_TRUE(share > 0.5 && share < 0.9) << share;
    const Pixel before = {static_cast<int>(30.5 - 20 * share), static_cast<int>(40.5 + 10 * share)};
    EXPECT_TRUE(
        contains(told["moved"].get<std::string>(), "pixel " + before.place() + " object wall"))
        << told["moved"];
    EXPECT_EQ(told["moved by fingers"], told["moved"]);
    EXPECT_LT(psnr("moved", "original"), 30);
    EXPECT_LT(psnr("moved_by_keys", "original"), 30);
    EXPECT_GE(psnr("reset", "original"), 100);
    EXPECT_EQ(told["menu_opens"], false);

    const std::vector<double> tops = told["layout"];
    EXPECT_TRUE(std::is_sorted(tops.begin(), tops.end())) << "help stands above the picture";
}

TEST_F(ViewPage, NeedsNothingElse) {
    render("coincident.glb", "64x36");
    ASSERT_EQ(run({"view", "layers.exr", "-o", "page.html", "--exposure", "0"}).exit_code, 0);
    const std::string page = bytesOf(scratch_ / "page.html");
    for (const char* sign : {"http:", "https:", "src=", "@import", "url("})
        EXPECT_EQ(page.find(sign), std::string::npos) << sign;
    EXPECT_EQ(page.find("{{"), std::string::npos) << "a field was left open";
    // The verb render writes the same page directly.
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
