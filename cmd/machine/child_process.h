// SPDX-License-Identifier: Apache-2.0
// Another run of this program, and the signals of the run that waits for it.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

namespace peeler::cmd {

/// The program itself with other arguments, nothing on its stdin, both streams read here. It gets a
/// SIGTERM when this process ends, however it ends. The destructor ends it if it still runs.
class ChildProcess {
  public:
    /// Throws Error (kInternal) if the system has no process or pipe left.
    explicit ChildProcess(const std::vector<std::string>& arguments);
    ~ChildProcess();
    ChildProcess(ChildProcess&& other) noexcept;
    ChildProcess& operator=(ChildProcess&&) = delete;

    /// Takes what there is on the streams, without waiting.
    void read();
    /// Whether it has ended; then all that it wrote has been read.
    bool ended();
    /// Sends it a signal; does nothing once it has ended.
    void signal(int number) const;
    /// From here on nobody waits for it or ends it.
    void abandon();

    /// Files to poll for input; −1 once they are at their end.
    int outFile() const { return out_.file; }
    int errFile() const { return err_.file; }

    /// Once it has ended: the exit code, 128 + n if signal n ended it.
    int exitCode() const { return exit_code_; }
    /// The signal that ended it; 0 if it ended by itself.
    int endingSignal() const { return ending_signal_; }
    const std::string& out() const { return out_.text; }
    /// The last 64 KiB of its stderr.
    const std::string& err() const { return err_.text; }
    /// From its start to its end.
    double milliseconds() const { return milliseconds_; }

  private:
    struct Stream {
        int file = -1;
        std::string text;
        std::size_t most = 0;  ///< bytes to keep; 0 = all
        void read();
        void close();
    };

    pid_t process_ = -1;  ///< −1 = it has ended
    Stream out_, err_;
    std::chrono::steady_clock::time_point start_;
    double milliseconds_ = 0;
    int exit_code_ = -1;
    int ending_signal_ = 0;
};

/// Signals as something to poll for, while it lives: SIGCHLD, and those of SIGINT, SIGTERM and
/// SIGHUP that are not ignored. They have no other effect meanwhile. Throws Error (kInternal) if
/// the system has no file left.
class SignalFile {
  public:
    SignalFile();
    ~SignalFile();
    SignalFile(const SignalFile&) = delete;
    SignalFile& operator=(const SignalFile&) = delete;

    int file() const { return file_; }
    /// Takes the next signal that has come; 0 = none.
    int take() const;

  private:
    int file_ = -1;
};

}  // namespace peeler::cmd
