// SPDX-License-Identifier: Apache-2.0
// What schedulers and the kernel let a process have: limits of processors and of memory.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cmd/machine/cgroups.h"

namespace peeler::cmd {

/// An amount, and who limits to it: "the cgroup /job_7 (memory.max)", "SLURM_CPUS_PER_TASK".
struct Limit {
    std::uint64_t amount = 0;
    std::string source;
    bool operator==(const Limit&) const = default;
};

/// Where limits are read. The default is this process's surroundings; tests have others.
struct Surroundings {
    Cgroups cgroups;
    /// The value of an environment variable, null if it is not set.
    std::function<const char*(const char* name)> variable;
};

const Surroundings& ownSurroundings();

/// Every limit of processors that there is, CPU affinity aside:
/// - the quota of the process's cgroup and of those above it: cpu.max (v2), cpu.cfs_quota_us (v1),
///   each divided by its period and rounded up
/// - SLURM_CPUS_PER_TASK (sbatch --cpus-per-task), CUE_THREADS (OpenCue)
/// What is missing, says "max" or is no positive number limits nothing.
std::vector<Limit> processorLimits(const Surroundings& surroundings);

/// Every limit of memory, in bytes:
/// - of the process's cgroup and of those above it: memory.max and memory.high (v2),
///   memory.limit_in_bytes (v1)
/// - SLURM_MEM_PER_NODE (MiB; sbatch --mem), SLURM_MEM_PER_CPU times SLURM_CPUS_PER_TASK (or
///   SLURM_CPUS_ON_NODE), CUE_MEMORY (KiB; OpenCue's reservation)
std::vector<Limit> memoryLimits(const Surroundings& surroundings);

/// The first of the least.
std::optional<Limit> least(const std::vector<Limit>& limits);

}  // namespace peeler::cmd
