// SPDX-License-Identifier: Apache-2.0
// Tests samples in tar shards: members, --skip-existing, --chunk and errors.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using Strings = std::vector<std::string>;
using Members = std::map<std::string, std::string>;

/// A Python program that unpacks tar files and prints the names of their members in order.
constexpr const char* kUnpack = R"(
import json, sys, tarfile
names = []
for path in sys.argv[2:]:
    with tarfile.open(path) as tar:
        tar.extractall(sys.argv[1])
        names.append(tar.getnames())
print(json.dumps(names))
)";

class ShardsOfPictures : public testing::Test {
  protected:
    ShardsOfPictures() {
        for (const char* name : {"a.x", "b", "below/b"}) {
            const fs::path folder = (scenes_ / name).parent_path();
            fs::create_directories(folder);
            fs::rename(writeScene(folder, stackScene(2)), (scenes_ / name).string() + ".gltf");
        }
    }
    Outcome render(const fs::path& scene, const std::string& output, Strings more) const {
        Strings line{"render", scene.string(), "-o", (scratch_ / output).string(),
                     "--json", "--quiet"};
        if (std::ranges::find(more, "--size") == more.end())
            line.insert(line.end(), {"--size", "24x16"});
        line.insert(line.end(), more.begin(), more.end());
        return runPeeler(line);
    }
    Json rendered(const fs::path& scene, const std::string& output, const Strings& more) const {
        const Outcome result = render(scene, output, more);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return result.exit_code == 0 ? Json::parse(result.out) : Json();
    }
    /// Returns the contents of the shards' members by name; `order` receives the names, shard by
    /// shard.
    Members unpacked(const Strings& shards, Json* order = nullptr) const {
        const fs::path folder = scratch_ / "unpacked";
        fs::remove_all(folder);
        fs::create_directory(folder);
        Strings arguments{folder.string()};
        for (const std::string& shard : shards)
            arguments.push_back((scratch_ / shard).string());
        const auto read = runPython(kUnpack, arguments);
        EXPECT_EQ(read.exit_code, 0) << read.err;
        if (order) *order = Json::parse(read.out);
        return filesIn(folder);
    }
    static Members filesIn(const fs::path& folder) {
        Members members;
        for (const auto& entry : fs::directory_iterator(folder))
            members[entry.path().filename().string()] = bytesOf(entry.path());
        return members;
    }

    ScratchDir scratch_;
    fs::path scenes_ = scratch_ / "scenes";
    fs::path scene_ = scenes_ / "a.x.gltf";
};

TEST_F(ShardsOfPictures, HoldTheFilesThatViewsWouldBe) {
    const Json views = rendered(scene_, "out/s-%02d.tar",
                                {"--views", "5", "--shard-member", "png", "--shard-count", "2"})
                           .at("views");
    ASSERT_EQ(views.size(), 5U);
    EXPECT_EQ(views[3].at("sample"), "a_x_0003");
    EXPECT_EQ(views[3].at("output"), (scratch_ / "out/s-01.tar").string());
    const ScratchDir lone;
    ASSERT_EQ(runPeeler({"render", scene_.string(), "-o", (lone / "a_x_@@@@.png").string(),
                         "--size", "24x16", "--views", "5"})
                  .exit_code,
              0);
    Json order;
    Members members = unpacked({"out/s-00.tar", "out/s-01.tar", "out/s-02.tar"}, &order);
    EXPECT_EQ(order[1], Json({"a_x_0002.png", "a_x_0002.json", "a_x_0003.png", "a_x_0003.json"}));
    EXPECT_EQ(order[2].size(), 2U);
    for (const auto& [name, bytes] : filesIn(lone.path())) {
        EXPECT_EQ(members.at(name), bytes) << name;
        const Json about = Json::parse(members.at(name.substr(0, 8) + ".json"));
        EXPECT_EQ(about.at("scene"), "a.x.gltf");
        EXPECT_EQ(about.at("view"), std::stoi(name.substr(4, 4)));
        EXPECT_EQ(about.at("camera").at("cameraToWorld").size(), 4U);
        EXPECT_EQ(bytes.find(about.at("outputHash").get<std::string>()) != std::string::npos, true);
    }
    EXPECT_EQ(views[3].at("bytes"), members.at("a_x_0003.png").size());
    // Nothing else may be left: no scratch folder, no hidden file.
    EXPECT_EQ(filesIn(scratch_ / "out").size(), 3U);
}

TEST_F(ShardsOfPictures, HoldFilesBeside) {
    const Json views = rendered(scene_, "lari.tar", {"--preset", "lari", "--views", "2"});
    const Members members = unpacked({"lari.tar"});
    EXPECT_EQ(members.size(), 8U);
    for (const char* name : {"a_x_0001.png", "a_x_0001.ldi.npz", "a_x_0001.npy"})
        EXPECT_TRUE(members.contains(name)) << name;
    ASSERT_EQ(render(scene_, "alone/@@@@.png", {"--preset", "lari", "--views", "2"}).exit_code, 0);
    EXPECT_EQ(members.at("a_x_0001.ldi.npz"), bytesOf(scratch_ / "alone/0001_ldi.npz"));
    EXPECT_EQ(members.at("a_x_0001.npy"), bytesOf(scratch_ / "alone/0001.npy"));
    EXPECT_TRUE(Json::parse(members.at("a_x_0001.json")).contains("normalized"));
    rendered(scene_, "dense.tar", {"--dense", "3"});
    EXPECT_TRUE(unpacked({"dense.tar"}).contains("a_x.npz"));
    rendered(scene_, "layers.tar", {});
    EXPECT_TRUE(unpacked({"layers.tar"}).contains("a_x.exr"));
}

TEST_F(ShardsOfPictures, SamplesHaveTheirCalibration) {
    // The focal length of 24 x 16 pixels at 90 degrees is 8 pixels. The first pixel's centre is (0,
    // 0), so the middle is (11.5, 7.5). The scene's centre is 3 in front of every camera.
    const Json views = rendered(scene_, "s.tar",
                                {"--views", "3", "--around", "random", "--distance", "3", "--fov",
                                 "90", "--normalize", "unit-cube"})
                           .at("views");
    const Members members = unpacked({"s.tar"});
    for (std::size_t i = 0; i < 3; ++i) {
        const Json about = Json::parse(members.at("a_x_000" + std::to_string(i) + ".json"));
        for (const Json* const json : {&about, &views[i]}) {
            EXPECT_EQ(json->at("size"), Json({24, 16}));
            const Json k{{8.0, 0.0, 11.5}, {0.0, 8.0, 7.5}, {0.0, 0.0, 1.0}};
            for (std::size_t row = 0; row < 3; ++row)
                for (std::size_t column = 0; column < 3; ++column)
                    EXPECT_NEAR(json->at("K")[row][column].get<double>(),
                                k[row][column].get<double>(), 1e-12);
            const double centre[] = {0, 0, 3, 1};
            for (std::size_t row = 0; row < 4; ++row)
                EXPECT_NEAR(json->at("world_to_camera")[row][3].get<double>(), centre[row], 1e-12);
            EXPECT_EQ(json->at("convention"), "opencv");
            EXPECT_EQ(json->at("pixel_center"), 0);
        }
    }
}

TEST_F(ShardsOfPictures, AreSharedByScenes) {
    const Strings asked{"--shard-member", "{folder}_{stem}.npz", "--shard-count", "2"};
    const Json scenes = rendered(scenes_, "s-##.tar", asked).at("scenes");
    ASSERT_EQ(scenes.size(), 3U);
    Json order;
    unpacked({"s-00.tar", "s-01.tar"}, &order);
    EXPECT_EQ(order, Json({{"scenes_a_x.npz", "scenes_a_x.json", "scenes_b.npz", "scenes_b.json"},
                           {"below_b.npz", "below_b.json"}}));
    // Each chunk has its own part of the scenes, and its own shards.
    Strings chunk = asked;
    chunk.insert(chunk.end(), {"--chunk", "2/2"});
    EXPECT_EQ(rendered(scenes_, "c{chunk}-##.tar", chunk).at("scenes").size(), 2U);
    unpacked({"c2-00.tar"}, &order);
    EXPECT_EQ(order[0][0], "scenes_b.npz");
    EXPECT_EQ(render(scenes_, "c-##.tar", chunk).exit_code, 2);
    const Outcome same = render(scenes_, "t-##.tar", {});
    EXPECT_EQ(same.exit_code, 2);
    EXPECT_TRUE(contains(same.err, "--shard-member")) << same.err;
    // If a scene fails, its samples are missing; existing samples are kept.
    const Outcome rest =
        runPeeler({"render", (scenes_ / "a.x.gltf").string(), (scenes_ / "none.gltf").string(),
                   (scenes_ / "below/b.gltf").string(), "-o", (scratch_ / "s-##.tar").string(),
                   "--size", "24x16", "--json", "--shard-member", "{folder}_{stem}.npz",
                   "--shard-count", "2", "--skip-existing", "--keep-going"});
    EXPECT_EQ(rest.exit_code, 3) << rest.err;
    EXPECT_EQ(Json::parse(rest.out).at("scenes")[1].at("skipped"), true) << rest.out;
    unpacked({"s-00.tar"}, &order);
    EXPECT_EQ(order[0][2], "below_b.npz");
    EXPECT_TRUE(contains(rest.err, "s-01.tar and any that follow")) << rest.err;
}

TEST_F(ShardsOfPictures, KeepWhatIsThere) {
    const Strings asked{"--views",       "4", "--shard-member", "png",
                        "--shard-count", "2", "--skip-existing"};
    rendered(scene_, "s-#.tar", asked);
    const std::string first = bytesOf(scratch_ / "s-0000.tar");
    const std::string second = bytesOf(scratch_ / "s-0001.tar");
    const auto written = fs::last_write_time(scratch_ / "s-0000.tar");
    fs::remove(scratch_ / "s-0001.tar");
    const Json views = rendered(scene_, "s-#.tar", asked).at("views");
    EXPECT_EQ(views[0].at("skipped"), true);
    EXPECT_GT(views[0].at("bytes"), 0);
    EXPECT_FALSE(views[2].contains("skipped"));
    EXPECT_EQ(fs::last_write_time(scratch_ / "s-0000.tar"), written);
    EXPECT_EQ(bytesOf(scratch_ / "s-0001.tar"), second);
    // Other settings give other pictures, so the samples are rendered again.
    Strings other = asked;
    other.insert(other.end(), {"--background", "1,0,0"});
    EXPECT_FALSE(rendered(scene_, "s-#.tar", other).at("views")[0].contains("skipped"));
    EXPECT_NE(bytesOf(scratch_ / "s-0000.tar"), first);

    const Json plan = rendered(scene_, "s-#.tar",
                               {"--views", "4", "--shard-member", "png", "--skip-existing",
                                "--background", "1,0,0", "--dry-run", "--frames", "0"});
    EXPECT_EQ(plan.at("pictures")[0].at("sample"), "a_x_0000_0000");
    EXPECT_EQ(plan.at("pictures")[0].at("output"), (scratch_ / "s-#.tar").string());
    EXPECT_EQ(plan.at("pictures")[0].at("action"), "render");
    other.push_back("--dry-run");
    EXPECT_EQ(rendered(scene_, "s-#.tar", other).at("pictures")[3].at("action"), "skip");
}

TEST_F(ShardsOfPictures, AreRefused) {
    const struct {
        std::string output;
        Strings more;
        std::string said;
    } cases[] = {
        {"s.tar", {"--shard-member", "foo"}, "foo"},
        {"s.tar", {"--shard-member", "a/{stem}.png"}, "--shard-member"},
        {"s.tar", {"--shard-member", "png", "--as", "deep"}, "deep"},
        {"s.tar", {"--shard-count", "0"}, "--shard-count"},
        {"s.tar", {"--shard-size", "0"}, "--shard-size"},
        {"{stem}.tar", {}, "all scenes of a run"},
        {"s-@@.tar", {"--views", "2"}, "@@"},
        {"s.tar", {"--layout", "per-file"}, "--layout"},
        {"s.tar", {"--views", "3", "--chunk", "1/2"}, "{chunk}"},
        {"s.tar", {"--views", "3", "--shard-count", "1"}, "no place for the number"},
        {"s.png", {"--shard-count", "3"}, "there are no shards"},
        {"s.png", {"--shard-member", "png"}, "there are no shards"},
    };
    for (const auto& row : cases) {
        const Outcome result = render(scene_, row.output, row.more);
        EXPECT_EQ(result.exit_code, 2) << row.said;
        EXPECT_TRUE(contains(result.err, row.said)) << result.err;
    }
    EXPECT_EQ(runPeeler({"render", scene_.string(), "-o", "-.tar"}).exit_code, 2);
    fs::remove(scratch_ / "s.tar");
    rendered(scene_, "s.tar", {});
    EXPECT_EQ(render(scene_, "s.tar", {"--no-clobber"}).exit_code, 4);
    EXPECT_EQ(render(scene_, "missing/s.tar", {"--no-mkdir"}).exit_code, 4);
    EXPECT_EQ(scratch_.files(), (Strings{"s.tar", "scenes"}));
}

}  // namespace
}  // namespace peeler::test
