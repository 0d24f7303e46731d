// SPDX-License-Identifier: Apache-2.0
// Memory for writing baked values.
#pragma once

#include <cstdint>

#include "cmd/bake/bake_options.h"
#include "cmd/options/capture_job.h"
#include "core/bake/receivers.h"

namespace peeler::cmd {

/// Returns the maximum bytes needed to write the values of `receivers` receivers, in addition to
/// the values themselves. `texels` is null for a bake to vertices. May read the scene file. Throws
/// like GlbWriter.
std::uint64_t writeMemory(const BakeOptions& bake, const SceneOptions& options,
                          const OpenedScene& scene, std::uint64_t receivers,
                          const TexelReceivers* texels);

}  // namespace peeler::cmd
