// SPDX-License-Identifier: Apache-2.0
// The table of verbs. A new verb is one new file and one new row.
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "cmd/console.h"

namespace CLI {
class App;
}

namespace peeler::cmd {

/// What a verb does once its options are read; the result is the exit code.
using VerbAction = std::function<int(Console&)>;

struct Verb {
    std::string_view name;
    std::string_view summary;  ///< one line for --help
    /// Declares the verb's options; the action owns where they are stored.
    VerbAction (*declare)(CLI::App&);
};

/// In the order of --help.
std::span<const Verb> verbs();

// One file each.
VerbAction declareRender(CLI::App& app);
VerbAction declareRays(CLI::App& app);
VerbAction declareBake(CLI::App& app);
VerbAction declareFlatten(CLI::App& app);
VerbAction declareExtract(CLI::App& app);
VerbAction declareMerge(CLI::App& app);
VerbAction declareConvert(CLI::App& app);
VerbAction declareView(CLI::App& app);
VerbAction declareSheet(CLI::App& app);
VerbAction declareBatch(CLI::App& app);
VerbAction declareCompare(CLI::App& app);
VerbAction declareInfo(CLI::App& app);
VerbAction declareVerify(CLI::App& app);
VerbAction declareDevices(CLI::App& app);

}  // namespace peeler::cmd
