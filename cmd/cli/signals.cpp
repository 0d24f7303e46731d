// SPDX-License-Identifier: Apache-2.0
// The signal actions: async-signal-safe calls only.
#include "cmd/cli/signals.h"

#include <unistd.h>

#include <csignal>

#include "formats/file/atomic_file.h"

namespace peeler::cmd {

namespace {

extern "C" void endBySignal(int number) {
    removeTemporaryFiles();
    // Not exit(): destructors and the GL driver's atexit code are not safe to run from here.
    _exit(128 + number);
}

void catchUnlessIgnored(int number) {
    struct sigaction before {};
    if (sigaction(number, nullptr, &before) == 0 && before.sa_handler == SIG_IGN) return;
    struct sigaction action {};
    action.sa_handler = endBySignal;
    // A second signal must not interrupt the removal.
    sigfillset(&action.sa_mask);
    sigaction(number, &action, nullptr);
}

}  // namespace

void installSignalActions() {
    for (const int number : {SIGINT, SIGTERM, SIGHUP})
        catchUnlessIgnored(number);
    for (const int number : {SIGPIPE, SIGXFSZ})
        std::signal(number, SIG_IGN);
}

}  // namespace peeler::cmd
