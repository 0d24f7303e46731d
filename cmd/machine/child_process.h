// SPDX-License-Identifier: Apache-2.0
// Child processes that run this program, and signals that can be polled.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

namespace peeler::cmd {

/// A child process that runs this program with other arguments and an empty stdin. The parent reads
/// the child's stdout and stderr. The child gets a SIGTERM when the parent ends for any reason. The
/// destructor ends the child if it is still running.
class ChildProcess {
  public:
    /// Throws Error (kInternal) if the system cannot create another process or pipe.
    explicit ChildProcess(const std::vector<std::string>& arguments);
    ~ChildProcess();
    ChildProcess(ChildProcess&& other) noexcept;
    ChildProcess& operator=(ChildProcess&&) = delete;

    /// Reads the available output without blocking.
    void read();
    /// Whether the process has ended and all its output has been read.
    bool ended();
    /// Sends a signal; does nothing once the process has ended.
    void signal(int number) const;
    /// Detaches the process, so that the destructor neither waits for it nor ends it.
    void abandon();

    /// Return file descriptors to poll for input; −1 at end of file.
    int outFile() const { return out_.file; }
    int errFile() const { return err_.file; }

    /// Returns the exit code once the process has ended; 128 + n if signal n ended it.
    int exitCode() const { return exit_code_; }
    /// Returns the signal that ended the process, or 0 if it exited by itself.
    int endingSignal() const { return ending_signal_; }
    const std::string& out() const { return out_.text; }
    /// Returns the last 64 KiB of the process's stderr.
    const std::string& err() const { return err_.text; }
    double milliseconds() const { return milliseconds_; }

  private:
    struct Stream {
        int file = -1;
        std::string text;
        std::size_t most = 0;  ///< number of bytes to keep, from the end; 0 = all
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

/// A pollable file that receives signals: SIGCHLD, and SIGINT, SIGTERM and SIGHUP unless they are
/// ignored. During the object's lifetime these signals have no other effect. The constructor throws
/// Error (kInternal) if the system has no file descriptor left.
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
