// SPDX-License-Identifier: Apache-2.0
// Scene information.
#pragma once

#include <glm/glm.hpp>
#include <string>

#include "cmd/info/info_options.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// Prints the node tree, the number of drawn elements, materials, cameras, bounds, extensions and
/// warnings. Throws Error (kInput) like readSceneFile().
void printSceneInfo(const InfoOptions& options, Reporter& reporter);

/// Returns the components with six significant digits. Programs that sum in a different order then
/// print the same text.
std::string vectorText(const glm::dvec3& v);

Json vectorJson(const glm::dvec3& v);

}  // namespace peeler::cmd
