// SPDX-License-Identifier: Apache-2.0
// A COLMAP model as stored in its files, text or binary.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/cameras/camera_file.h"

namespace peeler {

/// A COLMAP camera model (src/colmap/sensor/models.h): number, name and parameters.
struct ColmapLens {
    int id;
    std::string_view name;
    int parameters;
    /// The number of focal lengths among the parameters; the next two are the principal point, from
    /// the upper left pixel's corner, and all others must be 0. 0: never a pinhole.
    int focal_lengths;
};

/// Returns the camera model of this number or name; null for an unknown one.
const ColmapLens* colmapLens(int id);
const ColmapLens* colmapLens(std::string_view name);

struct ColmapCamera {
    Intrinsics intrinsics;  ///< in our convention
    Size size;
};
struct ColmapImage {
    std::uint32_t id = 0, camera = 0;
    std::string name;
    glm::dmat4 camera_to_world{1};  ///< in our convention
};
struct ColmapModel {
    std::map<std::uint32_t, ColmapCamera> cameras;
    std::vector<ColmapImage> images;  ///< by id
};

// colmap_cameras.cpp.

/// Returns the camera with these parameters. Throws Error (kInput) for lens distortion.
ColmapCamera colmapCamera(const ColmapLens& lens, double width, double height,
                          std::span<const double> parameters, const std::string& where);
/// Returns an image's pose (camera to world) from qw, qx, qy, qz, tx, ty, tz (world to camera).
/// Throws Error (kInput).
glm::dmat4 colmapPose(std::span<const double, 7> numbers, const std::string& where);
/// Returns the seven COLMAP pose numbers of a camera's matrix.
std::array<double, 7> colmapNumbers(const glm::dmat4& camera_to_world);

// colmap_text.cpp, colmap_binary.cpp: in `folder`.

/// Throw Error (kInput).
ColmapModel readColmapText(const std::filesystem::path& folder);
ColmapModel readColmapBinary(const std::filesystem::path& folder);

/// The contents of the files cameras, images and points3D. No image has observations.
struct ColmapFiles {
    std::string cameras, images, points;
};
ColmapFiles colmapText(const ColmapModel& model, std::span<const ScenePoint> points);
ColmapFiles colmapBinary(const ColmapModel& model, std::span<const ScenePoint> points);

}  // namespace peeler
