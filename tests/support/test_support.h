// SPDX-License-Identifier: Apache-2.0
// Shared parts of tests: paths, scratch folders, running the command.
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

/// Returns the repository's root; $PEELER_SOURCE for programs that were built elsewhere
/// (tests/gpu).
std::filesystem::path sourceDir();

/// Returns the folder of real models: $PEELER_ASSETS, otherwise ../shared/assets beside the
/// repository. Nothing if it does not exist; tests then skip with a message (PEELER_REQUIRE_ASSETS
/// below).
std::optional<std::filesystem::path> assetsDir();

/// Returns the contents of a file; empty if it does not exist.
std::string bytesOf(const std::filesystem::path& path);

/// Whether a text contains these words.
bool contains(const Text& text, const std::string& part);

/// A new folder, removed with the object.
class ScratchDir {
  public:
    ScratchDir();
    ~ScratchDir();
    ScratchDir(const ScratchDir&) = delete;
    ScratchDir& operator=(const ScratchDir&) = delete;
    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    /// Returns the names of its entries, sorted; without those of subfolders.
    std::vector<std::string> files() const;

  private:
    std::filesystem::path path_;
};

/// The exit code and the streams of a finished command.
struct Outcome {
    int exit_code = -1;  ///< of a process: 128 + n if signal n ended it
    std::string out, err;
};

/// The same for a process, plus its use of the machine.
struct CommandResult : Outcome {
    double cpu_seconds = 0;         ///< of all threads, without other load on the machine
    std::uint64_t peak_memory = 0;  ///< peak resident bytes
};

/// Whether this is a build with AddressSanitizer or ThreadSanitizer: their memory and address space
/// do not represent the product's, and they take several times as long.
#ifdef PEELER_SHADOW_MEMORY
inline constexpr bool kShadowMemory = true;
#else
inline constexpr bool kShadowMemory = false;
#endif

/// Processor seconds that no refusal takes on the slowest machine: beyond that it hangs, or does
/// far more work than its input requires. Benchmarks measure the speed.
inline constexpr double kEndlessSeconds = kShadowMemory ? 600 : 60;

/// Runs a command line of `peeler` in this process, in half the time of starting one.
Outcome runPeeler(const std::vector<std::string>& arguments);

/// Returns the path of the built `peeler`.
std::filesystem::path peelerBinary();

/// Starts the built `peeler` with these arguments, DISPLAY and WAYLAND_DISPLAY unset, and waits for
/// it, for tests of the process (its memory, signals, environment, streams). `environment` adds
/// "NAME=value" entries; `directory` is its working folder (default: the current one).
CommandResult runPeelerProcess(const std::vector<std::string>& arguments,
                               const std::vector<std::string>& environment = {},
                               const std::filesystem::path& directory = {});

/// Returns the command line that runPeelerProcess() runs.
std::vector<std::string> peelerCommand(const std::vector<std::string>& arguments);

/// A command that runs beside the test; killed with the object unless it has been waited for.
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

/// Whether another program accepted a file. For exrinfo this depends on stderr: Debian's (OpenEXR
/// 3.1.5) returns an uninitialised exit code.
bool took(const std::vector<std::string>& command, const CommandResult& result);

/// Returns the folder of a libEGL.so.1 with fake GPUs, for LD_LIBRARY_PATH. Variables control it
/// (support/fake_egl/fake_egl.cpp).
std::filesystem::path fakeEglDir();

/// Returns the program that runHelper() is tested with (support/programs/test_helper.cpp).
std::filesystem::path testHelper();

/// Returns the library that finds modules relative to itself (support/programs/module_finder.cpp).
std::filesystem::path moduleFinder();

/// Returns "egl" or "osmesa" from PEELER_TEST_BACKEND (default egl).
std::string testBackend();

/// Whether to test everything (`sh tests/run.sh all` sets PEELER_TEST_ALL), or the short run's
/// sample of runs, sizes or models.
bool exhaustive();

}  // namespace peeler::test

#define PEELER_REQUIRE_ASSETS(variable)                                                      \
    const auto variable##_optional = peeler::test::assetsDir();                              \
    if (!variable##_optional)                                                                \
        GTEST_SKIP() << "no asset folder (set PEELER_ASSETS or put it at ../shared/assets)"; \
    const std::filesystem::path& variable = *variable##_optional
