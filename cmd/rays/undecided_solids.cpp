// SPDX-License-Identifier: Apache-2.0
#include "cmd/rays/undecided_solids.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cmd/cli/report.h"
#include "cmd/rays/ray_parity.h"

namespace peeler::cmd {

namespace {

/// The maximum number of solids that the warning names; JSON lists all.
constexpr std::size_t kNamedSolids = 4;

std::string reasonOf(const Solid& solid) {
    if (!solid.closed()) return "open";
    return solid.facing == SolidFacing::kInward ? "inside out" : "faces both ways";
}

}  // namespace

std::vector<UndecidedSolid> undecidedSolids(const Scene& scene, const Solids& solids) {
    std::vector<UndecidedSolid> undecided;
    for (const Solid& solid : solids.all())
        if (!solid.winds())
            undecided.push_back(
                {solidName(scene, solid), reasonOf(solid), solid.node, solid.instance});
    return undecided;
}

std::string undecidedText(const std::vector<UndecidedSolid>& undecided) {
    std::string text = undecided.size() == 1 ? "a surface is" : "surfaces are";
    text += " not closed and facing outwards, so parity decides where shells overlap: ";
    for (std::size_t i = 0; i < std::min(undecided.size(), kNamedSolids); ++i)
        text += (i == 0 ? "" : ", ") + undecided[i].name + " (" + undecided[i].reason + ")";
    if (undecided.size() > kNamedSolids)
        text += " and " + groupedText(undecided.size() - kNamedSolids) + " more";
    return text;
}

nlohmann::ordered_json undecidedJson(const std::vector<UndecidedSolid>& undecided) {
    auto json = nlohmann::ordered_json::array();
    for (const UndecidedSolid& solid : undecided)
        json.push_back({{"node", solid.name},
                        {"nodeIndex", solid.node},
                        {"instance", solid.instance},
                        {"reason", solid.reason}});
    return json;
}

}  // namespace peeler::cmd
