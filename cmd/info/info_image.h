// SPDX-License-Identifier: Apache-2.0
// Prints what is in an image.
#pragma once

#include "cmd/info/info_options.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// Prints windows, layers with their pixels, completeness, where the picture comes from. Throws
/// Error (kInput) if the file is damaged.
void printImageInfo(const InfoOptions& options, Reporter& reporter);

}  // namespace peeler::cmd
