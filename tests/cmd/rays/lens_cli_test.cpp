// SPDX-License-Identifier: Apache-2.0
// Tests peeler rays with lenses, moving cameras and lists of rays.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cmd/tiny_gltf.h"
#include "support/npz_file.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// The scene is the triangle (−1, −1, 0), (1, −1, 0), (0, 1, 0).
class LensRaysCli : public testing::Test {
  protected:
    void SetUp() override { scene_ = writeScene(scratch_ / "."); }
    Outcome rays(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), {"rays", scene_.string()});
        return runPeeler(arguments);
    }
    Json traced(std::vector<std::string> arguments, const std::string& out) const {
        arguments.insert(arguments.end(), {"-o", scratch_ / out, "--json", "--quiet"});
        const Outcome run = rays(arguments);
        EXPECT_EQ(run.exit_code, 0) << run.err;
        return run.exit_code == 0 ? Json::parse(run.out) : Json();
    }
    void expectRefused(std::vector<std::string> arguments, const std::string& words) const {
        arguments.insert(arguments.end(), {"-o", scratch_ / "refused.npz"});
        const Outcome run = rays(arguments);
        EXPECT_EQ(run.exit_code, 2) << run.err;
        EXPECT_NE(run.err.find(words), std::string::npos) << run.err;
        EXPECT_FALSE(fs::exists(scratch_ / "refused.npz"));
    }
    std::string put(const std::string& name, const std::string& text) const {
        std::ofstream(scratch_ / name, std::ios::binary) << text;
        return scratch_ / name;
    }

    const ScratchDir scratch_;
    fs::path scene_;
};

TEST_F(LensRaysCli, AFisheyeSeesTheTriangleAtItsSolidAngle) {
    const Json json = traced({"--lens", "fisheye", "--fov", "180", "--size", "400x400", "--eye",
                              "0,0,1", "--target", "0,0,0"},
                             "f.npz");
    EXPECT_EQ(json.at("rays"), 160'000);
    EXPECT_EQ(json.at("engine"), "cpu");
    // In this lens, a picture of radius 200 shows 90 degrees; pixels beyond it show up to 180.
    EXPECT_FALSE(json.contains("withoutRay"));
    const auto arrays = readNpz(scratch_ / "f.npz");
    double solid_angle = 0;
    const auto splits = arrays.at("ray_splits").as<std::int64_t>();
    const auto t = arrays.at("t_hit").as<float>();
    const double radians = M_PI / 400;
    for (std::size_t ray = 0; ray < 160'000; ++ray) {
        if (splits[ray + 1] == splits[ray]) continue;
        const double angle = radians * std::hypot(static_cast<double>(ray % 400) - 199.5,
                                                  static_cast<double>(ray / 400) - 199.5);
        solid_angle += radians * radians * std::sin(angle) / angle;
        EXPECT_NEAR(t[static_cast<std::size_t>(splits[ray])], 1 / std::cos(angle), 1e-4);
    }
    // Van Oosterom & Strackee 1983: the corners are at (−1, −1, −1), (1, −1, −1), (0, 1, −1).
    const double numerator = 4;
    const double denominator = std::sqrt(3.0) * std::sqrt(3.0) * std::sqrt(2.0) +
                               1 * std::sqrt(2.0) + 0 * std::sqrt(3.0) + 0 * std::sqrt(3.0);
    EXPECT_NEAR(solid_angle, 2 * std::atan2(numerator, denominator), 2e-3);
}

constexpr const char* kWitnessPose = "--pose=0.36,-0.8,0.48,0.1,0.48,0.6,0.64,-0.2,-0.8,0,0.6,2.5";

// Projects the hits by OpenCV, and compares with the pixels of their rays. The arguments: .npz,
// .ply, model, coefficients, focal lengths and centre, width.
constexpr const char* kProjectByOpencv = R"(
import sys, numpy as np, cv2
npz, ply, model, coefficients, intrinsics, width = sys.argv[1:]
splits = np.load(npz)['ray_splits']
ray = np.repeat(np.arange(len(splits) - 1), np.diff(splits))
data = open(ply, 'rb').read()
head, body = data[:data.index(b'end_header\n')].decode(), data[data.index(b'end_header\n') + 11:]
size = {'double': 8, 'float': 4, 'uint': 4, 'int': 4, 'float32': 4, 'float64': 8, 'uint32': 4, 'int32': 4}
step = sum(size[l.split()[1]] for l in head.splitlines() if l.startswith('property'))
points = np.ndarray((len(ray), 3), '<f8', body, strides=(step, 8)).copy()
fx, fy, cx, cy = map(float, intrinsics.split(','))
K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
d = np.array([float(c) for c in coefficients.split(',')])
R = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0], [0.48, 0.64, 0.6]]).T
t = np.array([0.1, -0.2, 2.5])
r = cv2.Rodrigues(R)[0]
if model == 'opencv':
    at = cv2.projectPoints(points.reshape(-1, 1, 3), r, t, K, d)[0].reshape(-1, 2)
else:
    at = cv2.fisheye.projectPoints(points.reshape(-1, 1, 3), r, t.reshape(3, 1), K, d)[0].reshape(-1, 2)
pixel = np.stack([ray % int(width), ray // int(width)], 1)
print(len(points), np.abs(at - pixel).max())
)";

TEST_F(LensRaysCli, OpencvProjectsHitsToTheirPixels) {
    PEELER_REQUIRE_PYTHON("cv2");
    const std::string intrinsics = "310,305,163.2,117.9";
    for (const auto& [model, coefficients] :
         {std::pair("opencv", "-0.25,0.06,0.001,-0.002,0.01"),
          std::pair("opencv", "0.2,-0.1,1e-3,2e-3,0.05,0.3,0.02,0.01,1e-3,2e-3,-3e-3,1e-3"),
          std::pair("opencv-fisheye", "0.03,-0.01,0.004,-0.0006")}) {
        const std::vector<std::string> camera = {
            "--lens",     model,          "--distortion=" + std::string(coefficients),
            kWitnessPose, "--intrinsics", intrinsics,
            "--size",     "320x240"};
        traced(camera, "h.npz");
        std::vector<std::string> points = camera;
        points.emplace_back("--double");
        const Json json = traced(points, "h.ply");
        EXPECT_GT(json.at("hits"), 3000);
        const Outcome read = runPython(kProjectByOpencv, {scratch_ / "h.npz", scratch_ / "h.ply",
                                                          model, coefficients, intrinsics, "320"});
        ASSERT_EQ(read.exit_code, 0) << read.err;
        std::istringstream numbers(read.out);
        std::size_t hits = 0;
        double farthest = 1;
        numbers >> hits >> farthest;
        EXPECT_EQ(hits, json.at("hits").get<std::size_t>());
        EXPECT_LT(farthest, 1e-4) << model << " " << coefficients;
    }
}

// Writes a COLMAP model that observes each hit at the centre of its ray's pixel, undistorts it by
// COLMAP, and compares with the hits' pinhole projections. The arguments: .npz, .ply, model,
// parameters, an empty folder.
constexpr const char* kUndistortByColmap = R"(
import os, subprocess, sys, numpy as np
npz, ply, model, parameters, folder = sys.argv[1:]
width, height = 320, 240
splits = np.load(npz)['ray_splits']
ray = np.repeat(np.arange(len(splits) - 1), np.diff(splits))
data = open(ply, 'rb').read()
start = data.index(b'end_header\n') + 11
points = np.ndarray((len(ray), 3), '<f8', data, start, (len(data[start:]) // len(ray), 8))
R = np.array([[0.36, -0.8, 0.48], [0.48, 0.6, 0.64], [-0.8, 0, 0.6]])
t = np.array([0.1, -0.2, 2.5])
w = np.sqrt(1 + np.trace(R)) / 2
q = [w, *np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4 * w)]
for name in ('in', 'images', 'out', 'text'):
    os.makedirs(os.path.join(folder, name))
def put(name, text):
    open(os.path.join(folder, name), 'w').write(text)
put('images/a.pgm', f'P2 {width} {height} 255 ' + '0 ' * (width * height))
put('in/cameras.txt', f'1 {model} {width} {height} {parameters}\n')
observed = ' '.join(f'{r % width + 0.5} {r // width + 0.5} {i + 1}' for i, r in enumerate(ray))
put('in/images.txt', '1 ' + ' '.join(f'{v:.17g}' for v in (*q, *t)) + f' 1 a.pgm\n{observed}\n')
put('in/points3D.txt', ''.join(f'{i + 1} {x:.17g} {y:.17g} {z:.17g} 0 0 0 0 1 {i}\n' for i, (x, y, z) in enumerate(points)))
def colmap(*arguments):
    subprocess.run(['colmap', *arguments], cwd=folder, check=True, stdout=subprocess.DEVNULL)
colmap('image_undistorter', '--image_path', 'images', '--input_path', 'in', '--output_path', 'out')
colmap('model_converter', '--input_path', 'out/sparse', '--output_path', 'text', '--output_type', 'TXT')
lines = lambda name: [l for l in open(os.path.join(folder, 'text', name)) if l[0] != '#']
camera = lines('cameras.txt')[0].split()
assert camera[1] == 'PINHOLE', camera
fx, fy, cx, cy = map(float, camera[4:8])
seen = np.array(lines('images.txt')[1].split(), float).reshape(-1, 3)
assert len(seen) == len(points) and (seen[:, 2] == np.arange(1, len(points) + 1)).all()
x, y, z = R @ points.T + t[:, None]
at = np.stack([fx * x / z + cx, fy * y / z + cy], 1)
print(len(points), np.abs(at - seen[:, :2]).max())
)";

TEST_F(LensRaysCli, ColmapUndistortsPixelsToTheirHits) {
    if (!exhaustive()) GTEST_SKIP() << "set PEELER_TEST_ALL to run COLMAP";
    if (runCommand({"colmap", "help"}).exit_code != 0)
        GTEST_SKIP() << "colmap is not installed (examples/install_dependencies.sh)";
    PEELER_REQUIRE_PYTHON("numpy");
    struct Model {
        std::string lens, coefficients;
        bool one_focal = false;
    };
    for (const Model& model :
         {Model{"simple-radial", "-0.2", true}, Model{"radial", "-0.2,0.05", true},
          Model{"opencv", "-0.25,0.06,0.001,-0.002"},
          Model{"opencv-fisheye", "0.03,-0.01,0.004,-0.0006"},
          Model{"thin-prism-fisheye", "0.03,-0.01,0.001,-0.002,0.004,-0.0006,0.002,-0.001"},
          Model{"fov", "0.9"}}) {
        // COLMAP's pixel centres are at halves.
        const std::string focal = model.one_focal ? "310" : "310,305";
        std::string name = model.lens, parameters = focal + ",163.7,118.4," + model.coefficients;
        std::ranges::transform(name, name.begin(), [](unsigned char c) {
            return static_cast<char>(c == '-' ? '_' : std::toupper(c));
        });
        std::ranges::replace(parameters, ',', ' ');
        std::vector<std::string> camera = {
            "--lens",     model.lens,     "--distortion=" + model.coefficients,
            kWitnessPose, "--intrinsics", (model.one_focal ? "310,310" : focal) + ",163.2,117.9",
            "--size",     "320x240"};
        traced(camera, "h.npz");
        camera.emplace_back("--double");
        const Json json = traced(camera, "h.ply");
        const Outcome read = runPython(kUndistortByColmap, {scratch_ / "h.npz", scratch_ / "h.ply",
                                                            name, parameters, scratch_ / name});
        ASSERT_EQ(read.exit_code, 0) << read.err;
        std::istringstream numbers(read.out);
        std::size_t hits = 0;
        double farthest = 1;
        numbers >> hits >> farthest;
        EXPECT_EQ(hits, json.at("hits").get<std::size_t>());
        EXPECT_GT(hits, 16'000) << name;
        EXPECT_LT(farthest, 1e-6) << name;
    }
}

TEST_F(LensRaysCli, ALensWithoutDistortionIsThePinhole) {
    const std::vector<std::string> camera = {
        "--intrinsics", "200,210,63.3,60.2", "--size", "128x128", "--eye", "0.3,0.2,2"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.end(), camera.begin(), camera.end());
        return more;
    };
    traced(with({}), "plain.npz");
    traced(with({"--lens", "pinhole"}), "lens.npz");
    traced(with({"--distortion", "0,0,0,0,0"}), "opencv.npz");
    EXPECT_EQ(bytesOf(scratch_ / "lens.npz"), bytesOf(scratch_ / "plain.npz"));
    EXPECT_EQ(bytesOf(scratch_ / "opencv.npz"), bytesOf(scratch_ / "plain.npz"));
}

TEST_F(LensRaysCli, PixelsBeyondTheLensAreCounted) {
    // k1 = −1: r (1 − r²) has its maximum 0.385 at r = 0.577.
    const Json json = traced({"--lens", "simple-radial", "--distortion", "-1", "--intrinsics",
                              "100,100,49.5,49.5", "--size", "100x100", "--eye", "0,0,3"},
                             "r.npz");
    const double circle = M_PI * 38.49 * 38.49;
    EXPECT_NEAR(json.at("withoutRay").get<double>(), 10'000 - circle, 60);
    const Outcome run =
        rays({"--lens", "simple-radial", "--distortion", "-1", "--intrinsics", "100,100,49.5,49.5",
              "--size", "100x100", "--eye", "0,0,3", "-o", scratch_ / "r.npz"});
    EXPECT_TRUE(contains(run.err, "the lens sees nothing there")) << run.err;
}

TEST_F(LensRaysCli, AListOfRaysIsTracedInItsOrder) {
    PEELER_REQUIRE_PYTHON("numpy");
    const Outcome made = runPython(R"(
import sys, numpy as np
rays = np.array([[0, 0, 5, 0, 0, -2], [0, 0, 5, 0, 0, 1], [0, 0, -3, 0, 0, 0.5],
                 [9, 9, 9, 0, 0, -1], [0, 0, 1, float('nan'), 0, 0]])
np.save(sys.argv[1], rays.astype('float32'))
np.savez(sys.argv[2], rays=rays.reshape(1, 5, 6))
)",
                                   {scratch_ / "rays.npy", scratch_ / "rays.npz"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const Json json = traced({"--rays", scratch_ / "rays.npy"}, "l.npz");
    EXPECT_EQ(json.at("withoutRay"), 1);
    const auto arrays = readNpz(scratch_ / "l.npz");
    EXPECT_EQ(arrays.at("ray_splits").as<std::int64_t>(),
              (std::vector<std::int64_t>{0, 1, 1, 2, 2, 2}));
    EXPECT_EQ(arrays.at("t_hit").as<float>(), (std::vector<float>{5, 3}));
    EXPECT_EQ(arrays.at("facing").as<std::int32_t>(), (std::vector<std::int32_t>{1, -1}));
    traced({"--rays", scratch_ / "rays.npz", "--dense", "2", "--columns", "t_hit"}, "d.npz");
    EXPECT_EQ(readNpz(scratch_ / "d.npz").at("t_hit").shape, "(1, 5, 2)");
    traced({"--rays", scratch_ / "rays.npz"}, "p.ply");
    traced({"--rays", scratch_ / "rays.npz"}, "e.exr");
    traced({"--rays", scratch_ / "rays.npz", "--map", "first,count"}, "m.npz");
    const auto first = readNpz(scratch_ / "m.npz").at("first.0").as<float>();
    EXPECT_EQ(first[2], 3);
    EXPECT_EQ(first[3], INFINITY);
}

TEST_F(LensRaysCli, AMovingCameraTakesItsPosesFromAFile) {
    const std::string still = R"("target": [0, 0, 0], "size": [64, 64], "fx": 60, "fy": 60,)"
                              R"( "cx": 31.5, "cy": 31.5)";
    const auto poses = put("poses.jsonl", R"({"eye": [0, 0, 1], )" + still +
                                              "}\n"
                                              R"({"eye": [0, 0, 3], )" +
                                              still + "}\n");
    const Json json = traced({"--shutter", poses}, "s.npz");
    EXPECT_EQ(json.at("rays"), 64 * 64);
    const auto arrays = readNpz(scratch_ / "s.npz");
    const auto splits = arrays.at("ray_splits").as<std::int64_t>();
    const auto t = arrays.at("t_hit").as<float>();
    for (const std::size_t row : {25U, 32U, 40U}) {
        const std::size_t ray = row * 64 + 32;
        ASSERT_EQ(splits[ray + 1] - splits[ray], 1) << row;
        const double x = 0.5 / 60, y = (static_cast<double>(row) - 31.5) / 60;
        const double distance = 1 + 2 * (static_cast<double>(row) + 0.5) / 64;
        EXPECT_NEAR(t[static_cast<std::size_t>(splits[ray])],
                    distance * std::sqrt(1 + x * x + y * y), 1e-5);
    }
    // With a lens of its own, only the poses are taken.
    EXPECT_EQ(
        traced({"--shutter", poses, "--lens", "fisheye", "--fov", "90", "--size", "32x16"}, "l.npz")
            .at("rays"),
        32 * 16);
    const auto one = put("one.jsonl", R"({"eye": [0, 0, 1], )" + still + "}\n");
    expectRefused({"--shutter", one}, "two or more poses");
}

TEST_F(LensRaysCli, CamerasOfAFileHaveTheirLenses) {
    const std::string place =
        R"("eye": [0, 0, 2], "target": [0, 0, 0], "size": [64, 64], "fx": 40, "fy": 40,)"
        R"( "cx": 31.5, "cy": 31.5})";
    const auto cameras =
        put("c.jsonl", R"({"lens": "fisheye", )" + place + "\n{" + place + "\n" +
                           R"({"lens": "opencv", "distortion": [0.1, 0, 0, 0], )" + place);
    const Json json = traced({"--cameras", cameras}, "c.npz");
    EXPECT_EQ(json.at("bundles"), 3);
    traced({"--cameras", cameras}, "v@@@@.npz");
    EXPECT_TRUE(fs::exists(scratch_ / "v0002.npz"));
    EXPECT_EQ(
        traced({"--views", "3", "--lens", "fisheye", "--fov", "120", "--size", "64x64"}, "a.npz")
            .at("bundles"),
        3);
}

TEST_F(LensRaysCli, ContradictionsAreRefused) {
    const auto list = put("r.npy", "x");
    expectRefused({"--rays", list, "--axes"}, "cannot be combined");
    expectRefused({"--rays", list, "--fov", "30"}, "cannot be combined");
    expectRefused({"--rays", list, "--resolution", "30"}, "defines all rays");
    expectRefused({"--fov", "200"}, "less than 180");
    expectRefused({"--fov", "361", "--lens", "fisheye", "--size", "8x8"}, "at most 360");
    expectRefused({"--lens", "fisheye", "--fov", "100", "--size", "8x8", "--engine", "gl"},
                  "traced on the CPU");
    expectRefused({"--lens", "fisheye", "--fov", "100", "--size", "8x8", "--cameras", list},
                  "defines the lenses");
    expectRefused({"--shutter", list, "--views", "2"}, "a single view");
    expectRefused({"--lens", "nothing"}, "fisheye");
}

}  // namespace
}  // namespace peeler::test
