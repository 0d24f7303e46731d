// SPDX-License-Identifier: Apache-2.0
// Tests that invalid camera files are rejected without a crash, and that the error names the fault
// and its location.
#include <sys/stat.h>

#include <cstdio>
#include <random>

#include "cmd/batch/batch_report.h"
#include "formats/cameras/camera_files.h"

namespace peeler::test {
namespace {

using Convention = CameraConvention;

/// Returns `text` with `other` in place of the first occurrence of `part`.
std::string withPart(std::string text, const std::string& part, const std::string& other) {
    const std::size_t at = text.find(part);
    EXPECT_NE(at, std::string::npos) << part;
    return text.replace(at, part.size(), other);
}

/// A fault, made by replacing a part of a text, and its expected error.
struct BadCameras {
    std::string part, other, what, where;
};

TEST(CameraRefusals, Transforms) {
    const ScratchDir scratch;
    const std::string matrix = "/frames/0/transform_matrix";
    const BadCameras damages[] = {
        {"\"k1\": 0", "\"k1\": 0.1", "distortion", "/k1"},
        {"\"k1\": 0", "\"distortion_params\": [0, 0, 0.1]", "distortion", "/distortion_params"},
        {"{\"file_path\"", "{\"p1\": -1e-9, \"file_path\"", "distortion", "/frames/0/p1"},
        {"OPENCV", "OPENCV_FISHEYE", "OPENCV_FISHEYE", "/camera_model"},
        {"\"k1\": 0", "\"is_fisheye\": true", "is_fisheye", "/is_fisheye"},
        {"{\"file_path\"", "{\"K\": [[1, 2, 3]], \"file_path\"", "matrix of intrinsics", "/K"},
        {"\"fl_x\": 500", "\"fl_x\": -500", "above 0", "/frames/0"},
        {"\"fl_x\": 500", "\"fl_x\": 0", "above 0", "/frames/0"},
        {"\"fl_x\": 500", "\"fl_x\": \"500\"", "expected a number", "/fl_x"},
        {"\"fl_x\": 500", "\"fl_x\": 1e400", "not valid JSON", "t.json"},
        {"\"fl_x\": 500", "\"fl_x\": NaN", "not valid JSON", "t.json"},
        {"\"fl_x\": 500, \"fl_y\": 400,", "", "\"fl_x\" and \"camera_angle_x\" are", "/frames/0"},
        {"\"fl_x\": 500, \"fl_y\": 400,", "\"camera_angle_x\": 3.2,", "between 0 and half",
         "angle_x"},
        {"\"cx\": 300.75", "\"cx\": 1e7", "too far outside", "view a.b"},
        {"\"h\": 480", "\"h\": 65537", "1 to 65536", "/w"},
        {"\"h\": 480", "\"h\": 0", "1 to 65536", "/w"},
        {"\"h\": 480", "\"h\": 1.5", "1 to 65536", "/w"},
        {"640.0, \"h\": 480", "65536, \"h\": 65536", "more than", "/w"},
        {"\"h\": 480,", "", "both \"w\" and \"h\"", "/frames/0"},
        {"[0,0,1,1]", "[0,0,1]", "list of 4", matrix + "/0"},
        {"[0,0,1,1]", "[0,0,null,1]", "expected a number", matrix + "/0/2"},
        {"[0,0,1,1]", "[0,0,1.01,1]", "rotation and a translation", matrix},
        {"[0,0,1,1]", "[0,0,-1,1]", "rotation and a translation", matrix},   // mirrored
        {"[0,0,1,1]", "[0.1,0,1,1]", "rotation and a translation", matrix},  // sheared
        {"[0,0,1,1]", "[0,0,0,1]", "rotation and a translation", matrix},    // singular
        {"[0,0,0,1]", "[0,0,1,1]", "last row", matrix},
        {"\"transform_matrix\"", "\"matrix\"", "\"transform_matrix\" is missing", "/frames/0"},
        {"{\"file_path\"", "{\"peeler_near\": 0, \"file_path\"", "in front of", "/frames/0"},
        {"\"frames\": [", "\"frames\": [3, ", "expected an object, not 3", "/frames/0"},
    };
    for (const BadCameras& damage : damages)
        expectRefusedCameras(
            put(scratch / "t.json", withPart(transformsText(), damage.part, damage.other)),
            damage.what, damage.where);
    expectRefusedCameras(put(scratch / "e.json", R"({"frames": []})"), "no cameras", "/frames");
    expectRefusedCameras(put(scratch / "e.json", R"({"frames": 3})"), "a list of frames",
                         "/frames");
    expectRefusedCameras(put(scratch / "e.json", "{}"), "unknown camera format", "e.json");
    expectRefusedCameras(put(scratch / "e.json", "[1]"), "unknown camera format", "e.json");
    expectRefusedCameras(put(scratch / "e.json", ""), "not valid JSON", "e.json");
    expectRefusedCameras(put(scratch / "e.json", std::string(300, '[')), "nested deeper", "e.json");
}

TEST(CameraRefusals, Bop) {
    const ScratchDir scratch;
    const auto path = scratch / "scene_camera.json";
    const BadCameras damages[] = {
        {"500, 0, 300.25", "500, 1e-9, 300.25", "skew", "/7/cam_K"},
        {"500, 0, 300.25", "0, 0, 300.25", "above 0", "/7/cam_K"},
        {"0, 0, 1]", "0, 0, 2]", "K must be", "/7/cam_K"},
        {"0, 0, 1]", "0, 0]", "list of 9", "/7/cam_K"},
        {"cam_K", "cam_k", "\"cam_K\" is missing", "/7"},
        {"\"cam_K\"", "\"cam_model\": {}, \"cam_K\"", "pinhole", "/7/cam_model"},
        {"-1, -1, 0, 0]", "-1, 1, 0, 0]", "rotation and a translation", "/7/cam_R_w2c"},
        {"-2000, 5000", "5000", "list of 3", "/7/cam_t_w2c"},
        {"\"7\"", "\"x\"", "unknown camera format", "scene_camera.json"},
        {"{\"7\"", "{\"07\": {}, \"7\"", "twice", "scene_camera.json"},
    };
    for (const BadCameras& damage : damages)
        expectRefusedCameras(put(path, withPart(bopText(), damage.part, damage.other)), damage.what,
                             damage.where);
    put(path, bopText());
    put(scratch / "camera.json", R"({"width": 3})");
    expectRefusedCameras(path, "\"height\" is missing", "camera.json");
    put(scratch / "camera.json", R"({"width": 3, "height": -1})");
    expectRefusedCameras(path, "1 to 65536", "camera.json");
    std::filesystem::remove(scratch / "camera.json");
    const std::string good = R"("cam_R_m2c": [1,0,0,0,1,0,0,0,1], "cam_t_m2c": [0,0,1])";
    const auto objects = [&](const std::string& object) {
        put(scratch / "scene_gt.json", "{\"7\": [" + object + "]}");
    };
    objects("{\"obj_id\": 1.5, " + good + "}");
    expectRefusedCameras(path, "whole number", "scene_gt.json, /7/0/obj_id");
    objects("{" + good + "}");
    expectRefusedCameras(path, "\"obj_id\" is missing", "scene_gt.json, /7/0");
    objects("{\"obj_id\": 1}");
    expectRefusedCameras(path, "\"cam_R_m2c\" is missing", "scene_gt.json, /7/0");
    objects("{\"obj_id\": 1, " + good + "}");
    EXPECT_EQ(readCameras(path)[0].objects.size(), 1U);
}

TEST(CameraRefusals, ColmapText) {
    const ScratchDir scratch;
    const auto cameras = scratch / "cameras.txt", images = scratch / "images.txt";
    put(images, kColmapImagesText);
    const auto lens = [&](const std::string& text, const std::string& what) {
        put(cameras, colmapCamerasText(text));
        expectRefusedCameras(scratch.path(), what, "cameras.txt:3");
    };
    lens("SIMPLE_RADIAL 640 480 500 320 240 0.01", "distortion");
    lens("OPENCV 640 480 500 400 320 240 0 0 0 1e-9", "distortion");
    lens("OPENCV_FISHEYE 640 480 500 400 320 240 0 0 0 0", "this is a OPENCV_FISHEYE");
    lens("PINHOLE 640 480 500 400 320", "ends before a parameter");
    lens("PINHOLE 640 480 500 400 320 240 0", "there are more");
    lens("PINHOLE 640 480 500 400 320 24x", "not \"24x\"");
    lens("PINHOLE 640 480 500 400 320 nan", "not finite");
    lens("PINHOLE 640 480 500 400 320 1e999", "not \"1e999\"");
    lens("PINHOLE 640 480 500 -400 320 240", "above 0");
    lens("PINHOLE 640 70000 500 400 320 240", "1 to 65536");
    lens("PINHOLES 640 480 500 400 320 240", "unknown camera model \"PINHOLES\"");
    put(cameras, colmapCamerasText() + colmapCamerasText());
    expectRefusedCameras(scratch.path(), "appears twice", "cameras.txt:6");
    put(cameras, "# none\n");
    expectRefusedCameras(scratch.path(), "no cameras", "cameras.txt");
    put(cameras, colmapCamerasText());
    const BadCameras damages[] = {
        {"0.5 0.5 0.5 -0.5", "0 0 0 0", "quaternion is 0", "images.txt:2"},
        {"0.5 0.5", "nan 0.5", "not finite", "images.txt:2"},
        {"0.5 0.5", "1e200 0.5", "not finite", "images.txt:2"},
        {"1.5 2.5 -1", "2.5 -1", "ends before a point's id", "images.txt:3"},
        {"1.5 2.5 -1", "1.5 2.5 0.5", "expected a point's id, not \"0.5\"", "images.txt:3"},
        {"1.5 2.5 -1 3 4 17", "# none", "expected a point's x, not \"#\"", "images.txt:3"},
        {"-2 5", "inf 5", "not finite", "images.txt:2"},
        {"9 0.5", "-9 0.5", "an image's number", "images.txt:2"},
        {"1 3 folder", "1 4 folder", "no camera 4", "images.txt, image 9"},
    };
    for (const BadCameras& damage : damages) {
        put(images, withPart(kColmapImagesText, damage.part, damage.other));
        expectRefusedCameras(scratch.path(), damage.what, damage.where);
    }
    put(images, kColmapImagesText + kColmapImagesText);
    expectRefusedCameras(scratch.path(), "appears twice", "image 9");
    // The first image lacks its line of points, so the next image's line takes its place. A reader
    // that skips every second line would lose that image.
    const std::string image = kColmapImagesText.substr(0, kColmapImagesText.find("1.5"));
    put(images, image + "10" + image.substr(image.find(" 0.5")));
    expectRefusedCameras(scratch.path(), "a point's id, not \"0.5\"", "images.txt:3");
    // If an image's name is a number, the image's line looks like a line of points.
    put(images, "9 1 0 0 0 0 0 0 3 1\n10 1 0 0 0 0 0 0 3 2\n");
    expectRefusedCameras(scratch.path(), "ends before a point's y", "images.txt:2");
    put(images, "#\n");
    expectRefusedCameras(scratch.path(), "no cameras", "images.txt");
    std::filesystem::remove(images);
    expectRefusedCameras(scratch.path(), "no COLMAP model", scratch.path());
    expectRefusedCameras(cameras, "does not exist", "images.txt");
}

TEST(CameraRefusals, ColmapBinary) {
    const ScratchDir scratch;
    const std::string good_cameras = colmapCamerasBinary(), good_images = colmapImagesBinary();
    put(scratch / "images.bin", good_images);
    const auto number = [](std::string text, std::size_t at, auto value) {
        return text.replace(at, sizeof value, PackedNumbers().add(value).text);
    };
    const auto lens = [&](const std::string& text, const std::string& what) {
        put(scratch / "cameras.bin", text);
        expectRefusedCameras(scratch.path(), what, "cameras.bin");
    };
    lens(number(good_cameras, 0, std::uint64_t{1} << 62), "too small for");
    lens(number(good_cameras, 0, std::uint64_t{2}), "ends early");
    lens(number(good_cameras, 0, std::uint64_t{0}), "no cameras");
    lens(number(good_cameras, 12, std::int32_t{99}), "unknown camera model 99");
    lens(number(good_cameras, 12, std::int32_t{-1}), "unknown camera model -1");
    lens(number(good_cameras, 12, std::int32_t{5}) + std::string(32, '\0'), "OPENCV_FISHEYE");
    lens(number(good_cameras, 16, std::uint64_t{0}), "1 to 65536");
    lens(number(good_cameras, 32, double{NAN}), "not finite");
    lens(good_cameras + "x", "follows the last number");
    put(scratch / "cameras.bin", good_cameras);
    const auto image = [&](const std::string& text, const std::string& what) {
        put(scratch / "images.bin", text);
        expectRefusedCameras(scratch.path(), what, "images.bin");
    };
    image(number(good_images, 0, std::uint64_t{1} << 40), "too small for");
    image(number(good_images, 12, double{NAN}), "not finite");
    image(number(good_images, 44, double{INFINITY}), "not finite");
    image(number(good_images, good_images.size() - 32, std::uint64_t{1} << 60), "too small for");
    image(good_images.substr(0, 80), "too small for");
    put(scratch / "images.bin", number(good_images, 68, std::uint32_t{4}));
    expectRefusedCameras(scratch.path(), "no camera 4", "image 9");
}

TEST(CameraRefusals, Lines) {
    const ScratchDir scratch;
    const std::string place = "\"cameraToWorld\": [" + kKnownOpenglRows + "]";
    const std::string good = lineText(place);
    const BadCameras damages[] = {
        {"\"size\"", "\"sise\"", "unknown key \"sise\"", ":2"},
        {"[640, 480]", "[640]", "list of 2", ":2, /size"},
        {"[640, 480]", "[640, 0]", "1 to 65536", ":2, /size"},
        {"\"fx\": 500,", "", "\"fx\" is missing", ":2"},
        {"\"fx\"", "\"fov\": 40, \"fx\"", "fx and fov", ":2"},
        {"\"fx\": 500", "\"fx\": -500", "above 0", ":2"},
        {"\"fx\"", "\"near\": 0, \"fx\"", "in front of the eye", ":2"},
        {"\"fx\"", "\"near\": 2, \"far\": 1, \"fx\"", "before the far plane", ":2"},
        {"\"name\": \"a\"", "\"name\": 3", "expected a string", ":2, /name"},
        {place, "\"fov\": 180", "fx and fov", ":2"},
        {place, "\"eye\": [0, 0, 0]", "\"target\" is missing", ":2"},
        {place, "\"eye\": [0, 0, 1], \"target\": [0, 0, 1]", "at the target", ":2, /target"},
        {place, "\"eye\": [0, 0, 1], \"target\": [0, 0, 0], \"up\": [0, 0, 1]", "parallel",
         ":2, /up"},
        {place, place + ", \"up\": [0, 1, 0]", "\"up\" needs \"eye\"", ":2, /up"},
        {place, place + ", \"eye\": [0, 1, 0]", "cameraToWorld and eye", ":2"},
        {", " + place, "", "place is missing", ":2"},
        {"[0,0,1,1]", "[0,0,2,1]", "rotation and a translation", ":2, /cameraToWorld"},
        {"}\n", "\n", "not valid JSON", ":2"},
    };
    for (const BadCameras& damage : damages)
        expectRefusedCameras(
            put(scratch / "c.jsonl", good + withPart(good, damage.part, damage.other)), damage.what,
            "c.jsonl" + damage.where);
    expectRefusedCameras(put(scratch / "c.jsonl", "\n\n"), "no cameras", "c.jsonl");
    std::string many;
    for (std::uint64_t i = 0; i <= kMostViews; ++i)
        many += "{\"eye\":[0,0,1],\"target\":[0,0,0]}\n";
    expectRefusedCameras(put(scratch / "many.jsonl", many), "1000001 views", "many.jsonl");
}

TEST(CameraRefusals, ConventionsThatAreNotTheFormats) {
    const ScratchDir scratch;
    const auto refused = [](const std::filesystem::path& path, Convention convention,
                            const std::string& what) {
        expectRefusedCameras(path, what, path.filename(), {convention, {}}, ErrorKind::kUsage);
    };
    refused(put(scratch / "t.json", transformsText()), Convention::kOpencv,
            "opencv is not that of transforms.json: its cameras use opengl");
    refused(put(scratch / "scene_camera.json", bopText()), Convention::kOpengl,
            "its cameras use opencv");
    put(scratch / "m/cameras.txt", colmapCamerasText());
    put(scratch / "m/images.txt", kColmapImagesText);
    refused(scratch / "m", Convention::kOpengl, "its cameras use opencv");
    const auto lines =
        put(scratch / "c.jsonl", lineText("\"cameraToWorld\": [" + kKnownOpenglRows + "]"));
    for (const Convention convention : {Convention::kOpencv, Convention::kOpengl})
        refused(lines, convention, "its keys define");
    for (const char* path : {"t.json", "scene_camera.json", "m", "c.jsonl"})
        EXPECT_EQ(readCameras(scratch / path, {Convention::kBlender, {}}).size(), 1U) << path;
    try {
        cameraConvention("openvc");
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_TRUE(contains(error.hint(), "did you mean 'opencv'?")) << error.hint();
    }
}

TEST(CameraRefusals, WhatIsNoFile) {
    const ScratchDir scratch;
    for (const char* name : {"a.json", "a.npy", "a.jsonl", "a.txt", "cameras.bin"})
        expectRefusedCameras(scratch / name, "does not exist", "");
    expectRefusedCameras(scratch.path(), "no COLMAP model", scratch.path());
    std::filesystem::create_directory(scratch / "d.jsonl");
    expectRefusedCameras(scratch / "d.jsonl", "a folder", "d.jsonl");
    for (const char* name : {"p.json", "p.npz", "p.jsonl", "p"}) {
        ASSERT_EQ(mkfifo((scratch / name).c_str(), 0600), 0);
        expectRefusedCameras(scratch / name, "not a regular file", name);
    }
    for (const char* name : {"l.json", "l.npy", "l.npz", "l.jsonl", "l", "images.bin"}) {
        std::filesystem::resize_file(put(scratch / "big" / name, ""), std::uint64_t{2} << 30);
        put(scratch / "big/cameras.bin", colmapCamerasBinary());
        expectRefusedCameras(scratch / "big" / name, "the limit is 1073741824", name);
    }
    expectRefusedCameras(put(scratch / "a.txt", "hello"), "unknown camera format", "a.txt");
    const std::string header = npyText("<f4", "(1000001, 3, 4)", "");
    std::filesystem::resize_file(put(scratch / "h.npy", header), header.size() + 1000001 * 48);
    expectRefusedCameras(scratch / "h.npy", "1000001 views", "h.npy", {Convention::kOpengl, {}});
    expectRefusedCameras(put(scratch / "s.npy", npyText("<f8", "(999999999, 3, 4)", "")),
                         "contradicts its header", "s.npy", {Convention::kOpengl, {}});
    expectRefusedCameras(
        put(scratch / "c.npy", npyText("<c16", "(1, 3, 4)", std::string(192, 'a'))),
        "an array of numbers", "c.npy", {Convention::kOpengl, {}});
}

/// Expects either cameras or an Error from a file that is truncated or has random bytes changed.
void expectSturdy(const std::filesystem::path& file, const std::filesystem::path& read,
                  const CameraFileOptions& options, std::uint64_t seed) {
    const std::string whole = bytesOf(file);
    std::printf("%s: seed %llu\n", file.filename().c_str(), static_cast<unsigned long long>(seed));
    const auto outcome = [&](const std::string& text) {
        put(file, text);
        try {
            // Warnings are allowed, because damage may turn a key into another one.
            ReadWarnings warnings(false, read.string());
            return peeler::readCameras(read, options, warnings).size();
        } catch (const Error& error) {
            EXPECT_TRUE(error.kind() == ErrorKind::kInput || error.kind() == ErrorKind::kUsage)
                << error.what();
            EXPECT_NE(error.where(), "");
            return std::size_t{0};
        }
    };
    ASSERT_EQ(outcome(whole), 1U);
    for (std::size_t size = 0; size < whole.size(); size += exhaustive() ? 1 : 3)
        EXPECT_LE(outcome(whole.substr(0, size)), 1U) << size;
    std::mt19937_64 random(seed);
    for (int i = 0; i < (exhaustive() ? 1000 : 250); ++i) {
        std::string text = whole;
        for (std::uint64_t n = random() % 3 + 1; n > 0; --n)
            text[random() % text.size()] = static_cast<char>(random());
        outcome(text);
    }
    put(file, whole);
}

TEST(CameraRefusals, DamagedFiles) {
    const ScratchDir scratch;
    const CameraFileOptions opengl{Convention::kOpengl, {}};
    std::uint64_t seed = 1;
    const auto alone = [&](const char* name, const std::string& text,
                           const CameraFileOptions& options = {}) {
        const auto path = put(scratch / name, text);
        expectSturdy(path, path, options, seed++);
    };
    alone("t.json", transformsText());
    alone("scene_camera.json", bopText());
    alone("c.jsonl", lineText("\"worldToCamera\": [" + kKnownOpencvRows + "]"));
    alone("p.npy", npyPoses(kKnownOpengl), opengl);
    put(scratch / "m/cameras.txt", colmapCamerasText());
    put(scratch / "m/images.txt", kColmapImagesText);
    put(scratch / "b/cameras.bin", colmapCamerasBinary());
    put(scratch / "b/images.bin", colmapImagesBinary());
    for (const char* name : {"m/cameras.txt", "m/images.txt", "b/cameras.bin", "b/images.bin"})
        expectSturdy(scratch / name, (scratch / name).parent_path(), {}, seed++);
    for (const char* name : {"b/cameras.bin", "b/images.bin"}) {
        const std::string whole = bytesOf(scratch / name);
        for (std::size_t size = 0; size < whole.size(); ++size) {
            put(scratch / name, whole.substr(0, size));
            expectRefusedCameras(scratch / "b", "", std::filesystem::path(name).filename());
        }
        put(scratch / name, whole);
    }
}

}  // namespace
}  // namespace peeler::test
