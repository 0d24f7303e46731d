// SPDX-License-Identifier: Apache-2.0
// Solids whose interior has no winding number (--overlap).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/rays/solids.h"

namespace peeler::cmd {

/// A solid that is open, inside out, or has triangles that face both ways.
struct UndecidedSolid {
    std::string name, reason;
    int node = 0;
    std::size_t instance = 0;
};

/// Returns the undecided solids in draw order.
std::vector<UndecidedSolid> undecidedSolids(const Scene& scene, const Solids& solids);
/// Returns a warning in one line.
std::string undecidedText(const std::vector<UndecidedSolid>& undecided);
/// Returns the solids with the keys listed in cmd/README.md.
nlohmann::ordered_json undecidedJson(const std::vector<UndecidedSolid>& undecided);

}  // namespace peeler::cmd
