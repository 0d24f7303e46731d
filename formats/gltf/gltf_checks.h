// SPDX-License-Identifier: Apache-2.0
// What glTF 2.0 demands beyond types and indices: versions, extensions, the node forest, cameras.
#pragma once

#include <tiny_gltf.h>

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace peeler {

/// The file must be a glTF 2.x that 2.0 readers may read. `path` is for errors about the whole
/// file.
void checkGltfVersion(const nlohmann::json& gltf, const std::string& path);

/// Everything in extensionsRequired must be supported.
void checkRequiredExtensions(const nlohmann::json& gltf);

/// Nodes form a forest, scenes list roots, far planes lie behind near planes, the field of view is
/// one. Indices must have been checked (checkGltfSchema).
/// All three throw Error(kInput) with a JSON pointer.
void checkGltfModel(const tinygltf::Model& model);

}  // namespace peeler
