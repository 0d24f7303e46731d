// SPDX-License-Identifier: Apache-2.0
// Prints what is in a scene.
#pragma once

#include <glm/glm.hpp>
#include <string>

#include "cmd/info/info_options.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// Prints the node tree, what is drawn, materials, cameras, bounds, extensions, warnings. Throws
/// Error (kInput) like readSceneFile().
void printSceneInfo(const InfoOptions& options, Reporter& reporter);

/// To six significant digits, which other programs that add the same numbers print as well.
std::string vectorText(const glm::dvec3& v);

Json vectorJson(const glm::dvec3& v);

}  // namespace peeler::cmd
