// SPDX-License-Identifier: Apache-2.0
#include "cmd/sequence_options.h"

#include "cmd/options.h"

namespace peeler::cmd {

void addSequenceOptions(CLI::App& app, SequenceOptions& options) {
    constexpr const char* kGroup = "Output";
    app.add_flag("--skip-existing", options.skip_existing,
                 wrapped("leave a file alone that is complete (peeler verify reads all of it) and "
                         "was made of the same scene, settings, camera, size and time; any other "
                         "is made anew"))
        ->group(kGroup);
    app.add_flag("--keep-going", options.keep_going,
                 wrapped("a frame that fails does not stop the others; the greatest of the exit "
                         "codes is the command's"))
        ->group(kGroup);
    app.add_flag("--dry-run", options.dry_run,
                 wrapped("print what would be done as JSON, and write nothing"))
        ->group(kGroup);
}

}  // namespace peeler::cmd
