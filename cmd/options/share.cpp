// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/share.h"

#include "cmd/cli/parse.h"
#include "core/base/error.h"

namespace peeler::cmd {

std::pair<std::size_t, std::size_t> Share::of(std::size_t items) const {
    const auto i = static_cast<std::size_t>(index), n = static_cast<std::size_t>(count);
    return {items * (i - 1) / n, items * i / n};
}

Share parseShare(std::string_view text) {
    constexpr int kMost = 1000000;
    const std::size_t slash = text.find('/');
    try {
        if (slash == std::string_view::npos) throw Error(ErrorKind::kUsage, "no slash");
        Share share;
        share.count = static_cast<int>(parseInteger(text.substr(slash + 1), 1, kMost));
        share.index = static_cast<int>(parseInteger(text.substr(0, slash), 1, share.count));
        return share;
    } catch (const Error&) {
        throw Error(ErrorKind::kUsage, "expected one of so many parts, from 1/N to N/N", "",
                    "e.g. 1/4 for the first of four");
    }
}

}  // namespace peeler::cmd
