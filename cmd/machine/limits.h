// SPDX-License-Identifier: Apache-2.0
// Processor and memory limits of cgroups and schedulers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace peeler::cmd {

struct Cgroup {
    std::string name;              ///< path below the mount: "/", "/slurm/job_7"
    std::filesystem::path folder;  ///< folder with the group's files
};

/// The cgroups that this process was in at construction; the limits in their files may change
/// later. See cgroups(7), and proc(5) for mountinfo.
class Cgroups {
  public:
    /// Reads from `root`/proc/self the groups of this process and their mount points.
    explicit Cgroups(std::filesystem::path root);

    /// Returns the process's own group, then its ancestors as far as they are mounted. `controller`
    /// is a version 1 controller ("memory"), or "" for the version 2 hierarchy. Empty if the
    /// hierarchy is not mounted. In a container, the container's own group may look like the root.
    /// Limits of the groups above are then invisible.
    std::vector<Cgroup> of(const std::string& controller) const;

  private:
    // `controllers` is a comma-separated list; "" is the version 2 hierarchy.
    struct Membership {
        std::string controllers;
        std::string name;  ///< path of the process's group
    };
    struct Mount {
        std::string controllers;  ///< comma-separated mount options, including the controllers
        std::string top;          ///< path of the group that is mounted
        std::string point;
    };
    static std::optional<Membership> membershipIn(const std::string& line);
    static std::optional<Mount> mountIn(const std::string& line);

    std::filesystem::path root_;
    std::vector<Membership> memberships_;
    std::vector<Mount> mounts_;
};

/// A limit, in processors or bytes, and its source: "the cgroup /job_7 (memory.max)",
/// "SLURM_CPUS_PER_TASK".
struct Limit {
    std::uint64_t amount = 0;
    std::string source;
    bool operator==(const Limit&) const = default;
};

/// The sources of limits: system files and environment variables. Tests supply their own.
struct LimitSources {
    Cgroups cgroups;
    /// Returns the value of an environment variable, or null if it is not set.
    std::function<const char*(const char* name)> variable;
};

/// Returns the system files and environment variables of this process.
const LimitSources& processLimitSources();

/// Returns every processor limit except CPU affinity:
/// - the quota of the process's cgroup and its ancestors: cpu.max (v2), cpu.cfs_quota_us (v1),
///   each divided by its period and rounded up
/// - SLURM_CPUS_PER_TASK (sbatch --cpus-per-task), CUE_THREADS (OpenCue)
/// A value that is missing, "max" or not a positive number is no limit.
std::vector<Limit> processorLimits(const LimitSources& sources);

/// Returns every memory limit, in bytes:
/// - memory.max and memory.high (v2), memory.limit_in_bytes (v1) of the process's cgroup and its
///   ancestors
/// - SLURM_MEM_PER_NODE (MiB; sbatch --mem), SLURM_MEM_PER_CPU times SLURM_CPUS_PER_TASK (or
///   SLURM_CPUS_ON_NODE), CUE_MEMORY (KiB; OpenCue's reservation)
std::vector<Limit> memoryLimits(const LimitSources& sources);

/// Returns the smallest limit, or the first of several equal ones; nothing if the list is empty.
std::optional<Limit> least(const std::vector<Limit>& limits);

}  // namespace peeler::cmd
