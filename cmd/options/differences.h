// SPDX-License-Identifier: Apache-2.0
// Differences between two pictures' headers, in command-line terms.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include <peeler/sink.h>
#include <peeler/view.h>

namespace peeler::cmd {

/// A difference between two pictures.
struct Difference {
    std::string what;         ///< an option ("--channels"), or a phrase ("the camera")
    std::string here, there;  ///< this picture's value, the other's; both "" if `what` suffices

    /// Returns "--channels: normal, not none".
    std::string text() const;
};

/// Returns all texts, joined by semicolons.
std::string differencesText(const std::vector<Difference>& differences);

/// Returns the difference between the scene files, by name or by content; at most one entry.
std::vector<Difference> sceneDifferences(const Provenance& here, const Provenance& there);

/// Returns the options in which Provenance::settings differ, key by key. If only the hashes are
/// known to differ, returns one entry for that.
std::vector<Difference> settingsDifferences(const Provenance& here, const Provenance& there);

/// Returns the difference in the size of the whole picture; at most one entry.
std::vector<Difference> sizeDifferences(const View& here, const View& there);
/// Returns the differences of the cameras: name, projection and pose.
std::vector<Difference> cameraDifferences(const View& here, const View& there);

/// Returns Provenance::settings as an object, null if it is not one. Drops nesting deeper than
/// settings have, which could overflow the stack of recursive code.
nlohmann::json settingsJson(const Provenance& provenance);

/// Returns the option of peeler render for a key of Provenance::settings.
std::string optionOfSetting(const std::string& key);

}  // namespace peeler::cmd
