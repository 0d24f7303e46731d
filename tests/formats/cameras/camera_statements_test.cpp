// SPDX-License-Identifier: Apache-2.0
// Handling of every statement of camera files (formats/README.md).
#include "cmd/batch/batch_report.h"
#include "formats/arrays/table_writers.h"
#include "formats/cameras/camera_files.h"
#include "formats/file/file_statements.h"

namespace peeler::test {
namespace {

std::vector<Text> cameraWarnings(const std::filesystem::path& file, bool strict) {
    const bool is_array = file.extension() == ".npy" || file.extension() == ".npz";
    CameraFileOptions options{.convention = {}, .size = {640, 480}};
    if (is_array) options.convention = CameraConvention::kOpencv;
    ReadWarnings warnings(strict, file.string());
    readCameras(file, options, warnings);
    return warnings.take();
}

/// Returns transforms.json with another member in the file and in its frame.
std::string transformsSaying(const std::string& of_file, const std::string& of_frame = "") {
    return R"({"camera_angle_x": 1, "w": 640, "h": 480, )" + of_file + R"("frames": [{)" +
           of_frame + R"("transform_matrix": [)" + kKnownOpenglRows + ",[0,0,0,1]]}]}";
}

TEST(Statements, OfTransformsJson) {
    const char* const name = "transforms.json";
    const auto says = [&](const char* what, const char* becomes, const std::string& of_file,
                          const std::string& of_frame = "") {
        return Statement{what, becomes, name, transformsSaying(of_file, of_frame)};
    };
    const std::vector<Statement> statements = {
        {"matrices, lens and size, of the file or of a frame", "read", name, transformsText()},
        says("matrices, lens and size, of the file or of a frame", "read", "",
             R"("fl_x": 500, "w": 64, "h": 48, "file_path": "a.png", )"),
        says("fields of view in radians or degrees", "read", R"("x_fov": 40, )"),
        says("fields of view in radians or degrees", "read", R"("camera_angle_y": 1, )"),
        says("`peeler_near`, `peeler_far`, `peeler_name`", "read", "",
             R"("peeler_near": 1, "peeler_far": 2, "peeler_name": "a", )"),
        says("what is about training: `aabb_scale`, `scale`, `offset`, masks, depth pictures, …",
             "read", R"("aabb_scale": 16, "scale": 0.33, "offset": [0.5, 0.5, 0.5], )",
             R"("sharpness": 3, "mask_path": "m.png", "rotation": 0.01, )"),
        says("distortion that is all 0, and transforms that change nothing", "read",
             R"("camera_model": "OPENCV", "k1": 0, "applied_scale": 1.0,
                "applied_transform": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]],
                "rolling_shutter": [0, 0, 0], "from_mitsuba": false, )"),
        says("`applied_transform`", "warned",
             R"("applied_transform": [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0]], )"),
        says("`applied_scale`", "warned", R"("applied_scale": 0.5, )"),
        says("`rolling_shutter`", "warned", R"("rolling_shutter": [0, 0, 0.01], )"),
        says("`from_mitsuba`", "warned", R"("from_mitsuba": true, )"),
        says("`time` of a frame", "warned", "", R"("time": 0.5, )"),
        says("`transform_matrix_start`, `transform_matrix_end`", "warned", "",
             R"("transform_matrix_start": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]], )"),
        says("anything else", "warned", R"("lens_shift": 3, )"),
        says("anything else", "warned", "", R"("zoom": 3, )"),
        says("lens distortion, a skew (`K`), other lenses", "refused", R"("k1": 0.1, )"),
        says("lens distortion, a skew (`K`), other lenses", "refused", "",
             R"("K": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], )"),
        says("lens distortion, a skew (`K`), other lenses", "refused",
             R"("camera_model": "OPENCV_FISHEYE", )"),
        says("lens distortion, a skew (`K`), other lenses", "refused", R"("is_fisheye": true, )"),
    };
    expectStatements("transforms.json", statements, cameraWarnings);
}

TEST(Statements, OfBop) {
    const char* const name = "scene_camera.json";
    const std::string k = R"("cam_K": [500, 0, 300, 0, 400, 200, 0, 0, 1])";
    const auto picture = [&](const std::string& more) { return "{\"7\": {" + k + more + "}}"; };
    const auto objects = [&](const std::string& key, const std::string& more) {
        return std::map<std::string, std::string>{
            {"scene_gt.json", "{\"" + key +
                                  R"(": [{"obj_id": 1, "cam_R_m2c": [1,0,0,0,1,0,0,0,1],
                                  "cam_t_m2c": [0, 0, 1])" +
                                  more + "}]}"}};
    };
    const std::vector<Statement> statements = {
        {"`cam_K`, `cam_R_w2c`, `cam_t_w2c`", "read", name, bopText()},
        {"what is about depth pictures and the data set: `depth_scale`, `view_level`, `mode`",
         "read", name, picture(R"(, "depth_scale": 0.1, "view_level": 0, "mode": 1)")},
        {"size of `camera.json`",
         "read",
         name,
         picture(""),
         {{"camera.json", R"({"width": 64, "height": 48, "fx": 1, "cx": 2, "depth_scale": 1})"}}},
        {"objects of `scene_gt.json`", "read", name, picture(""), objects("7", "")},
        {"objects of pictures without a camera", "warned", name, picture(""), objects("8", "")},
        {"anything else, in each of the three files", "warned", name, picture(R"(, "zoom": 2)")},
        {"anything else, in each of the three files", "warned", name, picture(""),
         objects("7", R"(, "scale": 2)")},
        {"anything else, in each of the three files",
         "warned",
         name,
         picture(""),
         {{"camera.json", R"({"width": 64, "height": 48, "k1": 0.1})"}}},
        {"lens distortion (`cam_model`), a skew", "refused", name, picture(R"(, "cam_model": {})")},
        {"lens distortion (`cam_model`), a skew", "refused", name,
         R"({"7": {"cam_K": [500, 1, 300, 0, 400, 200, 0, 0, 1]}})"},
    };
    expectStatements("BOP", statements, cameraWarnings);
}

TEST(Statements, OfColmap) {
    const std::map<std::string, std::string> pinhole = {{"cameras.txt", colmapCamerasText()}};
    const auto lens = [](const char* what, const char* becomes, const std::string& text) {
        return Statement{what,
                         becomes,
                         "images.txt",
                         kColmapImagesText,
                         {{"cameras.txt", colmapCamerasText(text)}}};
    };
    const std::vector<Statement> statements = {
        lens("pinhole cameras, and others whose distortion is 0", "read",
             "PINHOLE 640 480 500 400 320 240"),
        lens("pinhole cameras, and others whose distortion is 0", "read",
             "OPENCV 640 480 500 400 320 240 0 0 0 0"),
        {"poses of images",
         "read",
         "images.bin",
         colmapImagesBinary(),
         {{"cameras.bin", colmapCamerasBinary()}}},
        {"quaternions that are not of length 1", "read", "images.txt",
         "1 2 0 0 0 0 0 0 3 a.png\n\n", pinhole},
        {"points that images observe, points of the scene, rigs, frames", "read", "images.txt",
         "1 1 0 0 0 0 0 0 3 a.png\n10.5 20 -1\n", pinhole},
        lens("lens distortion, fisheye and spherical lenses", "refused",
             "SIMPLE_RADIAL 640 480 500 320 240 0.01"),
        lens("lens distortion, fisheye and spherical lenses", "refused",
             "OPENCV_FISHEYE 640 480 500 400 320 240 0 0 0 0"),
        {"images without the line of points below them", "refused", "images.txt",
         "1 1 0 0 0 0 0 0 3 a.png\n2 1 0 0 0 0 0 0 3 b.png\n", pinhole},
        {"more numbers than a camera has",
         "refused",
         "images.txt",
         kColmapImagesText,
         {{"cameras.txt", colmapCamerasText("PINHOLE 640 480 500 400 320 240 7")}}},
    };
    expectStatements("COLMAP", statements, cameraWarnings);
}

struct NamedMatrix {
    const char* name;
    std::vector<double> numbers;  ///< 9 or 12, of 3 rows
};

std::string npzOf(const std::vector<NamedMatrix>& matrices) {
    const ScratchDir scratch;
    const std::string path = scratch / "a.npz";
    std::vector<NamedArray> arrays;
    for (const NamedMatrix& matrix : matrices)
        arrays.push_back({matrix.name, NumberType::kDouble, {3, matrix.numbers.size() / 3}});
    ArrayWriter writer(path, arrays);
    for (std::size_t i = 0; i < matrices.size(); ++i)
        writer.append(i, std::as_bytes(std::span(matrices[i].numbers)));
    writer.finish();
    return bytesOf(path);
}

TEST(Statements, OfArraysOfPoses) {
    const std::string poses = npyPoses(kKnownOpencv);
    const NamedMatrix w2c{"w2c", kKnownOpencv};
    const std::vector<double> k = {500, 0, 320, 0, 500, 240, 0, 0, 1};
    const std::vector<double> skew = {500, 1, 320, 0, 500, 240, 0, 0, 1};
    const std::vector<Statement> statements = {
        {"poses, (n, 3, 4) or (n, 4, 4)", "read", "a.npy", poses},
        {"`K` and `size`", "read", "a.npz", npzOf({w2c, {"K", k}})},
        {"any other array of a `.npz`", "warned", "a.npz", npzOf({w2c, {"intrinsics", k}})},
        {"any other array of a `.npz`", "warned", "a.npz", npzOf({w2c, {"c2w", kKnownOpencv}})},
        {"a skew", "refused", "a.npz", npzOf({w2c, {"K", skew}})},
        {"other shapes, and what is no number", "refused", "a.npy",
         npyText("<f8", "(2, 6)", PackedNumbers().add(kKnownOpencv).text)},
        {"other shapes, and what is no number", "refused", "a.npy",
         npyText("|b1", "(1, 3, 4)", std::string(12, '\1'))},
    };
    expectStatements("Arrays of poses", statements, cameraWarnings);
}

TEST(Statements, OfLinesOfCameras) {
    const std::string place = "\"cameraToWorld\": [" + kKnownOpenglRows + "]";
    const std::vector<Statement> statements = {
        {"all keys that there are", "read", "a.jsonl", lineText(place)},
        {"all keys that there are", "read", "a.jsonl",
         R"({"fov": 40, "near": 1, "far": 9, "eye": [0, 0, 1], "target": [0, 0, 0], "up": [0, 1, 0]})"},
        {"anything else", "refused", "a.jsonl", lineText("\"zoom\": 2, " + place)},
    };
    expectStatements("Lines of cameras", statements, cameraWarnings);
}

}  // namespace
}  // namespace peeler::test
