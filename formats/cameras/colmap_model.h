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

/// A COLMAP camera model (src/colmap/sensor/models.h): its number, name and parameters.
struct ColmapLens {
    int id;
    std::string_view name;
    int parameters;
    /// The number of focal lengths, which are the first parameters. The next two parameters are the
    /// principal point, measured from the corner of the upper left pixel. All further parameters
    /// are the coefficients of the lens model with this name (findLensModel()) or, if there is no
    /// such model, must be 0. With focal_lengths = 0, the model has none of these.
    int focal_lengths;
};

/// Returns the camera model with this number or name, or null if it is unknown.
const ColmapLens* colmapLens(int id);
const ColmapLens* colmapLens(std::string_view name);

struct ColmapCamera {
    std::optional<Intrinsics> intrinsics;  ///< in peeler's pixel coordinates
    Size size;
    std::optional<Lens> lens{};
};
struct ColmapImage {
    std::uint32_t id = 0, camera = 0;
    std::string name;
    glm::dmat4 camera_to_world{1};  ///< in glTF's axes
};
struct ColmapModel {
    std::map<std::uint32_t, ColmapCamera> cameras;
    std::vector<ColmapImage> images;  ///< sorted by id
};

// Defined in colmap_cameras.cpp.

/// Returns the camera with these parameters. Throws Error (kInput) if its model is not known to
/// findLensModel(), or like checkedLens().
ColmapCamera colmapCamera(const ColmapLens& lens, double width, double height,
                          std::span<const double> parameters, const CameraFileOptions& options,
                          const std::string& where);
/// The row and the parameters of a camera.
struct ColmapParameters {
    const ColmapLens* lens;  ///< null if COLMAP has no such lens
    std::vector<double> numbers;
};
/// Inverts colmapCamera().
ColmapParameters colmapParameters(const ColmapCamera& camera);
/// Returns the pose (camera to world) for an image's qw, qx, qy, qz, tx, ty, tz (world to camera).
/// Throws Error (kInput).
glm::dmat4 colmapPose(std::span<const double, 7> numbers, const std::string& where);
/// Returns COLMAP's seven pose numbers for a camera-to-world matrix.
std::array<double, 7> colmapNumbers(const glm::dmat4& camera_to_world);

// Defined in colmap_text.cpp and colmap_binary.cpp. The readers read the files in `folder` and
// throw Error (kInput).

ColmapModel readColmapText(const std::filesystem::path& folder, const CameraFileOptions& options);
ColmapModel readColmapBinary(const std::filesystem::path& folder, const CameraFileOptions& options);

/// The contents of the files cameras, images and points3D. The images have no observations.
struct ColmapFiles {
    std::string cameras, images, points;
};
ColmapFiles colmapText(const ColmapModel& model, std::span<const ScenePoint> points);
ColmapFiles colmapBinary(const ColmapModel& model, std::span<const ScenePoint> points);

}  // namespace peeler
