// SPDX-License-Identifier: Apache-2.0
// Options for ray maps.
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

/// The requested ray maps and their parameters.
struct RayMapFlags {
    std::vector<RayMap> maps;  ///< empty = write hits instead of maps
    /// Attenuation per scene unit, for materials given by name glob or index.
    std::vector<std::pair<std::string, double>> attenuation;
    std::vector<std::string> parts;  ///< globs of node names, which define the parts
    std::optional<std::pair<double, double>> range;
    bool legend = true;
};

/// Declares --map, --attenuation, --part, --range and --legend. `flags` must outlive the parse.
void addRayMapOptions(VerbOptions& verb, RayMapFlags& flags);

/// Throws Error (kUsage) if the flags contradict each other. Does not need the scene.
void checkRayMapFlags(const RayMapFlags& flags);

/// Whether the attenuation of X-rays is needed, but not given.
bool needsAttenuation(const RayMapFlags& flags);
/// Returns the attenuation per scene unit that lets half of the X-rays pass along a path.
double startAttenuation(double path);

/// Returns the map options for a scene. Throws Error (kUsage) if the scene lacks a given material
/// or node.
RayMapOptions rayMapOptions(const RayMapFlags& flags, const Scene& scene);

}  // namespace peeler::cmd
