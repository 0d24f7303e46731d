// SPDX-License-Identifier: Apache-2.0
// What `peeler info` says of each kind of file.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <string>

#include "cmd/cli/report.h"
#include "cmd/options/layered_options.h"
#include "cmd/session/reporter.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::cmd {

struct InfoOptions {
    std::filesystem::path file;
    bool json = false;
    SceneReadOptions reading;  ///< of a scene
    LayeredReadOptions image;  ///< of an image; `strict` is that of `reading`
};

/// Prints the node tree, what is drawn, materials, cameras, bounds, extensions, warnings. Throws
/// Error (kInput) like readSceneFile().
void printSceneInfo(const InfoOptions& options, Reporter& reporter);

/// Prints windows, layers with their pixels, completeness, where the picture comes from. Throws
/// Error (kInput) if the file is damaged.
void printImageInfo(const InfoOptions& options, Reporter& reporter);

/// To six significant digits, which other programs that add the same numbers print as well.
std::string vectorText(const glm::dvec3& v);
Json vectorJson(const glm::dvec3& v);

}  // namespace peeler::cmd
