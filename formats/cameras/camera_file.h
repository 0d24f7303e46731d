// SPDX-License-Identifier: Apache-2.0
// Camera files of other programs and our own, read as views and written from views.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/camera_choice.h>
#include "formats/file/read_warnings.h"

namespace peeler {

/// The maximum number of views in a camera file, and its maximum size in bytes.
inline constexpr std::uint64_t kMostViews = 1'000'000;
inline constexpr std::uint64_t kMostCameraBytes = std::uint64_t{1} << 30;

/// An object of the scene as placed in a view (BOP): its id, and its matrix, object to world, in
/// metres on both sides.
struct PlacedObject {
    int id = 0;
    glm::dmat4 to_world{1};
};

/// One view of a camera file. The caller chooses any missing values.
struct FileCamera {
    std::string name;     ///< its picture's, without folder and extension, else its number
    std::string picture;  ///< its picture's file as named in the file; "" if unnamed
    /// glTF's axes: it looks along −Z, +Y up. Rigid to 1e-4 (distanceFromRigid()).
    glm::dmat4 camera_to_world{1};
    std::optional<Intrinsics> intrinsics;
    std::optional<double> fov, ortho_height;  ///< instead of intrinsics, as in CameraChoice
    std::optional<double> near, far;          ///< metres; JSON lines and our own transforms.json
    Size size{0, 0};                          ///< {0, 0}: unknown
    std::vector<PlacedObject> objects;
};

/// The axes of poses, for files that do not define them.
enum class CameraConvention {
    kOpencv,   ///< world to camera, which looks along +Z, +Y down
    kOpengl,   ///< camera to world, which looks along −Z, +Y up
    kBlender,  ///< as kOpengl, with +Z up in the world, which is turned: (x, y, z) to (x, z, −y)
};

struct CameraConventionInfo {
    std::string_view name, summary;
};
/// Returns "opencv", "opengl", "blender", in the order of the enumeration.
std::span<const CameraConventionInfo> cameraConventions();
/// Returns the convention with this name. Throws Error (kUsage) with the list for an unknown name.
CameraConvention cameraConvention(const std::string& name);

struct CameraFileOptions {
    /// Required for arrays of poses. Other formats have their own, which may be named here; with
    /// kBlender their world is turned, and their camera axes stay those of the format.
    std::optional<CameraConvention> convention{};
    Size size{0, 0};  ///< of pictures, if the file does not define it
};

/// Reads the views of a camera file, in the order of the file, or by picture number (BOP, COLMAP).
/// Distinguishes formats by name and content: transforms.json (nerfstudio, instant-ngp), BOP's
/// scene_camera.json with the files beside it, a COLMAP folder, text or binary, or one of its
/// files, .npy and .npz, and our own .jsonl. formats/README.md, "Cameras", has the conventions and
/// the keys read from each format. Warns of anything else in the file.
///
/// Throws Error (kInput) for a file that is missing, larger than kMostCameraBytes, damaged or has
/// more than kMostViews; for numbers that are not finite; for poses that are not rigid, skew and
/// lens distortion, with the place (JSON pointer, line, byte); (kUsage) for a convention that is
/// missing or is not the format's.
std::vector<FileCamera> readCameras(const std::filesystem::path& path,
                                    const CameraFileOptions& options, ReadWarnings& warnings);

/// Returns a view's camera for a file: pose, intrinsics and size of its crop, near and far. An
/// orthographic view has the `ortho_height` of its crop. cameraChoice() of the result makes a view
/// with the same rays, and from then on bitwise the same view.
FileCamera fileCamera(const View& view, std::string name);

/// Returns the camera choice for a camera from a file: pose, intrinsics or field of view, near, far
/// and size. An unknown size stays as in `choice`. Throws Error (kUsage) if it is unknown and there
/// are intrinsics.
CameraChoice cameraChoice(const FileCamera& camera, CameraChoice choice = {});

/// A point of a scene, for COLMAP's points3D.
struct ScenePoint {
    glm::dvec3 position;  ///< world space
    std::array<std::uint8_t, 3> rgb{};
};

struct CameraOutputOptions {
    std::span<const ScenePoint> points{};  ///< COLMAP only
    double depth_scale = 1;                ///< BOP: millimetres per unit of its depth pictures
};

/// Whether the format of this name can hold points. Throws like checkCameraOutput().
bool holdsScenePoints(const std::string& path);

/// Throws Error (kUsage) if no format writes files of this name: `transforms.json` and other .json,
/// `scene_camera….json`, a folder (an existing one, a name without extension, or with a trailing
/// slash), or `cameras.bin` and `cameras.txt` in one.
void checkCameraOutput(const std::string& path);

/// Returns the files of a name, read or written: all files of a COLMAP model, and BOP's camera and
/// objects beside the file of this name.
std::vector<std::filesystem::path> cameraFiles(const std::filesystem::path& path);

/// Writes cameras in the format of this name; all files of a format are published, or none. Throws
/// Error (kUsage) for a name that checkCameraOutput() refuses, for an empty list, orthographic
/// cameras and cameras without a size, for names that the format cannot hold, and, for BOP, for
/// sizes that differ; (kOutput).
void writeCameras(const std::string& path, std::span<const FileCamera> cameras,
                  const CameraOutputOptions& options = {});

}  // namespace peeler
