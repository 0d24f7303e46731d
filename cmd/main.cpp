// SPDX-License-Identifier: Apache-2.0
// The executable: locale, signals and streams.
#include <sys/prctl.h>
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
    // _exit() rather than exit(): destructors and the GL driver's atexit handlers are not safe in a
    // signal handler.
    _exit(128 + number);
}

void catchUnlessIgnored(int number) {
    struct sigaction before {};
    if (sigaction(number, nullptr, &before) == 0 && before.sa_handler == SIG_IGN) return;
    struct sigaction action {};
    action.sa_handler = endBySignal;
    // A second signal must not interrupt the removal of temporary files.
    sigfillset(&action.sa_mask);
    sigaction(number, &action, nullptr);
}

/// Installs the signal actions. SIGINT, SIGTERM and SIGHUP remove the temporary files and end the
/// process with exit code 128 + n; a signal that was ignored at the start stays ignored. SIGPIPE
/// and SIGXFSZ are ignored: a failed write is reported as an error, and a closed stderr does not
/// stop a render.
void installSignalActions() {
    for (const int number : {SIGINT, SIGTERM, SIGHUP})
        catchUnlessIgnored(number);
    for (const int number : {SIGPIPE, SIGXFSZ})
        std::signal(number, SIG_IGN);
}

/// Ends the process where throwing is impossible. Does not allocate memory. May be called from any
/// thread.
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

/// Handles a failed allocation. Throws if enough memory is left to unwind and report the error;
/// otherwise ends the process. Unwinding without memory is unsafe: destructors (nlohmann::json's),
/// the standard library and drivers allocate in noexcept code, and streams silently drop data.
void takeFailedAllocation() {
    constexpr std::size_t kRoom = std::size_t{64} << 10U;
    // `volatile` keeps the compiler from removing the allocation.
    void* const volatile room = std::malloc(kRoom);
    if (!room) endWithoutMemory();
    std::free(room);
    throw std::bad_alloc();
}

/// Handles std::terminate, which is called when an exception escapes from noexcept code.
[[noreturn]] void takeTermination() {
    try {
        if (std::current_exception()) throw;
    } catch (const std::bad_alloc&) {
        endWithoutMemory();
    } catch (...) {
    }
    endAtOnce(
        peeler::ErrorKind::kInternal,
        "peeler: error: unhandled exception\n"
        "peeler: hint: this is a bug in peeler; please report it with the command that shows it\n");
}

/// Whether to use colours (no-color.org, and the terminal type).
bool wantsColors() {
    const char* const refused = std::getenv("NO_COLOR");
    const char* const kind = std::getenv("TERM");
    return (!refused || *refused == '\0') && kind && std::string_view(kind) != "dumb";
}

}  // namespace

int main(int argc, char** argv) {
    peeler::openStandardStreams();
    // The archive's launcher starts a dynamic linker, whose name pgrep would not find.
    prctl(PR_SET_NAME, "peeler");
    // Number formats must not depend on the locale.
    std::setlocale(LC_ALL, "C");
    installSignalActions();
    std::set_new_handler(takeFailedAllocation);
    std::set_terminate(takeTermination);
    const bool terminal = isatty(STDERR_FILENO) == 1;
    peeler::cmd::Console console(std::cout, std::cerr, terminal, terminal && wantsColors());
    const std::vector<std::string> arguments(argv + (argc > 0 ? 1 : 0), argv + argc);
    return peeler::cmd::runCommandLine(arguments, console);
}
