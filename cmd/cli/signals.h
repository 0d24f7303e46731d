// SPDX-License-Identifier: Apache-2.0
// What a signal does to a running command: no temporary file survives it.
#pragma once

namespace peeler::cmd {

/// SIGINT, SIGTERM and SIGHUP remove the temporary files and end the process with 128 + n; one that
/// was ignored when the process started stays ignored. SIGPIPE and SIGXFSZ are ignored: the failed
/// write is reported where it happens, and a reader that leaves stderr does not stop a render.
void installSignalActions();

}  // namespace peeler::cmd
