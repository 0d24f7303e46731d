// SPDX-License-Identifier: Apache-2.0
// The table of verbs. A new verb is one new file and one new row.
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "cmd/cli/console.h"

namespace peeler::cmd {

class VerbOptions;

/// What a verb does once its options are read; the result is the exit code.
using VerbAction = std::function<int(Console&)>;

struct Verb {
    std::string_view name;
    std::string_view summary;  ///< one line for --help
    /// Declares the verb's options; the action owns where they are stored.
    VerbAction (*declare)(VerbOptions&);
};

/// In the order of --help.
std::span<const Verb> verbs();

// One file each.
VerbAction declareRender(VerbOptions& verb);
VerbAction declareRays(VerbOptions& verb);
VerbAction declareBake(VerbOptions& verb);
VerbAction declareFlatten(VerbOptions& verb);
VerbAction declareExtract(VerbOptions& verb);
VerbAction declareMerge(VerbOptions& verb);
VerbAction declareConvert(VerbOptions& verb);
VerbAction declareView(VerbOptions& verb);
VerbAction declareSheet(VerbOptions& verb);
VerbAction declareBatch(VerbOptions& verb);
VerbAction declareCompare(VerbOptions& verb);
VerbAction declareInfo(VerbOptions& verb);
VerbAction declareVerify(VerbOptions& verb);
VerbAction declareDevices(VerbOptions& verb);

}  // namespace peeler::cmd
