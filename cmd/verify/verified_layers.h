// SPDX-License-Identifier: Apache-2.0
// Faults of layers in parts of their own that fragment lists do not show.
#pragma once

#include <string>

#include "cmd/verify/verified_file.h"

namespace peeler::cmd {

/// What fragment lists do not show, of layers in parts of their own: pixels without a fragment that
/// are not 0 (Z: +inf), and layers that skip one. Does nothing where layers are stored in another
/// way. Throws Error (kInput) if a chunk is damaged.
void checkLayerParts(const std::string& path, const ExrInfo& info, VerifiedFile& file);

}  // namespace peeler::cmd
