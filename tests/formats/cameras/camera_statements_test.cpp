// SPDX-License-Identifier: Apache-2.0
// Tests the table for camera files in formats/README.md, "Supported content".
#include <algorithm>
#include <iterator>

#include "cmd/batch/batch_report.h"
#include "formats/arrays/table_writers.h"
#include "formats/cameras/camera_files.h"
#include "formats/file/file_statements.h"

namespace peeler::test {
namespace {

constexpr const char* kCameras = "all of [Cameras](#cameras); zero distortion";
constexpr const char* kCameraPassedOver =
    "ignored: training data (`aabb_scale`, `scale`, `offset`, masks, depth pictures …), transforms "
    "without effect; BOP's `depth_scale`, `view_level`, `mode`, lens in `camera.json`; COLMAP's "
    "points, rigs, frames, length of quaternions except 0";
constexpr const char* kCameraOtherKeys =
    "transforms.json: `applied_transform`, `applied_scale`, `rolling_shutter`, `from_mitsuba`, "
    "`time` (use `--time`), `transform_matrix_start`, `transform_matrix_end`, anything else";
constexpr const char* kCameraOtherContent =
    "BOP: objects of pictures without a camera, anything else; `.npz`: other arrays";
constexpr const char* kCameraNotPinhole =
    "skew, other lenses, also of unused cameras; COLMAP: an "
    "image without its "
    "line of points, too many camera numbers; arrays: other shapes, non-numbers; `.jsonl`: other "
    "keys";

std::vector<Text> cameraWarnings(const std::filesystem::path& file, bool strict) {
    const bool is_array = file.extension() == ".npy" || file.extension() == ".npz";
    CameraFileOptions options{.convention = {}, .size = {640, 480}};
    if (is_array) options.convention = CameraConvention::kOpencv;
    ReadWarnings warnings(strict, file.string());
    readCameras(file, options, warnings);
    return warnings.take();
}

/// Returns a transforms.json with these members added to the file and to its frame.
std::string transformsSaying(const std::string& of_file, const std::string& of_frame = "") {
    return R"({"camera_angle_x": 1, "w": 640, "h": 480, )" + of_file + R"("frames": [{)" +
           of_frame + R"("transform_matrix": [)" + kKnownOpenglRows + ",[0,0,0,1]]}]}";
}

std::vector<Statement> ofTransformsJson() {
    const char* const name = "transforms.json";
    const auto says = [&](const char* what, const char* becomes, const std::string& of_file,
                          const std::string& of_frame = "") {
        return Statement{what, becomes, name, transformsSaying(of_file, of_frame)};
    };
    return {
        {kCameras, "read", name, transformsText()},
        says(kCameras, "read", "", R"("fl_x": 500, "w": 64, "h": 48, "file_path": "a.png", )"),
        says(kCameras, "read", R"("x_fov": 40, )"),
        says(kCameras, "read", R"("camera_angle_y": 1, )"),
        says(kCameras, "read", "", R"("peeler_near": 1, "peeler_far": 2, "peeler_name": "a", )"),
        says(kCameraPassedOver, "read",
             R"("aabb_scale": 16, "scale": 0.33, "offset": [0.5, 0.5, 0.5], )",
             R"("sharpness": 3, "mask_path": "m.png", "rotation": 0.01, )"),
        says(kCameraPassedOver, "read",
             R"("camera_model": "OPENCV", "k1": 0, "applied_scale": 1.0,
                "applied_transform": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]],
                "rolling_shutter": [0, 0, 0], "from_mitsuba": false, )"),
        says(kCameraOtherKeys, "warned",
             R"("applied_transform": [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0]], )"),
        says(kCameraOtherKeys, "warned", R"("applied_scale": 0.5, )"),
        says(kCameraOtherKeys, "warned", R"("rolling_shutter": [0, 0, 0.01], )"),
        says(kCameraOtherKeys, "warned", R"("from_mitsuba": true, )"),
        says(kCameraOtherKeys, "warned", "", R"("time": 0.5, )"),
        says(kCameraOtherKeys, "warned", "",
             R"("transform_matrix_start": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]], )"),
        says(kCameraOtherKeys, "warned", R"("lens_shift": 3, )"),
        says(kCameraOtherKeys, "warned", "", R"("zoom": 3, )"),
        says(kCameraNotPinhole, "refused", R"("k1": 0.1, )"),
        says(kCameraNotPinhole, "refused", "", R"("K": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], )"),
        says(kCameraNotPinhole, "refused", R"("camera_model": "OPENCV_FISHEYE", )"),
        says(kCameraNotPinhole, "refused", R"("is_fisheye": true, )"),
    };
}

std::vector<Statement> ofBop() {
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
    return {
        {kCameras, "read", name, bopText()},
        {kCameraPassedOver, "read", name,
         picture(R"(, "depth_scale": 0.1, "view_level": 0, "mode": 1)")},
        {kCameraPassedOver,
         "read",
         name,
         picture(""),
         {{"camera.json", R"({"width": 64, "height": 48, "fx": 1, "cx": 2, "depth_scale": 1})"}}},
        {kCameras, "read", name, picture(""), objects("7", "")},
        {kCameraOtherContent, "warned", name, picture(""), objects("8", "")},
        {kCameraOtherContent, "warned", name, picture(R"(, "zoom": 2)")},
        {kCameraOtherContent, "warned", name, picture(""), objects("7", R"(, "scale": 2)")},
        {kCameraOtherContent,
         "warned",
         name,
         picture(""),
         {{"camera.json", R"({"width": 64, "height": 48, "k1": 0.1})"}}},
        {kCameraNotPinhole, "refused", name, picture(R"(, "cam_model": {})")},
        {kCameraNotPinhole, "refused", name,
         R"({"7": {"cam_K": [500, 1, 300, 0, 400, 200, 0, 0, 1]}})"},
    };
}

std::vector<Statement> ofColmap() {
    const std::map<std::string, std::string> pinhole = {{"cameras.txt", colmapCamerasText()}};
    const auto lens = [](const char* what, const char* becomes, const std::string& text) {
        return Statement{what,
                         becomes,
                         "images.txt",
                         kColmapImagesText,
                         {{"cameras.txt", colmapCamerasText(text)}}};
    };
    return {
        lens(kCameras, "read", "PINHOLE 640 480 500 400 320 240"),
        lens(kCameras, "read", "OPENCV 640 480 500 400 320 240 0 0 0 0"),
        {kCameras,
         "read",
         "images.bin",
         colmapImagesBinary(),
         {{"cameras.bin", colmapCamerasBinary()}}},
        {kCameraPassedOver, "read", "images.txt", "1 2 0 0 0 0 0 0 3 a.png\n\n", pinhole},
        {kCameraPassedOver, "read", "images.txt", "1 1 0 0 0 0 0 0 3 a.png\n10.5 20 -1\n", pinhole},
        lens(kCameraNotPinhole, "refused", "SIMPLE_RADIAL 640 480 500 320 240 0.01"),
        lens(kCameraNotPinhole, "refused", "OPENCV_FISHEYE 640 480 500 400 320 240 0 0 0 0"),
        {kCameraNotPinhole, "refused", "images.txt",
         "1 1 0 0 0 0 0 0 3 a.png\n2 1 0 0 0 0 0 0 3 b.png\n", pinhole},
        {kCameraNotPinhole,
         "refused",
         "images.txt",
         kColmapImagesText,
         {{"cameras.txt", colmapCamerasText("PINHOLE 640 480 500 400 320 240 7")}}},
    };
}

struct NamedMatrix {
    const char* name;
    std::vector<double> numbers;  ///< 3 x 3 or 3 x 4 numbers
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

std::vector<Statement> ofArraysOfPoses() {
    const std::string poses = npyPoses(kKnownOpencv);
    const NamedMatrix w2c{"w2c", kKnownOpencv};
    const std::vector<double> k = {500, 0, 320, 0, 500, 240, 0, 0, 1};
    const std::vector<double> skew = {500, 1, 320, 0, 500, 240, 0, 0, 1};
    return {
        {kCameras, "read", "a.npy", poses},
        {kCameras, "read", "a.npz", npzOf({w2c, {"K", k}})},
        {kCameraOtherContent, "warned", "a.npz", npzOf({w2c, {"intrinsics", k}})},
        {kCameraOtherContent, "warned", "a.npz", npzOf({w2c, {"c2w", kKnownOpencv}})},
        {kCameraNotPinhole, "refused", "a.npz", npzOf({w2c, {"K", skew}})},
        {kCameraNotPinhole, "refused", "a.npy",
         npyText("<f8", "(2, 6)", PackedNumbers().add(kKnownOpencv).text)},
        {kCameraNotPinhole, "refused", "a.npy", npyText("|b1", "(1, 3, 4)", std::string(12, '\1'))},
    };
}

std::vector<Statement> ofLinesOfCameras() {
    const std::string place = "\"cameraToWorld\": [" + kKnownOpenglRows + "]";
    return {
        {kCameras, "read", "a.jsonl", lineText(place)},
        {kCameras, "read", "a.jsonl",
         R"({"fov": 40, "near": 1, "far": 9, "eye": [0, 0, 1], "target": [0, 0, 0], "up": [0, 1, 0]})"},
        {kCameraNotPinhole, "refused", "a.jsonl", lineText("\"zoom\": 2, " + place)},
    };
}

TEST(Statements, OfCameraFiles) {
    std::vector<Statement> statements;
    for (auto* const group :
         {ofTransformsJson, ofBop, ofColmap, ofArraysOfPoses, ofLinesOfCameras}) {
        std::vector<Statement> more = group();
        std::ranges::move(more, std::back_inserter(statements));
    }
    expectStatements("Camera files", statements, cameraWarnings);
}

}  // namespace
}  // namespace peeler::test
