// SPDX-License-Identifier: Apache-2.0
// The KHR_materials extensions of a glTF material.
#pragma once

#include <tiny_gltf.h>

#include <functional>
#include <string>

#include "core/scene/material.h"

namespace peeler {

struct GltfDocument;
struct GltfOptions;

/// Turns a texture reference of the file into the scene's; `where` is its JSON pointer.
using ReadTexture = std::function<TextureRef(const tinygltf::TextureInfo&, const std::string&)>;

/// A member of an object, or null. The schema check has seen its type.
const tinygltf::Value* findMember(const tinygltf::Value& object, const char* name);
const tinygltf::Value* findExtension(const tinygltf::ExtensionMap& extensions, const char* name);

/// Adds what the material's extensions say. Numbers outside the range of their extension are
/// clamped with a warning. Of an unlit material nothing is read that changes what it looks
/// like: KHR_materials_unlit goes with no such other. `where` is the material's JSON pointer.
void readMaterialExtensions(const tinygltf::Material& source, const std::string& where,
                            const GltfOptions& options, GltfDocument& document,
                            const ReadTexture& read_texture, Material& material);

}  // namespace peeler
