// SPDX-License-Identifier: Apache-2.0
// Tests processor and memory limits, read from simulated file trees and variables.
#include "cmd/machine/limits.h"
#include "cmd/machine/resources.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <string>

#include "support/test_support.h"

namespace peeler::cmd {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMebi = 1 << 20;

/// A simulated machine with these files (by path below its root) and variables.
class FakeMachine {
  public:
    FakeMachine& file(const std::string& path, const std::string& text) {
        fs::create_directories((scratch_ / path).parent_path());
        std::ofstream(scratch_ / path) << text;
        return *this;
    }
    FakeMachine& groups(const std::string& text) { return file("proc/self/cgroup", text); }
    FakeMachine& mounts(const std::string& text) { return file("proc/self/mountinfo", text); }
    FakeMachine& set(const std::string& name, const std::string& value) {
        variables_[name] = value;
        return *this;
    }
    LimitSources sources() const {
        return {Cgroups(scratch_.path()), [this](const char* name) -> const char* {
                    const auto entry = variables_.find(name);
                    return entry == variables_.end() ? nullptr : entry->second.c_str();
                }};
    }
    std::optional<Limit> memory() const { return least(memoryLimits(sources())); }
    std::optional<Limit> processors() const { return least(processorLimits(sources())); }
    const test::ScratchDir& folder() const { return scratch_; }

  private:
    test::ScratchDir scratch_;
    std::map<std::string, std::string> variables_;
};

constexpr const char* kVersion2 =
    "25 1 8:1 / / rw - ext4 /dev/sda1 rw\n"
    "30 25 0:26 / /sys/fs/cgroup rw,nosuid shared:4 - cgroup2 cgroup2 rw,nsdelegate\n";

TEST(Limits, NothingLimitsAMachineWithoutAnything) {
    const FakeMachine machine;
    EXPECT_EQ(machine.memory(), std::nullopt);
    EXPECT_EQ(machine.processors(), std::nullopt);
}

TEST(Limits, OfVersionTwoAreThoseOfAllGroupsAbove) {
    FakeMachine machine;
    machine.mounts(kVersion2).groups("0::/slurm/job_7/step:0\n");
    const std::string top = "sys/fs/cgroup/";
    machine.file(top + "slurm/job_7/step:0/memory.max", "max\n")
        .file(top + "slurm/job_7/step:0/cpu.max", "max 100000\n")
        .file(top + "slurm/job_7/memory.max", "2147483648\n")
        .file(top + "slurm/job_7/cpu.max", "250000 100000\n")
        .file(top + "slurm/memory.max", "8589934592\n")
        .file(top + "slurm/cpu.max", "800000 100000\n");
    EXPECT_EQ(machine.memory(), (Limit{2048 * kMebi, "the cgroup /slurm/job_7 (memory.max)"}));
    EXPECT_EQ(machine.processors(), (Limit{3, "the cgroup /slurm/job_7 (cpu.max)"}))
        << "two and a half, rounded up";
    machine.file(top + "slurm/job_7/step:0/memory.high", "1073741824\n");
    machine.file(top + "slurm/cpu.max", "50000 100000\n");
    EXPECT_EQ(machine.memory(),
              (Limit{1024 * kMebi, "the cgroup /slurm/job_7/step:0 (memory.high)"}));
    EXPECT_EQ(machine.processors(), (Limit{1, "the cgroup /slurm (cpu.max)"}));
}

TEST(Limits, OfVersionOneHaveAMountForEachController) {
    FakeMachine machine;
    machine
        .mounts(
            "31 30 0:27 / /sys/fs/cgroup/cpu,cpuacct rw - cgroup cgroup rw,cpu,cpuacct\n"
            "32 30 0:28 / /sys/fs/cgroup/mem\\040ory rw master:3 - cgroup cgroup rw,memory\n")
        .groups("5:cpu,cpuacct:/farm/a\n4:memory:/farm/b\n1:name=systemd:/\n0::/\n");
    const std::string cpu = "sys/fs/cgroup/cpu,cpuacct/farm/", memory = "sys/fs/cgroup/mem ory/";
    machine.file(cpu + "a/cpu.cfs_quota_us", "-1\n").file(cpu + "a/cpu.cfs_period_us", "100000\n");
    machine.file(memory + "farm/b/memory.limit_in_bytes", "9223372036854771712\n");
    EXPECT_EQ(machine.memory(), std::nullopt) << "version 1 has this number for no limit";
    EXPECT_EQ(machine.processors(), std::nullopt);
    machine.file(cpu + "cpu.cfs_quota_us", "200000\n").file(cpu + "cpu.cfs_period_us", "100000\n");
    machine.file(memory + "farm/memory.limit_in_bytes", "536870912\n");
    EXPECT_EQ(machine.memory(), (Limit{512 * kMebi, "the cgroup /farm (memory.limit_in_bytes)"}));
    EXPECT_EQ(machine.processors(), (Limit{2, "the cgroup /farm (cpu.cfs_quota_us)"}));
}

TEST(Limits, OfBothVersionsCountWhereBothAreMounted) {
    FakeMachine machine;
    machine
        .mounts(
            "32 30 0:28 / /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory\n"
            "33 30 0:29 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n")
        .groups("4:memory:/a\n0::/b\n")
        .file("sys/fs/cgroup/memory/a/memory.limit_in_bytes", "1073741824")
        .file("sys/fs/cgroup/unified/b/cpu.max", "400000 100000");
    EXPECT_EQ(machine.memory()->amount, 1024 * kMebi);
    EXPECT_EQ(machine.processors()->amount, 4U);
}

/// A container may mount only its own cgroup, while the path in /proc is relative to the host's
/// root.
TEST(Limits, OfAContainerAreFoundBelowItsMount) {
    FakeMachine machine;
    machine.mounts("30 25 0:26 /docker/c0ffee /sys/fs/cgroup ro - cgroup2 cgroup rw\n")
        .groups("0::/docker/c0ffee/child\n")
        .file("sys/fs/cgroup/memory.max", "1073741824")
        .file("sys/fs/cgroup/child/memory.max", "536870912");
    EXPECT_EQ(machine.memory(), (Limit{512 * kMebi, "the cgroup /child (memory.max)"}));
    machine.groups("0::/docker/c0ffee2\n");
    EXPECT_EQ(machine.memory(), (Limit{1024 * kMebi, "the cgroup / (memory.max)"}))
        << "another group's name begins alike";
    machine.groups("0::/../../etc\n").file("etc/memory.max", "1");
    EXPECT_EQ(machine.memory()->amount, 1024 * kMebi) << "nothing above the mount is read";
}

TEST(Limits, VariablesHaveTheirSchedulersUnits) {
    FakeMachine machine;
    machine.set("CUE_MEMORY", "3145728").set("CUE_THREADS", "6");
    EXPECT_EQ(machine.memory(), (Limit{3072 * kMebi, "CUE_MEMORY"})) << "KiB";
    EXPECT_EQ(machine.processors(), (Limit{6, "CUE_THREADS"}));
    machine.set("SLURM_MEM_PER_NODE", "2048").set("SLURM_CPUS_PER_TASK", "4");
    EXPECT_EQ(machine.memory(), (Limit{2048 * kMebi, "SLURM_MEM_PER_NODE"})) << "MiB";
    EXPECT_EQ(machine.processors(), (Limit{4, "SLURM_CPUS_PER_TASK"}));
}

TEST(Limits, MemoryPerProcessorIsTakenTimesThoseOfTheTask) {
    FakeMachine machine;
    machine.set("SLURM_MEM_PER_CPU", "500");
    EXPECT_EQ(machine.memory(), std::nullopt) << "of how many?";
    machine.set("SLURM_CPUS_ON_NODE", "8");
    EXPECT_EQ(machine.memory(), (Limit{4000 * kMebi, "SLURM_MEM_PER_CPU"}));
    machine.set("SLURM_CPUS_PER_TASK", "2");
    EXPECT_EQ(machine.memory(), (Limit{1000 * kMebi, "SLURM_MEM_PER_CPU"}));
}

TEST(Limits, GarbageLimitsNothing) {
    for (const std::string text : {"", "max", "-1", "0", "12x", "1e9", " ", "0x10", "4 GB",
                                   "99999999999999999999999", "\xff\xfe"}) {
        FakeMachine machine;
        machine.mounts(std::string("nonsense\n- - -\n\n") + kVersion2)
            .groups("\n:\n::\nnonsense\n0::/a\n");
        for (const char* file : {"memory.max", "memory.high"}) {
            if (text != "4 GB") machine.file(std::string("sys/fs/cgroup/a/") + file, text);
        }
        machine.file("sys/fs/cgroup/a/cpu.max", text == "4 GB" ? "4" : text);
        for (const char* name : {"CUE_MEMORY", "CUE_THREADS", "SLURM_MEM_PER_NODE",
                                 "SLURM_CPUS_PER_TASK", "SLURM_MEM_PER_CPU"})
            machine.set(name, text);
        EXPECT_EQ(machine.memory(), std::nullopt) << text;
        EXPECT_EQ(machine.processors(), std::nullopt) << text;
    }
    FakeMachine machine;
    machine.set("SLURM_MEM_PER_NODE", "18446744073709551615");
    EXPECT_EQ(machine.memory(), std::nullopt) << "more bytes than there are numbers";
}

TEST(Limits, TheLeastOfAllCountsAndIsNamed) {
    EXPECT_EQ(least({}), std::nullopt);
    EXPECT_EQ(least({{3, "a"}, {2, "b"}, {2, "c"}}), (Limit{2, "b"}));
    FakeMachine machine;
    machine.mounts(kVersion2).groups("0::/a\n").set("CUE_MEMORY", "2097152");
    machine.file("sys/fs/cgroup/a/memory.max", "1073741824");
    EXPECT_EQ(machine.memory()->source, "the cgroup /a (memory.max)");
    machine.file("sys/fs/cgroup/a/memory.max", "4294967296");
    EXPECT_EQ(machine.memory()->source, "CUE_MEMORY");
}

TEST(Limits, MayChangeOfGroupsThatAreReadOnce) {
    FakeMachine machine;
    machine.mounts(kVersion2).groups("0::/a\n").file("sys/fs/cgroup/a/memory.max", "1073741824");
    const LimitSources sources = machine.sources();
    machine.mounts("").groups("");
    EXPECT_EQ(least(memoryLimits(sources))->amount, 1024 * kMebi);
    machine.file("sys/fs/cgroup/a/memory.max", "536870912");
    EXPECT_EQ(least(memoryLimits(sources))->amount, 512 * kMebi);
}

TEST(Limits, ABudgetIsSevenEighthsOfItsLimitAndNamesIt) {
    const MemoryBudget budget = budgetUnder({800 * kMebi, "CUE_MEMORY"});
    EXPECT_EQ(budget.bytes, 700 * kMebi);
    EXPECT_EQ(budget.where(), "CUE_MEMORY allows 800M");
    EXPECT_EQ(MemoryBudget(512 * kMebi).where(), "`memory` 512M");
    EXPECT_EQ(MemoryBudget(512 * kMebi).hint(600 * kMebi), "give at least 600M");
}

}  // namespace
}  // namespace peeler::cmd
