// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/sequence_options.h"

#include "cmd/cli/options.h"

namespace peeler::cmd {

void addSequenceOptions(VerbOptions& verb, SequenceOptions& options) {
    constexpr const char* kGroup = "Output";
    verb.addFlag("--skip-existing", options.skip_existing,
                 "leave a file alone that is complete (peeler verify reads all of it) and was made "
                 "of the same scene, settings, camera, size and time; any other is made anew")
        .group(kGroup);
    verb.addFlag("--keep-going", options.keep_going,
                 "a frame that fails does not stop the others; the greatest of the exit codes is "
                 "the command's")
        .group(kGroup);
    verb.addFlag("--dry-run", options.dry_run,
                 "print what would be done as JSON, and write nothing")
        .group(kGroup);
}

}  // namespace peeler::cmd
