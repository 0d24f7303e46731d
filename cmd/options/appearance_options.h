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

struct AppearanceOptions {
    std::optional<std::string> variant;  ///< name or index
    bool transmission = true;            ///< light passes through what the file says
    std::optional<std::filesystem::path> environment;
    std::optional<double> environment_rotation;  ///< degrees
};

/// Declares --variant alone.
void addVariantOption(VerbOptions& verb, AppearanceOptions& appearance);
/// Declares --variant, --transmission, --environment and --environment-rotation.
void addAppearanceOptions(VerbOptions& verb, AppearanceOptions& appearance);
/// Declares those that can change what is baked: --variant, --environment and
/// --environment-rotation.
void addBakedAppearanceOptions(VerbOptions& verb, AppearanceOptions& appearance);

/// Throws Error (kUsage) for a rotation of no environment.
void checkAppearanceOptions(const AppearanceOptions& appearance);

/// Reads the scene as the options want it: its materials of the variant, its environment from the
/// file. `shadows` asks for a warning where nothing can cast them. Throws Error (kUsage) for an
/// unknown variant, with the list, and what readGltf and readEnvironment throw.
Scene loadScene(const std::filesystem::path& path, GltfOptions gltf,
                const AppearanceOptions& appearance, bool shadows);

/// Index of the variant that was chosen. Throws Error (kUsage) for an unknown one, with the list.
std::optional<std::size_t> chosenVariant(const Scene& scene, const AppearanceOptions& appearance);

/// What of it changes pixels, for the settings' hash; an empty object if nothing was asked for.
nlohmann::json appearanceSettings(const AppearanceOptions& appearance, const Scene& scene);

}  // namespace peeler::cmd
