// SPDX-License-Identifier: Apache-2.0
// Canonical text and hash of capture settings, for provenance.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <peeler/capture_settings.h>
#include <peeler/window.h>

namespace peeler::cmd {

/// The rendered part of a scene file.
struct ShownScene {
    int scene = 0;
    std::vector<int> animations{};
    std::vector<std::string> include{}, exclude{};
    double frames_per_second = 0;  ///< for motion vectors; 0 = no motion vectors
    /// The pixels for --occlusion-ratio. Part of the settings, because the ratio may keep more or
    /// fewer layers in a tile than in the whole picture.
    Window crop{};
};

/// Returns all settings that change pixels (peeler:settings), as the text of a JSON object with
/// sorted keys. Most keys are names of options (differences.h). Renders of the same scene file with
/// the same settings, time and camera (peeler:cameraJson) have the same layers. Omits camera, size,
/// crop and time, which are elsewhere in the header: the tiles of a picture and the frames of a
/// sequence have the same settings. Also omits settings that change nothing: threads, memory,
/// backend, and the choice among exact methods. `more` is an object of further settings, such as
/// appearanceSettings().
std::string settingsText(const ShownScene& shown, const CaptureSettings& capture,
                         const nlohmann::json& more = nlohmann::json::object());
/// Returns the hash of settingsText() (peeler:settingsHash), 16 hexadecimal digits.
std::string settingsHash(const ShownScene& shown, const CaptureSettings& capture,
                         const nlohmann::json& more = nlohmann::json::object());

}  // namespace peeler::cmd
