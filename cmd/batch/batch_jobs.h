// SPDX-License-Identifier: Apache-2.0
// Jobs of peeler batch: parsed and checked JSON lines.
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
/// `verb` is one that writes a file. `args` (strings) are the arguments after it on the command
/// line. `options` adds options by name without dashes: a string or number is the value, true gives
/// the option without a value, false omits it, an array repeats it. `id` identifies the job in the
/// results. There are no other keys.
struct Job {
    std::size_t line = 0;  ///< from 1
    std::string id;        ///< "" = none
    std::string verb;
    std::vector<std::string> arguments;  ///< the verb's
    /// Hash of the line without its id, as hexadecimal digits; independent of key order.
    std::string hash;
    /// All output files, frame by frame. If the numbers in a name are not frames, the name keeps
    /// its pattern.
    std::vector<std::filesystem::path> outputs;
    // Whether the verb has --json, --quiet, --threads and --memory and the job does not set them.
    bool wants_json = false, wants_quiet = false, wants_threads = false, wants_memory = false;
};

/// Parses all jobs; skips blank lines. `name` is the file's name for messages, `text` its content.
/// Throws Error (kUsage), with the line as `where`, if a line is not a JSON object, a key is
/// unknown, missing, duplicate or of the wrong type, an id is not unique, arguments are malformed,
/// or an output is also that of an earlier job.
std::vector<Job> readJobs(const std::string& name, const std::string& text);

}  // namespace peeler::cmd
