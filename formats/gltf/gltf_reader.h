// SPDX-License-Identifier: Apache-2.0
// Reads glTF 2.0 (.gltf and .glb) into a Scene.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <peeler/gltf_options.h>
#include <peeler/scene.h>

namespace peeler {

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

}  // namespace peeler
