// SPDX-License-Identifier: Apache-2.0
// Jobs of peeler batch: JSON lines, parsed and checked.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace peeler::cmd {

/// A line of a job file:
///
///     {"id": "front", "verb": "render", "args": ["scene.glb", "-o", "front.exr"],
///      "options": {"size": "640x360", "shadows": true}}
///
/// `verb` must be a verb that writes a file. `args` (strings) are the arguments after it on the
/// command line. `options` adds options by name without dashes: a string or number is the value,
/// true gives the option without a value, false omits it, an array repeats it. `id` identifies the
/// job in the results. Other keys are errors.
struct Job {
    std::size_t line = 0;  ///< line number in the job file, from 1
    std::string id;        ///< id of the job; "" = none
    std::string verb;
    std::vector<std::string> arguments;
    /// The hash of the line without its id, in hexadecimal digits. The hash does not depend on the
    /// order of keys.
    std::string hash;
    /// All output files; for sequences, one per frame. Patterns for other numbers, such as views,
    /// stay in the names.
    std::vector<std::filesystem::path> outputs;
    // Whether the batch adds --json, --quiet, --threads or --memory. It adds only options that the
    // verb has and the job does not set.
    bool wants_json = false, wants_quiet = false, wants_threads = false, wants_memory = false;
};

/// Parses all jobs; skips blank lines. `text` is the file's content; `name` is its name in
/// messages. Throws Error (kUsage), with the line as `where`, if a line is not a JSON object, a key
/// is unknown, missing, duplicate or of the wrong type, an id is not unique, arguments are
/// malformed, or an earlier job has the same output.
std::vector<Job> readJobs(const std::string& name, const std::string& text);

}  // namespace peeler::cmd
