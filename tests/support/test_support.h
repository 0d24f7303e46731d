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

/// Returns the repository's root folder. Returns $PEELER_SOURCE in programs built on another
/// machine (tests/gpu).
std::filesystem::path sourceDir();

/// Returns the folder of real models: $PEELER_ASSETS (default: ../shared/assets next to the
/// repository). Returns nothing if the folder does not exist; tests then skip with a message
/// (PEELER_REQUIRE_ASSETS below).
std::optional<std::filesystem::path> assetsDir();

/// Returns the contents of a file; empty if it does not exist.
std::string bytesOf(const std::filesystem::path& path);

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
    /// Returns the sorted names of the folder's entries, without those in subfolders.
    std::vector<std::string> files() const;

  private:
    std::filesystem::path path_;
};

struct Outcome {
    int exit_code = -1;  ///< 128 + n if signal n ended the process
    std::string out, err;
};

/// The outcome of a process, and its use of resources.
struct CommandResult : Outcome {
    double cpu_seconds = 0;         ///< of all threads
    std::uint64_t peak_memory = 0;  ///< peak of resident memory, in bytes
};

/// Whether this build has AddressSanitizer or ThreadSanitizer. Sanitizers take more memory and
/// address space, and make tests several times slower.
#ifdef PEELER_SHADOW_MEMORY
inline constexpr bool kShadowMemory = true;
#else
inline constexpr bool kShadowMemory = false;
#endif

/// The maximum processor time, in seconds, for rejecting input on the slowest machine. A command
/// that takes longer hangs, or does far more work than its input requires. Only benchmarks measure
/// speed.
inline constexpr double kEndlessSeconds = kShadowMemory ? 600 : 60;

/// Runs a command line of `peeler` inside this process, in half the time of a new process.
Outcome runPeeler(const std::vector<std::string>& arguments);

/// Returns the path of the built `peeler` program.
std::filesystem::path peelerBinary();

/// Runs the built `peeler` with these arguments, for tests of the process itself: memory, signals,
/// environment, streams. `environment` adds "NAME=value" entries; DISPLAY and WAYLAND_DISPLAY are
/// unset. `directory` is the working folder (default: the current folder).
CommandResult runPeelerProcess(const std::vector<std::string>& arguments,
                               const std::vector<std::string>& environment = {},
                               const std::filesystem::path& directory = {});

/// Returns the command line of runPeelerProcess().
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

/// Runs a program found in PATH, otherwise like runPeelerProcess().
CommandResult runCommand(const std::vector<std::string>& command,
                         const std::vector<std::string>& environment = {},
                         const std::filesystem::path& directory = {});

/// Whether another program accepted a file. Decides by the exit code; for exrinfo, by stderr,
/// because Debian's version (OpenEXR 3.1.5) returns an uninitialised exit code.
bool took(const std::vector<std::string>& command, const CommandResult& result);

/// Returns the folder of a libEGL.so.1 with fake GPUs, for LD_LIBRARY_PATH.
/// support/fake_egl/fake_egl.cpp describes the environment variables that control the fake GPUs.
std::filesystem::path fakeEglDir();

/// Returns the path of a helper program (support/programs/test_helper.cpp), for tests of
/// runHelper().
std::filesystem::path testHelper();

/// Returns the path of a library that finds modules relative to itself
/// (support/programs/module_finder.cpp).
std::filesystem::path moduleFinder();

/// Returns the backend to test, "egl" or "osmesa", from PEELER_TEST_BACKEND (default: egl).
std::string testBackend();

/// Whether tests must cover everything (`sh tests/run.sh all` sets PEELER_TEST_ALL) instead of a
/// sample of runs, sizes or models.
bool exhaustive();

}  // namespace peeler::test

#define PEELER_REQUIRE_ASSETS(variable)                                                      \
    const auto variable##_optional = peeler::test::assetsDir();                              \
    if (!variable##_optional)                                                                \
        GTEST_SKIP() << "no asset folder (set PEELER_ASSETS or put it at ../shared/assets)"; \
    const std::filesystem::path& variable = *variable##_optional
