// SPDX-License-Identifier: Apache-2.0
// The tables of limits.
#include "cmd/machine/limits.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <span>
#include <string_view>

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kKibi = 1024, kMebi = kKibi * 1024;

/// Memory without a limit is the largest whole page of 63 bits in version 1.
constexpr std::uint64_t kNoLimit = std::uint64_t{1} << 62;

/// A whole number from 1; nothing for "max", −1, and what is none.
std::optional<std::uint64_t> positive(std::string_view text) {
    std::uint64_t value = 0;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure != std::errc() || end != text.data() + text.size() || value == 0)
        return std::nullopt;
    return value;
}

/// The words of the first line of a file; none if it cannot be read.
std::vector<std::string> wordsOf(const fs::path& path) {
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);
    std::vector<std::string> words;
    for (std::size_t at = 0; (at = line.find_first_not_of(' ', at)) != std::string::npos;) {
        const std::size_t end = std::min(line.find(' ', at), line.size());
        words.push_back(line.substr(at, end - at));
        at = end;
    }
    return words;
}

std::optional<std::uint64_t> numberIn(const std::vector<std::string>& words, std::size_t index) {
    return index < words.size() ? positive(words[index]) : std::nullopt;
}

std::optional<std::uint64_t> roundedUp(std::optional<std::uint64_t> quota,
                                       std::optional<std::uint64_t> period) {
    if (!quota || !period) return std::nullopt;
    return *quota / *period + (*quota % *period != 0 ? 1 : 0);
}

// One reader for each kind of file; `folder` is a cgroup's.
std::optional<std::uint64_t> bytesIn(const fs::path& folder, const char* file) {
    const auto bytes = numberIn(wordsOf(folder / file), 0);
    return bytes && *bytes < kNoLimit ? bytes : std::nullopt;
}

/// "200000 100000": so many microseconds of every so many.
std::optional<std::uint64_t> quotaAndPeriodIn(const fs::path& folder, const char* file) {
    const auto words = wordsOf(folder / file);
    return roundedUp(numberIn(words, 0), numberIn(words, 1));
}

std::optional<std::uint64_t> quotaIn(const fs::path& folder, const char* file) {
    return roundedUp(numberIn(wordsOf(folder / file), 0),
                     numberIn(wordsOf(folder / "cpu.cfs_period_us"), 0));
}

struct LimitFile {
    const char* controller;  ///< of version 1; "" = version 2
    const char* name;
    std::optional<std::uint64_t> (*read)(const fs::path& folder, const char* file);
};

// Linux, Documentation/admin-guide/cgroup-v2.rst and cgroup-v1/memory.rst,
// Documentation/scheduler/sched-bwc.rst.
constexpr LimitFile kProcessorFiles[] = {
    {"", "cpu.max", quotaAndPeriodIn},
    {"cpu", "cpu.cfs_quota_us", quotaIn},
};
constexpr LimitFile kMemoryFiles[] = {
    {"", "memory.max", bytesIn},
    {"", "memory.high", bytesIn},
    {"memory", "memory.limit_in_bytes", bytesIn},
};

struct LimitVariable {
    const char* name;
    std::uint64_t unit;
    /// The first of these that is set says how many of them there are; none = one.
    std::span<const char* const> times;
};

constexpr const char* kCpusOfTask[] = {"SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE"};

// sbatch(1), "OUTPUT ENVIRONMENT VARIABLES"; OpenCue's dispatcher (DispatchSupportService).
constexpr LimitVariable kProcessorVariables[] = {
    {"SLURM_CPUS_PER_TASK", 1, {}},
    {"CUE_THREADS", 1, {}},
};
constexpr LimitVariable kMemoryVariables[] = {
    {"SLURM_MEM_PER_NODE", kMebi, {}},
    {"SLURM_MEM_PER_CPU", kMebi, kCpusOfTask},
    {"CUE_MEMORY", kKibi, {}},
};

std::optional<std::uint64_t> numberOf(const Surroundings& surroundings, const char* name) {
    const char* text = surroundings.variable(name);
    return text ? positive(text) : std::nullopt;
}

std::optional<std::uint64_t> countOf(const Surroundings& surroundings, const LimitVariable& row) {
    if (row.times.empty()) return 1;
    for (const char* name : row.times)
        if (const auto count = numberOf(surroundings, name)) return count;
    return std::nullopt;
}

std::vector<Limit> limitsOf(const Surroundings& surroundings, std::span<const LimitFile> files,
                            std::span<const LimitVariable> variables) {
    std::vector<Limit> limits;
    for (const LimitFile& row : files) {
        for (const Cgroup& group : surroundings.cgroups.of(row.controller)) {
            if (const auto amount = row.read(group.folder, row.name))
                limits.push_back({*amount, "the cgroup " + group.name + " (" + row.name + ")"});
        }
    }
    for (const LimitVariable& row : variables) {
        const auto value = numberOf(surroundings, row.name);
        const auto count = countOf(surroundings, row);
        constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
        if (!value || !count || *value > kMost / row.unit / *count) continue;
        limits.push_back({*value * row.unit * *count, row.name});
    }
    return limits;
}

}  // namespace

const Surroundings& ownSurroundings() {
    static const Surroundings own{
        Cgroups("/"), [](const char* name) -> const char* { return std::getenv(name); }};
    return own;
}

std::vector<Limit> processorLimits(const Surroundings& surroundings) {
    return limitsOf(surroundings, kProcessorFiles, kProcessorVariables);
}

std::vector<Limit> memoryLimits(const Surroundings& surroundings) {
    return limitsOf(surroundings, kMemoryFiles, kMemoryVariables);
}

std::optional<Limit> least(const std::vector<Limit>& limits) {
    const auto found =
        std::min_element(limits.begin(), limits.end(),
                         [](const Limit& a, const Limit& b) { return a.amount < b.amount; });
    return found == limits.end() ? std::nullopt : std::optional(*found);
}

}  // namespace peeler::cmd
