// SPDX-License-Identifier: Apache-2.0
// What writing baked values takes of memory.
#pragma once

#include <cstdint>

#include "cmd/bake/bake_options.h"
#include "cmd/options/capture_job.h"
#include "core/bake/receivers.h"

namespace peeler::cmd {

/// Most bytes that are made of the values of so many receivers while they are written, besides the
/// values. `texels`: null if vertices are the target. May read the scene's file, throwing like
/// GlbWriter.
std::uint64_t writeMemory(const BakeOptions& bake, const SceneOptions& options,
                          const OpenedScene& scene, std::uint64_t receivers,
                          const TexelReceivers* texels);

}  // namespace peeler::cmd
