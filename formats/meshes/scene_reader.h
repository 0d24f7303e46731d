// SPDX-License-Identifier: Apache-2.0
// Reader of scene files of all formats: glTF, PLY, STL, OBJ, arrays.
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

/// A scene format, a row of the format table.
struct SceneFormat {
    const char* name;                              ///< "STL"
    std::span<const std::string_view> extensions;  ///< with their dots
    /// Whether a file of this size that begins with these bytes has this format.
    bool (*recognises)(std::string_view begin, std::uint64_t size);
    Scene (*read)(const std::filesystem::path& path, const SceneReadOptions& options);
    /// Its extensions are ambiguous, so only the content identifies a scene.
    bool by_content = false;
};

/// Returns all formats, in the order in which they are tried.
std::span<const SceneFormat> sceneFormats();

/// Returns the extensions of all formats, separated by blanks: ".gltf .glb .npz .safetensors .ply
/// .stl .obj"; with `by_name` only those for which isSceneName() can be true.
std::string sceneExtensions(bool by_name = false);
/// Whether the name has an extension used only by scenes.
bool isSceneName(const std::filesystem::path& path);

/// Returns the format of a file by its content; null if there is none. Throws Error (kInput) if the
/// file cannot be read.
const SceneFormat* sceneFormatOf(const std::filesystem::path& path);

/// Assumptions about properties that a format leaves undefined.
struct Assumed {
    const char* format = "";
    Axis up = Axis::kY;  ///< the axis of the file that is +Y of the scene
    double metres_per_unit = 1;
};
/// Returns the assumptions for a file; nothing if its format defines everything, as glTF does.
std::optional<Assumed> assumedOf(const std::filesystem::path& path,
                                 const SceneReadOptions& options);

/// Reads the scene. A file not recognised by content is read by its name's format, whose reader
/// then reports the problem. PLY, STL and OBJ become triangles, lines or points in file order: a
/// polygon of n corners becomes n − 2 consecutive triangles, only bit-identical corners are welded,
/// and nothing is dropped. Coordinates are 32-bit floats, unchanged; `up` and `metres_per_unit`
/// rotate and scale the nodes. Throws Error (kInput): `where` is a JSON pointer into a glTF,
/// "part.obj:12" (a line), "part.stl, byte 84", or the path.
Scene readSceneFile(const std::filesystem::path& path, const SceneReadOptions& options = {});

}  // namespace peeler
