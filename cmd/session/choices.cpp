// SPDX-License-Identifier: Apache-2.0
#include "cmd/session/choices.h"

#include <algorithm>
#include <cstddef>

namespace peeler::cmd {

void refuseName(const std::string& kind, std::string_view text,
                std::span<const std::string_view> names) {
    throw Error(ErrorKind::kUsage, "unknown " + kind + " '" + std::string(text) + "'", "",
                choiceHint(text, pluralOf(kind), names));
}

std::vector<std::string_view> listedNames(const std::string& kind, std::string_view list,
                                          std::span<const std::string_view> names) {
    std::vector<std::string_view> listed;
    for (std::size_t begin = 0; begin <= list.size();) {
        const std::size_t end = std::min(list.find(',', begin), list.size());
        const std::string_view name = list.substr(begin, end - begin);
        const auto found = std::ranges::find(names, name);
        if (found == names.end()) refuseName(kind, name, names);
        listed.push_back(*found);
        begin = end + 1;
    }
    return listed;
}

}  // namespace peeler::cmd
