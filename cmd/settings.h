// SPDX-License-Identifier: Apache-2.0
// Everything that was asked for and changes pixels, as one hash.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/renderer.h"
#include "core/view.h"

namespace peeler::cmd {

/// What is shown of the scene's file, and when.
struct ShownScene {
    int scene = 0;                  ///< index
    std::vector<int> animations{};  ///< indices
    double time = 0;                ///< seconds; matters if there are animations
    std::vector<std::string> include{}, exclude{};
};

/// Two renders of the same scene file with the same hash have the same layers. Left out is what
/// changes nothing: threads, memory, backend, and which of the exact methods it is. `fxaa`: whether
/// the composite is filtered; `look`: what lookSettings() says. 16 hexadecimal digits.
std::string settingsHash(const ShownScene& shown, const View& view, const CaptureSettings& capture,
                         bool fxaa = false, const nlohmann::json& look = nlohmann::json::object());

}  // namespace peeler::cmd
