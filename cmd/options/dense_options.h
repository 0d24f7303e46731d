// SPDX-License-Identifier: Apache-2.0
// Options for dense arrays, which have planes instead of fragment lists.
#pragma once

#include "cmd/options/output_options.h"

namespace peeler::cmd {

/// Declares --dense, --fill and --dense-type. --dense also selects the output kind "dense" unless
/// --as is given.
void addDenseOptions(VerbOptions& verb, OutputRequest& output);

/// Throws Error (kUsage) if one of these options is given for an output without planes.
void checkDenseOptions(const OutputRequest& output, bool has_planes);

}  // namespace peeler::cmd
