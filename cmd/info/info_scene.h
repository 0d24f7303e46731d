// SPDX-License-Identifier: Apache-2.0
// Scene information.
#pragma once

#include <glm/glm.hpp>
#include <string>

#include "cmd/info/info_options.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// Prints the node tree, drawn primitives, materials, cameras, bounds, extensions, warnings. Throws
/// Error (kInput) like readSceneFile().
void printSceneInfo(const InfoOptions& options, Reporter& reporter);

/// Returns six significant digits, so that programs which sum in another order print the same.
std::string vectorText(const glm::dvec3& v);

Json vectorJson(const glm::dvec3& v);

}  // namespace peeler::cmd
