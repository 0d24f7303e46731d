// SPDX-License-Identifier: Apache-2.0
// Presets: values of several options, for data sets whose loaders expect them.
#pragma once

#include <optional>
#include <string>

#include "cmd/render/render_options.h"

namespace peeler::cmd {

/// Declares --preset.
void addPresetOption(VerbOptions& verb, std::optional<std::string>& preset);

/// Sets what a preset says and nothing on the command line does.
void applyPreset(const VerbOptions& verb, RenderOptions& options);

}  // namespace peeler::cmd
