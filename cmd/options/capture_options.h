// SPDX-License-Identifier: Apache-2.0
// Capture options shared by verbs: fragments, lights, memory, device.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <peeler/capture_settings.h>
#include "cmd/session/capture_choices.h"
#include "core/gl/context.h"

namespace peeler::cmd {

class VerbOptions;

/// The default number of samples per pixel of display composites.
inline constexpr int kDisplaySamples = 4;

/// Declares --method, --layers, --occlusion-ratio, --tail, --samples, --surfaces, --faces,
/// --shading, --point-size and --precision.
void addLayerOptions(VerbOptions& verb, CaptureSettings& capture);

/// Declares only --method, --faces and --point-size, for verbs that always capture all layers.
void addAllLayersOptions(VerbOptions& verb, CaptureSettings& capture);

/// Declares --faces for rays. Without a value, the default depends on the verb's other options.
void addRayFacesOption(VerbOptions& verb, std::optional<Faces>& faces);

/// Declares --shadows and --shadow-size (texels per side).
void addLightOptions(VerbOptions& verb, CaptureSettings& capture, std::optional<int>& shadow_size);

/// Sets the size of shadow maps if `shadow_size` has a value. Throws Error (kUsage) if
/// `shadow_size` has a value although there are no shadows.
void setShadowSize(CaptureSettings& capture, const std::optional<int>& shadow_size);

/// Declares --memory (bytes). The default is inheritedBudget() (cmd/machine/resources.h). `remark`
/// is help text: how the verb stays within the budget.
void addMemoryOption(VerbOptions& verb, MemoryBudget& budget, const std::string& remark);

/// Declares --backend, --device, --require-gpu, --threads and --memory; `memory` is
/// addMemoryOption()'s `remark`.
void addMachineOptions(VerbOptions& verb, gl::ContextRequest& device, int& threads,
                       CaptureSettings& capture, const std::string& memory);

void addEngineOption(VerbOptions& verb, RayEngine& engine);

}  // namespace peeler::cmd
