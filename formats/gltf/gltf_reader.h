// SPDX-License-Identifier: Apache-2.0
// Reader of glTF 2.0 (.gltf and .glb).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <peeler/gltf_options.h>
#include <peeler/scene.h>

namespace peeler {

/// Reads the scene. The file's content determines whether it is JSON or binary. Coordinates stay as
/// in the file (right-handed, +Y up, metres: glTF 2.0 §3.4). Checks every index, range and type
/// before use. For each unsupported optional extension, adds a sentence to Scene::warnings. Throws
/// Error (kInput) with the path as `where` if the file as a whole is bad, else with a JSON pointer.
Scene readGltf(const std::filesystem::path& path, const GltfOptions& options = {});

/// A known glTF extension.
struct GltfExtension {
    const char* name;
    bool supported;  ///< whether extensionsRequired may list the extension
    /// The purpose of a supported extension, or the effect of ignoring the extension.
    const char* note;
    /// Whether the extension provides texture images in a format that cannot be decoded.
    bool undecoded_images = false;
};

/// Returns the known extensions, sorted by name.
const std::vector<GltfExtension>& gltfExtensions();

/// Returns the known extensions that extensionsRequired may list, sorted by name.
const std::vector<GltfExtension>& supportedGltfExtensions();

/// Returns the names of extensions that provide texture images in formats that cannot be decoded. A
/// scene read without these extensions keeps its geometry but lacks colours.
std::vector<std::string> undecodedImageExtensions();

}  // namespace peeler
