// SPDX-License-Identifier: Apache-2.0
// A process that runs a worker's jobs one by one.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace peeler::cmd {

/// The limits for each process of a worker.
struct JobLimits {
    int threads = 0;  ///< number of threads of a job without --threads; 0 = the verb's default
    /// Memory budget of a job without --memory, bytes; 0 = the verb's default.
    std::uint64_t memory = 0;
    std::uint64_t keep = 0;  ///< maximum number of bytes of scenes to keep open between jobs
};

/// A separate process for jobs, so that a driver crash affects only one job and a cancelled job
/// ends at once. It is forked from the worker, shares only stderr with the worker, and ends when
/// the worker ends.
class JobProcess {
  public:
    /// Throws Error (kInternal) if the system cannot create another process or socket.
    explicit JobProcess(const JobLimits& limits);
    /// Ends the process, which then removes its temporary files.
    ~JobProcess();
    JobProcess(const JobProcess&) = delete;
    JobProcess& operator=(const JobProcess&) = delete;

    /// Returns the file descriptor to poll for input.
    int file() const { return file_; }
    /// Starts the job in `line` (a WorkerRequest). The previous job must have ended.
    void start(const std::string& line);
    /// Cancels the job within a tenth of a second. A job that reports progress often enough stops
    /// by itself; otherwise the job's process is ended.
    void cancel() const;
    /// Ends the process like the destructor, but without waiting.
    void terminate() const;
    /// Reads the available lines without blocking: progress lines, and the result line if a job has
    /// ended. Returns false once the process has ended.
    bool read(std::vector<std::string>& progress, std::string& ended);
    /// Return the signal that ended the process (0 = the process exited by itself) and the exit
    /// code.
    int endingSignal() const { return ending_signal_; }
    int exitCode() const { return exit_code_; }

  private:
    [[noreturn]] static void serve(int file, const JobLimits& limits, pid_t parent);

    pid_t process_ = -1;  ///< −1 = ended
    int file_ = -1;
    std::string text_;  ///< the beginning of a line whose end has not arrived yet
    int ending_signal_ = 0, exit_code_ = 0;
};

}  // namespace peeler::cmd
