// SPDX-License-Identifier: Apache-2.0
// The control groups that a process is in.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace peeler::cmd {

struct Cgroup {
    std::string name;              ///< below its mount: "/", "/slurm/job_7"
    std::filesystem::path folder;  ///< where its files are
};

/// The group of the process that reads `root`/proc/self, and those above it as far up as they are
/// mounted, its own first. `controller` is one of version 1 ("memory"), or "" for the hierarchy of
/// version 2. Empty if that is not mounted. A container may see its own group as the root; limits
/// above it are not to be seen then. (cgroups(7), proc(5): mountinfo.)
std::vector<Cgroup> cgroupsOf(const std::filesystem::path& root, const std::string& controller);

}  // namespace peeler::cmd
