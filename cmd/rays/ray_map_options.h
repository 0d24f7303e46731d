// SPDX-License-Identifier: Apache-2.0
// The options of maps of rays.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <peeler/scene.h>
#include "core/rays/ray_maps.h"
#include "formats/rays/ray_output.h"

namespace peeler::cmd {

class VerbOptions;

/// Which maps of rays, and what they need to know.
struct RayMapFlags {
    std::vector<RayMap> maps;  ///< none: hits are written
    /// Of materials, per scene unit, by a glob of their names or an index.
    std::vector<std::pair<std::string, double>> attenuation;
    std::vector<std::string> parts;  ///< globs of node names
    std::optional<std::pair<double, double>> range;
    bool legend = true;
};

/// Declares --map, --attenuation, --part and --range. `flags` must outlive the parse.
void addRayMapOptions(VerbOptions& verb, RayMapFlags& flags);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkRayMapFlags(const RayMapFlags& flags);

/// What the maps need, of this scene. Throws Error (kUsage) for a material or a node that the scene
/// does not have.
RayMapOptions rayMapOptions(const RayMapFlags& flags, const Scene& scene);

}  // namespace peeler::cmd
