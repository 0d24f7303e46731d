// SPDX-License-Identifier: Apache-2.0
// Every hit of every ray as files: arrays, points, deep images.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "cmd/rays/hit_columns.h"
#include "cmd/rays/ray_output.h"
#include "core/image/sink.h"

namespace peeler::cmd {

/// What hits are written with.
struct HitSources {
    PosedScene posed;
    Provenance provenance;  ///< of an image's headers, and of a point cloud's comment
};

/// .npz: ray_splits, the columns of hitColumns() and the bundles; the help of the verb lists them.
std::unique_ptr<RayOutput> makeHitArrays(std::string path, const HitSources& sources);

/// .ply: a binary point cloud, a point a hit: x y z (64 bits if `double_positions`), the columns,
/// and the number of its bundle.
std::unique_ptr<RayOutput> makeHitPoints(std::string path, const HitSources& sources,
                                         bool double_positions);

/// .exr: a deep part a bundle, of views withCommonDisplay().
std::unique_ptr<RayOutput> makeHitImage(std::string path, const HitSources& sources);

/// Whether the path ends in it, whatever the case; `extension` is lower case, with the dot.
bool hasExtension(const std::filesystem::path& path, std::string_view extension);

/// Throws Error (kUsage) unless the path ends like one of those.
void checkHitFormat(const std::string& path);
std::unique_ptr<RayOutput> makeHitOutput(const std::string& path, const HitSources& sources,
                                         bool double_positions);

}  // namespace peeler::cmd
