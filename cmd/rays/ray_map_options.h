// SPDX-License-Identifier: Apache-2.0
// Which maps of rays, and what they need to know.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "formats/rays/ray_output.h"

namespace peeler::cmd {

class VerbOptions;

struct RayMapFlags {
    std::vector<RayMap> maps;  ///< none: hits are written
    std::vector<std::pair<std::string, double>>
        attenuation;                 ///< by material: a glob of names, or an index
    std::vector<std::string> parts;  ///< globs of node names
    std::optional<std::pair<double, double>> range;
};

/// Declares --map, --attenuation, --part and --range. `flags` must outlive the parse.
void addRayMapOptions(VerbOptions& verb, RayMapFlags& flags);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkRayMapFlags(const RayMapFlags& flags);

/// Throws Error (kUsage) for a material or a node that the scene does not have.
RayMapOptions rayMapOptions(const RayMapFlags& flags, const Scene& scene);

}  // namespace peeler::cmd
