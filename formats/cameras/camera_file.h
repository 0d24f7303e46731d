// SPDX-License-Identifier: Apache-2.0
// Files of cameras of other programs, and of our own: read as views, and written of views.
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

/// The most views that are taken from a file, and the most bytes that a file of cameras may have.
inline constexpr std::uint64_t kMostViews = 1'000'000;
inline constexpr std::uint64_t kMostCameraBytes = std::uint64_t{1} << 30;

/// An object of the scene where a view has it (BOP): its id, and its matrix, object to world, in
/// metres on both sides.
struct PlacedObject {
    int id = 0;
    glm::dmat4 to_world{1};
};

/// One view of a file of cameras. What is not there is for the caller to choose.
struct FileCamera {
    std::string name;     ///< of its picture without folder and extension, else its number
    std::string picture;  ///< the file of its picture, as the file names it; "" if it names none
    /// glTF's axes: it looks along −Z, +Y up. Rigid to 1e-4 (distanceFromRigid()).
    glm::dmat4 camera_to_world{1};
    std::optional<Intrinsics> intrinsics;
    std::optional<double> fov, ortho_height;  ///< in place of intrinsics, as of CameraChoice
    std::optional<double> near, far;          ///< metres; JSON lines and our own transforms.json
    Size size{0, 0};                          ///< {0, 0}: not known
    std::vector<PlacedObject> objects;
};

/// What a file of cameras does not say of its axes.
enum class CameraConvention {
    kOpencv,   ///< world to camera, which looks along +Z, +Y down
    kOpengl,   ///< camera to world, which looks along −Z, +Y up
    kBlender,  ///< likewise, and +Z is up in the world: it is turned, (x, y, z) to (x, z, −y)
};

struct CameraConventionInfo {
    std::string_view name, summary;
};
/// "opencv", "opengl", "blender", in the order of the enumeration.
std::span<const CameraConventionInfo> cameraConventions();
/// The convention of a name. Throws Error (kUsage) with the list.
CameraConvention cameraConvention(const std::string& name);

struct CameraFileOptions {
    /// Arrays of poses need one. Other formats have their own, and may be told of it; with kBlender
    /// their world is turned, and their cameras are what the format has.
    std::optional<CameraConvention> convention{};
    Size size{0, 0};  ///< of pictures where the file does not say
};

/// The views of a file of cameras, told apart by its name and by what is in it: transforms.json
/// (nerfstudio, instant-ngp), BOP's scene_camera.json with what stands beside it, a folder of
/// COLMAP's, text or binary, or a file of it, .npy and .npz, and .jsonl of our own, in the order of
/// the file, or of the numbers that pictures have (BOP, COLMAP). formats/README.md, "Cameras", has
/// the conventions and what is read of each. Anything else that a file says is a warning.
///
/// Throws Error (kInput) for a file that is missing, larger than kMostCameraBytes, damaged or has
/// more than kMostViews; for numbers that are not finite; for poses that are not rigid, skew and
/// lens distortion, with the place (JSON pointer, line, byte); (kUsage) for a convention that is
/// missing or is not the format's.
std::vector<FileCamera> readCameras(const std::filesystem::path& path,
                                    const CameraFileOptions& options, ReadWarnings& warnings);

/// The camera of a view as a file has it: pose, intrinsics and size of its crop, near and far. An
/// orthographic view has `ortho_height` of its crop. The camera's choice makes a view of the same
/// rays, and from then on the same view to the last bit.
FileCamera fileCamera(const View& view, std::string name);

/// The choice of a camera from a file: pose, intrinsics or field of view, near, far and size. A
/// size that is not known stays as `choice` has it. Throws Error (kUsage) if it is not known and
/// there are intrinsics.
CameraChoice cameraChoice(const FileCamera& camera, CameraChoice choice = {});

/// A point of a scene, for COLMAP's points3D.
struct ScenePoint {
    glm::dvec3 position;  ///< world space
    std::array<std::uint8_t, 3> rgb{};
};

struct CameraOutputOptions {
    std::span<const ScenePoint> points{};  ///< COLMAP; others have no place for them
    double depth_scale = 1;  ///< BOP: what a number in its depth pictures is, millimetres
};

/// Whether the format of such a name has a place for points. Throws like checkCameraOutput().
bool holdsScenePoints(const std::string& path);

/// Throws Error (kUsage) if no format that is written has files of such a name: `transforms.json`
/// and other .json, `scene_camera….json`, a folder (one that is there, a name without extension, or
/// with a slash behind it), or `cameras.bin` and `cameras.txt` in one.
void checkCameraOutput(const std::string& path);

/// The files that a name stands for, read or written: all of a model of COLMAP's, and BOP's camera
/// and objects beside the file of this name.
std::vector<std::filesystem::path> cameraFiles(const std::filesystem::path& path);

/// Writes cameras in the format of such a name; all files of a format appear, or none. Throws Error
/// (kUsage) for a name as checkCameraOutput() does, for no cameras, orthographic ones and ones
/// without a size, for names that the format cannot hold, and of BOP for sizes that differ;
/// (kOutput).
void writeCameras(const std::string& path, std::span<const FileCamera> cameras,
                  const CameraOutputOptions& options = {});

}  // namespace peeler
