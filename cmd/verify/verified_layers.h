// SPDX-License-Identifier: Apache-2.0
// Checks of layers that are stored in separate parts.
#pragma once

#include <string>

#include "cmd/verify/verified_file.h"

namespace peeler::cmd {

/// Checks layers in separate parts for faults that disappear when layers are read as fragment
/// lists: pixels without a fragment whose values are not 0 (for Z: not +inf), and pixels that skip
/// a layer. Does nothing for other layouts. Throws Error (kInput) if a chunk is damaged.
void checkLayerParts(const std::string& path, const ExrInfo& info, VerifiedFile& file);

}  // namespace peeler::cmd
