// SPDX-License-Identifier: Apache-2.0
#include "support/test_support.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "cmd/cli/command_line.h"
#include "cmd/cli/console.h"

extern char** environ;

namespace peeler::test {

namespace fs = std::filesystem;

fs::path sourceDir() {
    const char* variable = std::getenv("PEELER_SOURCE");
    return variable && *variable ? variable : PEELER_SOURCE_DIR;
}

std::optional<fs::path> assetsDir() {
    const char* variable = std::getenv("PEELER_ASSETS");
    const fs::path path = variable && *variable ? fs::path(variable)
                                                : sourceDir().parent_path() / "shared" / "assets";
    std::error_code error;
    if (!fs::is_directory(path, error)) return std::nullopt;
    return path;
}

ScratchDir::ScratchDir() {
    std::string pattern = (fs::temp_directory_path() / "peeler-test-XXXXXX").string();
    if (!mkdtemp(pattern.data())) throw std::runtime_error("cannot make a scratch folder");
    path_ = pattern;
}

ScratchDir::~ScratchDir() {
    std::error_code error;
    fs::permissions(path_, fs::perms::owner_all, error);
    fs::remove_all(path_, error);
}

std::vector<std::string> ScratchDir::files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path_))
        names.push_back(entry.path().filename());
    std::ranges::sort(names);
    return names;
}

std::string bytesOf(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

bool contains(const Text& text, const std::string& part) {
    return text.str().find(part) != std::string::npos;
}

namespace {

/// Resets the peak memory to the current size. Otherwise, Linux would count the parent's peak as
/// the child's, because the child shares the parent's memory until exec().
void forgetPeakMemory() {
    std::ofstream("/proc/self/clear_refs") << 5;
}

}  // namespace

StartedCommand::StartedCommand(const std::vector<std::string>& command,
                               const std::vector<std::string>& environment,
                               const fs::path& directory) {
    const std::string out = streams_ / "out", err = streams_ / "err";

    std::vector<std::string> variables = environment;
    for (char** entry = environ; *entry; ++entry) {
        const std::string text = *entry;
        const std::string name = text.substr(0, text.find('=') + 1);
        bool replaced = name == "DISPLAY=" || name == "WAYLAND_DISPLAY=";
        for (const auto& own : environment)
            replaced = replaced || own.starts_with(name);
        if (!replaced) variables.push_back(text);
    }
    std::vector<char*> argv, envp;
    for (const auto& argument : command)
        argv.push_back(const_cast<char*>(argument.c_str()));
    for (const auto& variable : variables)
        envp.push_back(const_cast<char*>(variable.c_str()));
    argv.push_back(nullptr);
    envp.push_back(nullptr);

    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 1, out.c_str(), O_WRONLY | O_CREAT, 0600);
    posix_spawn_file_actions_addopen(&actions, 2, err.c_str(), O_WRONLY | O_CREAT, 0600);
    if (!directory.empty()) posix_spawn_file_actions_addchdir_np(&actions, directory.c_str());
    forgetPeakMemory();
    const int failed = posix_spawnp(&pid_, argv[0], &actions, nullptr, argv.data(), envp.data());
    posix_spawn_file_actions_destroy(&actions);
    if (failed) throw std::runtime_error("cannot start " + command.front());
}

StartedCommand::~StartedCommand() {
    if (pid_ == 0) return;
    kill(pid_, SIGKILL);
    wait();
}

bool StartedCommand::running() const {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == 0;
}

CommandResult StartedCommand::wait() {
    int status = 0;
    struct rusage used = {};
    wait4(std::exchange(pid_, 0), &status, 0, &used);
    const auto seconds = [](const timeval& time) {
        return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
    };
    return {{WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
             bytesOf(streams_ / "out"), bytesOf(streams_ / "err")},
            seconds(used.ru_utime) + seconds(used.ru_stime),
            static_cast<std::uint64_t>(used.ru_maxrss) * 1024};  // ru_maxrss is in KiB
}

CommandResult runCommand(const std::vector<std::string>& command,
                         const std::vector<std::string>& environment, const fs::path& directory) {
    return StartedCommand(command, environment, directory).wait();
}

bool took(const std::vector<std::string>& command, const CommandResult& result) {
    return command.front() == "exrinfo" ? result.err.empty() : result.exit_code == 0;
}

fs::path peelerBinary() {
    return PEELER_BINARY;
}

std::vector<std::string> peelerCommand(const std::vector<std::string>& arguments) {
    std::vector<std::string> command{peelerBinary()};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return command;
}

Outcome runPeeler(const std::vector<std::string>& arguments) {
    std::ostringstream out, err;
    int code = 0;
    {
        cmd::Console console(out, err, false);
        code = cmd::runCommandLine(arguments, console);
    }
    return {code, out.str(), err.str()};
}

CommandResult runPeelerProcess(const std::vector<std::string>& arguments,
                               const std::vector<std::string>& environment,
                               const fs::path& directory) {
    return runCommand(peelerCommand(arguments), environment, directory);
}

fs::path fakeEglDir() {
    return PEELER_FAKE_EGL_FOLDER;
}

fs::path testHelper() {
    return PEELER_TEST_HELPER;
}

fs::path moduleFinder() {
    return PEELER_MODULE_FINDER;
}

std::string testBackend() {
    const char* variable = std::getenv("PEELER_TEST_BACKEND");
    return variable && *variable ? variable : "egl";
}

bool exhaustive() {
    const char* variable = std::getenv("PEELER_TEST_ALL");
    return variable && *variable;
}

}  // namespace peeler::test
