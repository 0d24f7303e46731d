// SPDX-License-Identifier: Apache-2.0
// Reader of scene files of all formats: glTF, PLY, STL, OBJ, 3MF, arrays, Gaussian splats.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <peeler/scene.h>
#include <peeler/scene_read_options.h>

namespace peeler {

/// A scene format: a row of the format table.
struct SceneFormat {
    const char* name;                              ///< name of the format, such as "STL"
    std::span<const std::string_view> extensions;  ///< file name extensions with their dots
    /// Whether a file that has this size and begins with these bytes has this format.
    bool (*recognises)(std::string_view begin, std::uint64_t size);
    Scene (*read)(const std::filesystem::path& path, const SceneReadOptions& options);
    /// Whether files that are not scenes have the same extensions, so that only the content
    /// identifies a scene.
    bool by_content = false;
    /// The properties that the format defines, for a message; null if it defines neither up axis
    /// nor unit.
    const char* defines = nullptr;
    bool has_normals = false;  ///< whether smooth_normals does not apply
    bool names_unit = false;   ///< whether each file names its unit
    /// Whether only files with the extensions have the format, since `recognises` is not certain.
    bool by_name = false;
};

/// Returns all formats, in the order in which they are tested.
std::span<const SceneFormat> sceneFormats();

/// Returns the extensions of all formats, separated by blanks: ".gltf .glb .npz .safetensors
/// .ply .stl .obj .3mf .spz .splat". With `by_name`, only those that isSceneName() accepts.
std::string sceneExtensions(bool by_name = false);
/// Whether the file names its unit, as a 3MF does. Throws Error (kInput) if it cannot be read.
bool namesUnit(const std::filesystem::path& path);
/// Whether the name has an extension that only scenes have.
bool isSceneName(const std::filesystem::path& path);

/// Returns the format of a file's content, or null if the content is not a scene. Throws Error
/// (kInput) if the file cannot be read.
const SceneFormat* sceneFormatOf(const std::filesystem::path& path);

/// The assumed values of properties that a file's format leaves undefined.
struct Assumed {
    const char* format = "";
    Axis up = Axis::kY;  ///< the file's axis that becomes +Y of the scene
    double metres_per_unit = 1;
};
/// Returns the assumptions for a file, or nothing if its format defines all these properties, as
/// glTF and 3MF do.
std::optional<Assumed> assumedOf(const std::filesystem::path& path,
                                 const SceneReadOptions& options);

/// Reads the scene. If the content is not recognised, the reader for the file's extension reads the
/// file and reports the problem. PLY, STL and OBJ become triangles, lines or points in file order:
/// a polygon with n corners becomes n − 2 consecutive triangles, only bit-identical corners are
/// welded, and nothing is dropped. Coordinates are 32-bit floats, unchanged; `up` and
/// `metres_per_unit` rotate and scale the nodes instead. Throws Error (kInput) with a JSON pointer
/// into a glTF, "part.obj:12" (a line), "part.stl, byte 84", or the path as `where`.
Scene readSceneFile(const std::filesystem::path& path, const SceneReadOptions& options = {});

}  // namespace peeler
