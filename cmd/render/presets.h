// SPDX-License-Identifier: Apache-2.0
// Option presets for the loaders of common data sets.
#pragma once

#include <optional>
#include <string>

#include "cmd/render/render_options.h"

namespace peeler::cmd {

/// Declares --preset.
void addPresetOption(VerbOptions& verb, std::optional<std::string>& preset);

/// Applies a preset to options that are not on the command line.
void applyPreset(const VerbOptions& verb, RenderOptions& options);

}  // namespace peeler::cmd
