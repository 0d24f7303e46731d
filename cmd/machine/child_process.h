// SPDX-License-Identifier: Apache-2.0
// Child processes of this program, and signals for polling.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

namespace peeler::cmd {

/// A run of this program with other arguments, an empty stdin, and both output streams read here.
/// It gets a SIGTERM when this process ends for any reason. The destructor ends it if it is still
/// running.
class ChildProcess {
  public:
    /// Throws Error (kInternal) if the system has no process or pipe left.
    explicit ChildProcess(const std::vector<std::string>& arguments);
    ~ChildProcess();
    ChildProcess(ChildProcess&& other) noexcept;
    ChildProcess& operator=(ChildProcess&&) = delete;

    /// Reads available output without blocking.
    void read();
    /// Whether it has ended; all its output has then been read.
    bool ended();
    /// Sends a signal; does nothing once the process has ended.
    void signal(int number) const;
    /// Detaches the process: it is neither awaited nor ended.
    void abandon();

    /// Return file descriptors to poll for input; −1 at end of file.
    int outFile() const { return out_.file; }
    int errFile() const { return err_.file; }

    /// Returns the exit code after the end; 128 + n if signal n ended it.
    int exitCode() const { return exit_code_; }
    /// Returns the signal that ended it; 0 if it exited.
    int endingSignal() const { return ending_signal_; }
    const std::string& out() const { return out_.text; }
    /// Returns the last 64 KiB of its stderr.
    const std::string& err() const { return err_.text; }
    /// Returns its running time.
    double milliseconds() const { return milliseconds_; }

  private:
    struct Stream {
        int file = -1;
        std::string text;
        std::size_t most = 0;  ///< bytes to keep; 0 = all
        void read();
        void close();
    };

    pid_t process_ = -1;  ///< −1 = ended
    Stream out_, err_;
    std::chrono::steady_clock::time_point start_;
    double milliseconds_ = 0;
    int exit_code_ = -1;
    int ending_signal_ = 0;
};

/// A pollable file of signals: SIGCHLD, and SIGINT, SIGTERM and SIGHUP unless ignored. They have no
/// other effect during its lifetime. The constructor throws Error (kInternal) if the system has no
/// file descriptor left.
class SignalFile {
  public:
    SignalFile();
    ~SignalFile();
    SignalFile(const SignalFile&) = delete;
    SignalFile& operator=(const SignalFile&) = delete;

    int file() const { return file_; }
    /// Returns the next pending signal; 0 = none.
    int take() const;

  private:
    int file_ = -1;
};

}  // namespace peeler::cmd
