// SPDX-License-Identifier: Apache-2.0
// Camera files of peeler and of other programs: readers and writers of views.
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

/// An object of the scene as placed in one view (BOP): its id, and the matrix from object to world,
/// both in metres.
struct PlacedObject {
    int id = 0;
    glm::dmat4 to_world{1};
};

/// One camera of a file. The caller replaces missing values.
struct FileCamera {
    std::string name;     ///< name of the picture without folder and extension, else the index
    std::string picture;  ///< file name of the picture as stored in the file; "" = not stored
    /// In glTF's axes: the camera looks along −Z, with +Y up. distanceFromRigid() is below 1e-4.
    glm::dmat4 camera_to_world{1};
    std::optional<Intrinsics> intrinsics;
    /// A lens other than a pinhole; only if CameraFileOptions::lenses. Lenses whose pictures show
    /// all directions have no intrinsics.
    std::optional<Lens> lens;
    std::optional<double> fov, ortho_height;  ///< used instead of intrinsics, as in CameraChoice
    /// Metres; only in JSON lines and in transforms.json written by peeler.
    std::optional<double> near, far;
    Size size{0, 0};  ///< {0, 0} if unknown
    std::vector<PlacedObject> objects;
};

/// The directions and axes of poses.
enum class CameraConvention {
    kOpencv,   ///< world to camera; the camera looks along +Z, with +Y down
    kOpengl,   ///< camera to world; the camera looks along −Z, with +Y up
    kBlender,  ///< as kOpengl, but in a world with +Z up: (x, y, z) becomes (x, z, −y)
};

struct CameraConventionInfo {
    std::string_view name, summary;
};
/// Returns the names and summaries of the conventions, in the order of the enumeration.
std::span<const CameraConventionInfo> cameraConventions();
CameraConvention cameraConvention(const std::string& name);

struct CameraFileOptions {
    /// The convention of the file's poses, required for arrays of poses. Every other format has its
    /// own convention, and accepts only this convention or kBlender. kBlender then turns only the
    /// file's world; the camera axes stay as the format defines them.
    std::optional<CameraConvention> convention{};
    Size size{0, 0};      ///< size of the pictures if the file has none
    bool lenses = false;  ///< whether the caller takes lenses; if not, they are refused
};

/// Reads the views of a camera file, in the order of the file, or by picture number (BOP, COLMAP).
/// Recognises the format by name and content: transforms.json (nerfstudio, instant-ngp); BOP's
/// scene_camera.json with the files beside it; a COLMAP folder, text or binary, or one of its
/// files; .npy and .npz; and peeler's own .jsonl. formats/README.md, "Cameras", has the conventions
/// and the keys read from each format. Warns about everything else in the file.
///
/// Throws Error (kInput), with the place (JSON pointer, line, byte), if the file is missing, larger
/// than kMostCameraBytes, damaged or has more than kMostViews views, or if it has numbers that are
/// not finite, poses that are not rigid, skew or, unless options.lenses, lens distortion. Throws
/// Error (kUsage) if a required convention is missing, or if the options' convention contradicts
/// that of the format.
std::vector<FileCamera> readCameras(const std::filesystem::path& path,
                                    const CameraFileOptions& options, ReadWarnings& warnings);

/// Returns a view's camera as stored in files: pose, intrinsics and size of the crop, near and far.
/// For an orthographic view, `ortho_height` is the height of the crop. cameraChoice() converts the
/// returned camera to a view with the same rays. Storing and reading the converted view again gives
/// an identical view, bit by bit.
FileCamera fileCamera(const View& view, std::string name);

/// Returns the camera choice for a camera from a file: pose, intrinsics or field of view, near, far
/// and size. Missing values stay as in `choice`. Throws Error (kUsage) if the file gives intrinsics
/// but no size.
CameraChoice cameraChoice(const FileCamera& camera, CameraChoice choice = {});

/// A point of a scene, for COLMAP's points3D.
struct ScenePoint {
    glm::dvec3 position;  ///< in world space
    std::array<std::uint8_t, 3> rgb{};
};

struct CameraOutputOptions {
    std::span<const ScenePoint> points{};  ///< stored only by COLMAP
    double depth_scale = 1;                ///< BOP: millimetres per unit of the depth pictures
};

/// Whether the format chosen by the path's file name can store points. Throws like
/// checkCameraOutput().
bool holdsScenePoints(const std::string& path);

/// Throws Error (kUsage) if no format accepts the path. Valid paths are `transforms.json` and other
/// .json, `scene_camera….json`, a folder (an existing one, a name without extension, or one with a
/// trailing slash), and `cameras.bin` or `cameras.txt` in a folder.
void checkCameraOutput(const std::string& path);

/// Returns the files that are read or written for a path: all files of a COLMAP model; BOP's
/// scene_camera with camera and scene_gt beside it; or the file itself.
std::vector<std::filesystem::path> cameraFiles(const std::filesystem::path& path);

/// Writes cameras in the format chosen by the path. Publishes either all files of the format, or
/// none. Throws Error (kUsage) if checkCameraOutput() refuses the path, if there are no cameras, if
/// a camera is orthographic or has no size, if the format cannot store a name, or if sizes differ
/// in BOP. Throws Error (kOutput) if writing fails.
void writeCameras(const std::string& path, std::span<const FileCamera> cameras,
                  const CameraOutputOptions& options = {});

}  // namespace peeler
