// SPDX-License-Identifier: Apache-2.0
// The executable: locale, signals and streams around the command line.
#include <unistd.h>

#include <clocale>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/command_line.h"
#include "cmd/cli/console.h"
#include "formats/file/regular_file.h"
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

/// Ends the process where no exception can, without memory, from any thread.
[[noreturn]] void endAtOnce(peeler::ErrorKind kind, std::string_view line) {
    peeler::removeTemporaryFiles();
    [[maybe_unused]] const auto written = write(STDERR_FILENO, line.data(), line.size());
    _exit(static_cast<int>(kind));
}

[[noreturn]] void endWithoutMemory() {
    endAtOnce(peeler::ErrorKind::kMemory,
              "peeler: error: out of memory\n"
              "peeler: hint: use a smaller --size, or fewer --threads; or raise the limit\n");
}

/// An allocation that fails throws as long as there is room for what an exception passes and for
/// its report. Where there is none, it ends the process: destructors (nlohmann::json's), the
/// standard library and drivers allocate where nothing may be thrown, and streams would pass over
/// what they could not store.
void takeFailedAllocation() {
    constexpr std::size_t kRoom = std::size_t{64} << 10U;
    void* const volatile room = std::malloc(kRoom);  // volatile: not to be optimised away
    if (!room) endWithoutMemory();
    std::free(room);
    throw std::bad_alloc();
}

/// What is thrown where nothing may be.
[[noreturn]] void takeTermination() {
    try {
        if (std::current_exception()) throw;
    } catch (const std::bad_alloc&) {
        endWithoutMemory();
    } catch (...) {
    }
    endAtOnce(peeler::ErrorKind::kInternal,
              "peeler: error: an exception that nothing handles\n"
              "peeler: hint: this is a bug in peeler; please report it with the command that "
              "shows it\n");
}

/// no-color.org, and terminals that say that they have none.
bool wantsColors() {
    const char* const refused = std::getenv("NO_COLOR");
    const char* const kind = std::getenv("TERM");
    return (!refused || *refused == '\0') && kind && std::string_view(kind) != "dumb";
}

}  // namespace

int main(int argc, char** argv) {
    peeler::openStandardStreams();
    // Numbers are read and written the same everywhere, whatever a library asks of the locale.
    std::setlocale(LC_ALL, "C");
    installSignalActions();
    std::set_new_handler(takeFailedAllocation);
    std::set_terminate(takeTermination);
    const bool terminal = isatty(STDERR_FILENO) == 1;
    peeler::cmd::Console console(std::cout, std::cerr, terminal, terminal && wantsColors());
    const std::vector<std::string> arguments(argv + (argc > 0 ? 1 : 0), argv + argc);
    return peeler::cmd::runCommandLine(arguments, console);
}
