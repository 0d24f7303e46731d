// SPDX-License-Identifier: Apache-2.0
// Image information.
#pragma once

#include "cmd/info/info_options.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// Prints the windows, the layers with their pixel counts, completeness and provenance. Throws
/// Error (kInput) if the file is damaged.
void printImageInfo(const InfoOptions& options, Reporter& reporter);

}  // namespace peeler::cmd
