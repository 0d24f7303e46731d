// SPDX-License-Identifier: Apache-2.0
// Differences between the headers of two pictures, worded in terms of the command line.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include <peeler/sink.h>
#include <peeler/view.h>

namespace peeler::cmd {

struct Difference {
    std::string what;  ///< an option ("--channels") or a phrase ("the camera")
    /// The value in this picture, and in the other picture. "" = only `what` is shown.
    std::string here, there;

    /// Returns the difference as text: "--channels: normal, not none".
    std::string text() const;
};

std::string differencesText(const std::vector<Difference>& differences);

/// Returns the difference between the scene files, in name or in content; at most one entry.
std::vector<Difference> sceneDifferences(const Provenance& here, const Provenance& there);

/// Returns the differences between Provenance::settings, one entry per key. If the settings are
/// unknown but their hashes differ, returns a single entry.
std::vector<Difference> settingsDifferences(const Provenance& here, const Provenance& there);

/// Returns the difference between the sizes of the whole pictures; at most one entry.
std::vector<Difference> sizeDifferences(const View& here, const View& there);
/// Returns the differences between the cameras: name, projection and pose.
std::vector<Difference> cameraDifferences(const View& here, const View& there);

/// Returns Provenance::settings as a JSON object, or null if the text is damaged or nested too
/// deeply.
nlohmann::json settingsJson(const Provenance& provenance);

/// Returns the option of peeler render that sets this key of Provenance::settings.
std::string optionOfSetting(const std::string& key);

}  // namespace peeler::cmd
