// SPDX-License-Identifier: Apache-2.0
// The jobs of peeler batch: JSON lines in, checked command lines out.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace peeler::cmd {

/// One line of a file of jobs:
///
///     {"id": "front", "verb": "render", "args": ["scene.glb", "-o", "front.exr"],
///      "options": {"size": "640x360", "shadows": true}}
///
/// `verb` is one that writes a file. `args` (strings) is what follows it on the command line.
/// `options` is more of that: the name without its dashes; a string or number is its value, true
/// gives it without one, false leaves it out, an array gives it several times. `id` is for whoever
/// reads the results. There are no other keys.
struct Job {
    std::size_t line = 0;  ///< from 1
    std::string id;        ///< "" = none
    std::string verb;
    std::vector<std::string> arguments;  ///< the verb's
    /// Hash of the line but for its id, as hexadecimal digits; the order of keys does not matter.
    std::string hash;
    /// All files that the job writes, frame by frame. Where the numbers in a name are not those of
    /// frames, this is the name with the place for them.
    std::vector<std::filesystem::path> outputs;
    // Whether the verb has --json, --quiet, --threads and --memory, and the job leaves them to the
    // batch.
    bool wants_json = false, wants_quiet = false, wants_threads = false, wants_memory = false;
};

/// Reads all jobs; blank lines do not count. `name` is the file's for messages, `text` what is in
/// it. Throws Error (kUsage) with the line as `where` for what is no JSON object, a key that is
/// unknown, missing, twice there or of the wrong type, an id that is not unique, arguments that the
/// verb would refuse for their form, and an output that an earlier job has.
std::vector<Job> readJobs(const std::string& name, const std::string& text);

}  // namespace peeler::cmd
