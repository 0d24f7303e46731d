// SPDX-License-Identifier: Apache-2.0
// A known camera, described in every camera file format.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <string>
#include <vector>

#include <peeler/error.h>
#include "cmd/batch/batch_report.h"
#include "core/scene/framing.h"
#include "core/scene/posed_scene.h"
#include "formats/cameras/camera_file.h"
#include "support/test_support.h"

namespace peeler::test {

/// Returns the pose of a camera at (1, 2, 5) that looks along −X, with +Y on its right and +Z up.
/// All numbers, including those of its quaternion, are exact in binary.
inline glm::dmat4 knownPose() {
    return {{0, 1, 0, 0}, {0, 0, 1, 0}, {1, 0, 0, 0}, {1, 2, 5, 1}};
}
/// The known camera's lens: an off-centre principal point in 640 × 480 non-square pixels.
inline constexpr Intrinsics kKnownLens{500, 400, 300.25, 200.5};
inline constexpr Size kKnownSize{640, 480};

// The known camera's world-to-camera matrix in OpenCV's axes. Each row is an axis (right, down,
// forward) and −axis · eye.
inline const std::string kKnownOpencvRows = "[0,1,0,-2],[0,0,-1,5],[-1,0,0,1]";
inline const std::string kKnownOpenglRows = "[0,0,1,1],[1,0,0,2],[0,1,0,5]";
/// The known pose in Blender's axes (+Z up): our (x, y, z) is Blender's (x, −z, y).
inline const std::string kKnownBlenderRows = "[0,0,1,1],[0,-1,0,-5],[1,0,0,2]";

inline std::filesystem::path put(const std::filesystem::path& path, const std::string& text) {
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
    return path;
}

/// The bytes of a binary file, appended number by number in the machine's byte order.
class PackedNumbers {
  public:
    template <class T>
    PackedNumbers& add(T value) {
        text.append(reinterpret_cast<const char*>(&value), sizeof value);
        return *this;
    }
    PackedNumbers& add(const std::vector<double>& values) {
        for (const double value : values)
            add<double>(value);
        return *this;
    }
    std::string text;
};

inline std::string transformsText(const std::string& rows = kKnownOpenglRows) {
    return R"({"fl_x": 500, "fl_y": 400, "cx": 300.75, "cy": 201, "w": 640.0, "h": 480,
        "camera_model": "OPENCV", "k1": 0, "p2": 0.0, "aabb_scale": 16, "frames": [
        {"file_path": "./images/a.b.png", "transform_matrix": [)" +
           rows + ",[0,0,0,1]]}]}";
}

inline std::string bopText() {
    return R"({"7": {"cam_K": [500, 0, 300.25, 0, 400, 200.5, 0, 0, 1], "depth_scale": 0.1,
        "cam_R_w2c": [0, 1, 0, 0, 0, -1, -1, 0, 0], "cam_t_w2c": [-2000, 5000, 1000]}})";
}

inline std::string colmapCamerasText(
    const std::string& lens = "PINHOLE 640 480 500 400 300.75 201") {
    return "# cameras\n\n3 " + lens + "\n";
}
inline const std::string kColmapImagesText =
    "# images\n9 0.5 0.5 0.5 -0.5 -2 5 1 3 folder/a.b.png\n1.5 2.5 -1 3 4 17\n";

inline std::string colmapCamerasBinary() {
    return PackedNumbers()
        .add(std::uint64_t{1})
        .add(std::uint32_t{3})
        .add(std::int32_t{1})
        .add(std::uint64_t{640})
        .add(std::uint64_t{480})
        .add(std::vector<double>{500, 400, 300.75, 201})
        .text;
}
inline std::string colmapImagesBinary() {
    PackedNumbers file;
    file.add(std::uint64_t{1}).add(std::uint32_t{9});
    file.add(std::vector<double>{0.5, 0.5, 0.5, -0.5, -2, 5, 1}).add(std::uint32_t{3});
    file.text += std::string("folder/a.b.png") + '\0';
    return file.add(std::uint64_t{1}).add(1.5).add(2.5).add(std::int64_t{-1}).text;
}

/// Returns a .npy file, version 1.
inline std::string npyText(const std::string& type, const std::string& shape,
                           const std::string& numbers, bool columns = false) {
    std::string header = "{'descr': '" + type +
                         "', 'fortran_order': " + (columns ? "True" : "False") +
                         ", 'shape': " + shape + ", }\n";
    return std::string("\x93NUMPY\x01\0", 8) + static_cast<char>(header.size() & 255U) +
           static_cast<char>(header.size() >> 8U) + header + numbers;
}

inline const std::vector<double> kKnownOpencv = {0, 1, 0, -2, 0, 0, -1, 5, -1, 0, 0, 1};
inline const std::vector<double> kKnownOpengl = {0, 0, 1, 1, 1, 0, 0, 2, 0, 1, 0, 5};
inline const std::vector<double> kKnownBlender = {0, 0, 1, 1, 0, -1, 0, -5, 1, 0, 0, 2};

inline std::string npyPoses(const std::vector<double>& numbers) {
    return npyText("<f8", "(1, 3, 4)", PackedNumbers().add(numbers).text);
}

inline std::string lineText(const std::string& place) {
    return R"({"name": "a", "size": [640, 480], "fx": 500, "fy": 400, "cx": 300.25, "cy": 200.5, )" +
           place + "}\n";
}

/// Returns the cameras of a file. Expects no warnings.
inline std::vector<FileCamera> readCameras(const std::filesystem::path& path,
                                           const CameraFileOptions& options = {}) {
    ReadWarnings warnings(false, path.string());
    std::vector<FileCamera> cameras = peeler::readCameras(path, options, warnings);
    EXPECT_EQ(warnings.sentences(), std::vector<Text>()) << path;
    return cameras;
}

/// Returns the view of a file's camera, for a scene of one triangle.
inline View viewOfCamera(const FileCamera& camera) {
    static const Scene scene = [] {
        Scene made;
        made.scenes = {{"", {0}}};
        made.nodes.resize(1);
        made.nodes[0].mesh = 0;
        made.materials.resize(1);
        Primitive triangle;
        triangle.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
        made.meshes = {{"", {triangle}}};
        return made;
    }();
    const PosedScene posed(scene);
    return makeView(posed, SceneExtent(posed), cameraChoice(camera));
}

/// Expects two views to be bitwise identical, except that 0 equals −0.
inline void expectSameView(const View& a, const View& b, const std::string& which) {
    EXPECT_EQ(a.camera_to_world, b.camera_to_world) << which;
    EXPECT_EQ(a.projection.perspective, b.projection.perspective) << which;
    EXPECT_EQ(a.projection.half_width, b.projection.half_width) << which;
    EXPECT_EQ(a.projection.half_height, b.projection.half_height) << which;
    EXPECT_EQ(a.projection.near, b.projection.near) << which;
    EXPECT_EQ(a.projection.far, b.projection.far) << which;
    EXPECT_EQ(a.width, b.width) << which;
    EXPECT_EQ(a.height, b.height) << which;
    EXPECT_EQ(a.crop, b.crop) << which;
    EXPECT_EQ(a.sample, b.sample) << which;
}

/// Expects an error when reading the file. `what` and `where` are parts of the error's texts.
inline void expectRefusedCameras(const std::filesystem::path& path, const std::string& what,
                                 const std::string& where, const CameraFileOptions& options = {},
                                 ErrorKind kind = ErrorKind::kInput) {
    try {
        readCameras(path, options);
        ADD_FAILURE() << path << " is taken, but expected: " << what;
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), kind) << error.what();
        EXPECT_TRUE(contains(error.what(), what)) << error.what() << ", not " << what;
        EXPECT_TRUE(contains(error.where(), where)) << error.where() << ", not " << where;
    }
}

}  // namespace peeler::test
