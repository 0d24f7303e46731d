// SPDX-License-Identifier: Apache-2.0
// Tests files of hits through lenses: what they say about the lens, and what other verbs make of
// them.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "formats/exr/exr_files.h"
#include "formats/image/flat_image.h"
#include "support/closed_meshes.h"
#include "support/npz_file.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Reads points, and prints the largest distance between two files' and their distance from the
/// unit sphere.
constexpr const char* kComparePoints = R"(
import json, sys, numpy as np
types = {'float': '<f4', 'double': '<f8', 'uchar': 'u1', 'uint': '<u4', 'int': '<i4'}
def points(name):
    file, fields, count = open(name, 'rb'), [], 0
    while (words := file.readline().decode().split())[0] != 'end_header':
        if words[0] == 'element': count = int(words[2])
        if words[0] == 'property': fields.append((words[2], types[words[1]]))
    return np.frombuffer(file.read(), dtype=fields, count=count)
a, b = points(sys.argv[1]), points(sys.argv[2])
assert len(a) == len(b) > 1000, (len(a), len(b))
at = lambda p: np.stack([p['x'], p['y'], p['z']], 1).astype(float)
eye = np.array([0.25, 0.125, -0.5])
radius = np.linalg.norm(at(a), axis=1)
print(json.dumps({'apart': np.abs(at(a) - at(b)).max(), 'least': radius.min(),
                  'most': radius.max(),
                  'z': np.abs(a['camera_z'] - (eye - at(a))[:, 2]).max(),
                  't': np.abs(a['t'] - np.linalg.norm(at(a) - eye, axis=1)).max()}))
)";

/// The inside of a unit sphere, seen across 200 degrees.
class LensFiles : public testing::Test {
  protected:
    void SetUp() override {
        const Primitive sphere = icosphere(5);
        std::ofstream ply(scene());
        ply << "ply\nformat ascii 1.0\nelement vertex " << sphere.positions.size()
            << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
            << sphere.indices.size() / 3
            << "\nproperty list uchar int vertex_indices\nend_header\n";
        ply.precision(9);
        for (const glm::vec3& v : sphere.positions)
            ply << v.x << ' ' << v.y << ' ' << v.z << '\n';
        for (std::size_t i = 0; i < sphere.indices.size(); i += 3)
            ply << "3 " << sphere.indices[i] << ' ' << sphere.indices[i + 1] << ' '
                << sphere.indices[i + 2] << '\n';
    }
    std::string scene() const { return scratch_ / "sphere.ply"; }
    std::string path(const std::string& name) const { return scratch_ / name; }
    void run(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin() + 1, "--quiet");
        const Outcome outcome = runPeeler(arguments);
        ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    }
    void refused(const std::vector<std::string>& arguments, const std::string& words) const {
        const Outcome outcome = runPeeler(arguments);
        EXPECT_NE(outcome.exit_code, 0);
        EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    }
    void rays(const std::string& name, std::vector<std::string> more = kFisheye) const {
        more.insert(more.begin(), {"rays", scene(), "-o", path(name)});
        run(more);
    }
    static const std::vector<std::string> kFisheye;

    const ScratchDir scratch_;
};
const std::vector<std::string> LensFiles::kFisheye = {
    "--lens", "opencv-fisheye", "--distortion", "0.02,-0.003,0.001,0", "--fov",    "200",
    "--size", "64x64",          "--eye",        "0.25,0.125,-0.5",     "--target", "0.25,0.125,-1"};

TEST_F(LensFiles, PointsOfADeepFileAreThoseOfTheRays) {
    PEELER_REQUIRE_PYTHON("numpy");
    rays("hits.ply");
    rays("hits.exr");
    run({"extract", path("hits.exr"), "--points", path("deep.ply")});
    const CommandResult compared = runPython(kComparePoints, {path("hits.ply"), path("deep.ply")});
    ASSERT_EQ(compared.exit_code, 0) << compared.err;
    const Json found = Json::parse(compared.out);
    EXPECT_LT(found["apart"], 5e-7);
    // The mesh is within 5e-4 of the sphere.
    EXPECT_GT(found["least"], 1 - 5e-4);
    EXPECT_LT(found["most"], 1 + 1e-6);
    EXPECT_LT(found["t"], 5e-7);
    EXPECT_LT(found["z"], 5e-7);
}

TEST_F(LensFiles, ArraysNameBothDepthsAndTheLens) {
    rays("hits.npz");
    rays("hits.exr");
    run({"extract", path("hits.exr"), "--npz", path("deep.npz")});
    auto hits = readNpz(path("hits.npz")), deep = readNpz(path("deep.npz"));
    for (const char* name : {"t_hit", "z_hit", "ray_splits", "primitive_ids", "bundle_origin",
                             "bundle_direction", "bundle_perspective", "bundle_lens"})
        EXPECT_EQ(hits[name].numbers, deep[name].numbers) << name;
    EXPECT_EQ(deep["z"].numbers, deep["t_hit"].numbers);  // Z is the distance
    const auto t = hits["t_hit"].as<float>(), z = hits["z_hit"].as<float>();
    ASSERT_EQ(z.size(), t.size());
    int behind = 0;
    for (std::size_t i = 0; i < z.size(); ++i) {
        ASSERT_LE(std::abs(z[i]), t[i]);
        behind += z[i] < 0 ? 1 : 0;
    }
    EXPECT_GT(behind, 0);
    EXPECT_EQ(hits["bundle_perspective"].as<std::uint8_t>(), std::vector<std::uint8_t>{2});
    EXPECT_TRUE(std::isnan(hits["bundle_size"].as<double>()[0]));
    EXPECT_EQ(hits["bundle_origin"].as<double>(), (std::vector<double>{0.25, 0.125, -0.5}));
    const Json lens = Json::parse(hits["bundle_lens"].numbers);
    ASSERT_EQ(lens.size(), 1U);
    EXPECT_EQ(lens[0]["model"], "opencv-fisheye");
    EXPECT_EQ(lens[0]["coefficients"], Json::parse("[0.02,-0.003,0.001,0]"));
    EXPECT_EQ(lens[0]["intrinsics"][2], 31.5);

    rays("dense.npz", {"--lens", "equirectangular", "--size", "16x8", "--eye", "0.1,0,0", "--dense",
                       "1", "--columns", "z_hit"});
    auto dense = readNpz(path("dense.npz"));
    EXPECT_EQ(Json::parse(dense["bundle_lens"].numbers)[0]["intrinsics"], Json());
    EXPECT_EQ(dense["z_hit"].shape, "(8, 16, 1)");
    rays("map.npz",
         {"--lens", "equirectangular", "--size", "16x8", "--eye", "0.1,0,0", "--map", "first"});
    EXPECT_TRUE(readNpz(path("map.npz")).contains("bundle_lens"));
}

TEST_F(LensFiles, APinholeHasCameraZOnlyIfAsked) {
    const std::vector<std::string> camera = {"--eye", "0,0,3", "--fov", "40", "--size", "32x32"};
    rays("all.npz", camera);
    auto all = readNpz(path("all.npz"));
    EXPECT_FALSE(all.contains("z_hit"));
    EXPECT_FALSE(all.contains("bundle_lens"));
    EXPECT_EQ(all["bundle_perspective"].as<std::uint8_t>(), std::vector<std::uint8_t>{1});
    std::vector<std::string> chosen = camera;
    chosen.insert(chosen.end(), {"--columns", "t_hit,z_hit"});
    rays("z.npz", chosen);
    const auto z = readNpz(path("z.npz"))["z_hit"].as<float>();
    rays("hits.exr", camera);
    run({"extract", path("hits.exr"), "--npz", path("deep.npz")});
    EXPECT_EQ(readNpz(path("deep.npz"))["z"].as<float>(), z);
    EXPECT_FALSE(readExrInfo(path("hits.exr")).parts[0].channel("cameraZ"));
}

TEST_F(LensFiles, InfoSaysTheLens) {
    rays("hits.exr");
    const Outcome text = runPeeler({"info", path("hits.exr")});
    EXPECT_NE(text.out.find("camera: lens opencv-fisheye 0.02 -0.003 0.001 0, fx "),
              std::string::npos)
        << text.out;
    const Json camera = Json::parse(runPeeler({"info", path("hits.exr"), "--json"}).out)["camera"];
    EXPECT_EQ(camera["projection"], "lens");
    EXPECT_EQ(camera["lens"]["model"], "opencv-fisheye");
    EXPECT_EQ(camera["lens"]["intrinsics"].size(), 4U);
    const Outcome verified = runPeeler({"verify", path("hits.exr")});
    EXPECT_EQ(verified.exit_code, 0) << verified.err << verified.out;
}

TEST_F(LensFiles, AViewIsThatOfAPinhole) {
    rays("hits.exr");
    run({"view", path("hits.exr"), "-o", path("seen.exr"), "--fov", "60", "--size", "40x30"});
    const View view = readExrInfo(path("seen.exr")).plan.view;
    EXPECT_FALSE(view.rays);
    EXPECT_NEAR(view.projection.half_height, std::tan(glm::radians(30.0)), 1e-12);
    EXPECT_NEAR(view.projection.half_width * 3, view.projection.half_height * 4, 1e-12);
    EXPECT_EQ(glm::dvec3(view.camera_to_world[3]), glm::dvec3(0.25, 0.125, -0.5));
    refused({"view", path("hits.exr"), "-o", path("seen.html")}, "has a lens");
}

TEST_F(LensFiles, LayersKeepTheLens) {
    rays("hits.exr");
    run({"convert", path("hits.exr"), "-o", path("layers.exr"), "--as", "ldi"});
    run({"convert", path("hits.exr"), "-o", path("layers.safetensors")});
    run({"extract", path("hits.exr"), "--points", path("deep.ply")});
    for (const char* name : {"layers.exr", "layers.safetensors"}) {
        run({"extract", path(name), "--points", path("layers.ply")});
        EXPECT_TRUE(bytesOf(path("layers.ply")) == bytesOf(path("deep.ply"))) << name;
    }
    rays("other.exr", {"--eye", "0,0,3", "--fov", "40", "--size", "64x64"});
    refused({"merge", path("hits.exr"), path("other.exr"), "-o", path("no.exr")},
            "the lens opencv-fisheye");
}

TEST_F(LensFiles, AMovingCameraAndAListHaveNoCamera) {
    std::ofstream(path("poses.jsonl"))
        << R"({"size":[32,32],"fov":90,"eye":[0,0,0],"target":[0,0,-1]})" << '\n'
        << R"({"size":[32,32],"fov":90,"eye":[0.1,0,0],"target":[0.1,0,-1]})" << '\n';
    const std::vector<std::string> shutter = {"--shutter", path("poses.jsonl")};
    rays("moved.exr", shutter);
    rays("moved.npz", shutter);
    const ExrInfo info = readExrInfo(path("moved.exr"));
    EXPECT_EQ(info.attributes().at("peeler:projection"), "shutter");
    EXPECT_FALSE(info.attributes().contains("peeler:cameraJson"));
    auto arrays = readNpz(path("moved.npz"));
    EXPECT_EQ(arrays["bundle_perspective"].as<std::uint8_t>(), std::vector<std::uint8_t>{3});
    EXPECT_TRUE(std::isnan(arrays["bundle_origin"].as<double>()[0]));
    EXPECT_FALSE(arrays.contains("bundle_lens"));
    EXPECT_FALSE(arrays.contains("z_hit"));
    refused({"rays", scene(), "--shutter", path("poses.jsonl"), "--columns", "z_hit", "-o",
             path("no.npz")},
            "no camera Z");
    refused({"extract", path("moved.exr"), "--points", path("no.ply")}, "camera");
    EXPECT_FALSE(fs::exists(path("no.npz")));
}

}  // namespace
}  // namespace peeler::test
