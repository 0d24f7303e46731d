// SPDX-License-Identifier: Apache-2.0
// The executable: locale, signals and streams around the command line.
#include <unistd.h>

#include <clocale>
#include <iostream>
#include <string>
#include <vector>

#include "cmd/cli/command_line.h"
#include "cmd/cli/console.h"
#include "cmd/cli/signals.h"

int main(int argc, char** argv) {
    // Numbers are read and written the same everywhere, whatever a library asks of the locale.
    std::setlocale(LC_ALL, "C");
    peeler::cmd::installSignalActions();
    peeler::cmd::Console console(std::cout, std::cerr, isatty(STDERR_FILENO) == 1);
    const std::vector<std::string> arguments(argv + (argc > 0 ? 1 : 0), argv + argc);
    return peeler::cmd::runCommandLine(arguments, console);
}
