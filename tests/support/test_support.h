// SPDX-License-Identifier: Apache-2.0
// Shared parts of tests: paths, scratch folders, running commands.
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

/// Returns the repository's root folder; $PEELER_SOURCE in programs that were built elsewhere
/// (tests/gpu).
std::filesystem::path sourceDir();

/// Returns the folder of real models: $PEELER_ASSETS, or ../shared/assets next to the repository by
/// default. Returns nothing if it does not exist; tests then skip with a message
/// (PEELER_REQUIRE_ASSETS below).
std::optional<std::filesystem::path> assetsDir();

/// Returns the contents of a file; empty if it does not exist.
std::string bytesOf(const std::filesystem::path& path);

/// Whether a text contains another.
bool contains(const Text& text, const std::string& part);

/// A new folder. The destructor removes it.
class ScratchDir {
  public:
    ScratchDir();
    ~ScratchDir();
    ScratchDir(const ScratchDir&) = delete;
    ScratchDir& operator=(const ScratchDir&) = delete;
    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    /// Returns the sorted names of the folder's entries, not including those of subfolders.
    std::vector<std::string> files() const;

  private:
    std::filesystem::path path_;
};

/// The exit code and the output streams of a finished command.
struct Outcome {
    int exit_code = -1;  ///< for a process, 128 + n if signal n ended it
    std::string out, err;
};

/// The outcome of a process, and its use of resources.
struct CommandResult : Outcome {
    double cpu_seconds = 0;         ///< processor time of all its threads
    std::uint64_t peak_memory = 0;  ///< peak of resident memory, in bytes
};

/// Whether this build has AddressSanitizer or ThreadSanitizer. With these, memory and address space
/// are not those of the product, and tests take several times as long.
#ifdef PEELER_SHADOW_MEMORY
inline constexpr bool kShadowMemory = true;
#else
inline constexpr bool kShadowMemory = false;
#endif

/// A limit of processor time, in seconds, for rejecting input even on the slowest machine. A
/// command that exceeds it hangs, or does far more work than its input requires. Benchmarks measure
/// speed.
inline constexpr double kEndlessSeconds = kShadowMemory ? 600 : 60;

/// Runs a command line of `peeler` inside this process, in half the time of a new process.
Outcome runPeeler(const std::vector<std::string>& arguments);

/// Returns the path of the built `peeler` program.
std::filesystem::path peelerBinary();

/// Runs the built `peeler` with these arguments, for tests of the process itself: memory, signals,
/// environment, streams. DISPLAY and WAYLAND_DISPLAY are unset. `environment` adds "NAME=value"
/// entries. `directory` is the working folder (default: the current folder).
CommandResult runPeelerProcess(const std::vector<std::string>& arguments,
                               const std::vector<std::string>& environment = {},
                               const std::filesystem::path& directory = {});

/// Returns the command line that runPeelerProcess() would run.
std::vector<std::string> peelerCommand(const std::vector<std::string>& arguments);

/// A command that runs in parallel with the test. The destructor kills it unless wait() was called.
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

/// Runs any program found in PATH, otherwise like runPeelerProcess().
CommandResult runCommand(const std::vector<std::string>& command,
                         const std::vector<std::string>& environment = {},
                         const std::filesystem::path& directory = {});

/// Whether another program accepted a file. For exrinfo, stderr decides, because Debian's version
/// (OpenEXR 3.1.5) returns an uninitialised exit code.
bool took(const std::vector<std::string>& command, const CommandResult& result);

/// Returns the folder of a libEGL.so.1 with fake GPUs, for LD_LIBRARY_PATH. Environment variables
/// control the fake GPUs (support/fake_egl/fake_egl.cpp).
std::filesystem::path fakeEglDir();

/// Returns the path of the program for tests of runHelper() (support/programs/test_helper.cpp).
std::filesystem::path testHelper();

/// Returns the path of the library that finds modules relative to itself
/// (support/programs/module_finder.cpp).
std::filesystem::path moduleFinder();

/// Returns the backend to test, "egl" or "osmesa", from PEELER_TEST_BACKEND (default: egl).
std::string testBackend();

/// Whether tests must cover everything (`sh tests/run.sh all` sets PEELER_TEST_ALL) or, in the
/// short run, only a sample of runs, sizes or models.
bool exhaustive();

}  // namespace peeler::test

#define PEELER_REQUIRE_ASSETS(variable)                                                      \
    const auto variable##_optional = peeler::test::assetsDir();                              \
    if (!variable##_optional)                                                                \
        GTEST_SKIP() << "no asset folder (set PEELER_ASSETS or put it at ../shared/assets)"; \
    const std::filesystem::path& variable = *variable##_optional
