// SPDX-License-Identifier: Apache-2.0
// Tests the results of the verbs, and the streams to which they are printed.
#include <ImfArray.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <gtest/gtest.h>

#include <cstring>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "core/image/channels.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class Results : public testing::Test {
  protected:
    Outcome render(const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{"render",        scene_.string(), "-o",
                                           image_.string(), "--size",        "96x64"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runPeeler(arguments);
    }

    ScratchDir scratch_;
    fs::path scene_ = writeScene(scratch_.path(), stackScene(5));
    fs::path image_ = scratch_ / "a.exr";
};

TEST_F(Results, StdoutIsEmptyUnlessAskedFor) {
    const Outcome result = render({});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_NE(result.err.find("a.exr: 5 layers, 30,720 fragments"), std::string::npos)
        << result.err;
    EXPECT_EQ(result.err.find("peeler: error:"), std::string::npos);
    for (const char c : result.err)
        EXPECT_TRUE(c == '\n' || (c >= ' ' && c <= '~')) << int{c};

    const Outcome quiet = render({"--quiet"});
    EXPECT_EQ(quiet.exit_code, 0);
    EXPECT_EQ(quiet.out + quiet.err, "");
}

TEST_F(Results, JsonHasEveryKey) {
    const fs::path report = scratch_ / "report.json";
    const Outcome result = render({"--json", "--report", report.string()});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(bytesOf(report), result.out);
    const Json json = Json::parse(result.out);
    EXPECT_EQ(json.at("input"), scene_.string());
    EXPECT_EQ(json.at("output"), image_.string());
    EXPECT_EQ(json.at("bytes"), fs::file_size(image_));
    EXPECT_EQ(json.at("width"), 96);
    EXPECT_EQ(json.at("height"), 64);
    EXPECT_EQ(json.at("layers"), 5);
    EXPECT_EQ(json.at("fragmentsCounted"), 5 * 96 * 64);
    EXPECT_EQ(json.at("fragmentsStored"), 5 * 96 * 64);
    EXPECT_EQ(json.at("complete"), true);
    EXPECT_EQ(json.at("method"), "a-buffer");
    EXPECT_NE(json.at("renderer"), "");
    EXPECT_NE(json.at("backend"), "");
    EXPECT_GE(json.at("passes").get<int>(), 1);
    EXPECT_GT(json.at("peakMemory").get<std::uint64_t>(), 1'000'000U);
    EXPECT_EQ(json.at("fragmentsBlended"), 0);
    EXPECT_EQ(json.at("fragmentsLeftOut"), 0);
    EXPECT_EQ(json.at("samples"), 1);
    EXPECT_EQ(json.at("settingsHash").get<std::string>().size(), 16U);
    EXPECT_GE(json.at("forecastBytes"), json.at("bytes"));
    EXPECT_GT(json.at("forecastMemory").get<std::uint64_t>(), 1'000'000U);
    EXPECT_EQ(json.size(), 21U);
    const Json& stages = json.at("milliseconds");
    double sum = 0;
    for (const char* stage : {"load", "context", "upload", "count", "capture", "sort", "composite",
                              "encode", "write"}) {
        EXPECT_GE(stages.at(stage).get<double>(), 0) << stage;
        sum += stages.at(stage).get<double>();
    }
    EXPECT_EQ(stages.size(), 10U);
    for (const char* stage : {"load", "context", "upload", "count", "capture", "write"}) {
        EXPECT_GT(stages.at(stage).get<double>(), 0) << stage;
    }
    EXPECT_LE(sum, stages.at("total").get<double>() * 1.01);
}

TEST_F(Results, BeginAndEndAlikeWhateverTheVerb) {
    const auto in = [&](const char* name) { return (scratch_ / name).string(); };
    const Outcome rendered = render({"--json", "--quiet"});
    ASSERT_EQ(rendered.exit_code, 0) << rendered.err;
    const std::vector<std::vector<std::string>> lines{
        {"rays", scene_.string(), "-o", in("a.npz"), "--direction", "0,0,1", "--resolution", "8",
         "--engine", "gl"},
        {"bake", scene_.string(), "-o", in("a.glb"), "--directions", "2", "--resolution", "8",
         "--engine", "gl"},
        {"extract", image_.string(), "--points", in("a.ply")}};
    const std::vector<std::string> last{"settingsHash", "renderer", "backend", "peakMemory",
                                        "milliseconds"};
    for (std::vector<std::string> line : lines) {
        line.insert(line.end(), {"--json", "--quiet"});
        const Outcome result = runPeeler(line);
        ASSERT_EQ(result.exit_code, 0) << result.err;
        const auto json = nlohmann::ordered_json::parse(result.out);
        std::vector<std::string> keys;
        for (const auto& [key, value] : json.items())
            keys.push_back(key);
        ASSERT_GT(keys.size(), 8U);
        EXPECT_EQ(std::vector(keys.begin(), keys.begin() + 3),
                  (std::vector<std::string>{"input", "output", "bytes"}));
        EXPECT_EQ(std::vector(keys.end() - 5, keys.end()), last);
        EXPECT_EQ(json.at("input"), line[1]);
        EXPECT_EQ(json.at("output"), line[3]);
        EXPECT_EQ(json.at("bytes"), fs::file_size(line[3]));
        EXPECT_EQ(json.at("settingsHash").get<std::string>().size(), 16U);
        EXPECT_NE(json.at("renderer"), "");
        const Json stages = Json::parse(rendered.out).at("milliseconds");
        for (const auto& [stage, milliseconds] : stages.items())
            EXPECT_TRUE(json.at("milliseconds").contains(stage)) << line[0] << ' ' << stage;
        EXPECT_EQ(std::prev(json.at("milliseconds").end()).key(), "total");
    }
}

TEST_F(Results, HashOfSettingsIsThatOfWhatWasAskedFor) {
    const auto hash = [&](std::vector<std::string> line) {
        line.insert(line.end(), {"--json", "--quiet"});
        const Outcome result = runPeeler(line);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return Json::parse(result.out).at("settingsHash").get<std::string>();
    };
    const auto rays = [&](const std::string& resolution, const std::string& more) {
        return hash({"rays", scene_.string(), "-o", (scratch_ / "a.npz").string(), "--direction",
                     "0,0,1", "--resolution", resolution, more});
    };
    EXPECT_EQ(rays("8", "--refine"), rays("8", "--threads=1"));
    EXPECT_NE(rays("8", "--refine"), rays("8", "--no-refine"));
    EXPECT_NE(rays("8", "--refine"), rays("9", "--refine"));
    const auto bake = [&](const std::string& directions, const std::string& more) {
        return hash({"bake", scene_.string(), "-o", (scratch_ / "a.glb").string(), "--resolution",
                     "8", "--directions", directions, more});
    };
    EXPECT_EQ(bake("2", "--faces=both"), bake("2", "--threads=1"));
    EXPECT_NE(bake("2", "--faces=both"), bake("4", "--faces=both"));
    EXPECT_NE(bake("2", "--faces=both"), bake("2", "--faces=front"));

    // A sheet of the scene has the same hash as a sheet of the layers rendered from the scene.
    ASSERT_EQ(render({}).exit_code, 0);
    const std::string sheet = (scratch_ / "a.png").string();
    EXPECT_EQ(
        hash({"sheet", scene_.string(), "-o", sheet, "--size", "96x64", "--environment", "none"}),
        hash({"sheet", image_.string(), "-o", sheet}));
}

TEST_F(Results, TellTheSamplesOfThePictureTheyAreMadeOf) {
    ASSERT_EQ(render({"--samples", "2"}).exit_code, 0);
    for (const auto& [verb, name] : {std::pair("flatten", "b.png"), std::pair("convert", "b.exr"),
                                     std::pair("merge", "c.exr")}) {
        const Outcome result =
            runPeeler({verb, image_.string(), "-o", (scratch_ / name).string(), "--json", "-q"});
        ASSERT_EQ(result.exit_code, 0) << result.err;
        EXPECT_EQ(Json::parse(result.out).at("samples"), 2) << verb;
    }
}

TEST_F(Results, ProgressLinesForPrograms) {
    const Outcome result = render({"--progress", "json", "--quiet"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::istringstream stream(result.err);
    double last = -1;
    for (std::string line; std::getline(stream, line);)
        last = Json::parse(line).at("progress");
    EXPECT_EQ(last, 1);
}

/// Returns the channels R, G, B, A and Z of a file's first part, as bytes.
std::vector<std::string> channelBytes(const fs::path& path) {
    Imf::MultiPartInputFile file(path.c_str());
    Imf::InputPart part(file, 0);
    const Imath::Box2i window = part.header().dataWindow();
    const auto width = static_cast<std::size_t>(window.max.x - window.min.x + 1);
    const auto height = static_cast<std::size_t>(window.max.y - window.min.y + 1);
    std::vector<std::string> planes;
    for (const char* name : {"R", "G", "B", "A", "Z"}) {
        const Imf::Channel* channel = part.header().channels().findChannel(name);
        if (!channel) {
            ADD_FAILURE() << path << " has no channel " << name;
            return {};
        }
        const std::size_t size = channel->type == Imf::HALF ? 2 : 4;
        std::string& plane = planes.emplace_back(width * height * size, '\0');
        Imf::FrameBuffer frame;
        frame.insert(name,
                     Imf::Slice::Make(channel->type, plane.data(), window, size, size * width));
        part.setFrameBuffer(frame);
        part.readPixels(window.min.y, window.max.y);
    }
    return planes;
}

TEST_F(Results, FlattenEqualsTheCompositePart) {
    for (const char* precision : {"half", "float"}) {
        ASSERT_EQ(render({"--precision", precision}).exit_code, 0);
        const fs::path flat = scratch_ / "flat.exr";
        const Outcome result =
            runPeeler({"flatten", image_.string(), "-o", flat.string(), "--json"});
        ASSERT_EQ(result.exit_code, 0) << result.err;
        EXPECT_EQ(channelBytes(flat), channelBytes(image_)) << precision;
        EXPECT_EQ(Json::parse(result.out).at("layers"), 5);
    }
}

TEST_F(Results, FlattenOfTheNearestLayersEqualsALimitedRender) {
    ASSERT_EQ(render({}).exit_code, 0);
    const fs::path flat = scratch_ / "flat.exr", limited = scratch_ / "limited.exr";
    const Outcome result =
        runPeeler({"flatten", image_.string(), "-o", flat.string(), "--layers", "2", "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json json = Json::parse(result.out);
    EXPECT_EQ(json.at("layers"), 2);
    EXPECT_EQ(json.at("fragmentsStored"), 2 * 96 * 64);
    EXPECT_EQ(json.at("complete"), false);
    ASSERT_EQ(runPeeler({"render", scene_.string(), "-o", limited.string(), "--size", "96x64",
                         "--layers", "2"})
                  .exit_code,
              0);
    EXPECT_EQ(channelBytes(flat), channelBytes(limited));
}

TEST_F(Results, FlattenBlendsTheTailAsARenderDoes) {
    ASSERT_EQ(render({"--precision", "float"}).exit_code, 0);
    const fs::path flat = scratch_ / "flat.exr", limited = scratch_ / "limited.exr";
    const std::vector<std::string> blended{"--layers", "2", "--tail", "blend", "--json"};
    std::vector<std::string> arguments{"flatten", image_.string(), "-o", flat.string()};
    arguments.insert(arguments.end(), blended.begin(), blended.end());
    const Outcome result = runPeeler(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json json = Json::parse(result.out);
    EXPECT_EQ(json.at("fragmentsStored"), 2 * 96 * 64);
    EXPECT_EQ(json.at("fragmentsBlended"), 3 * 96 * 64);
    arguments = {"render", scene_.string(), "-o",        limited.string(), "--size",
                 "96x64",  "--as",          "composite", "--precision",    "float"};
    arguments.insert(arguments.end(), blended.begin(), blended.end());
    ASSERT_EQ(runPeeler(arguments).exit_code, 0);
    EXPECT_EQ(channelBytes(flat), channelBytes(limited));
}

TEST_F(Results, CalibratedCamerasAreThoseOfNumbers) {
    // OpenCV cameras look along +Z with Y down. This one is at (0, 0, 5) and looks along -Z.
    const std::string pose = "1,0,0,0,0,-1,0,0,0,0,-1,5";
    const auto camera = [&](const std::vector<std::string>& options) {
        EXPECT_EQ(render(options).exit_code, 0);
        return Json::parse(runPeeler({"info", image_.string(), "--json"}).out).at("camera");
    };
    // The picture has 96 x 64 pixels and a focal length of 80. In OpenCV's convention, pixel
    // centres have whole coordinates, so the principal point (47.5, 31.5) is the picture's centre.
    const std::vector<std::string> asked{"--intrinsics", "80,80,47.5,31.5", "--pose", pose};
    const Json found = camera(asked);
    EXPECT_EQ(found.at("cameraToWorld"), Json::parse("[[1,0,0,0],[0,1,0,0],[0,0,1,5],[0,0,0,1]]"));
    EXPECT_DOUBLE_EQ(found.at("halfHeight"), 0.4);
    EXPECT_DOUBLE_EQ(found.at("halfWidth"), 0.6);
    EXPECT_EQ(camera({"--intrinsics", "80,80,47.5,31.5", "--pose", pose + ",0,0,0,1"}), found);
    // If the principal point moves by ten pixels, the picture is a crop of a picture that is twenty
    // pixels wider.
    const Json aside = camera({"--intrinsics", "80,80,57.5,31.5", "--pose", pose});
    EXPECT_EQ(aside.at("width"), 116);
    EXPECT_EQ(aside.at("crop"), Json::parse("[0,0,96,64]"));
    const std::string hits = (scratch_ / "hits.npz").string();
    std::vector<std::string> rays{"rays", scene_.string(), "-o", hits, "--size", "96x64", "--json"};
    rays.insert(rays.end(), asked.begin(), asked.end());
    const Outcome traced = runPeeler(rays);
    ASSERT_EQ(traced.exit_code, 0) << traced.err;
    EXPECT_EQ(Json::parse(traced.out).at("rays"), 96 * 64);
}

TEST_F(Results, FlatImagesAreWritten) {
    ASSERT_EQ(render({}).exit_code, 0);
    const fs::path direct = scratch_ / "direct.png", flat = scratch_ / "flat.png";
    const std::vector<std::string> look{"--background", "#336699",    "--exposure",
                                        "0.5",          "--tone-map", "neutral"};
    std::vector<std::string> first{"render",        scene_.string(), "-o",
                                   direct.string(), "--size",        "96x64"};
    std::vector<std::string> second{"flatten", image_.string(), "-o", flat.string()};
    // Uses the settings with which the EXR was rendered.
    first.insert(first.end(), {"--samples", "1", "--environment", "none"});
    first.insert(first.end(), look.begin(), look.end());
    second.insert(second.end(), look.begin(), look.end());
    ASSERT_EQ(runPeeler(first).exit_code, 0);
    ASSERT_EQ(runPeeler(second).exit_code, 0);
    EXPECT_EQ(bytesOf(direct), bytesOf(flat));
}

TEST_F(Results, MethodsAndThreadsGiveTheSameFileButForTheMethodsName) {
    ASSERT_EQ(render({"--threads", "1"}).exit_code, 0);
    const std::string one = bytesOf(image_);
    ASSERT_EQ(render({"--threads", "3"}).exit_code, 0);
    EXPECT_EQ(bytesOf(image_), one);
    const auto hash = [&] {
        return Json::parse(runPeeler({"info", "--json", image_.string()}).out)
            .at("attributes")
            .at("peeler:settingsHash");
    };
    const Json before = hash();
    ASSERT_EQ(render({"--method", "front-to-back"}).exit_code, 0);
    EXPECT_EQ(hash(), before);
    ASSERT_EQ(render({"--layers", "1"}).exit_code, 0);
    EXPECT_NE(hash(), before);
}

TEST_F(Results, InfoOnAScene) {
    const Outcome text = runPeeler({"info", scene_.string()});
    EXPECT_EQ(text.exit_code, 0) << text.err;
    for (const char* part :
         {"5 triangles", "1 BLEND", "0  front, perspective", "extensions: none"}) {
        EXPECT_NE(text.out.find(part), std::string::npos) << part << " not in\n" << text.out;
    }
    const Json json = Json::parse(runPeeler({"info", "--json", scene_.string()}).out);
    EXPECT_EQ(json.at("kind"), "scene");
    EXPECT_EQ(json.at("triangles"), 5);
    EXPECT_EQ(json.at("nodes").size(), 6U);
    EXPECT_EQ(json.at("materials").at("BLEND"), 1);
    EXPECT_EQ(json.at("cameras").at(0).at("name"), "front");
    EXPECT_EQ(json.at("bounds").at("min").size(), 3U);
    EXPECT_TRUE(json.at("warnings").empty());
    // Every node and every material, including glTF's default material, has a name.
    EXPECT_EQ(json.at("objectNames").size(), 6U);
    EXPECT_EQ(json.at("materialNames").size(), 2U);
    const std::string first = json.at("objectNames").at(0);
    const Outcome chosen =
        runPeeler({"info", "--json", scene_.string(), "--exclude", first, "--variant", "0"});
    EXPECT_EQ(chosen.exit_code, 2);
    EXPECT_TRUE(contains(chosen.err, "unknown variant")) << chosen.err;
    const Json less =
        Json::parse(runPeeler({"info", "--json", scene_.string(), "--exclude", first}).out);
    EXPECT_LT(less.at("triangles"), json.at("triangles"));
}

TEST_F(Results, InfoTellsWhichExtensionsAreSupported) {
    auto scene = triangleScene();
    scene["extensionsUsed"] = {"KHR_materials_unlit", "EXT_made_up"};
    const Json json =
        Json::parse(runPeeler({"info", "--json", writeScene(scratch_.path(), scene).string()}).out);
    EXPECT_EQ(json.at("extensions").at(0).at("supported"), true);
    EXPECT_EQ(json.at("extensions").at(1).at("supported"), false);
    EXPECT_EQ(json.at("extensions").at(1).at("required"), false);
}

TEST_F(Results, InfoOnALayeredImage) {
    ASSERT_EQ(render({"--crop", "8,8,40,20"}).exit_code, 0);
    const Outcome text = runPeeler({"info", image_.string()});
    EXPECT_EQ(text.exit_code, 0) << text.err;
    EXPECT_NE(text.out.find("4,000 of 4,000, complete"), std::string::npos) << text.out;
    const Json json = Json::parse(runPeeler({"info", "--json", image_.string()}).out);
    EXPECT_EQ(json.at("kind"), "image");
    EXPECT_EQ(json.at("peeler"), true);
    EXPECT_EQ(json.at("complete"), true);
    EXPECT_EQ(json.at("crop"), Json({8, 8, 40, 20}));
    EXPECT_EQ(json.at("layers").size(), 5U);
    EXPECT_EQ(json.at("layers").at(0).at("pixels"), 800);
    EXPECT_EQ(json.at("fragmentsFound"), 4000);
    EXPECT_EQ(json.at("parts").size(), 6U);
    EXPECT_EQ(json.at("attributes").at("peeler:scene"), "scene.gltf");
}

TEST_F(Results, DevicesListsEveryBackend) {
    const Outcome text = runPeeler({"devices"});
    const Outcome result = runPeeler({"devices", "--json"});
    EXPECT_EQ(text.exit_code, result.exit_code);
    const Json json = Json::parse(result.out);
    bool usable = false;
    for (const Json& device : json.at("devices")) {
        EXPECT_EQ(device.at("usable"), device.at("problem") == "");
        EXPECT_TRUE(device.at("limits").contains("shaderStorageBlockSize"));
        usable = usable || device.at("usable").get<bool>();
    }
    EXPECT_EQ(result.exit_code, usable ? 0 : 5);
    for (const char* backend : {"egl", "osmesa"}) {
        EXPECT_NE(text.out.find(backend), std::string::npos) << text.out;
    }
}

TEST_F(Results, SceneWithoutAnythingToSee) {
    const fs::path scene =
        writeScene(scratch_.path(), Json::parse(R"({"asset": {"version": "2.0"}})"));
    const Outcome result = runPeeler({"render", scene.string(), "-o", image_.string(), "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out).at("layers"), 0);
    EXPECT_EQ(
        runPeeler({"flatten", image_.string(), "-o", (scratch_ / "f.png").string()}).exit_code, 0);
    EXPECT_EQ(runPeeler({"info", image_.string()}).exit_code, 0);
}

}  // namespace
}  // namespace peeler::test
