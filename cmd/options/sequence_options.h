// SPDX-License-Identifier: Apache-2.0
// How a run over many pictures meets what is there already, and what fails.
#pragma once

namespace peeler::cmd {

class VerbOptions;

struct SequenceOptions {
    bool skip_existing = false;
    bool keep_going = false;
    bool dry_run = false;
};

/// Declares --skip-existing, --keep-going and --dry-run. `options` must outlive the parse.
void addSequenceOptions(VerbOptions& verb, SequenceOptions& options);

}  // namespace peeler::cmd
