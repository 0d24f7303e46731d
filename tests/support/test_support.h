// SPDX-License-Identifier: Apache-2.0
// What tests share: where things are, scratch folders, running the command.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include <peeler/text.h>

namespace peeler::test {

using Json = nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

/// The repository's root; $PEELER_SOURCE where programs are run that were built elsewhere
/// (tests/gpu).
std::filesystem::path sourceDir();

/// The folder of real models: $PEELER_ASSETS, else ../shared/assets beside the repository. Nothing
/// if it is not there; tests then skip and say so (PEELER_REQUIRE_ASSETS below).
std::optional<std::filesystem::path> assetsDir();

/// The contents of a file; empty if it is not there.
std::string bytesOf(const std::filesystem::path& path);

/// Whether a text holds these words.
bool contains(const Text& text, const std::string& part);

/// A folder that is made fresh and removed with the object.
class ScratchDir {
  public:
    ScratchDir();
    ~ScratchDir();
    ScratchDir(const ScratchDir&) = delete;
    ScratchDir& operator=(const ScratchDir&) = delete;
    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    /// The names of what is in it, sorted; not of what is in folders below it.
    std::vector<std::string> files() const;

  private:
    std::filesystem::path path_;
};

/// The exit code and the streams of a command that has ended.
struct Outcome {
    int exit_code = -1;  ///< of a process: 128 + n if signal n ended it
    std::string out, err;
};

/// The same of a command that was a process, and what it took of the machine.
struct CommandResult : Outcome {
    double cpu_seconds = 0;         ///< of all threads; what the machine does besides is not in it
    std::uint64_t peak_memory = 0;  ///< most bytes resident at once
};

/// Whether this is a build with AddressSanitizer or ThreadSanitizer, whose memory and address space
/// say nothing of the product's, and which take several times as long.
#ifdef PEELER_SHADOW_MEMORY
inline constexpr bool kShadowMemory = true;
#else
inline constexpr bool kShadowMemory = false;
#endif

/// Processor seconds that no refusal takes on the slowest machine: what needs more does not end, or
/// does far more work than its input asks for. Benchmarks tell how fast it is.
inline constexpr double kEndlessSeconds = kShadowMemory ? 600 : 60;

/// Runs a command line of `peeler` in this process, which takes half the time of starting one.
Outcome runPeeler(const std::vector<std::string>& arguments);

/// The built `peeler`.
std::filesystem::path peelerBinary();

/// Starts the built `peeler` with these arguments, DISPLAY and WAYLAND_DISPLAY unset, and waits for
/// it: where the process is what is tested (its memory, signals, environment, streams).
/// `environment` holds "NAME=value" entries to add; `directory` is where it runs (default: here).
CommandResult runPeelerProcess(const std::vector<std::string>& arguments,
                               const std::vector<std::string>& environment = {},
                               const std::filesystem::path& directory = {});

/// The command line that runPeelerProcess() runs.
std::vector<std::string> peelerCommand(const std::vector<std::string>& arguments);

/// A command that runs while the test does something else; killed with the object unless it has
/// been waited for.
class StartedCommand {
  public:
    explicit StartedCommand(const std::vector<std::string>& command,
                            const std::vector<std::string>& environment = {},
                            const std::filesystem::path& directory = {});
    ~StartedCommand();
    StartedCommand(const StartedCommand&) = delete;
    StartedCommand& operator=(const StartedCommand&) = delete;

    pid_t pid() const { return pid_; }
    bool running() const;
    CommandResult wait();

  private:
    ScratchDir streams_;
    pid_t pid_ = 0;
};

/// Runs any program, looked up in PATH, and waits for it; otherwise like runPeelerProcess().
CommandResult runCommand(const std::vector<std::string>& command,
                         const std::vector<std::string>& environment = {},
                         const std::filesystem::path& directory = {});

/// Whether a program of others took a file. Of exrinfo it is what it says on stderr: Debian's
/// (OpenEXR 3.1.5) ends with an exit code that it never sets.
bool took(const std::vector<std::string>& command, const CommandResult& result);

/// The folder of a libEGL.so.1 with GPUs that are not there, for LD_LIBRARY_PATH. Variables say
/// what it does (support/fake_egl/fake_egl.cpp).
std::filesystem::path fakeEglDir();

/// The program that runHelper() is tested with (support/programs/test_helper.cpp).
std::filesystem::path testHelper();

/// The library that finds modules by its own place (support/programs/module_finder.cpp).
std::filesystem::path moduleFinder();

/// "egl" or "osmesa" from PEELER_TEST_BACKEND (default egl).
std::string testBackend();

/// Whether everything is asked for (`sh tests/run.sh all` sets PEELER_TEST_ALL), or the sample of
/// it that the short run takes: of many runs, sizes or models, some.
bool exhaustive();

}  // namespace peeler::test

#define PEELER_REQUIRE_ASSETS(variable)                                                      \
    const auto variable##_optional = peeler::test::assetsDir();                              \
    if (!variable##_optional)                                                                \
        GTEST_SKIP() << "no asset folder (set PEELER_ASSETS or put it at ../shared/assets)"; \
    const std::filesystem::path& variable = *variable##_optional
