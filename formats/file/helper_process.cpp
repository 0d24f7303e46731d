// SPDX-License-Identifier: Apache-2.0
// Helper processes: start, wait, and receive a result or an error.
#include "formats/file/helper_process.h"

#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>
#include <utility>

#include <peeler/error.h>

namespace peeler {
namespace {

/// The spawn settings of a helper: two open files, the default action for every signal, and no
/// blocked signals.
class SpawnSettings {
  public:
    SpawnSettings(int in, int out) {
        posix_spawn_file_actions_init(&actions_);
        posix_spawnattr_init(&attributes_);
        keep(posix_spawn_file_actions_adddup2(&actions_, in, 0));
        keep(posix_spawn_file_actions_adddup2(&actions_, out, 1));
        keep(posix_spawn_file_actions_addclosefrom_np(&actions_, 2));
        sigset_t set;
        sigemptyset(&set);
        posix_spawnattr_setsigmask(&attributes_, &set);
        sigfillset(&set);
        posix_spawnattr_setsigdefault(&attributes_, &set);
        posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    }
    ~SpawnSettings() {
        posix_spawnattr_destroy(&attributes_);
        posix_spawn_file_actions_destroy(&actions_);
    }
    SpawnSettings(const SpawnSettings&) = delete;
    SpawnSettings& operator=(const SpawnSettings&) = delete;

    const posix_spawn_file_actions_t* actions() const { return &actions_; }
    const posix_spawnattr_t* attributes() const { return &attributes_; }
    /// Returns the first error (errno) of the settings, or 0. After an error, no helper may be
    /// started.
    int failure() const { return failure_; }

  private:
    void keep(int failure) {
        if (failure_ == 0) failure_ = failure;
    }

    posix_spawn_file_actions_t actions_{};
    posix_spawnattr_t attributes_{};
    int failure_ = 0;
};

pid_t start(const HelperRun& run, int in, int out) {
    std::string program = run.program.string(), seconds = std::to_string(run.cpu_seconds);
    const std::array<char*, 3> arguments = {program.data(), seconds.data(), nullptr};
    const char* const folders = std::getenv("LD_LIBRARY_PATH");
    std::string libraries = std::string("LD_LIBRARY_PATH=") + (folders ? folders : "");
    const std::array<char*, 2> environment = {folders ? libraries.data() : nullptr, nullptr};
    const SpawnSettings settings(in, out);
    pid_t child = 0;
    int failure = settings.failure();
    if (failure == 0)
        failure = posix_spawn(&child, program.c_str(), settings.actions(), settings.attributes(),
                              arguments.data(), environment.data());
    if (failure == 0) return child;
    if (failure == ENOMEM) throw std::bad_alloc();
    throw Error(ErrorKind::kInternal,
                "a part of peeler cannot be started: " + std::string(std::strerror(failure)),
                program);
}

constexpr std::uint64_t kSecond = 1'000'000;

std::uint64_t microsecondsOf(const timeval& time) {
    return static_cast<std::uint64_t>(time.tv_sec) * kSecond +
           static_cast<std::uint64_t>(time.tv_usec);
}

/// Waits for the process to end. Throws Error (kInput or kMemory) if a signal ended it.
void waitFor(pid_t child, const HelperRun& run) {
    int status = 0;
    rusage used{};
    pid_t ended = 0;
    while ((ended = wait4(child, &status, 0, &used)) < 0 && errno == EINTR) {
    }
    // wait4() fails if the host process ignores SIGCHLD or waits for all children. Then only the
    // helper's result shows whether it succeeded.
    if (ended < 0) return;
    const std::uint64_t microseconds =
        microsecondsOf(used.ru_utime) + microsecondsOf(used.ru_stime);
    if (run.used) *run.used += microseconds;
    constexpr int kNotLoaded = 127;  // the dynamic linker's exit status
    if (WIFEXITED(status) && WEXITSTATUS(status) == kNotLoaded)
        throw Error(ErrorKind::kInternal, "a part of peeler lacks a library", run.program.string(),
                    run.install);
    if (!WIFSIGNALED(status)) return;
    const int number = WTERMSIG(status);
    const std::uint64_t seconds = (microseconds + kSecond / 2) / kSecond;
    const bool late = seconds + 1 >= static_cast<std::uint64_t>(run.cpu_seconds);
    if (number == SIGKILL && !late)
        throw Error(ErrorKind::kMemory, "the decoder was killed, probably for lack of memory");
    if (number == SIGSYS)
        throw Error(ErrorKind::kInput,
                    "the decoder makes a system call that no decoder needs: the data is damaged "
                    "or malicious",
                    "", run.hint);
    throw Error(
        ErrorKind::kInput,
        number == SIGXCPU || number == SIGKILL
            ? "decoding takes longer than " + std::to_string(seconds) + " s: the data is damaged"
            : "the decoder crashes on the data, which is damaged (signal " +
                  std::to_string(number) + ")",
        "", run.hint);
}

std::string takeText(SharedFile& result) {
    // Maximum bytes of a text; no text of an Error is longer.
    constexpr std::uint64_t kMostOfMessage = 8192;
    const auto text = result.take<char>(kMostOfMessage);
    return {text.begin(), text.end()};
}

}  // namespace

SharedFile runHelper(const HelperRun& run, const SharedFile& request) {
    SharedFile result;
    result.putOne(HelperState::kUnfinished);
    waitFor(start(run, request.descriptor(), result.descriptor()), run);
    result.seek(0);
    const auto state = result.takeOne<HelperState>();
    if (state == HelperState::kDone) return result;
    // A decoder fails only with kMemory or kInput, but a compromised helper may send any number.
    const auto kind = state == HelperState::kFailed ? result.takeOne<ErrorKind>() : ErrorKind();
    if (kind != ErrorKind::kInput && kind != ErrorKind::kMemory)
        throw Error(ErrorKind::kInput, "the decoder ends without a result", "", run.hint);
    const std::string what = takeText(result);
    throw Error(kind, what, "", takeText(result));
}

}  // namespace peeler
