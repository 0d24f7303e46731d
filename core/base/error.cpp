// SPDX-License-Identifier: Apache-2.0
#include <peeler/error.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

namespace peeler::inline v0 {

namespace {

/// Returns the text. If it has more than 8,000 bytes, returns its beginning and "…".
Text cut(Text text) {
    constexpr std::size_t kMost = 8000;
    if (text.str().size() <= kMost) return text;
    Text kept;
    text.visit(
        [&](std::string_view words) {
            std::size_t end = std::min(words.size(), kMost - std::min(kMost, kept.str().size()));
            while (end > 0 && end < words.size() && (words[end] & 0xC0) == 0x80)
                --end;  // keep UTF-8 characters whole
            kept += words.substr(0, end);
        },
        [&](Parameter parameter) {
            if (kept.str().size() < kMost) kept += parameter;
        });
    return kept + "…";
}

}  // namespace

Error::Error(ErrorKind kind, Text what, Text where, Text hint)
    : std::runtime_error(cut(what).str()),
      kind_(kind),
      what_(cut(std::move(what))),
      where_(cut(std::move(where))),
      hint_(cut(std::move(hint))) {}

}  // namespace peeler::inline v0
