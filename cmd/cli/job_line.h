// SPDX-License-Identifier: Apache-2.0
// A verb and its arguments as a line of JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace peeler::cmd {

/// A job in one line:
///
///     {"verb": "render", "args": ["scene.glb", "-o", "out.exr"],
///      "options": {"size": "640x360", "shadows": true}}
///
/// `args` (strings) is what follows the verb on the command line. `options` is more of that: the
/// name without its dashes; a string or number is its value, true gives it without one, false
/// leaves it out, an array gives it several times.
struct JobLine {
    /// Reads a line; the object may have `more_keys`, too, which are the caller's to read. `help`
    /// is the hint of errors. Throws Error (kUsage) for a text that is not a JSON object, and for a
    /// key that is unknown, missing, given twice or of the wrong type.
    JobLine(const std::string& line, std::span<const std::string_view> more_keys,
            const std::string& help);

    nlohmann::json json;  ///< all of it
    std::string verb;
    std::vector<std::string> arguments;
};

}  // namespace peeler::cmd
