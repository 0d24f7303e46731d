// SPDX-License-Identifier: Apache-2.0
// Everything that was asked for and changes pixels, as one hash.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/capture/renderer.h"

namespace peeler::cmd {

/// What is shown of the scene's file.
struct ShownScene {
    int scene = 0;                  ///< index
    std::vector<int> animations{};  ///< indices
    std::vector<std::string> include{}, exclude{};
    double frames_per_second = 0;  ///< that motion is measured by; 0 = it is not
    /// The pixels that a share of them is taken of, for --occlusion-ratio: tiles keep other layers
    /// than the whole.
    Window crop{};
};

/// Two renders of the same scene file with the same hash, time and camera (peeler:cameraJson) have
/// the same layers. What the header says in full is left out, so that the tiles of a picture and
/// the frames of a sequence share a hash: camera, size, crop and time; and so is what changes
/// nothing: threads, memory, backend, and which of the exact methods it is. `fxaa`: whether the
/// composite is filtered; `look`: what lookSettings() says. 16 hexadecimal digits.
std::string settingsHash(const ShownScene& shown, const CaptureSettings& capture, bool fxaa = false,
                         const nlohmann::json& look = nlohmann::json::object());

}  // namespace peeler::cmd
