// SPDX-License-Identifier: Apache-2.0
// Reads glTF 2.0 (.gltf and .glb) into a Scene.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/memory_budget.h"
#include "core/scene/scene.h"

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

struct GltfOptions {
    /// The first warning is an Error instead: whatever the file says is shown, or nothing is. An
    /// uncompressed fallback does not excuse damaged compressed data, nor a WebP or KTX2 image.
    bool strict = false;
    /// URIs may lead out of the scene's folder: absolute paths, "..", symbolic links.
    bool allow_outside = false;
    /// False: KHR_materials_transmission and KHR_materials_volume are left unread, so that every
    /// surface is what its alpha mode says.
    bool transmission = true;
    /// Extensions that the file may require although they are not supported. A texture whose only
    /// image is of such an extension is left out, with a warning.
    std::vector<std::string> ignored_extensions{};
    std::uint64_t max_file_bytes = std::uint64_t{2} << 30;  ///< of the scene and each file it names
    std::uint64_t max_image_bytes = std::uint64_t{1} << 30;  ///< of each image, decoded to RGBA
    /// Of all vertices and indices together, as the scene holds them: many primitives may share the
    /// same bytes of a small file.
    std::uint64_t max_geometry_bytes = std::uint64_t{16} << 30;
    int max_image_dimension = 16384;  ///< width and height, pixels
    /// Reading keeps within it: what would not fit is refused (kMemory) before it is allocated.
    MemoryBudget memory{};

    bool operator==(const GltfOptions&) const = default;
};

/// Reads the scene; whether it is JSON or binary is told by the content. Coordinates stay those of
/// the file (right-handed, +Y up, metres: glTF 2.0 §3.4). Every index, range and type is checked
/// before use. What the file has but we do not evaluate (optional extensions) becomes one sentence
/// each in Scene::warnings. Throws Error(kInput): `where` is the path if the file as a whole is
/// bad, else a JSON pointer.
Scene readGltf(const std::filesystem::path& path, const GltfOptions& options = {});

/// A glTF extension that we know.
struct GltfExtension {
    const char* name;
    bool supported;    ///< may stand in extensionsRequired
    const char* note;  ///< supported: what it is; else: what is lost where it is ignored
    bool undecoded_images = false;  ///< gives textures images in a format that is not decoded
};

/// The known extensions, by name.
const std::vector<GltfExtension>& gltfExtensions();

/// The known extensions that may be required, by name.
const std::vector<GltfExtension>& supportedGltfExtensions();

/// Names of the extensions that give textures images in formats that are not decoded. Without them
/// a scene has its geometry and lacks colours.
std::vector<std::string> undecodedImageExtensions();

}  // namespace peeler::inline v0

#pragma GCC visibility pop
