// SPDX-License-Identifier: Apache-2.0
#include "cmd/machine/child_process.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include <peeler/error.h>
#include "formats/file/module.h"

namespace peeler::cmd {

namespace {

constexpr std::size_t kMostMessages = std::size_t{64} << 10;

[[noreturn]] void fail(const std::string& what) {
    throw Error(ErrorKind::kInternal, what + ": " + std::strerror(errno), "",
                "the system's limit of processes or open files may be reached");
}

struct Pipe {
    std::array<int, 2> ends{-1, -1};
    Pipe() {
        if (pipe2(ends.data(), O_CLOEXEC) != 0) fail("cannot make a pipe");
    }
    ~Pipe() {
        for (const int end : ends)
            if (end >= 0) ::close(end);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;
    int takeReader() {
        fcntl(ends[0], F_SETFL, O_NONBLOCK);
        return std::exchange(ends[0], -1);
    }
};

sigset_t watchedSignals() {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGCHLD);
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction action {};
        if (sigaction(number, nullptr, &action) == 0 && action.sa_handler != SIG_IGN)
            sigaddset(&set, number);
    }
    return set;
}

/// Runs the program in the child process, after fork. Calls only async-signal-safe functions; does
/// not return.
[[noreturn]] void becomeProgram(const char* program, char* const* arguments, pid_t parent, int out,
                                int err) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(128 + SIGTERM);  // the parent ended before prctl()
    const int nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
    dup2(nothing, STDIN_FILENO);
    dup2(out, STDOUT_FILENO);
    dup2(err, STDERR_FILENO);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    execv(program, arguments);
    constexpr char kMessage[] = "peeler: error: cannot start: is /proc mounted?\n";
    [[maybe_unused]] const auto written = write(STDERR_FILENO, kMessage, sizeof kMessage - 1);
    _exit(static_cast<int>(ErrorKind::kInternal));
}

}  // namespace

void ChildProcess::Stream::read() {
    std::array<char, 65536> bytes;
    while (file >= 0) {
        const ssize_t count = ::read(file, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0 && errno == EAGAIN) return;
        if (count <= 0) return close();
        text.append(bytes.data(), static_cast<std::size_t>(count));
        if (most != 0 && text.size() > most) text.erase(0, text.size() - most);
    }
}

void ChildProcess::Stream::close() {
    if (file >= 0) ::close(file);
    file = -1;
}

ChildProcess::ChildProcess(const std::vector<std::string>& arguments)
    : start_(std::chrono::steady_clock::now()) {
    std::vector<char*> pointers;
    const std::string program = programFile();
    std::string name = "peeler";
    pointers.push_back(name.data());
    for (const std::string& argument : arguments)
        pointers.push_back(const_cast<char*>(argument.c_str()));
    pointers.push_back(nullptr);
    Pipe out, err;
    const pid_t parent = getpid();
    process_ = fork();
    if (process_ < 0) fail("cannot start a process");
    if (process_ == 0)
        becomeProgram(program.c_str(), pointers.data(), parent, out.ends[1], err.ends[1]);
    out_.file = out.takeReader();
    err_.file = err.takeReader();
    err_.most = kMostMessages;
}

ChildProcess::~ChildProcess() {
    out_.close();
    err_.close();
    if (process_ <= 0) return;
    // Sends SIGTERM first, so that the process can remove its temporary files.
    kill(process_, SIGTERM);
    for (int i = 0; i < 50; ++i) {
        if (waitpid(process_, nullptr, WNOHANG) == process_) return;
        usleep(10'000);
    }
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : process_(std::exchange(other.process_, -1)),
      out_(std::move(other.out_)),
      err_(std::move(other.err_)),
      start_(other.start_),
      milliseconds_(other.milliseconds_),
      exit_code_(other.exit_code_),
      ending_signal_(other.ending_signal_) {
    other.out_.file = other.err_.file = -1;
}

void ChildProcess::read() {
    out_.read();
    err_.read();
}

bool ChildProcess::ended() {
    if (process_ < 0) return true;
    int status = 0;
    pid_t found = 0;
    do  // retries, because SIGCHLD has been consumed and will not come again
        found = waitpid(process_, &status, WNOHANG);
    while (found < 0 && errno == EINTR);
    if (found == 0) return false;
    // Other code has already waited for the process, so its status is unknown.
    if (found < 0) status = static_cast<int>(ErrorKind::kInternal) << 8;
    process_ = -1;
    const std::chrono::duration<double, std::milli> passed =
        std::chrono::steady_clock::now() - start_;
    milliseconds_ = passed.count();
    ending_signal_ = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    exit_code_ = WIFSIGNALED(status) ? 128 + ending_signal_ : WEXITSTATUS(status);
    read();
    out_.close();
    err_.close();
    return true;
}

void ChildProcess::abandon() {
    process_ = -1;
}

void ChildProcess::signal(int number) const {
    if (process_ > 0) kill(process_, number);
}

SignalFile::SignalFile() {
    // A process inherits ignored signals from its parent. If SIGCHLD were ignored, the signal would
    // never arrive.
    std::signal(SIGCHLD, SIG_DFL);
    const sigset_t set = watchedSignals();
    file_ = signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
    if (file_ < 0) fail("cannot watch signals");
    sigprocmask(SIG_BLOCK, &set, nullptr);
}

SignalFile::~SignalFile() {
    ::close(file_);
    const sigset_t set = watchedSignals();
    sigprocmask(SIG_UNBLOCK, &set, nullptr);
}

int SignalFile::take() const {
    signalfd_siginfo info{};
    return ::read(file_, &info, sizeof info) == sizeof info ? static_cast<int>(info.ssi_signo) : 0;
}

}  // namespace peeler::cmd
