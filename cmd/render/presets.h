// SPDX-License-Identifier: Apache-2.0
// Presets of options for the loaders of common data sets.
#pragma once

#include <optional>
#include <string>

#include "cmd/render/render_options.h"

namespace peeler::cmd {

/// Declares --preset.
void addPresetOption(VerbOptions& verb, std::optional<std::string>& preset);

/// Applies the preset, if any, to the options that are not given.
void applyPreset(const VerbOptions& verb, RenderOptions& options);

}  // namespace peeler::cmd
