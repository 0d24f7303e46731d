// SPDX-License-Identifier: Apache-2.0
// The control groups that a process is in.
#pragma once

#include <filesystem>
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
    /// Those of the process that reads `root`/proc/self.
    explicit Cgroups(std::filesystem::path root);

    /// Its group, and those above it as far up as they are mounted, its own first. `controller` is
    /// one of version 1 ("memory"), or "" for the hierarchy of version 2. Empty if that is not
    /// mounted. A container may see its own group as the root; limits above it are not to be seen
    /// then.
    std::vector<Cgroup> of(const std::string& controller) const;

  private:
    // Controllers are a list with commas; "" is the hierarchy of version 2.
    struct Membership {
        std::string controllers;
        std::string name;  ///< of the group that the process is in
    };
    struct Mount {
        std::string controllers;  ///< with other options among them
        std::string top;          ///< the group that is mounted
        std::string point;        ///< where
    };
    static std::optional<Membership> membershipIn(const std::string& line);
    static std::optional<Mount> mountIn(const std::string& line);

    std::filesystem::path root_;
    std::vector<Membership> memberships_;
    std::vector<Mount> mounts_;
};

}  // namespace peeler::cmd
