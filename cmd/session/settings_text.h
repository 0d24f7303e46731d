// SPDX-License-Identifier: Apache-2.0
// The settings of a capture as canonical text, and their hash: what provenance records.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <peeler/capture_settings.h>
#include <peeler/window.h>

namespace peeler::cmd {

/// What is shown of the scene's file.
struct ShownScene {
    int scene = 0;                  ///< index
    std::vector<int> animations{};  ///< indices
    std::vector<std::string> include{}, exclude{};
    double frames_per_second = 0;  ///< by which motion is measured; 0 = it is not
    /// The pixels of which --occlusion-ratio takes a share: tiles keep other layers than the whole.
    Window crop{};
};

/// Everything that was asked for and changes pixels (peeler:settings), as the text of a JSON object
/// with sorted keys, most of them the names of options (differences.h tells which). Two renders of
/// the same scene file with the same settings, time and camera (peeler:cameraJson) have the same
/// layers. What the header says elsewhere in full is left out, so that the tiles of a picture and
/// the frames of a sequence share their settings: camera, size, crop and time; and so is what
/// changes nothing: threads, memory, backend, and which of the exact methods it is. `more`: an
/// object of what else there is, such as appearanceSettings().
std::string settingsText(const ShownScene& shown, const CaptureSettings& capture,
                         const nlohmann::json& more = nlohmann::json::object());
/// The hash of that text (peeler:settingsHash), 16 hexadecimal digits.
std::string settingsHash(const ShownScene& shown, const CaptureSettings& capture,
                         const nlohmann::json& more = nlohmann::json::object());

}  // namespace peeler::cmd
