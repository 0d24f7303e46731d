// SPDX-License-Identifier: Apache-2.0
// Tests camera files written by peeler: their content, and that reading them back loses nothing.
#include <cmath>
#include <cstdio>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <random>

#include "core/lens/lens.h"
#include "core/scene/intrinsics.h"
#include "core/scene/view.h"
#include "formats/cameras/camera_files.h"

namespace peeler::test {
namespace {

FileCamera knownCamera() {
    FileCamera camera;
    camera.name = "a";
    camera.camera_to_world = knownPose();
    camera.intrinsics = kKnownLens;
    camera.size = kKnownSize;
    return camera;
}

TEST(CameraWriters, TransformsOfOneLens) {
    const ScratchDir scratch;
    std::vector<FileCamera> cameras{knownCamera(), knownCamera()};
    cameras[1].picture = "views/b \"1\".png";
    cameras[1].near = 0.5;
    writeCameras(scratch / "t.json", cameras);
    const Json json = Json::parse(bytesOf(scratch / "t.json"));
    EXPECT_EQ(json["w"], 640);
    EXPECT_EQ(json["h"], 480);
    EXPECT_EQ(json["fl_x"], 500);
    EXPECT_EQ(json["fl_y"], 400);
    EXPECT_EQ(json["cx"], 300.75);  // cx counts from the corner of the picture
    EXPECT_EQ(json["cy"], 201);
    ASSERT_EQ(json["frames"].size(), 2U);
    EXPECT_EQ(json["frames"][0]["file_path"], "a");
    EXPECT_EQ(json["frames"][1]["file_path"], cameras[1].picture);
    EXPECT_EQ(json["frames"][0]["transform_matrix"],
              Json::parse("[" + kKnownOpenglRows + ",[0,0,0,1]]"));
    EXPECT_FALSE(json["frames"][0].contains("fl_x"));
    const std::vector<FileCamera> read = readCameras(scratch / "t.json");
    EXPECT_EQ(read[1].picture, cameras[1].picture);
    EXPECT_EQ(read[1].name, cameras[1].name);  // a separate JSON member stores the name
    EXPECT_EQ(read[1].near, 0.5);
    EXPECT_FALSE(read[0].near);

    cameras[1].intrinsics->fx = 3;
    writeCameras(scratch / "t.json", cameras);
    const Json own = Json::parse(bytesOf(scratch / "t.json"));
    EXPECT_FALSE(own.contains("fl_x"));
    EXPECT_EQ(own["frames"][0]["fl_x"], 500);
    EXPECT_EQ(own["frames"][1]["fl_x"], 3);
    EXPECT_EQ(own["frames"][1]["w"], 640);
}

TEST(CameraWriters, ModelsOfColmap) {
    const ScratchDir scratch;
    std::vector<FileCamera> cameras{knownCamera(), knownCamera(), knownCamera()};
    cameras[1].picture = "b.png";
    cameras[2].size = {64, 48};
    const ScenePoint points[] = {{{1, -2.5, 1e-7}, {255, 0, 7}}, {{4, 5, 6}, {1, 2, 3}}};
    const std::string text = scratch / "text/sparse/cameras.txt";
    writeCameras(text, cameras, {points});
    const std::string folder = scratch / "text/sparse/";
    EXPECT_TRUE(
        contains(bytesOf(text), "\n1 PINHOLE 640 480 500 400 300.75 201\n2 PINHOLE 64 48 500 400"))
        << bytesOf(text);
    EXPECT_TRUE(contains(bytesOf(folder + "images.txt"),
                         "\n1 0.5 0.5 0.5 -0.5 -2 5 1 1 a\n\n2 0.5 0.5 0.5 -0.5 -2 5 1 1 b.png\n\n"
                         "3 0.5 0.5 0.5 -0.5 -2 5 1 2 a\n\n"))
        << bytesOf(folder + "images.txt");
    EXPECT_TRUE(contains(bytesOf(folder + "points3D.txt"),
                         "\n1 1 -2.5 1e-07 255 0 7 -1\n2 4 5 6 1 2 3 -1\n"))
        << bytesOf(folder + "points3D.txt");

    writeCameras(scratch / "model", {cameras.data(), 1}, {points});
    std::string lens = colmapCamerasBinary();
    lens[8] = 1;  // the camera's ID
    EXPECT_EQ(bytesOf(scratch / "model/cameras.bin"), lens);
    PackedNumbers image;
    image.add(std::uint64_t{1}).add(std::uint32_t{1});
    image.add(std::vector<double>{0.5, 0.5, 0.5, -0.5, -2, 5, 1}).add(std::uint32_t{1});
    image.add('a').add('\0').add(std::uint64_t{0});
    EXPECT_EQ(bytesOf(scratch / "model/images.bin"), image.text);
    const std::string positions = bytesOf(scratch / "model/points3D.bin");
    ASSERT_EQ(positions.size(), 8U + 2 * 51U);
    EXPECT_EQ(
        positions.substr(8, 35),
        PackedNumbers().add(std::uint64_t{1}).add({1, -2.5, 1e-7}).text + "\xFF" + '\0' + "\x07");

    // The target may be an existing folder, or have a trailing slash.
    writeCameras(scratch / "model", cameras);
    EXPECT_EQ(readCameras(scratch / "model").size(), 3U);
    writeCameras((scratch / "other.model/").string(), cameras);
    EXPECT_EQ(readCameras(scratch / "other.model").size(), 3U);
    EXPECT_THROW(writeCameras(scratch / "model/cameras.txt", cameras), Error);
    cameras[1].picture = "with space";
    EXPECT_THROW(writeCameras(scratch / "new", cameras), Error);
    EXPECT_FALSE(std::filesystem::exists(scratch / "new"));
}

TEST(CameraWriters, Bop) {
    const ScratchDir scratch;
    std::vector<FileCamera> cameras{knownCamera(), knownCamera()};
    cameras[0].name = "000012";
    cameras[1].name = "3";
    cameras[1].objects = {{4, glm::dmat4(1)}};
    const std::string path = scratch / "test/scene_camera.json";
    writeCameras(path, cameras, {{}, 0.25});
    const Json json = Json::parse(bytesOf(path));
    ASSERT_EQ(json.size(), 2U);
    EXPECT_EQ(json["12"]["cam_K"], Json::parse("[500,0,300.25,0,400,200.5,0,0,1]"));
    EXPECT_EQ(json["12"]["cam_R_w2c"], Json::parse("[0,1,0,0,0,-1,-1,0,0]"));
    EXPECT_EQ(json["3"]["cam_t_w2c"], Json::parse("[-2000,5000,1000]"));
    EXPECT_EQ(json["3"]["depth_scale"], 0.25);
    const Json sensor = Json::parse(bytesOf(scratch / "test/camera.json"));
    EXPECT_EQ(sensor["width"], 640);
    EXPECT_EQ(sensor["cy"], 200.5);
    const Json objects = Json::parse(bytesOf(scratch / "test/scene_gt.json"));
    EXPECT_EQ(objects["12"], Json::array());
    EXPECT_EQ(objects["3"][0]["cam_t_m2c"], Json::parse("[-2000,5000,1000]"));
    const std::vector<FileCamera> read = readCameras(path);
    EXPECT_EQ(read[0].name, "000003");
    EXPECT_EQ(read[0].objects[0].to_world, glm::dmat4(1));
    EXPECT_EQ(read[1].camera_to_world, knownPose());

    cameras[1].size = {3, 4};
    EXPECT_THROW(writeCameras(path, cameras), Error);
    EXPECT_EQ(Json::parse(bytesOf(path)), json);
}

TEST(CameraWriters, WhatCannotBeWrittenIsRefused) {
    const ScratchDir scratch;
    const auto refused = [&](const std::string& path, const FileCamera& camera,
                             const std::string& what) {
        try {
            writeCameras(path, {&camera, 1});
            ADD_FAILURE() << what;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
            EXPECT_TRUE(contains(error.what(), what)) << error.what();
        }
        EXPECT_TRUE(scratch.files().empty());
    };
    View orthographic;
    orthographic.projection.perspective = false;
    orthographic.projection.half_height = 3;
    orthographic.projection.far = 9;
    orthographic.crop = {0, 0, 1280, 720};
    const FileCamera flat = fileCamera(orthographic, "flat");
    EXPECT_EQ(flat.ortho_height, 6);
    FileCamera no_size = knownCamera(), no_lens = knownCamera();
    no_size.size = {0, 0};
    no_lens.intrinsics.reset();
    for (const char* name : {"t.json", "scene_camera.json", "model", "model/cameras.txt"}) {
        refused(scratch / name, flat, "orthographic");
        refused(scratch / name, no_size, "size");
        refused(scratch / name, no_lens, "neither intrinsics nor a field of view");
    }
    for (const char* name : {"c.jsonl", "p.npz", "c.txt", "t.json/", ""}) {
        const bool is_folder = std::string(name) == "t.json/";
        const std::string path = *name ? (scratch / name).string() : "";
        if (is_folder)
            EXPECT_NO_THROW(checkCameraOutput(path));
        else
            refused(path, knownCamera(), "unknown camera format");
    }
    EXPECT_THROW(writeCameras(scratch / "t.json", {}), Error);
    no_lens.fov = 90;
    writeCameras(scratch / "t.json", {&no_lens, 1});
    EXPECT_NEAR(readCameras(scratch / "t.json")[0].intrinsics->fx, 240, 1e-10);
}

/// Returns a camera of random pose, lens and size. In a third of the cameras, the lens has all
/// digits of a double, like a calibration; in the others, it has three decimals or steps of 0.5.
FileCamera randomCamera(std::mt19937_64& random) {
    const auto uniform = [&](double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(random);
    };
    const auto size = [&] { return static_cast<int>(random() % 3000 + 1); };
    FileCamera camera;
    camera.name = "v" + std::to_string(random() % 1000);
    camera.size = {size(), size()};
    const int digits = static_cast<int>(random() % 3);
    const auto rounded = [&](double x) {
        return digits == 0 ? x : std::round(x * (digits == 1 ? 1e3 : 2)) / (digits == 1 ? 1e3 : 2);
    };
    const double w = camera.size.width, h = camera.size.height;
    camera.intrinsics = Intrinsics{rounded(uniform(1, 4000)), rounded(uniform(1, 4000)),
                                   rounded(uniform(-w, 2 * w)), rounded(uniform(-h, 2 * h))};
    const glm::dquat turn(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    camera.camera_to_world = glm::dmat4(glm::mat3_cast(glm::normalize(turn)));
    if (random() % 2) {  // rounds the rotation to single precision
        for (int column = 0; column < 3; ++column)
            for (int row = 0; row < 3; ++row)
                camera.camera_to_world[column][row] =
                    static_cast<float>(camera.camera_to_world[column][row]);
    }
    camera.camera_to_world[3] = {uniform(-9, 9), rounded(uniform(-9, 9)), uniform(-1e-3, 1e3), 1};
    return camera;
}

int repeats() {
    return exhaustive() ? 20'000 : 1'000;
}

TEST(CameraWriters, TransformsMakeTheSameViewsToTheLastBit) {
    const ScratchDir scratch;
    const std::uint64_t seed = std::random_device()();
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
    std::mt19937_64 random(seed);
    std::vector<View> views;
    std::vector<FileCamera> cameras;
    int as_they_were = 0;
    for (int i = 0; i < repeats(); ++i) {
        const FileCamera camera = randomCamera(random);
        views.push_back(viewOfCamera(camera));
        cameras.push_back(fileCamera(views.back(), camera.name));
        as_they_were += cameras.back().intrinsics == camera.intrinsics ? 1 : 0;
        const Intrinsics &a = *camera.intrinsics, &b = *cameras.back().intrinsics;
        EXPECT_NEAR(a.fx, b.fx, 1e-12 * a.fx);
        EXPECT_NEAR(a.fy, b.fy, 1e-12 * a.fy);
        EXPECT_NEAR(a.cx, b.cx, 1e-12 * 6000);
        EXPECT_NEAR(a.cy, b.cy, 1e-12 * 6000);
        EXPECT_EQ(camera.size, cameras.back().size);
    }
    EXPECT_GT(as_they_were, repeats() * 6 / 10);
    const std::string path = scratch / "t.json", again = scratch / "again.json";
    writeCameras(path, cameras);
    const std::vector<FileCamera> read = readCameras(path);
    ASSERT_EQ(read.size(), views.size());
    std::vector<FileCamera> next;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const View view = viewOfCamera(read[i]);
        expectSameView(view, views[i], std::to_string(i));
        next.push_back(fileCamera(view, read[i].name));
    }
    writeCameras(again, next);
    EXPECT_TRUE(bytesOf(again) == bytesOf(path));
}

/// A lens and the names of its model in COLMAP and transforms.json. A name is empty if the format
/// lacks the model.
struct WrittenLens {
    Lens lens;
    std::string colmap, transforms;
};
const WrittenLens kWrittenLenses[] = {
    {{"opencv", {0.1, -0.02, 1e-3, -2e-3}}, "OPENCV", "OPENCV"},
    {{"opencv", {0.1, -0.02, 1e-3, -2e-3, 0.03}}, "FULL_OPENCV", "OPENCV"},
    {{"opencv", {0.1, 0.02, 1e-3, 0, 0.03, 0.2, 0, 1.0 / 300}}, "FULL_OPENCV", "FULL_OPENCV"},
    {{"opencv", {0.1, 0.02, 1e-3, 0, 0, 0, 0, 0, 0.01, 0, 0, 0}}, "", ""},
    {{"full-opencv", {0.1, 0.02, 0, 0, 0, 0, 0.1, 0}}, "FULL_OPENCV", "FULL_OPENCV"},
    {{"simple-radial", {-0.05}}, "SIMPLE_RADIAL", "OPENCV"},
    {{"radial", {-0.05, 0.01}}, "RADIAL", "OPENCV"},
    {{"opencv-fisheye", {0.1, -0.02, 0.01, -0.001}}, "OPENCV_FISHEYE", "OPENCV_FISHEYE"},
    {{"simple-fisheye", {}}, "SIMPLE_FISHEYE", "OPENCV_FISHEYE"},
    {{"fisheye", {}}, "FISHEYE", "OPENCV_FISHEYE"},
    {{"radial-fisheye", {0.1, 0.01}}, "RADIAL_FISHEYE", "OPENCV_FISHEYE"},
    {{"thin-prism-fisheye", {0.1, 0, 1e-3, 2e-3, 0, 0, 0, 0}},
     "THIN_PRISM_FISHEYE",
     "OPENCV_FISHEYE"},
    {{"thin-prism-fisheye", {0.1, 0, 1e-3, 2e-3, 0, 0, 1e-3, 0}}, "THIN_PRISM_FISHEYE", ""},
    {{"rad-tan-thin-prism-fisheye", {0.1, 0, 0, 0, 0, 0, 1e-3, 0, 1e-3, 0, 0, 0}},
     "RAD_TAN_THIN_PRISM_FISHEYE",
     "FISHEYE624"},
    {{"fov", {0.9}}, "FOV", ""},
    {{"ftheta", {0, 0.004, 1e-7}}, "", "OPENCV"},
    {{"ftheta-forward", {0, 300}}, "", ""},
    {{"equirectangular", {}}, "EQUIRECTANGULAR", "EQUIRECTANGULAR"},
};

View viewOfLens(const Lens& lens) {
    View view;
    view.width = 640;
    view.height = 320;
    view.crop = {0, 0, 640, 320};
    view.camera_to_world = knownPose();
    const LensModel& model = lensModel(lens);
    setLens(view, {lens, model.in_pixels ? Intrinsics{1, 1, 320, 160}
                         : model.filling ? Intrinsics()
                                         : Intrinsics{300, 300, 1000.0 / 3, 150}});
    if (!model.filling) view.crop = {100, 50, 500, 300};
    return view;
}

TEST(CameraWriters, LensesMakeTheSameRaysToTheLastBit) {
    const ScratchDir scratch;
    for (const auto& [lens, colmap, transforms] : kWrittenLenses) {
        const View view = viewOfLens(lens);
        const FileCamera camera = fileCamera(view, "a");
        const auto check = [&](const std::string& path, const std::string& file,
                               const std::string& model) {
            const std::string which = lens.model + " in " + path;
            if (model.empty()) {
                try {
                    writeCameras(scratch / path, {&camera, 1});
                    ADD_FAILURE() << which;
                } catch (const Error& error) {
                    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
                    EXPECT_TRUE(contains(error.what(), lens.model)) << error.what();
                }
                return;
            }
            writeCameras(scratch / path, {&camera, 1});
            if (!file.empty()) {
                EXPECT_TRUE(contains(bytesOf(scratch / file), model)) << which;
            }
            const View read = viewOfCamera(readCameras(scratch / path, {.lenses = true}).at(0));
            ASSERT_TRUE(read.rays) << which;
            for (const glm::dvec2 at : {glm::dvec2(100.5, 60.5), {300, 200}, {499.5, 299.5}}) {
                const Ray a = rayOf(view, at);
                const Ray b = rayOf(read, at - glm::dvec2(view.crop.x0, view.crop.y0));
                // The principal point of a crop may be rounded.
                EXPECT_LT(glm::distance(a.direction, b.direction), 1e-14) << which;
                EXPECT_NE(a.direction, glm::dvec3(0)) << which;
            }
            const FileCamera again = fileCamera(read, "a");
            EXPECT_EQ(again.intrinsics, camera.intrinsics) << which;
        };
        check("t.json", "t.json", transforms.empty() ? "" : '"' + transforms + '"');
        check("text/cameras.txt", "text/cameras.txt", colmap.empty() ? "" : ' ' + colmap + ' ');
        check("binary", "", colmap);
        check("scene_camera.json", "", "");
    }
}

TEST(CameraWriters, CamerasThatHaveNoLensOfAFormatAreRefused) {
    const ScratchDir scratch;
    FileCamera camera = fileCamera(viewOfLens({"simple-radial", {0.1}}), "a");
    camera.intrinsics->fy = 299;
    EXPECT_THROW(writeCameras(scratch / "model", {&camera, 1}), Error);  // one focal length
    writeCameras(scratch / "t.json", {&camera, 1});
    View part = viewOfLens({"equirectangular"});
    part.crop.x0 = 1;
    EXPECT_THROW(fileCamera(part, "a"), Error);
    View moving = viewOfLens({"fisheye"});
    moving.rays = shutterPicture(moving.rays, {glm::dmat4(1), knownPose()}, moving.height);
    EXPECT_THROW(fileCamera(moving, "a"), Error);
    // Other lenses beside it keep their own.
    const FileCamera all[] = {camera, knownCamera(), fileCamera(viewOfLens({"fisheye"}), "c")};
    writeCameras(scratch / "t.json", all);
    const std::vector<FileCamera> read = readCameras(scratch / "t.json", {.lenses = true});
    EXPECT_EQ(read[0].lens->model, "opencv");
    EXPECT_FALSE(read[1].lens);
    EXPECT_EQ(read[2].lens->model, "opencv-fisheye");
}

TEST(CameraWriters, OtherViewsAreTheSameFromTheFirstFileOn) {
    const ScratchDir scratch;
    const std::uint64_t seed = std::random_device()();
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
    std::mt19937_64 random(seed);
    const auto uniform = [&](double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(random);
    };
    std::vector<View> views;
    for (int i = 0; i < repeats(); ++i) {
        // The views are crops of calibrated cameras, or have a field of view and a random
        // direction.
        FileCamera camera = randomCamera(random);
        View view;
        if (random() % 2) {
            view = viewOfCamera(camera);
            const int x = static_cast<int>(random() % static_cast<unsigned>(camera.size.width)),
                      y = static_cast<int>(random() % static_cast<unsigned>(camera.size.height));
            view.crop.x0 += x;
            view.crop.y0 += y;
        } else {
            camera.intrinsics.reset();
            camera.fov = uniform(1, 170);
            const auto steep = lookAlong({0, 0, 0}, {1, uniform(-1, 1), 1},
                                         {1, uniform(-1, 1), 1 + uniform(-1e-6, 1e-6)});
            if (steep) camera.camera_to_world = *steep;
            view = viewOfCamera(camera);
        }
        views.push_back(view);
    }
    const auto write = [&](const char* name) {
        std::vector<FileCamera> cameras;
        for (const View& view : views)
            cameras.push_back(fileCamera(view, "a"));
        writeCameras(scratch / name, cameras);
        views.clear();
        for (const FileCamera& camera : readCameras(scratch / name))
            views.push_back(viewOfCamera(camera));
    };
    const std::vector<View> first = views;
    write("0.json");
    for (std::size_t i = 0; i < views.size(); ++i) {
        const View &a = first[i], &b = views[i];
        ASSERT_EQ(a.crop.width(), b.crop.width());
        EXPECT_EQ(a.camera_to_world, b.camera_to_world);
        EXPECT_EQ(a.projection.near, b.projection.near);
        const auto at = [](const View& view, double x, double y) {
            return worldPosition(view, view.crop.x0 + view.sample.x + x,
                                 view.crop.y0 + view.sample.y + y, 1);
        };
        for (const double share : {0.0, 1.0}) {
            const double x = share * a.crop.width(), y = share * a.crop.height();
            const glm::dvec3 from = at(a, x, y);
            EXPECT_LT(glm::length(from - at(b, x, y)), 1e-12 * (1 + glm::length(from)));
        }
    }
    const std::vector<View> second = views;
    write("1.json");
    for (std::size_t i = 0; i < views.size(); ++i)
        expectSameView(views[i], second[i], std::to_string(i));
    EXPECT_TRUE(bytesOf(scratch / "0.json") == bytesOf(scratch / "1.json"));
}

TEST(CameraWriters, EveryFormatReadsBackWhatItWrote) {
    const ScratchDir scratch;
    const std::uint64_t seed = std::random_device()();
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
    std::mt19937_64 random(seed);
    std::vector<FileCamera> cameras;
    for (int i = 0; i < 200; ++i) {
        FileCamera camera = randomCamera(random);
        camera = fileCamera(viewOfCamera(camera), std::to_string(i));
        camera.size = {640, 480};  // BOP files have a single size
        cameras.push_back(camera);
    }
    for (const char* name : {"t.json", "scene_camera.json", "model", "text/cameras.txt"}) {
        writeCameras(scratch / name, cameras);
        const std::vector<FileCamera> read = readCameras(scratch / name);
        ASSERT_EQ(read.size(), cameras.size()) << name;
        for (std::size_t i = 0; i < read.size(); ++i) {
            const FileCamera &a = cameras[i], &b = read[i];
            EXPECT_EQ(std::stoul(b.name), i);
            EXPECT_EQ(a.size, b.size);
            for (int column = 0; column < 4; ++column)
                EXPECT_LT(glm::length(a.camera_to_world[column] - b.camera_to_world[column]),
                          1e-12 * (1 + glm::length(a.camera_to_world[3])))
                    << name;
            EXPECT_EQ(a.intrinsics->fx, b.intrinsics->fx);
            EXPECT_NEAR(a.intrinsics->cx, b.intrinsics->cx, 1e-12 * 6000);
        }
    }
}

}  // namespace
}  // namespace peeler::test
