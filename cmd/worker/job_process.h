// SPDX-License-Identifier: Apache-2.0
// A process that runs the jobs of a worker, one after the other.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace peeler::cmd {

/// What each process of a worker may use.
struct JobLimits {
    int threads = 0;           ///< for jobs that do not say; 0 = they choose
    std::uint64_t memory = 0;  ///< bytes, likewise; 0 = they choose
    std::uint64_t keep = 0;    ///< most bytes of scenes that stay open between jobs
};

/// A process of its own, so that a driver that crashes takes one job along, and a cancelled job
/// ends at once. It is forked, has nothing of the worker's but stderr, and ends with it.
class JobProcess {
  public:
    /// Throws Error (kInternal) if the system has no process or socket left.
    explicit JobProcess(const JobLimits& limits);
    /// Ends the process, which removes its temporary files.
    ~JobProcess();
    JobProcess(const JobProcess&) = delete;
    JobProcess& operator=(const JobProcess&) = delete;

    /// To be polled for input.
    int file() const { return file_; }
    /// Starts the job in `line`, a WorkerRequest; the one before has ended.
    void start(const std::string& line);
    /// The job ends within a tenth of a second: by itself where it reports progress that often,
    /// else with the process.
    void cancel() const;
    /// Ends the process, as the destructor does, without waiting for it.
    void terminate() const;
    /// Takes the lines that have come, without waiting: of progress, and of a job that has ended.
    /// False once the process has ended.
    bool read(std::vector<std::string>& progress, std::string& ended);
    /// Once it has ended: by which signal (0: by itself), and its exit code.
    int endingSignal() const { return ending_signal_; }
    int exitCode() const { return exit_code_; }

  private:
    [[noreturn]] static void serve(int file, const JobLimits& limits, pid_t parent);

    pid_t process_ = -1;  ///< −1 = it has ended
    int file_ = -1;
    std::string text_;  ///< of a line that has not come to its end
    int ending_signal_ = 0, exit_code_ = 0;
};

}  // namespace peeler::cmd
