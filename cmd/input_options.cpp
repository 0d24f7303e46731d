// SPDX-License-Identifier: Apache-2.0
// What a scene file may make us read.
#include "cmd/input_options.h"

#include "cmd/options.h"

namespace peeler::cmd {

void addInputOptions(CLI::App& app, bool& allow_outside) {
    app.add_flag("--allow-outside", allow_outside,
                 wrapped("read the buffers and images of the scene wherever it says: without this, "
                         "nothing outside its folder (absolute paths, \"..\", symbolic links)"))
        ->group("Scene");
}

}  // namespace peeler::cmd
