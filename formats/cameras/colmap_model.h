// SPDX-License-Identifier: Apache-2.0
// A model of COLMAP as its files have it, text or binary.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/cameras/camera_file.h"

namespace peeler {

/// A camera model of COLMAP (src/colmap/sensor/models.h): its number and name, and its parameters.
struct ColmapLens {
    int id;
    std::string_view name;
    int parameters;
    /// How many of them are focal lengths; the next two are the principal point, from the upper
    /// left pixel's corner, and all behind it have to be 0. 0: it is no pinhole even then.
    int focal_lengths;
};

/// Every model; null if there is none of this number or name.
const ColmapLens* colmapLens(int id);
const ColmapLens* colmapLens(std::string_view name);

struct ColmapCamera {
    Intrinsics intrinsics;  ///< of ours
    Size size;
};
struct ColmapImage {
    std::uint32_t id = 0, camera = 0;
    std::string name;
    glm::dmat4 camera_to_world{1};  ///< of ours
};
struct ColmapModel {
    std::map<std::uint32_t, ColmapCamera> cameras;
    std::vector<ColmapImage> images;  ///< by id
};

// colmap_cameras.cpp.

/// A camera of these parameters. Throws Error (kInput) for lens distortion.
ColmapCamera colmapCamera(const ColmapLens& lens, double width, double height,
                          std::span<const double> parameters, const std::string& where);
/// Where an image was taken, of qw, qx, qy, qz, tx, ty, tz: world to camera. Throws Error (kInput).
glm::dmat4 colmapPose(std::span<const double, 7> numbers, const std::string& where);
/// The seven numbers of a camera's matrix.
std::array<double, 7> colmapNumbers(const glm::dmat4& camera_to_world);

// colmap_text.cpp, colmap_binary.cpp: in `folder`.

/// Throw Error (kInput).
ColmapModel readColmapText(const std::filesystem::path& folder);
ColmapModel readColmapBinary(const std::filesystem::path& folder);

/// The contents of cameras, images and points3D. Every image observes nothing.
struct ColmapFiles {
    std::string cameras, images, points;
};
ColmapFiles colmapText(const ColmapModel& model, std::span<const ScenePoint> points);
ColmapFiles colmapBinary(const ColmapModel& model, std::span<const ScenePoint> points);

}  // namespace peeler
