// SPDX-License-Identifier: Apache-2.0
// Reads the file of a scene, whatever its format: glTF, PLY, STL, OBJ, arrays.
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

/// A format of scenes, a row of their table.
struct SceneFormat {
    const char* name;                              ///< "STL"
    std::span<const std::string_view> extensions;  ///< of its files, with their dots
    /// Whether a file of so many bytes that begins with these is one.
    bool (*recognises)(std::string_view begin, std::uint64_t size);
    Scene (*read)(const std::filesystem::path& path, const SceneReadOptions& options);
    /// Files with its extensions are often something else: only the content says that one is a
    /// scene.
    bool by_content = false;
};

/// All formats, in the order in which a file is tried.
std::span<const SceneFormat> sceneFormats();

/// The extensions of all formats with blanks between: ".gltf .glb .npz .safetensors .ply .stl
/// .obj"; or only of those for which isSceneName() can be true.
std::string sceneExtensions(bool by_name = false);
/// Whether the name ends like one of a scene and of nothing else.
bool isSceneName(const std::filesystem::path& path);

/// The format of a file by its content; null if it is none. Throws Error (kInput) if the file
/// cannot be read.
const SceneFormat* sceneFormatOf(const std::filesystem::path& path);

/// What the format of a file does not say, as it is understood.
struct Assumed {
    const char* format = "";
    Axis up = Axis::kY;  ///< the axis of the file that is +Y of the scene
    double metres_per_unit = 1;
};
/// Nothing of a format that says all of it, as glTF does.
std::optional<Assumed> assumedOf(const std::filesystem::path& path,
                                 const SceneReadOptions& options);

/// Reads the scene. A file whose content says nothing is taken for what its name says, so that its
/// reader tells what is wrong with it. PLY, STL and OBJ become triangles, lines or points in the
/// file's order: a polygon of n corners is n − 2 triangles in a row, nothing is welded but corners
/// with the same bits, and nothing is left out. Coordinates are 32-bit floats, as they stand; `up`
/// and `metres_per_unit` turn and scale the nodes. Throws Error (kInput): `where` is a JSON pointer
/// into a glTF, "part.obj:12" (a line), "part.stl, byte 84", or the path.
Scene readSceneFile(const std::filesystem::path& path, const SceneReadOptions& options = {});

}  // namespace peeler
