// SPDX-License-Identifier: Apache-2.0
// Reader of glTF 2.0 (.gltf and .glb).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <peeler/gltf_options.h>
#include <peeler/scene.h>

namespace peeler {

/// Reads the scene; JSON or binary is recognised by content. Coordinates stay those of the file
/// (right-handed, +Y up, metres: glTF 2.0 §3.4). Every index, range and type is checked before use.
/// Unsupported optional extensions become one sentence each in Scene::warnings. Throws Error
/// (kInput): `where` is the path if the whole file is bad, else a JSON pointer.
Scene readGltf(const std::filesystem::path& path, const GltfOptions& options = {});

/// A known glTF extension.
struct GltfExtension {
    const char* name;
    bool supported;                 ///< allowed in extensionsRequired
    const char* note;               ///< supported: its purpose; else: the effect of ignoring it
    bool undecoded_images = false;  ///< provides texture images in a format that is not decoded
};

/// Returns the known extensions, sorted by name.
const std::vector<GltfExtension>& gltfExtensions();

/// Returns the known extensions allowed in extensionsRequired, sorted by name.
const std::vector<GltfExtension>& supportedGltfExtensions();

/// Returns the names of extensions that provide texture images in undecoded formats. Without them a
/// scene keeps its geometry but lacks colours.
std::vector<std::string> undecodedImageExtensions();

}  // namespace peeler
