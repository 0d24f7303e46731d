// SPDX-License-Identifier: Apache-2.0
// Tests peeler render, and verbs that read its files, with lenses.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "cmd/tiny_gltf.h"
#include "support/exr_headers.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// The scene is the triangle (−1, −1, 0), (1, −1, 0), (0, 1, 0), red and half transparent.
class LensPicturesCli : public testing::Test {
  protected:
    void SetUp() override { scene_ = writeScene(scratch_ / "."); }
    Outcome run(std::vector<std::string> arguments, const std::string& out,
                const std::string& verb = "render") const {
        arguments.insert(arguments.begin(), {verb, scene_.string()});
        arguments.insert(arguments.end(), {"-o", scratch_ / out, "--backend", testBackend()});
        return runPeeler(arguments);
    }
    Json rendered(std::vector<std::string> arguments, const std::string& out) const {
        arguments.insert(arguments.end(), {"--json", "--quiet"});
        const Outcome outcome = run(std::move(arguments), out);
        EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
        return outcome.exit_code == 0 ? Json::parse(outcome.out) : Json();
    }
    std::string put(const std::string& name, const std::string& text) const {
        std::ofstream(scratch_ / name, std::ios::binary) << text;
        return scratch_ / name;
    }

    const ScratchDir scratch_;
    const std::vector<std::string> fisheye_{"--lens", "fisheye", "--fov",   "120",      "--size",
                                            "96x96",  "--eye",   "0,0,1.5", "--target", "0,0,0"};
    fs::path scene_;
};

TEST_F(LensPicturesCli, FilesNameTheLensAndOtherVerbsUseIt) {
    for (const std::string kind : {"ldi", "deep", "composite"}) {
        std::vector<std::string> options = fisheye_;
        options.insert(options.end(), {"--as", kind});
        const Json json = rendered(options, kind + ".exr");
        EXPECT_GT(json.at("fragmentsStored"), 500) << kind;
        EXPECT_FALSE(json.contains("withoutRay"));
        const Outcome info = runPeeler({"info", scratch_ / (kind + ".exr")});
        EXPECT_TRUE(contains(info.out, "lens fisheye")) << info.out;
    }
    rendered({"--eye", "0,0,1.5", "--target", "0,0,0", "--fov", "50", "--size", "32x32"},
             "pinhole.exr");
    for (const std::string kind : {"ldi", "deep"}) {
        const std::string file = scratch_ / (kind + ".exr");
        EXPECT_EQ(runPeeler({"verify", file}).exit_code, 0);
        const Outcome view =
            runPeeler({"view", file, "-o", scratch_ / "view.exr", "--eye", "0,0,1.5", "--target",
                       "0,0,0", "--fov", "50", "--size", "32x32"});
        ASSERT_EQ(view.exit_code, 0) << view.err;
        const Outcome compared =
            runPeeler({"compare", scratch_ / "view.exr", scratch_ / "pinhole.exr", "--max-rmse",
                       "0.05"});  // they differ at the edge
        EXPECT_EQ(compared.exit_code, 0) << compared.out << compared.err;
        const Outcome points =
            runPeeler({"extract", file, "--points", scratch_ / "points.ply", "--json"});
        ASSERT_EQ(points.exit_code, 0) << points.err;
    }
}

TEST_F(LensPicturesCli, PixelsBeyondTheLensAreToldAndEmpty) {
    // k1 = −1: r (1 − r²) has its maximum 0.385 at r = 0.577.
    const std::vector<std::string> camera = {
        "--lens", "simple-radial", "--distortion", "-1",   "--intrinsics", "100,100,49.5,49.5",
        "--size", "100x100",       "--eye",        "0,0,3"};
    EXPECT_NEAR(rendered(camera, "r.exr").at("withoutRay").get<double>(),
                10'000 - 3.14159 * 38.49 * 38.49, 60);
    const Outcome outcome = run(camera, "r.png");
    EXPECT_TRUE(contains(outcome.err, "the lens sees nothing there")) << outcome.err;
}

TEST_F(LensPicturesCli, CamerasOfAFileHaveTheirLenses) {
    const std::string place =
        R"("eye": [0, 0, 1.5], "target": [0, 0, 0], "size": [96, 96], "fx": 30, "fy": 30,)"
        R"( "cx": 47.5, "cy": 47.5})";
    const auto cameras = put("c.jsonl", R"({"lens": "fisheye", )" + place + "\n{" + place + "\n");
    rendered({"--cameras", cameras}, "v@@@@.exr");
    rendered({"--lens", "fisheye", "--intrinsics", "30,30,47.5,47.5", "--size", "96x96", "--eye",
              "0,0,1.5", "--target", "0,0,0"},
             "one.exr");
    rendered({"--intrinsics", "30,30,47.5,47.5", "--size", "96x96", "--eye", "0,0,1.5", "--target",
              "0,0,0"},
             "pinhole.exr");
    for (const auto& [file, same] :
         {std::pair("v0000.exr", "one.exr"), std::pair("v0001.exr", "pinhole.exr")}) {
        const Outcome compared = runPeeler({"compare", scratch_ / file, scratch_ / same});
        EXPECT_EQ(compared.exit_code, 0) << compared.out << compared.err;
    }
    EXPECT_EQ(runPeeler({"compare", scratch_ / "one.exr", scratch_ / "pinhole.exr"}).exit_code, 1);
}

TEST_F(LensPicturesCli, MasksHaveTheirPictures) {
    std::vector<std::string> options = fisheye_;
    options.insert(options.end(), {"--as", "coco", "--rgb"});
    const Outcome masks = run(options, "masks", "masks");
    ASSERT_EQ(masks.exit_code, 0) << masks.err;
    EXPECT_GT(fs::file_size(scratch_ / "masks/rgb/000000.png"), 500U);
}

TEST_F(LensPicturesCli, LinesAndPointsAreMissed) {
    Json scene = triangleScene();
    scene["meshes"][0]["primitives"].push_back(scene["meshes"][0]["primitives"][0]);
    scene["meshes"][0]["primitives"][1]["mode"] = 0;
    std::ofstream(scene_) << scene;
    const Outcome lenient = run(fisheye_, "a.exr");
    EXPECT_EQ(lenient.exit_code, 0) << lenient.err;
    EXPECT_TRUE(contains(lenient.err, "do not hit lines and points")) << lenient.err;
    std::vector<std::string> options = fisheye_;
    options.emplace_back("--strict");
    EXPECT_EQ(run(options, "b.exr").exit_code, 3);
    EXPECT_FALSE(fs::exists(scratch_ / "b.exr"));
}

TEST_F(LensPicturesCli, WhatOnlyRasterisesIsRefused) {
    for (const auto& [option, value, words] :
         {std::tuple("--method", "weighted-average", "cannot look through a lens"),
          std::tuple("--clip-plane", "0,0,1,0", "cannot be clipped"),
          std::tuple("--ortho-height", "2", "orthographic camera has no lens")}) {
        std::vector<std::string> options = fisheye_;
        options.insert(options.end(), {option, value});
        const Outcome refused = run(options, "refused.png");
        EXPECT_EQ(refused.exit_code, 2) << refused.err;
        EXPECT_TRUE(contains(refused.err, words)) << refused.err;
        EXPECT_FALSE(fs::exists(scratch_ / "refused.png"));
    }
}

}  // namespace
}  // namespace peeler::test
