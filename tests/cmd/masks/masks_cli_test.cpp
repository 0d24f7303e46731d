// SPDX-License-Identifier: Apache-2.0
// Tests peeler masks: compares masks with renders of each object alone, and checks the output files
// of many views.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "core/image/object_masks.h"
#include "formats/image/image_library.h"
#include "formats/layered/opened_picture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Reads the samples of a grey picture of 8 or 16 bits, as values from 0 to 1.
std::vector<float> grey(const fs::path& path) {
    const auto decoder = imageDecoder("png", path.string());
    const StoredImage& image = decoder->image();
    std::vector<float> samples(static_cast<std::size_t>(image.width * image.height));
    decoder->read(0, 1, samples.data());
    return samples;
}

std::vector<char> maskOf(const fs::path& path) {
    std::vector<char> mask;
    for (const float sample : grey(path))
        mask.push_back(sample > 0.5F ? 1 : 0);
    return mask;
}

/// Returns whether each pixel of a render has a fragment.
std::vector<char> coverageOf(const std::vector<std::string>& scene, const fs::path& scratch) {
    const std::string layers = (scratch / "alone.exr").string();
    std::vector<std::string> line{"render"};
    line.insert(line.end(), scene.begin(), scene.end());
    line.insert(line.end(), {"-o", layers, "--quiet"});
    const Outcome run = runPeeler(line);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const auto input = openLayered(layers);
    LayeredImage image;
    input->read(input->info().plan.view.crop, image);
    std::vector<char> covered;
    for (std::size_t p = 0; p < image.window.pixels(); ++p)
        covered.push_back(image.count(p) > 0 ? 1 : 0);
    return covered;
}

Json jsonOf(const fs::path& path) {
    return Json::parse(bytesOf(path));
}

Json run(std::vector<std::string> line) {
    line.insert(line.begin(), "masks");
    line.insert(line.end(), {"--json", "--quiet"});
    const Outcome outcome = runPeeler(line);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.exit_code == 0 ? Json::parse(outcome.out) : Json();
}

/// Returns the options for an explicit camera, which does not depend on the chosen objects.
std::vector<std::string> cameraFor(const fs::path& model) {
    const Outcome info = runPeeler({"info", model.string(), "--json"});
    EXPECT_EQ(info.exit_code, 0) << info.err;
    const Json bounds = Json::parse(info.out)["bounds"];
    std::string eye, target;
    double size = 0;
    for (std::size_t i = 0; i < 3; ++i)
        size = std::max(size, bounds["max"][i].get<double>() - bounds["min"][i].get<double>());
    const double towards[] = {0.8, 0.9, 1.6};
    for (std::size_t i = 0; i < 3; ++i) {
        const double middle = (bounds["max"][i].get<double>() + bounds["min"][i].get<double>()) / 2;
        target += (i == 0 ? "" : ",") + std::to_string(middle);
        eye += (i == 0 ? "" : ",") + std::to_string(middle + size * towards[i]);
    }
    return {"--eye", eye, "--target", target};
}

/// Compares the masks of every node of a model with renders of only that node.
void compareWithRenders(const fs::path& model) {
    SCOPED_TRACE(model.string());
    const ScratchDir scratch;
    std::vector<std::string> picture{model.string(), "--size", "120x90"};
    const std::vector<std::string> camera = cameraFor(model);
    picture.insert(picture.end(), camera.begin(), camera.end());
    std::vector<std::string> line = picture;
    line.insert(line.end(), {"-o", (scratch / "masks").string()});
    const Json found = run(line);
    ASSERT_FALSE(found.is_null());
    const Json objects = jsonOf(scratch / "masks/objects.json")["objects"];
    const Json listed = jsonOf(scratch / "masks/scene_gt.json")["0"];
    ASSERT_GT(listed.size(), 2U);
    std::vector<char> seen(std::size_t{120} * 90, 0);
    std::map<int, std::vector<char>> masks;
    for (std::size_t i = 0; i < listed.size(); ++i) {
        char name[32];
        std::snprintf(name, sizeof name, "000000_%06zu.png", i);
        masks[listed[i]["obj_id"]] = maskOf(scratch / "masks/mask" / name);
        const std::vector<char> visible = maskOf(scratch / "masks/mask_visib" / name);
        for (std::size_t p = 0; p < seen.size(); ++p) {
            ASSERT_FALSE(seen[p] && visible[p]) << "two are seen at pixel " << p;
            ASSERT_LE(visible[p], masks[listed[i]["obj_id"]][p]);
            seen[p] = static_cast<char>(seen[p] | visible[p]);
        }
    }
    EXPECT_EQ(seen, coverageOf(picture, scratch.path())) << "together they are the first layer";
    const std::vector<float> first = grey(scratch / "masks/ids/000000_layer_000.png");
    for (std::size_t p = 0; p < seen.size(); ++p)
        ASSERT_EQ(first[p] > 0, seen[p] != 0);
    for (const Json& object : objects) {
        const int number = object["object"];
        SCOPED_TRACE(object["name"]);
        std::vector<std::string> alone = picture;
        alone.insert(alone.end(), {"--include", object["name"]});
        const std::vector<char> covered = coverageOf(alone, scratch.path());
        if (masks.contains(number))
            EXPECT_EQ(masks[number], covered);
        else
            EXPECT_EQ(std::ranges::count(covered, 1), 0);
    }
}

TEST(Masks, OfEachObjectAreThoseOfTheObjectAlone) {
    compareWithRenders(sourceDir() / "examples/scenes/coincident.glb");
    PEELER_REQUIRE_ASSETS(assets);
    compareWithRenders(assets /
                       "gltf-sample-assets/StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp.gltf");
    if (!exhaustive()) return;
    compareWithRenders(sourceDir() / "examples/scenes/glasses.glb");
    compareWithRenders(assets /
                       "gltf-sample-assets/AlphaBlendModeTest/glTF/AlphaBlendModeTest.gltf");
}

/// Returns three named triangles of opacity 0.5, one behind the other. Each fills the picture.
Json stack() {
    Json scene = stackScene(3);
    for (std::size_t i = 0; i < 3; ++i)
        scene["nodes"][i]["name"] = "pane " + std::to_string(i);
    scene["nodes"][2]["extras"] = {{"class", 7}};
    return scene;
}

class MasksCommand : public testing::Test {
  protected:
    void SetUp() override { scene_ = writeScene(scratch_.path(), stack()).string(); }

    std::vector<std::string> line(std::vector<std::string> more,
                                  const std::string& output = "out") const {
        std::vector<std::string> line{scene_, "-o", (scratch_ / output).string(), "--size", "12x8"};
        line.insert(line.end(), more.begin(), more.end());
        return line;
    }
    /// Returns the number of visible pixels by object name, without objects that are not visible.
    std::map<std::string, int> visible(const std::vector<std::string>& more) const {
        std::map<std::string, int> counts;
        const Json found = run(line(more));
        for (const Json& object : found.value("objects", Json::array()))
            counts[object["name"]] = object["visiblePixels"];
        return counts;
    }
    Outcome refused(std::vector<std::string> more) const {
        more = line(more);
        more.insert(more.begin(), "masks");
        return runPeeler(more);
    }

    ScratchDir scratch_;
    std::string scene_;
};

using Counts = std::map<std::string, int>;

TEST_F(MasksCommand, ObjectsAreWhatByAsks) {
    EXPECT_EQ(visible({}), (Counts{{"pane 0", 96}, {"pane 1", 0}, {"pane 2", 0}}));
    EXPECT_EQ(visible({"--by", "material"}), (Counts{{"material 0", 96}}));
    EXPECT_EQ(visible({"--by", "glob:pane [12]"}), (Counts{{"pane [12]", 0}}))
        << "the background hides it";
    EXPECT_EQ(visible({"--by", "glob:pane 1,pane*", "--by", "glob:*2"}),
              (Counts{{"pane 1", 0}, {"pane*", 96}}))
        << "the first glob counts";
    EXPECT_EQ(visible({"--by", "extras:class"}), (Counts{{"7", 0}}));
    EXPECT_EQ(visible({"--by", "extras:class", "--exclude", "pane [01]"}), (Counts{{"7", 96}}));
    for (const char* const wrong :
         {"nodes", "glob:", "glob:a,", "extras:", "extras:klass", "glob:nothing", "material:x"}) {
        const Outcome outcome = refused({"--by", wrong});
        EXPECT_EQ(outcome.exit_code, 2) << wrong << outcome.err;
        EXPECT_TRUE(contains(outcome.err, "--by")) << outcome.err;
    }
    EXPECT_TRUE(contains(refused({"--by", "extras:clas"}).err, "did you mean 'class'?"));
    EXPECT_EQ(refused({"--by", "node", "--by", "material"}).exit_code, 2);
}

TEST_F(MasksCommand, SeesThroughWhatIsTransparent) {
    const Counts front{{"pane 0", 96}, {"pane 1", 0}, {"pane 2", 0}};
    EXPECT_EQ(visible({"--see-through", "0.5"}), front) << "their opacity is enough";
    EXPECT_EQ(visible({"--see-through", "0.6"}), front) << "nothing is opaque enough: the first";
    Json scene = stack();
    scene["materials"].push_back(scene["materials"][0]);
    scene["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"][3] = 0.1;
    scene["meshes"].push_back(scene["meshes"][0]);
    scene["meshes"][1]["primitives"][0]["material"] = 1;
    scene["nodes"][0]["mesh"] = 1;
    writeScene(scratch_.path(), scene);
    const Counts second{{"pane 0", 0}, {"pane 1", 96}, {"pane 2", 0}};
    EXPECT_EQ(visible({"--see-through", "0.1"}), front) << "0.1 is not rounded to less";
    EXPECT_EQ(visible({"--see-through", "0.11"}), second);
    EXPECT_EQ(visible({"--see-through", "0.5"}), second);
    for (const char* const wrong : {"-0.1", "1.5", "x"})
        EXPECT_EQ(refused({"--see-through", wrong}).exit_code, 2) << wrong;
}

TEST_F(MasksCommand, WritesWhatIsAskedFor) {
    run(line({"--as", "ids,coco"}));
    EXPECT_TRUE(fs::exists(scratch_ / "out/coco.json"));
    EXPECT_TRUE(fs::exists(scratch_ / "out/ids/000000_layer_002.png"));
    EXPECT_FALSE(fs::exists(scratch_ / "out/ids/000000_layer_003.png"));
    EXPECT_FALSE(fs::exists(scratch_ / "out/mask"));
    EXPECT_FALSE(fs::exists(scratch_ / "out/scene_gt.json"));
    const std::vector<float> second = grey(scratch_ / "out/ids/000000_layer_001.png");
    EXPECT_EQ(std::set<int>({2}), [&] {
        std::set<int> numbers;
        for (const float sample : second)
            numbers.insert(static_cast<int>(std::lround(sample * 65535)));
        return numbers;
    }());
    EXPECT_EQ(refused({"--as", "bob"}).exit_code, 2);
    EXPECT_EQ(refused({"--canvas", "2"}).exit_code, 2);
    EXPECT_EQ(refused({"--canvas", "11"}).exit_code, 2);
    EXPECT_EQ(refused({"--chunk", "1/2"}).exit_code, 2);
    EXPECT_EQ(refused({"--no-clobber"}).exit_code, 4);
    const Outcome orthographic = refused({"--ortho-height", "3"});
    EXPECT_EQ(orthographic.exit_code, 2);
    EXPECT_TRUE(contains(orthographic.err, "orthographic")) << orthographic.err;
    EXPECT_EQ(refused({"--ortho-height", "3", "--as", "coco"}).exit_code, 0);
    // Output must not replace the files of the scene.
    fs::create_directories(scratch_ / "own/ids");
    const fs::path scene = writeScene(scratch_ / "own/ids", stack());
    EXPECT_EQ(runPeeler({"masks", scene.string(), "-o", (scratch_ / "own").string()}).exit_code, 2);
}

TEST_F(MasksCommand, CountsOnACanvas) {
    // The panes are far larger than the picture. They also fill the canvas, which is three times as
    // wide and high as the picture.
    const Json found = run(line({"--canvas", "3"}))["objects"][0];
    EXPECT_EQ(found["canvasPixels"], 9 * 96);
    EXPECT_EQ(found["amodalPixels"], 96);
    EXPECT_EQ(found["visiblePixels"], 96);
    EXPECT_EQ(found["amodalBox"], (Json{-12, -8, 36, 24}));
    EXPECT_EQ(found["visibleBox"], (Json{0, 0, 12, 8}));
    EXPECT_NEAR(found["visibleFraction"].get<double>(), 1.0 / 9, 1e-12);
}

std::map<std::string, std::string> bytesIn(const fs::path& folder) {
    std::map<std::string, std::string> bytes;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file())
            bytes[fs::relative(entry.path(), folder).string()] = bytesOf(entry.path());
    return bytes;
}

TEST_F(MasksCommand, OfManyViewsAreThoseOfTheirParts) {
    const std::vector<std::string> views{"--views", "5", "--around", "orbit"};
    const Json whole = run(line(views, "whole"));
    ASSERT_EQ(whole["views"].size(), 5U);
    EXPECT_EQ(whole["sharedFiles"].size(), 6U);
    EXPECT_EQ(jsonOf(scratch_ / "whole/scene_gt_info.json").size(), 5U);
    EXPECT_EQ(jsonOf(scratch_ / "whole/coco.json")["images"].size(), 5U);
    for (const Json& view : whole["views"])
        EXPECT_EQ(view["width"], 12) << "--size is that of every view";
    for (const char* const chunk : {"2/3", "3/3", "1/3"}) {
        std::vector<std::string> part = views;
        part.insert(part.end(), {"--chunk", chunk});
        const Json json = run(line(part, "parts"));
        EXPECT_EQ(json["sharedFiles"].size(), chunk == std::string("1/3") ? 6U : 0U)
            << "when the last view is there";
    }
    EXPECT_EQ(bytesIn(scratch_ / "parts"), bytesIn(scratch_ / "whole"));

    std::vector<std::string> again = views;
    again.emplace_back("--skip-existing");
    const auto skipped = [&](const Json& json) {
        std::vector<int> numbers;
        for (const Json& view : json["views"])
            if (view.contains("skipped")) numbers.push_back(view["view"]);
        return numbers;
    };
    EXPECT_EQ(skipped(run(line(again, "whole"))), (std::vector<int>{0, 1, 2, 3, 4}));
    fs::remove(scratch_ / "whole/mask/000002_000001.png");
    fs::remove(scratch_ / "whole/views/000004.json");
    EXPECT_EQ(skipped(run(line(again, "whole"))), (std::vector<int>{0, 1, 3}));
    EXPECT_EQ(bytesIn(scratch_ / "parts"), bytesIn(scratch_ / "whole"));
    again.insert(again.end(), {"--see-through", "0.9"});
    EXPECT_EQ(skipped(run(line(again, "whole"))), std::vector<int>());
    // A run with --as coco removes the files written with other settings.
    again.insert(again.end(), {"--as", "coco"});
    run(line(again, "whole"));
    EXPECT_FALSE(fs::exists(scratch_ / "whole/mask/000000_000000.png"));
}

TEST_F(MasksCommand, NumbersAreTheIdsOfLayers) {
    // Node 0 has no mesh, so object numbers differ from the objects' positions.
    const fs::path model = sourceDir() / "examples/scenes/coincident.glb";
    const std::vector<std::string> picture{model.string(), "--size", "64x36"};
    std::vector<std::string> line = picture;
    line.insert(line.end(), {"-o", (scratch_ / "out").string(), "--as", "ids"});
    ASSERT_FALSE(run(line).is_null());
    const Json objects = jsonOf(scratch_ / "out/objects.json")["objects"];
    for (const Json& object : objects)
        EXPECT_EQ(object["object"], object["nodeIndex"].get<int>() + 1);

    line = picture;
    line.insert(line.begin(), "render");
    const std::string layers = (scratch_ / "ids.exr").string();
    line.insert(line.end(), {"-o", layers, "--channels", "id", "--quiet"});
    ASSERT_EQ(runPeeler(line).exit_code, 0);
    const auto input = openLayered(layers);
    LayeredImage image;
    input->read(input->info().plan.view.crop, image);
    const FragmentChannel ids = findIds(image, "id.object");
    const std::vector<float> first = grey(scratch_ / "out/ids/000000_layer_000.png");
    std::set<std::uint32_t> seen;
    for (std::size_t p = 0; p < first.size(); ++p) {
        const std::uint32_t id = image.count(p) > 0 ? ids.id(image.offsets[p]) : 0;
        ASSERT_EQ(std::lround(first[p] * 65535), id) << p;
        seen.insert(id);
    }
    EXPECT_GT(*seen.rbegin(), seen.size()) << "some numbers are missing";
}

TEST_F(MasksCommand, InstancesHaveNumbersBehindTheNodes) {
    const Json found = run({(sourceDir() / "examples/scenes/jellyfish.glb").string(), "-o",
                            (scratch_ / "out").string(), "--size", "16x16", "--as", "coco"});
    ASSERT_FALSE(found.is_null());
    const Outcome info =
        runPeeler({"info", (sourceDir() / "examples/scenes/jellyfish.glb").string(), "--json"});
    const std::size_t nodes = Json::parse(info.out)["objectNames"].size();
    std::set<std::size_t> numbers;
    const Json objects = jsonOf(scratch_ / "out/objects.json")["objects"];
    for (const Json& object : objects) {
        const std::size_t number = object["object"];
        EXPECT_TRUE(numbers.insert(number).second) << number << " twice";
        if (object.value("instance", 0) == 0)
            EXPECT_EQ(number, object["nodeIndex"].get<std::size_t>() + 1);
        else
            EXPECT_GT(number, nodes);
    }
    EXPECT_GT(*numbers.rbegin(), nodes);
}

TEST_F(MasksCommand, RgbIsThePictureThatRenderWrites) {
    const std::vector<std::string> views{"--views", "2", "--as", "coco"};
    std::vector<std::string> pictures = views;
    pictures.insert(pictures.end(), {"--rgb", "--background", "#ff8000"});
    const Json found = run(line(pictures));
    ASSERT_FALSE(found.is_null());
    EXPECT_EQ(found["views"][0]["toneMap"], "neutral");
    const Outcome render =
        runPeeler({"render", scene_, "-o", (scratch_ / "r/@.png").string(), "--size", "12x8",
                   "--views", "2", "--background", "#ff8000", "--quiet"});
    ASSERT_EQ(render.exit_code, 0) << render.err;
    const Json images = jsonOf(scratch_ / "out/coco.json")["images"];
    for (int view = 0; view < 2; ++view) {
        const std::string name = images[static_cast<std::size_t>(view)]["file_name"];
        const Outcome same =
            runPeeler({"compare", (scratch_ / "out" / name).string(),
                       (scratch_ / "r" / ("000" + std::to_string(view) + ".png")).string()});
        EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
    }
    // A missing picture makes its view incomplete. Without --rgb, outdated pictures are removed.
    fs::remove(scratch_ / "out/rgb/000001.png");
    pictures.emplace_back("--skip-existing");
    const Json again = run(line(pictures));
    EXPECT_TRUE(again["views"][0].contains("skipped"));
    EXPECT_FALSE(again["views"][1].contains("skipped"));
    EXPECT_TRUE(fs::exists(scratch_ / "out/rgb/000001.png"));
    run(line(views));
    EXPECT_FALSE(fs::exists(scratch_ / "out/rgb/000000.png"));
    for (const char* const option : {"--background=#fff000", "--samples=2", "--environment=none"})
        EXPECT_TRUE(contains(refused({option}).err, "add --rgb")) << option;
}

TEST_F(MasksCommand, OfSeveralScenesAreInAFolderEach) {
    const fs::path other = scratch_ / "other";
    fs::create_directories(other);
    const std::string second = writeScene(other, stackScene(2)).string();
    const std::string output = (scratch_ / "sets/{folder}").string();
    const Json found = run({scene_, second, "-o", output, "--size", "12x8", "--as", "coco"});
    ASSERT_EQ(found["scenes"].size(), 2U);
    const std::string first = scratch_.path().filename().string();
    EXPECT_EQ(found["scenes"][0]["output"], (scratch_ / "sets" / first).string());
    EXPECT_EQ(jsonOf(scratch_ / "sets" / first / "coco.json")["categories"].size(), 3U);
    EXPECT_EQ(jsonOf(scratch_ / "sets/other/coco.json")["categories"].size(), 2U);
    const Outcome clash = runPeeler({"masks", scene_, second, "-o", (scratch_ / "sets").string()});
    EXPECT_EQ(clash.exit_code, 2);
    EXPECT_TRUE(contains(clash.err, "{stem}")) << clash.err;
    const Outcome partly = runPeeler({"masks", (scratch_ / "missing.glb").string(), second, "-o",
                                      (scratch_ / "part/{folder}").string(), "--keep-going",
                                      "--size", "12x8", "--json", "--quiet"});
    EXPECT_EQ(partly.exit_code, 3);
    EXPECT_EQ(Json::parse(partly.out)["failed"][0]["exitCode"], 3);
    EXPECT_TRUE(fs::exists(scratch_ / "part/other/coco.json"));
}

TEST_F(MasksCommand, KeepsToItsMemory) {
    if (kShadowMemory) GTEST_SKIP() << "its memory is not the product's";
    const Json wide = run(line({"--memory", "1G"}, "wide"));
    ASSERT_FALSE(wide.is_null());
    const Outcome outcome = refused({"--size", "4000x4000", "--memory", "100M"});
    EXPECT_EQ(outcome.exit_code, 33) << outcome.err;
    EXPECT_FALSE(fs::exists(scratch_ / "out/views"));
}

}  // namespace
}  // namespace peeler::test
