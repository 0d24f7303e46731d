// SPDX-License-Identifier: Apache-2.0
// Job process: runs a worker's jobs one by one.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace peeler::cmd {

/// The limits of each of a worker's processes.
struct JobLimits {
    int threads = 0;           ///< default for jobs; 0 = the jobs choose
    std::uint64_t memory = 0;  ///< bytes, default for jobs; 0 = the jobs choose
    std::uint64_t keep = 0;    ///< limit on the bytes of scenes kept open between jobs
};

/// A separate process, so that a driver crash affects only one job and a cancelled job ends at
/// once. It is forked, shares only stderr with the worker, and ends with the worker.
class JobProcess {
  public:
    /// Throws Error (kInternal) if the system has no process or socket left.
    explicit JobProcess(const JobLimits& limits);
    /// Ends the process, which removes its temporary files.
    ~JobProcess();
    JobProcess(const JobProcess&) = delete;
    JobProcess& operator=(const JobProcess&) = delete;

    /// Returns the file descriptor to poll for input.
    int file() const { return file_; }
    /// Starts the job in `line`, a WorkerRequest. The previous job must have ended.
    void start(const std::string& line);
    /// Cancels the job within a tenth of a second: by itself if it reports progress that often,
    /// else by ending the process.
    void cancel() const;
    /// Ends the process, as the destructor does, without waiting for it.
    void terminate() const;
    /// Reads available lines without blocking: progress lines, and the line of an ended job.
    /// Returns false once the process has ended.
    bool read(std::vector<std::string>& progress, std::string& ended);
    /// Return, after the end, the signal that ended it (0 = exited) and its exit code.
    int endingSignal() const { return ending_signal_; }
    int exitCode() const { return exit_code_; }

  private:
    [[noreturn]] static void serve(int file, const JobLimits& limits, pid_t parent);

    pid_t process_ = -1;  ///< −1 = ended
    int file_ = -1;
    std::string text_;  ///< an incomplete line
    int ending_signal_ = 0, exit_code_ = 0;
};

}  // namespace peeler::cmd
