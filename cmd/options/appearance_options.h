// SPDX-License-Identifier: Apache-2.0
// Appearance options: variants, transmission, environments.
#pragma once

#include "cmd/session/scene_request.h"

namespace peeler::cmd {

class VerbOptions;

void addVariantOption(VerbOptions& verb, AppearanceOptions& appearance);
/// Declares --environment and --environment-rotation, for pictures.
void addEnvironmentOptions(VerbOptions& verb, AppearanceOptions& appearance);
/// Declares --variant, --transmission, --environment and --environment-rotation.
void addAppearanceOptions(VerbOptions& verb, AppearanceOptions& appearance);
/// Declares the options for baking: --variant, --environment and --environment-rotation.
void addBakedAppearanceOptions(VerbOptions& verb, AppearanceOptions& appearance);

}  // namespace peeler::cmd
