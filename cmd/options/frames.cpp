// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/frames.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <unordered_set>

#include "cmd/cli/parse.h"
#include "core/base/error.h"

namespace peeler::cmd {

namespace {

constexpr std::size_t kMaxFrames = 1000000;
constexpr std::int64_t kLargest = 2147483647;
constexpr std::size_t kLoneHashDigits = 4, kMostDigits = 16;

struct FrameRange {
    std::int64_t first = 0, last = 0, step = 1;
};

[[noreturn]] void refuseFrames(std::string_view text) {
    throw Error(ErrorKind::kUsage, "expected frames, not '" + std::string(text) + "'", "",
                "e.g. 1-100, 1-100x2, 150,200-180 or -5-5");
}

/// An integer at the beginning, which is taken off the text.
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

/// A place for the frame's number in a name.
struct Token {
    std::size_t begin = 0, end = 0;
    std::size_t digits = 0;        ///< least
    bool sign_takes_room = false;  ///< as in printf
};

/// The next token at or after `from`.
std::optional<Token> findToken(const std::string& name, std::size_t from) {
    for (std::size_t i = from; i < name.size(); ++i) {
        if (name[i] == '#') {
            const std::size_t end = std::min(name.find_first_not_of('#', i), name.size());
            return Token{i, end, end - i == 1 ? kLoneHashDigits : end - i, false};
        }
        if (name[i] != '%') continue;
        if (name[i + 1] == '%') {  // the terminating zero, at least, is there
            ++i;
            continue;
        }
        const std::size_t d = std::min(name.find_first_not_of("0123456789", i + 1), name.size());
        if (d == name.size() || name[d] != 'd') continue;
        if (d == i + 1) return Token{i, d + 1, 1, true};
        if (name[i + 1] == '0' && d - i <= 3)
            return Token{i, d + 1, std::strtoul(&name[i + 1], nullptr, 10), true};
    }
    return std::nullopt;
}

std::string tokenText(int frame, const Token& token) {
    std::string digits = std::to_string(std::abs(frame));
    std::size_t wanted = std::min(token.digits, kMostDigits);
    if (frame < 0 && token.sign_takes_room && wanted > 0) --wanted;
    if (digits.size() < wanted) digits.insert(0, wanted - digits.size(), '0');
    return frame < 0 ? '-' + digits : digits;
}

std::size_t nameBegin(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    return slash == std::string::npos ? 0 : slash + 1;
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
                        "these are more than " + std::to_string(kMaxFrames) + " frames", "",
                        "render them in parts");
        for (std::int64_t i = 0; i < count; ++i) {
            const int frame = static_cast<int>(range.first + i * step);
            if (seen.insert(frame).second) frames.push_back(frame);
        }
        if (comma == text.size()) return frames;
        text.remove_prefix(comma + 1);
    }
}

bool hasFrameToken(const std::string& path) {
    return findToken(path, nameBegin(path)).has_value();
}

std::string framePath(const std::string& path, int frame) {
    std::string result = path.substr(0, nameBegin(path));
    const std::string name = path.substr(result.size());
    std::size_t done = 0;
    while (const auto token = findToken(name, done)) {
        result += name.substr(done, token->begin - done) + tokenText(frame, *token);
        done = token->end;
    }
    result += name.substr(done);
    for (std::size_t at = nameBegin(path); (at = result.find("%%", at)) != std::string::npos; ++at)
        result.erase(at, 1);
    return result;
}

}  // namespace peeler::cmd
