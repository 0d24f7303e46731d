// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/frames.h"

#include <algorithm>
#include <cstdint>
#include <unordered_set>

#include <peeler/error.h>
#include "cmd/cli/parse.h"

namespace peeler::cmd {

namespace {

constexpr std::size_t kMaxFrames = 1000000;
constexpr std::int64_t kLargest = 2147483647;

struct FrameRange {
    std::int64_t first = 0, last = 0, step = 1;
};

[[noreturn]] void refuseFrames(std::string_view text) {
    throw Error(ErrorKind::kUsage, "expected frames, not '" + std::string(text) + "'", "",
                "e.g. 1-100, 1-100x2, 150,200-180 or -5-5");
}

/// Parses the integer at the beginning of `text`, and removes it from `text`.
std::int64_t takeNumber(std::string_view& text, std::string_view all) {
    std::size_t end = !text.empty() && text[0] == '-' ? 1 : 0;
    while (end < text.size() && text[end] >= '0' && text[end] <= '9')
        ++end;
    std::int64_t number = 0;
    try {
        number = parseInteger(text.substr(0, end), -kLargest, kLargest);
    } catch (const Error&) {
        refuseFrames(all);
    }
    text.remove_prefix(end);
    return number;
}

FrameRange parseFrameRange(std::string_view all) {
    std::string_view text = all;
    FrameRange range;
    range.first = range.last = takeNumber(text, all);
    if (!text.empty() && text[0] == '-') {
        text.remove_prefix(1);
        range.last = takeNumber(text, all);
        if (!text.empty() && (text[0] == 'x' || text[0] == ':')) {
            text.remove_prefix(1);
            range.step = takeNumber(text, all);
            if (range.step < 1) refuseFrames(all);
        }
    }
    if (!text.empty()) refuseFrames(all);
    return range;
}

}  // namespace

std::vector<int> parseFrames(std::string_view text) {
    std::vector<int> frames;
    std::unordered_set<int> seen;
    while (true) {
        const std::size_t comma = std::min(text.find(','), text.size());
        const FrameRange range = parseFrameRange(text.substr(0, comma));
        const std::int64_t step = range.first <= range.last ? range.step : -range.step;
        const std::int64_t count = (range.last - range.first) / step + 1;
        if (static_cast<std::uint64_t>(count) + frames.size() > kMaxFrames)
            throw Error(ErrorKind::kUsage,
                        "there are more than " + std::to_string(kMaxFrames) + " frames", "",
                        "render them in parts");
        for (std::int64_t i = 0; i < count; ++i) {
            const int frame = static_cast<int>(range.first + i * step);
            if (seen.insert(frame).second) frames.push_back(frame);
        }
        if (comma == text.size()) return frames;
        text.remove_prefix(comma + 1);
    }
}

}  // namespace peeler::cmd
