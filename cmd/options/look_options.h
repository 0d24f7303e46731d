// SPDX-License-Identifier: Apache-2.0
// What makes a scene look otherwise than its file says: variants, transmission, an environment.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "core/scene/scene.h"
#include "formats/gltf/gltf_reader.h"

namespace peeler::cmd {

class VerbOptions;

struct LookOptions {
    std::optional<std::string> variant;  ///< name or index
    bool transmission = true;            ///< light passes through what the file says
    std::optional<std::filesystem::path> environment;
    std::optional<double> environment_rotation;  ///< degrees
};

/// Declares --variant alone.
void addVariantOption(VerbOptions& verb, LookOptions& look);
/// Declares --variant, --transmission, --environment and --environment-rotation.
void addLookOptions(VerbOptions& verb, LookOptions& look);
/// Declares those that can change what is baked: --variant, --environment and
/// --environment-rotation.
void addBakedLookOptions(VerbOptions& verb, LookOptions& look);

/// Throws Error (kUsage) for a rotation of no environment.
void checkLookOptions(const LookOptions& look);

/// Reads the scene as the options want it: its materials of the variant, its environment from the
/// file. `shadows` asks for a warning where nothing can cast them. Throws Error (kUsage) for an
/// unknown variant, with the list, and what readGltf and readEnvironment throw.
Scene loadScene(const std::filesystem::path& path, GltfOptions gltf, const LookOptions& look,
                bool shadows);

/// Index of the variant that was chosen. Throws Error (kUsage) for an unknown one, with the list.
std::optional<std::size_t> chosenVariant(const Scene& scene, const LookOptions& look);

/// What of it changes pixels, for the settings' hash; an empty object if nothing was asked for.
nlohmann::json lookSettings(const LookOptions& look, const Scene& scene);

}  // namespace peeler::cmd
