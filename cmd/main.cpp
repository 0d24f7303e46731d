// SPDX-License-Identifier: Apache-2.0
// The executable: locale, signals and streams around the command line.
#include <unistd.h>

#include <clocale>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "cmd/cli/command_line.h"
#include "cmd/cli/console.h"
#include "formats/file/temporary_files.h"

namespace {

extern "C" void endBySignal(int number) {
    peeler::removeTemporaryFiles();
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

/// SIGINT, SIGTERM and SIGHUP remove the temporary files and end the process with 128 + n; one that
/// was ignored when the process started stays ignored. SIGPIPE and SIGXFSZ are ignored: the failed
/// write is reported where it happens, and a reader that leaves stderr does not stop a render.
void installSignalActions() {
    for (const int number : {SIGINT, SIGTERM, SIGHUP})
        catchUnlessIgnored(number);
    for (const int number : {SIGPIPE, SIGXFSZ})
        std::signal(number, SIG_IGN);
}

/// no-color.org, and terminals that say that they have none.
bool wantsColors() {
    const char* const refused = std::getenv("NO_COLOR");
    const char* const kind = std::getenv("TERM");
    return (!refused || *refused == '\0') && kind && std::string_view(kind) != "dumb";
}

}  // namespace

int main(int argc, char** argv) {
    // Numbers are read and written the same everywhere, whatever a library asks of the locale.
    std::setlocale(LC_ALL, "C");
    installSignalActions();
    const bool terminal = isatty(STDERR_FILENO) == 1;
    peeler::cmd::Console console(std::cout, std::cerr, terminal, terminal && wantsColors());
    const std::vector<std::string> arguments(argv + (argc > 0 ? 1 : 0), argv + argc);
    return peeler::cmd::runCommandLine(arguments, console);
}
