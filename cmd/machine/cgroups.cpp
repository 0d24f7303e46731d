// SPDX-License-Identifier: Apache-2.0
#include "cmd/machine/cgroups.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>
#include <utility>

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

/// Whether a list with commas has the word.
bool lists(std::string_view list, std::string_view word) {
    while (true) {
        const std::size_t end = list.find(',');
        if (list.substr(0, end) == word) return true;
        if (end == std::string_view::npos) return false;
        list.remove_prefix(end + 1);
    }
}

/// mountinfo writes blanks and backslashes as \040 and \134.
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

/// A group's path below what is mounted; "/" where the mount shows no such group.
fs::path below(const std::string& top, const std::string& path) {
    const fs::path relative = fs::path(path).lexically_normal().lexically_relative(top);
    if (relative.empty() || relative == "." || *relative.begin() == "..") return "/";
    return "/" / relative;
}

}  // namespace

Cgroups::Cgroups(fs::path root) : root_(std::move(root)) {
    std::ifstream groups(root_ / "proc/self/cgroup"), mounts(root_ / "proc/self/mountinfo");
    for (std::string line; std::getline(groups, line);)
        if (auto membership = membershipIn(line)) memberships_.push_back(std::move(*membership));
    for (std::string line; std::getline(mounts, line);)
        if (auto mount = mountIn(line)) mounts_.push_back(std::move(*mount));
}

/// Number, controllers and path with colons between; the path may hold more of them.
std::optional<Cgroups::Membership> Cgroups::membershipIn(const std::string& line) {
    const std::size_t first = line.find(':');
    if (first == std::string::npos) return std::nullopt;
    const std::size_t second = line.find(':', first + 1);
    if (second == std::string::npos) return std::nullopt;
    return Membership{line.substr(first + 1, second - first - 1), line.substr(second + 1)};
}

/// Four fields, the mount point, its options, any number of others, "-", type, source and the
/// options of the file system.
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

}  // namespace peeler::cmd
