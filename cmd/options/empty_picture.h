// SPDX-License-Identifier: Apache-2.0
// Warnings about pictures without any fragment.
#pragma once

#include <filesystem>
#include <string>

#include <peeler/capture_settings.h>
#include <peeler/view.h>
#include "cmd/session/reporter.h"
#include "cmd/session/scene_request.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

std::string emptyReason(const PosedScene& posed, const View& view, const CaptureSettings& capture,
                        const SceneOptions& options);

/// Warns that a picture is empty. If `strict`, throws Error (kIncomplete) instead.
void reportEmpty(const std::filesystem::path& file, const std::string& reason, bool strict,
                 Reporter& reporter);

}  // namespace peeler::cmd
