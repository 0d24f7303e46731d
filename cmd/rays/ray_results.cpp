// SPDX-License-Identifier: Apache-2.0
#include "cmd/rays/ray_results.h"

#include <nlohmann/json.hpp>
#include <utility>

namespace peeler::cmd {

namespace {

nlohmann::ordered_json mapJson(const RayMapResult& map) {
    nlohmann::ordered_json channels = nlohmann::ordered_json::array();
    for (const RayMapStatistics& channel : map.channels) {
        nlohmann::ordered_json entry{{"name", channel.name}};
        if (channel.least) entry["least"] = *channel.least;
        if (channel.greatest) entry["greatest"] = *channel.greatest;
        if (channel.volume) entry["volume"] = *channel.volume;
        channels.push_back(std::move(entry));
    }
    return {{"bundle", map.bundle}, {"output", map.path}, {"channels", std::move(channels)}};
}

}  // namespace

void addRayResults(const RayResults& results, nlohmann::ordered_json& json) {
    for (const RayMapResult& map : results.maps)
        json["maps"].push_back(mapJson(map));
    if (results.voxels) {
        const VoxelResult& voxels = *results.voxels;
        json["voxels"] = {{"output", voxels.path},
                          {"cells", {voxels.cells.x, voxels.cells.y, voxels.cells.z}},
                          {"spacing", voxels.spacing},
                          {"occupied", voxels.occupied},
                          {"disputed", voxels.disputed},
                          {"volume", voxels.volume}};
    }
    if (results.next_hits) {
        const NextHitsResult& hits = *results.next_hits;
        json["points"] = {{"count", hits.points},
                          {"before", hits.before},
                          {"after", hits.after},
                          {"besideBundles", hits.beside_bundles}};
    }
}

}  // namespace peeler::cmd
