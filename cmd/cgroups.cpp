// SPDX-License-Identifier: Apache-2.0
#include "cmd/cgroups.h"

#include <algorithm>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>

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

/// From a line of /proc/self/cgroup: number, controllers and path with colons between; the path may
/// hold more of them.
std::optional<std::string> ownPath(const fs::path& root, const std::string& controller) {
    std::ifstream file(root / "proc/self/cgroup");
    for (std::string line; std::getline(file, line);) {
        const std::size_t first = line.find(':');
        if (first == std::string::npos) continue;
        const std::size_t second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        if (lists(std::string_view(line).substr(first + 1, second - first - 1), controller))
            return line.substr(second + 1);
    }
    return std::nullopt;
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

struct Mount {
    std::string top;    ///< the group that is mounted
    std::string point;  ///< where
};

std::optional<Mount> mountOf(const fs::path& root, const std::string& controller) {
    std::ifstream file(root / "proc/self/mountinfo");
    for (std::string line; std::getline(file, line);) {
        std::istringstream stream(line);
        std::vector<std::string> words;
        for (std::string word; stream >> word;)
            words.push_back(word);
        // Four fields, the mount point, its options, any number of others, "-", type, source and
        // the options of the file system.
        const auto dash = std::find(words.begin(), words.end(), "-");
        if (words.end() - dash < 4 || dash - words.begin() < 6) continue;
        const bool found = controller.empty() ? dash[1] == "cgroup2"
                                              : dash[1] == "cgroup" && lists(dash[3], controller);
        if (found) return Mount{unescaped(words[3]), unescaped(words[4])};
    }
    return std::nullopt;
}

/// A group's path below what is mounted; "/" where the mount shows no such group.
fs::path below(const std::string& top, const std::string& path) {
    const fs::path relative = fs::path(path).lexically_normal().lexically_relative(top);
    if (relative.empty() || relative == "." || *relative.begin() == "..") return "/";
    return "/" / relative;
}

}  // namespace

std::vector<Cgroup> cgroupsOf(const fs::path& root, const std::string& controller) {
    std::vector<Cgroup> groups;
    const auto path = ownPath(root, controller);
    const auto mount = mountOf(root, controller);
    if (!path || !mount) return groups;
    const fs::path point = root / fs::path(mount->point).relative_path();
    for (fs::path name = below(mount->top, *path);; name = name.parent_path()) {
        groups.push_back({name.string(), point / name.relative_path()});
        if (name == name.root_path()) return groups;
    }
}

}  // namespace peeler::cmd
