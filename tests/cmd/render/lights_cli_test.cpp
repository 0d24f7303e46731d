// SPDX-License-Identifier: Apache-2.0
// Tests lights as cameras, midpoint shadow maps as files, and lights in `info`.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Returns three opaque triangles at z = 0, −0.1 and −0.2 with the corners (−100, −100), (100,
/// −100), (0, 100), and lights that shine along −Z: a sun, a lamp at z = 5, and a bulb.
Json litScene() {
    Json scene = stackScene(3);
    scene["materials"][0]["alphaMode"] = "OPAQUE";
    scene["extensionsUsed"] = {"KHR_lights_punctual"};
    scene["extensions"]["KHR_lights_punctual"]["lights"] = Json::parse(R"([
        {"type": "directional", "name": "sun", "intensity": 3},
        {"type": "spot", "intensity": 40, "range": 30, "spot": {"outerConeAngle": 0.3}},
        {"type": "point", "name": "bulb"}])");
    const char* const names[] = {"", "lamp", ""};
    for (int i = 0; i < 3; ++i) {
        scene["scenes"][0]["nodes"].push_back(scene["nodes"].size());
        scene["nodes"].push_back({{"name", names[i]},
                                  {"translation", {0, 0, 5}},
                                  {"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
    }
    return scene;
}

struct DepthMap {
    Imath::Box2i window;
    std::vector<float> z;
    Json camera;

    float at(int x, int y) const {
        const int width = window.max.x - window.min.x + 1;
        return z[static_cast<std::size_t>((y - window.min.y) * width + x - window.min.x)];
    }
};

DepthMap readDepthMap(const fs::path& path) {
    Imf::InputFile file(path.c_str());
    const Imf::Header& header = file.header();
    EXPECT_NE(header.channels().findChannel("Z"), nullptr);
    EXPECT_EQ(header.channels().findChannel("R"), nullptr);
    EXPECT_EQ(header.typedAttribute<Imf::StringAttribute>("peeler:surfaces").value(), "opaque");
    DepthMap map;
    map.window = header.dataWindow();
    map.camera =
        Json::parse(header.typedAttribute<Imf::StringAttribute>("peeler:cameraJson").value());
    const auto width = static_cast<std::size_t>(map.window.max.x - map.window.min.x + 1);
    map.z.resize(width * static_cast<std::size_t>(map.window.max.y - map.window.min.y + 1));
    Imf::FrameBuffer frame;
    frame.insert("Z", Imf::Slice::Make(Imf::FLOAT, map.z.data(), map.window, sizeof(float),
                                       sizeof(float) * width));
    file.setFrameBuffer(frame);
    file.readPixels(map.window.min.y, map.window.max.y);
    return map;
}

class LightCameras : public testing::Test {
  protected:
    Outcome render(const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{"render", scene_.string(), "-o", image_.string()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runPeeler(arguments);
    }

    ScratchDir scratch_;
    fs::path scene_ = writeScene(scratch_.path(), litScene());
    fs::path image_ = scratch_ / "map.exr";
};

TEST_F(LightCameras, SpotMapHoldsTheMidpointOfTheTwoNearest) {
    for (const char* name : {"light:lamp", "light:1"}) {
        const auto result = render({"--camera", name, "--as", "midpoint-depth", "--size", "50x37"});
        ASSERT_EQ(result.exit_code, 0) << result.err;
        const DepthMap map = readDepthMap(image_);
        ASSERT_EQ(map.z.size(), 50U * 37U);
        for (const float z : map.z)
            ASSERT_NEAR(z, 5.05, 5e-6);
    }
}

TEST_F(LightCameras, DirectionalMapIsFittedToTheScene) {
    const auto result =
        render({"--camera", "light:sun", "--as", "midpoint-depth", "--size", "200"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const DepthMap map = readDepthMap(image_);
    ASSERT_EQ(map.window.max.y, 199) << "the scene is as high as wide";
    EXPECT_NEAR(map.camera["halfWidth"].get<double>(), 101, 1e-6);
    const double eye = map.camera["cameraToWorld"][2][3];
    EXPECT_GT(eye, 0);
    int there = 0;
    for (int y = 0; y < 200; ++y) {
        for (int x = 0; x < 200; ++x) {
            const double px = 1.01 * (x + 0.5 - 100), py = 1.01 * (100 - y - 0.5);
            const double inside = std::min(py + 100, 100 - py - 2 * std::abs(px));
            if (std::abs(inside) < 0.01) continue;
            const float z = map.at(x, y);
            if (inside > 0) {
                ++there;
                ASSERT_NEAR(z, eye + 0.05, 1e-5) << x << ", " << y;
            } else {
                ASSERT_EQ(z, std::numeric_limits<float>::infinity()) << x << ", " << y;
            }
        }
    }
    EXPECT_GT(there, 15000);
}

TEST_F(LightCameras, CropIsPartOfTheMap) {
    const std::vector<std::string> options{"--camera",       "light:sun", "--as",
                                           "midpoint-depth", "--size",    "200"};
    ASSERT_EQ(render(options).exit_code, 0);
    const DepthMap whole = readDepthMap(image_);
    std::vector<std::string> cropped = options;
    cropped.insert(cropped.end(), {"--crop", "31,17,90,101"});
    ASSERT_EQ(render(cropped).exit_code, 0);
    const DepthMap part = readDepthMap(image_);
    ASSERT_EQ(part.z.size(), 90U * 101U);
    for (int y = 17; y < 118; ++y)
        for (int x = 31; x < 121; ++x)
            ASSERT_EQ(part.at(x, y), whole.at(x, y));
}

TEST_F(LightCameras, GlassIsNotInTheMap) {
    const fs::path glass = writeScene(scratch_.path(), stackScene(3));
    const auto result = runPeeler({"render", glass.string(), "-o", image_.string(), "--camera",
                                   "light:key", "--as", "midpoint-depth", "--size", "32x32"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    for (const float z : readDepthMap(image_).z)
        EXPECT_EQ(z, std::numeric_limits<float>::infinity());
}

TEST_F(LightCameras, OtherOutputsTakeThemToo) {
    const auto result = render({"--camera", "light:lamp", "--size", "64x48", "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out).at("fragmentsCounted"), 3 * 64 * 48);
}

TEST_F(LightCameras, UnknownOnesAreListed) {
    const auto result = render({"--camera", "light:son", "--as", "midpoint-depth"});
    EXPECT_EQ(result.exit_code, 2);
    for (const char* part : {"unknown light: --camera light:son", "did you mean 'light:sun'?",
                             "light:sun, light:lamp, light:bulb", "light:0 to light:2"})
        EXPECT_NE(result.err.find(part), std::string::npos) << part << "\n" << result.err;
    EXPECT_EQ(render({"--camera", "light:3"}).exit_code, 2);
    EXPECT_EQ(render({"--camera", "light:key"}).exit_code, 2) << "it is off";
    const auto bulb = render({"--camera", "light:bulb"});
    EXPECT_EQ(bulb.exit_code, 2);
    EXPECT_NE(bulb.err.find("no view"), std::string::npos) << bulb.err;
    EXPECT_FALSE(fs::exists(image_));
}

TEST_F(LightCameras, InfoListsTheLights) {
    const auto text = runPeeler({"info", scene_.string()});
    ASSERT_EQ(text.exit_code, 0) << text.err;
    for (const char* line :
         {"  0  sun, directional, 3 lx\n", "  1  lamp, spot, 40 cd\n", "  2  bulb, point, 1 cd\n"})
        EXPECT_NE(text.out.find(line), std::string::npos) << line << "\n" << text.out;
    const auto json = runPeeler({"info", scene_.string(), "--json"});
    const Json lamp = Json::parse(json.out).at("lights").at(1);
    EXPECT_EQ(lamp.at("type"), "spot");
    EXPECT_EQ(lamp.at("range"), 30);
    EXPECT_EQ(lamp.at("outerConeAngle"), 0.3);
}

}  // namespace
}  // namespace peeler::test
