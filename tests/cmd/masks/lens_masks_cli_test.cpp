// SPDX-License-Identifier: Apache-2.0
// Tests peeler masks through lenses: a sphere in closed form, resampled masks of a pinhole, and
// what lenses refuse.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "formats/image/image_library.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Writes a sphere of many triangles.
void writeSphere(const fs::path& path, const glm::dvec3& centre, double radius) {
    constexpr int kRings = 100, kSegments = 200;
    constexpr double kPi = std::numbers::pi;
    std::ofstream file(path);
    for (int ring = 0; ring <= kRings; ++ring) {
        for (int i = 0; i < kSegments; ++i) {
            const double a = kPi * ring / kRings, b = 2 * kPi * i / kSegments;
            const glm::dvec3 at =
                centre + radius * glm::dvec3(std::sin(a) * std::cos(b), std::cos(a),
                                             -std::sin(a) * std::sin(b));
            file << "v " << at.x << ' ' << at.y << ' ' << at.z << '\n';
        }
    }
    for (int ring = 0; ring < kRings; ++ring) {
        for (int i = 0; i < kSegments; ++i) {
            const int next = (i + 1) % kSegments, row = ring * kSegments + 1;
            file << "f " << row + i << ' ' << row + kSegments + i << ' ' << row + kSegments + next
                 << ' ' << row + next << '\n';
        }
    }
}

/// Returns the object numbers of a picture of ids.
std::vector<int> idsOf(const fs::path& path) {
    const auto decoder = imageDecoder("png", path.string());
    const StoredImage& image = decoder->image();
    std::vector<float> samples(static_cast<std::size_t>(image.width * image.height));
    decoder->read(0, 1, samples.data());
    std::vector<int> ids;
    for (const float sample : samples)
        ids.push_back(static_cast<int>(std::lround(sample * 65535)));
    return ids;
}

/// Returns the object that coco.json shows at each pixel, or 0.
std::vector<int> visibleObjects(const fs::path& folder, int width, int height) {
    std::vector<int> objects(static_cast<std::size_t>(width * height));
    const Json coco = Json::parse(bytesOf(folder / "coco.json"));
    for (const Json& annotation : coco["annotations"]) {
        bool inside = false;
        int at = 0;
        for (const int run : annotation["segmentation"]["counts"]) {
            for (const int end = at + run; at < end; ++at)
                if (inside)
                    objects[static_cast<std::size_t>(at % height * width + at / height)] =
                        annotation["category_id"];
            inside = !inside;
        }
    }
    return objects;
}

Outcome masks(const fs::path& scene, const fs::path& out, const std::string& options) {
    std::vector<std::string> line{"masks", scene.string(), "-o", out.string(), "--quiet"};
    std::istringstream words(options);
    for (std::string word; words >> word;)
        line.push_back(word);
    return runPeeler(line);
}

/// The pixels whose rays meet a sphere are within an angle of its centre.
TEST(LensMasks, OfASphereAreARound) {
    const ScratchDir scratch;
    const glm::dvec3 centre(3, 0.5, 0.8);  // 105° off the axis
    writeSphere(scratch / "sphere.obj", centre, 1);
    const Outcome run = masks(scratch / "sphere.obj", scratch / "out",
                              "--as coco,ids --lens fisheye --intrinsics 60,60,127.5,127.5 --size "
                              "256x256 --eye 0,0,0 --target 0,0,-1");
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const std::vector<int> ids = idsOf(scratch / "out/ids/000000_layer_000.png");
    const glm::dvec3 towards = glm::normalize(centre);
    const double most = std::asin(1 / glm::length(centre));
    int inside = 0;
    for (int y = 0; y < 256; ++y) {
        for (int x = 0; x < 256; ++x) {
            const glm::dvec2 at(x - 127.5, y - 127.5);
            const double angle = glm::length(at) / 60;
            if (angle > std::numbers::pi) continue;
            const glm::dvec2 side = glm::normalize(at) * std::sin(angle);
            const glm::dvec3 ray(side.x, -side.y, -std::cos(angle));
            const double off = std::acos(glm::dot(ray, towards));
            if (std::abs(off - most) < 2e-3) continue;  // the flat triangles
            ASSERT_EQ(ids[static_cast<std::size_t>(y * 256 + x)] != 0, off < most) << x << ' ' << y;
            if (off < most) ++inside;
        }
    }
    EXPECT_GT(inside, 1000);
    EXPECT_GT(visibleObjects(scratch / "out", 256, 256)[128 * 256 + 240], 0);
}

/// Away from edges, a fisheye sees the objects that a pinhole sees in the same direction, also
/// through glass.
TEST(LensMasks, AreThoseOfAPinholeResampled) {
    const ScratchDir scratch;
    const fs::path scene = sourceDir() / "examples/scenes/engine.glb";
    const std::string camera =
        "--as coco,ids --see-through 0.9 --eye 0.25,0.25,0.5 --size 200x200 ";
    for (const std::string lens : {"--lens fisheye --fov 70", "--fov 75"}) {
        const Outcome run = masks(scene, scratch / lens.substr(2, 3), camera + lens);
        ASSERT_EQ(run.exit_code, 0) << run.err;
    }
    const double focal = 100 / (70 * std::numbers::pi / 360);
    const double pinhole = 100 / std::tan(75 * std::numbers::pi / 360);
    const auto compare = [&](const std::vector<int>& fish, const std::vector<int>& flat) {
        int compared = 0, different = 0, objects = 0;
        for (int y = 0; y < 200; ++y) {
            for (int x = 0; x < 200; ++x) {
                const glm::dvec2 at(x - 99.5, y - 99.5);
                const double radius = glm::length(at);
                const glm::dvec2 place = 99.5 + at / radius * (std::tan(radius / focal) * pinhole);
                const glm::ivec2 nearest(glm::round(place));
                if (nearest.x < 2 || nearest.y < 2 || nearest.x > 197 || nearest.y > 197) continue;
                const int object = flat[static_cast<std::size_t>(nearest.y * 200 + nearest.x)];
                bool edge = false;
                for (int i = 0; i < 25; ++i)
                    edge |= flat[static_cast<std::size_t>((nearest.y + i / 5 - 2) * 200 +
                                                          nearest.x + i % 5 - 2)] != object;
                if (edge) continue;
                ++compared;
                if (object != 0) ++objects;
                if (fish[static_cast<std::size_t>(y * 200 + x)] != object) ++different;
            }
        }
        EXPECT_GT(compared, 15000);
        EXPECT_GT(objects, 1000);
        EXPECT_LE(different, 5);
    };
    const auto layer = [&](const char* folder) {
        return idsOf(scratch / folder / "ids/000000_layer_000.png");
    };
    compare(layer("len"), layer("fov"));
    compare(visibleObjects(scratch / "len", 200, 200), visibleObjects(scratch / "fov", 200, 200));
}

/// A file of cameras may mix lenses; --skip-existing knows the lens.
TEST(LensMasks, OfMixedCamerasAndOfACanvas) {
    const ScratchDir scratch;
    writeSphere(scratch / "sphere.obj", {0, 0, -3}, 1);
    const auto cameras = [&](double k1) {
        std::ofstream(scratch / "transforms.json")
            << R"({"fl_x": 50, "fl_y": 50, "cx": 32, "cy": 32, "w": 64, "h": 64, "frames": [)"
            << R"({"file_path": "a", "camera_model": "OPENCV_FISHEYE", "k1": )" << k1
            << R"(, "k2": 0, "k3": 0, "k4": 0, )"
            << R"("transform_matrix": [[1,0,0,2],[0,1,0,0],[0,0,1,0],[0,0,0,1]]},)"
            << R"({"file_path": "b",)"
            << R"("transform_matrix": [[1,0,0,2],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})";
    };
    cameras(0.1);
    const std::string line = "--as coco --canvas 3 --json --skip-existing --cameras " +
                             (scratch / "transforms.json").string();
    const auto run = [&] {
        const Outcome made = masks(scratch / "sphere.obj", scratch / "out", line);
        EXPECT_EQ(made.exit_code, 0) << made.err;
        return Json::parse(made.out)["views"];
    };
    const Json first = run();
    ASSERT_EQ(first.size(), 2U);
    EXPECT_TRUE(first[0]["renderer"] == "" || first[0]["renderer"].is_null());
    for (const Json& view : first) {
        const Json& object = view["objects"][0];
        EXPECT_GT(object["canvasPixels"], object["amodalPixels"]) << "a part is outside";
        EXPECT_LT(object["amodalBox"][0], 0);
    }
    EXPECT_NE(first[0]["objects"][0]["canvasPixels"], first[1]["objects"][0]["canvasPixels"]);
    for (const Json& view : run())
        EXPECT_TRUE(view.value("skipped", false));
    cameras(0.2);
    const Json again = run();
    EXPECT_FALSE(again[0].value("skipped", false));
    EXPECT_TRUE(again[1].value("skipped", false));
}

/// Returns the number of hits of the cameras of a file.
Json hitsOf(const fs::path& scene, const fs::path& cameras, const fs::path& out) {
    const Outcome run = runPeeler({"rays", scene.string(), "--quiet", "--json", "--cameras",
                                   cameras.string(), "-o", out.string()});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.exit_code == 0 ? Json::parse(run.out).at("hits") : Json();
}

TEST(LensMasks, BopCamerasHaveTheirLens) {
    const ScratchDir scratch;
    writeSphere(scratch / "sphere.obj", {0.3, 0, -3}, 1);
    const fs::path folder = scratch / "out", file = folder / "scene_camera.json";
    const Outcome run =
        masks(scratch / "sphere.obj", folder,
              "--as bop --lens opencv-fisheye --distortion 0.03,-0.01,0.004,-0.0006 "
              "--eye 0,0,0 --target 0,0,-1 --size 96x64 --intrinsics 40,40,47,31");
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const auto read = [](const fs::path& path) { return Json::parse(std::ifstream(path)); };
    Json cameras = read(file);
    Json& camera = cameras.at("0");
    EXPECT_FALSE(camera.contains("cam_K")) << "the toolkit takes one of the two";
    Json& model = camera.at("cam_model");
    EXPECT_EQ(model.at("projection_model_type"), "CameraModelType.FISHEYE624");
    EXPECT_EQ(model.at("projection_params"), Json({40., 40., 47., 31., 0.03, -0.01, 0.004, -0.0006,
                                                   0., 0., 0., 0., 0., 0., 0., 0.}));
    EXPECT_EQ(model.at("image_width"), 96);
    fs::remove(folder / "scene_gt.json");  // the scene has no node obj_1
    // The camera sees the sphere where the masks do. Each of its rays has two hits.
    const Json seen = read(folder / "scene_gt_info.json").at("0").at(0).at("px_count_visib");
    EXPECT_GT(seen, 300);
    EXPECT_EQ(hitsOf(scratch / "sphere.obj", file, scratch / "a.npz"), 2 * seen.get<int>());
    // Aria's recordings have one focal length.
    model["projection_params"].erase(0);
    std::ofstream(file) << cameras;
    EXPECT_EQ(hitsOf(scratch / "sphere.obj", file, scratch / "b.npz"), 2 * seen.get<int>());
    EXPECT_EQ(bytesOf(scratch / "a.npz"), bytesOf(scratch / "b.npz"));
    model["projection_model_type"] = "CameraModelType.KB3";
    std::ofstream(file) << cameras;
    const Outcome other = runPeeler({"rays", (scratch / "sphere.obj").string(), "--cameras",
                                     file.string(), "-o", scratch / "e.npz"});
    EXPECT_EQ(other.exit_code, 3);
    EXPECT_TRUE(contains(other.err, "is not CameraModelType.FISHEYE624")) << other.err;
}

TEST(LensMasks, WhatLensesRefuse) {
    const ScratchDir scratch;
    writeSphere(scratch / "sphere.obj", {0, 0, -3}, 1);
    const auto refused = [&](const std::string& options) {
        const Outcome run =
            masks(scratch / "sphere.obj", scratch / "out", "--size 64x32 " + options);
        EXPECT_EQ(run.exit_code, 2) << run.err;
        EXPECT_FALSE(fs::exists(scratch / "out"));
        return run.err;
    };
    const std::string fisheye = "--lens fisheye --fov 150 ", ids = "--as ids ";
    const auto expect = [](const std::string& message, const std::string& words) {
        EXPECT_NE(message.find(words), std::string::npos) << message;
    };
    expect(refused("--fov 50 --lens opencv --distortion 0.1,0,0,0"), "BOP has no lens like this");
    expect(refused(fisheye + ids + "--clip-plane 0,0,1,0"), "--clip-plane");
    expect(refused("--lens equirectangular --canvas 3 " + ids), "has no surroundings");
}

}  // namespace
}  // namespace peeler::test
