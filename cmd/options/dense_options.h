// SPDX-License-Identifier: Apache-2.0
// The options of dense arrays: planes in place of lists.
#pragma once

#include "cmd/options/output_options.h"

namespace peeler::cmd {

/// Declares --dense, which also chooses the kind "dense" unless --as says another, --fill and
/// --dense-type.
void addDenseOptions(VerbOptions& verb, OutputRequest& output);

/// Throws Error (kUsage) if one of them is given and the output has no planes.
void checkDenseOptions(const OutputRequest& output, bool has_planes);

}  // namespace peeler::cmd
