// SPDX-License-Identifier: Apache-2.0
#include "cmd/machine/limits.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <span>
#include <sstream>
#include <string_view>
#include <utility>

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

/// Whether a comma-separated list contains the word.
bool lists(std::string_view list, std::string_view word) {
    while (true) {
        const std::size_t end = list.find(',');
        if (list.substr(0, end) == word) return true;
        if (end == std::string_view::npos) return false;
        list.remove_prefix(end + 1);
    }
}

/// Decodes the octal escapes in mountinfo: a space is \040, a backslash \134.
std::string unescaped(const std::string& text) {
    std::string out;
    const auto octal = [&](std::size_t at) {
        return at < text.size() && text[at] >= '0' && text[at] <= '7';
    };
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '\\' && octal(i + 1) && octal(i + 2) && octal(i + 3)) {
            const int code =
                (text[i + 1] - '0') * 64 + (text[i + 2] - '0') * 8 + (text[i + 3] - '0');
            out += static_cast<char>(code);
            i += 3;
        } else {
            out += text[i];
        }
    }
    return out;
}

/// Returns the path of the group `path` relative to the mounted group `top`; "/" if `path` is not
/// below `top`.
fs::path below(const std::string& top, const std::string& path) {
    const fs::path relative = fs::path(path).lexically_normal().lexically_relative(top);
    if (relative.empty() || relative == "." || *relative.begin() == "..") return "/";
    return "/" / relative;
}

constexpr std::uint64_t kKibi = 1024, kMebi = kKibi * 1024;

/// A limit of this many bytes or more means "no limit". If there is no limit, cgroup version 1
/// reports the largest multiple of the page size below 2^63.
constexpr std::uint64_t kNoLimit = std::uint64_t{1} << 62;

/// Parses a positive integer. Returns nothing for "max", −1 and text that is not a number.
std::optional<std::uint64_t> positive(std::string_view text) {
    std::uint64_t value = 0;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure != std::errc() || end != text.data() + text.size() || value == 0)
        return std::nullopt;
    return value;
}

/// Returns the words in a file's first line; empty if the file cannot be read.
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

// Readers for the kinds of limit files. `folder` is a cgroup's folder.
std::optional<std::uint64_t> bytesIn(const fs::path& folder, const char* file) {
    const auto bytes = numberIn(wordsOf(folder / file), 0);
    return bytes && *bytes < kNoLimit ? bytes : std::nullopt;
}

/// Reads "200000 100000": quota and period in microseconds.
std::optional<std::uint64_t> quotaAndPeriodIn(const fs::path& folder, const char* file) {
    const auto words = wordsOf(folder / file);
    return roundedUp(numberIn(words, 0), numberIn(words, 1));
}

std::optional<std::uint64_t> quotaIn(const fs::path& folder, const char* file) {
    return roundedUp(numberIn(wordsOf(folder / file), 0),
                     numberIn(wordsOf(folder / "cpu.cfs_period_us"), 0));
}

struct LimitFile {
    const char* controller;  ///< name of a cgroup v1 controller; "" = cgroup v2
    const char* name;
    std::optional<std::uint64_t> (*read)(const fs::path& folder, const char* file);
};

// Sources: Linux, Documentation/admin-guide/cgroup-v2.rst and cgroup-v1/memory.rst,
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
    /// Processors or bytes per unit of the variable's value.
    std::uint64_t unit;
    /// The limit is multiplied by the first of these variables that is set; empty = not multiplied.
    std::span<const char* const> times;
};

constexpr const char* kCpusOfTask[] = {"SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE"};

// Sources: sbatch(1), "OUTPUT ENVIRONMENT VARIABLES"; OpenCue's dispatcher
// (DispatchSupportService).
constexpr LimitVariable kProcessorVariables[] = {
    {"SLURM_CPUS_PER_TASK", 1, {}},
    {"CUE_THREADS", 1, {}},
};
constexpr LimitVariable kMemoryVariables[] = {
    {"SLURM_MEM_PER_NODE", kMebi, {}},
    {"SLURM_MEM_PER_CPU", kMebi, kCpusOfTask},
    {"CUE_MEMORY", kKibi, {}},
};

std::optional<std::uint64_t> numberOf(const LimitSources& sources, const char* name) {
    const char* text = sources.variable(name);
    return text ? positive(text) : std::nullopt;
}

std::optional<std::uint64_t> countOf(const LimitSources& sources, const LimitVariable& row) {
    if (row.times.empty()) return 1;
    for (const char* name : row.times)
        if (const auto count = numberOf(sources, name)) return count;
    return std::nullopt;
}

std::vector<Limit> limitsOf(const LimitSources& sources, std::span<const LimitFile> files,
                            std::span<const LimitVariable> variables) {
    std::vector<Limit> limits;
    for (const LimitFile& row : files) {
        for (const Cgroup& group : sources.cgroups.of(row.controller)) {
            if (const auto amount = row.read(group.folder, row.name))
                limits.push_back({*amount, "the cgroup " + group.name + " (" + row.name + ")"});
        }
    }
    for (const LimitVariable& row : variables) {
        const auto value = numberOf(sources, row.name);
        const auto count = countOf(sources, row);
        constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
        if (!value || !count || *value > kMost / row.unit / *count) continue;
        limits.push_back({*value * row.unit * *count, row.name});
    }
    return limits;
}

}  // namespace

Cgroups::Cgroups(fs::path root) : root_(std::move(root)) {
    std::ifstream groups(root_ / "proc/self/cgroup"), mounts(root_ / "proc/self/mountinfo");
    for (std::string line; std::getline(groups, line);)
        if (auto membership = membershipIn(line)) memberships_.push_back(std::move(*membership));
    for (std::string line; std::getline(mounts, line);)
        if (auto mount = mountIn(line)) mounts_.push_back(std::move(*mount));
}

/// A line of the process's cgroup file has a hierarchy number, a list of controllers and a path,
/// separated by colons; the path may contain colons.
std::optional<Cgroups::Membership> Cgroups::membershipIn(const std::string& line) {
    const std::size_t first = line.find(':');
    if (first == std::string::npos) return std::nullopt;
    const std::size_t second = line.find(':', first + 1);
    if (second == std::string::npos) return std::nullopt;
    return Membership{line.substr(first + 1, second - first - 1), line.substr(second + 1)};
}

/// A line of mountinfo has four fields, the mount point, its options, any number of optional
/// fields, "-", then the type, source and options of the file system.
std::optional<Cgroups::Mount> Cgroups::mountIn(const std::string& line) {
    std::istringstream stream(line);
    const std::vector<std::string> words{std::istream_iterator<std::string>(stream), {}};
    const auto dash = std::find(words.begin(), words.end(), "-");
    if (words.end() - dash < 4 || dash - words.begin() < 6) return std::nullopt;
    const bool second = dash[1] == "cgroup2";
    if (!second && dash[1] != "cgroup") return std::nullopt;
    return Mount{second ? "" : dash[3], unescaped(words[3]), unescaped(words[4])};
}

std::vector<Cgroup> Cgroups::of(const std::string& controller) const {
    const auto controlled = [&](const auto& row) { return lists(row.controllers, controller); };
    const auto own = std::ranges::find_if(memberships_, controlled);
    const auto mount = std::ranges::find_if(mounts_, controlled);
    std::vector<Cgroup> groups;
    if (own == memberships_.end() || mount == mounts_.end()) return groups;
    const fs::path point = root_ / fs::path(mount->point).relative_path();
    for (fs::path name = below(mount->top, own->name);; name = name.parent_path()) {
        groups.push_back({name.string(), point / name.relative_path()});
        if (name == name.root_path()) return groups;
    }
}

const LimitSources& processLimitSources() {
    static const LimitSources own{
        Cgroups("/"), [](const char* name) -> const char* { return std::getenv(name); }};
    return own;
}

std::vector<Limit> processorLimits(const LimitSources& sources) {
    return limitsOf(sources, kProcessorFiles, kProcessorVariables);
}

std::vector<Limit> memoryLimits(const LimitSources& sources) {
    return limitsOf(sources, kMemoryFiles, kMemoryVariables);
}

std::optional<Limit> least(const std::vector<Limit>& limits) {
    const auto found =
        std::min_element(limits.begin(), limits.end(),
                         [](const Limit& a, const Limit& b) { return a.amount < b.amount; });
    return found == limits.end() ? std::nullopt : std::optional(*found);
}

}  // namespace peeler::cmd
