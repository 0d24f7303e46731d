// SPDX-License-Identifier: Apache-2.0
// Limits of processors and memory that control groups and schedulers set.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace peeler::cmd {

struct Cgroup {
    std::string name;              ///< below its mount: "/", "/slurm/job_7"
    std::filesystem::path folder;  ///< where its files are
};

/// The groups of one process, as they were when it was made; what limits them may change.
/// (cgroups(7), proc(5): mountinfo.)
class Cgroups {
  public:
    /// Reads the groups of this process, and where groups are mounted, below `root`/proc/self.
    explicit Cgroups(std::filesystem::path root);

    /// The group of the process and those above it as far up as they are mounted, its own first.
    /// `controller` is one of version 1 ("memory"), or "" for the hierarchy of version 2. Empty if
    /// that is not mounted. A container may see its own group as the root; limits above it are not
    /// to be seen then.
    std::vector<Cgroup> of(const std::string& controller) const;

  private:
    // Controllers are a list with commas; "" is the hierarchy of version 2.
    struct Membership {
        std::string controllers;
        std::string name;  ///< of the group that the process is in
    };
    struct Mount {
        std::string controllers;  ///< among other options of the mount
        std::string top;          ///< the group that is mounted
        std::string point;        ///< where it is mounted
    };
    static std::optional<Membership> membershipIn(const std::string& line);
    static std::optional<Mount> mountIn(const std::string& line);

    std::filesystem::path root_;
    std::vector<Membership> memberships_;
    std::vector<Mount> mounts_;
};

/// A number of processors or bytes, and who limits to it: "the cgroup /job_7 (memory.max)",
/// "SLURM_CPUS_PER_TASK".
struct Limit {
    std::uint64_t amount = 0;
    std::string source;
    bool operator==(const Limit&) const = default;
};

/// Where limits are read: files of the system and variables of the environment. Tests make up their
/// own.
struct LimitSources {
    Cgroups cgroups;
    /// The value of an environment variable, null if it is not set.
    std::function<const char*(const char* name)> variable;
};

/// The files and variables of this process.
const LimitSources& processLimitSources();

/// Every limit of processors that there is, CPU affinity aside:
/// - the quota of the process's cgroup and of those above it: cpu.max (v2), cpu.cfs_quota_us (v1),
///   each divided by its period and rounded up
/// - SLURM_CPUS_PER_TASK (sbatch --cpus-per-task), CUE_THREADS (OpenCue)
/// What is missing, says "max" or is no positive number limits nothing.
std::vector<Limit> processorLimits(const LimitSources& sources);

/// Every limit of memory, in bytes:
/// - of the process's cgroup and of those above it: memory.max and memory.high (v2),
///   memory.limit_in_bytes (v1)
/// - SLURM_MEM_PER_NODE (MiB; sbatch --mem), SLURM_MEM_PER_CPU times SLURM_CPUS_PER_TASK (or
///   SLURM_CPUS_ON_NODE), CUE_MEMORY (KiB; OpenCue's reservation)
std::vector<Limit> memoryLimits(const LimitSources& sources);

/// The least of some limits, of equal ones the first; nothing if there are none.
std::optional<Limit> least(const std::vector<Limit>& limits);

}  // namespace peeler::cmd
