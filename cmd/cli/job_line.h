// SPDX-License-Identifier: Apache-2.0
// JSON job lines: a verb and its arguments.
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
/// `args` (strings) are the arguments after the verb on the command line. `options` adds options by
/// name without dashes: a string or number is the value, true gives the option without a value,
/// false omits it, an array repeats it.
struct JobLine {
    /// Parses a line. The object may also have the keys in `more_keys`, which the caller reads.
    /// Throws Error (kUsage) if the text is not a JSON object or a key is unknown, missing,
    /// duplicate or of the wrong type. `help` becomes the hint of errors without a hint.
    JobLine(const std::string& line, std::span<const std::string_view> more_keys,
            const std::string& help);

    nlohmann::json json;
    std::string verb;
    std::vector<std::string> arguments;
};

}  // namespace peeler::cmd
