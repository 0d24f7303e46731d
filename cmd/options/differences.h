// SPDX-License-Identifier: Apache-2.0
// What the headers of two pictures say differently, in the words of the command line.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include <peeler/sink.h>
#include <peeler/view.h>

namespace peeler::cmd {

/// One thing in which a picture differs from another.
struct Difference {
    std::string what;         ///< an option ("--channels"), or words ("the camera")
    std::string here, there;  ///< this picture's, the other's; both "" if `what` says it all

    /// "--channels: normal, not none"
    std::string text() const;
};

/// The texts of all, with semicolons between.
std::string differencesText(const std::vector<Difference>& differences);

/// Whether two pictures are of one scene file that has not changed in between; at most one.
std::vector<Difference> sceneDifferences(const Provenance& here, const Provenance& there);

/// The options in which Provenance::settings differ, key by key. If their hashes differ and nobody
/// says in what, the one difference is that.
std::vector<Difference> settingsDifferences(const Provenance& here, const Provenance& there);

/// The size of the whole picture; at most one.
std::vector<Difference> sizeDifferences(const View& here, const View& there);
/// The camera: what it is called, what it sees and from where.
std::vector<Difference> cameraDifferences(const View& here, const View& there);

/// Provenance::settings as an object, null if it is none. What is nested deeper than settings are
/// is left out: whoever walks through it would run out of stack.
nlohmann::json settingsJson(const Provenance& provenance);

/// The option of peeler render that a key of Provenance::settings stands for.
std::string optionOfSetting(const std::string& key);

}  // namespace peeler::cmd
