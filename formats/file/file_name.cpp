// SPDX-License-Identifier: Apache-2.0
// File names: number placeholders, and the table of file kinds by first bytes.
#include "formats/file/file_name.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "formats/file/regular_file.h"
#include "formats/file/text_words.h"

namespace peeler {
namespace {

constexpr std::size_t kLoneDigits = 4, kMostDigits = 16;
constexpr char kFrameSign = '#', kViewSign = '@';

struct Token {
    std::size_t begin = 0, end = 0;
    std::size_t digits = 0;        ///< minimum number of digits
    bool sign_takes_room = false;  ///< whether a minus sign counts as a digit, as in printf
};

/// Returns the first placeholder with this sign ('#' or '@') at or after `from`, or nothing. For
/// '#', a placeholder may also have printf's form.
std::optional<Token> findToken(const std::string& name, std::size_t from, char sign) {
    for (std::size_t i = from; i < name.size(); ++i) {
        if (name[i] == sign) {
            const std::size_t end = std::min(name.find_first_not_of(sign, i), name.size());
            return Token{i, end, end - i == 1 ? kLoneDigits : end - i, false};
        }
        if (name[i] != '%' || sign != kFrameSign) continue;
        if (name[i + 1] == '%') {  // name[i + 1] exists: strings end with a zero
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

std::string tokenText(int number, const Token& token) {
    std::string digits = std::to_string(std::abs(number));
    std::size_t wanted = std::min(token.digits, kMostDigits);
    if (number < 0 && token.sign_takes_room && wanted > 0) --wanted;
    if (digits.size() < wanted) digits.insert(0, wanted - digits.size(), '0');
    return number < 0 ? '-' + digits : digits;
}

std::size_t nameBegin(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    return slash == std::string::npos ? 0 : slash + 1;
}

/// Returns the path with the number in place of every placeholder of its last component.
std::string numbered(const std::string& path, int number, char sign) {
    std::string result = path.substr(0, nameBegin(path));
    const std::string name = path.substr(result.size());
    std::size_t done = 0;
    while (const auto token = findToken(name, done, sign)) {
        result += name.substr(done, token->begin - done) + tokenText(number, *token);
        done = token->end;
    }
    return result + name.substr(done);
}

/// Returns the value of each run of digits in a name, if it is at most 1,000,000,000.
std::vector<int> numbersIn(const std::string& name) {
    constexpr const char* kDecimalDigits = "0123456789";
    constexpr unsigned long kMost = 1'000'000'000;
    std::vector<int> numbers;
    std::size_t end = 0;
    for (std::size_t at = 0; (at = name.find_first_of(kDecimalDigits, end)) != std::string::npos;) {
        end = std::min(name.find_first_not_of(kDecimalDigits, at), name.size());
        const unsigned long number = std::strtoul(&name[at], nullptr, 10);
        if (number <= kMost) numbers.push_back(static_cast<int>(number));
    }
    return numbers;
}

using namespace std::string_view_literals;

struct Magic {
    std::string_view bytes;
    FileKind kind;
};
constexpr Magic kMagics[] = {
    {"\x76\x2f\x31\x01"sv, FileKind::kExr},
    {"glTF"sv, FileKind::kGltf},
    {"{"sv, FileKind::kGltf},
    {"\x89PNG\r\n\x1a\n"sv, FileKind::kPng},
    {"\xff\xd8\xff"sv, FileKind::kJpeg},
    {"II\x2a\0"sv, FileKind::kTiff},
    {"MM\0\x2a"sv, FileKind::kTiff},
    {"#?RADIANCE"sv, FileKind::kHdr},
    {"#?RGBE"sv, FileKind::kHdr},
};

/// Returns the text without a leading byte order mark and leading white space, which may precede
/// JSON.
std::string_view withoutBlanks(std::string_view text) {
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    return text;
}

}  // namespace

std::string lowerExtension(const std::filesystem::path& path) {
    return lowerCase(path.extension().string());
}

bool hasFrameToken(const std::string& path) {
    return findToken(path, nameBegin(path), kFrameSign).has_value();
}

std::string framePath(const std::string& path, int frame) {
    std::string result = numbered(path, frame, kFrameSign);
    for (std::size_t at = nameBegin(path); (at = result.find("%%", at)) != std::string::npos; ++at)
        result.erase(at, 1);
    return result;
}

std::string firstFramePath(const std::string& path, int frame) {
    const auto token = findToken(path, nameBegin(path), kFrameSign);
    if (!token) return path;
    return path.substr(0, token->begin) + tokenText(frame, *token) + path.substr(token->end);
}

namespace {

/// Implements numbersThere(); unless `views`, '@' is an ordinary character.
std::vector<FileNumbers> numbersThere(const std::string& path, bool views) {
    const bool frames = hasFrameToken(path);
    const auto nameOf = [&](int frame, int view) {
        return framePath(views ? viewPath(path, view) : path, frame);
    };
    if (!frames && !views)
        return fileExists(nameOf(0, 0), ErrorKind::kOutput) ? std::vector<FileNumbers>(1)
                                                            : std::vector<FileNumbers>();
    std::set<std::pair<int, int>> found;  // frame and view
    const std::filesystem::path parent = std::filesystem::path(path).parent_path();
    for (const std::string& name : namesIn(parent.empty() ? "." : parent)) {
        // Any run of digits may be the number, so try each.
        const std::vector<int> numbers = numbersIn(name), one{0};
        for (const int frame : frames ? numbers : one)
            for (const int view : views ? numbers : one)
                if (std::filesystem::path(nameOf(frame, view)).filename() == name)
                    found.insert({frame, view});
    }
    std::vector<FileNumbers> sorted;
    for (const auto& [frame, view] : found)
        sorted.push_back({frame, view});
    return sorted;
}

}  // namespace

std::vector<FileNumbers> numbersThere(const std::string& path) {
    return numbersThere(path, hasViewToken(path));
}

std::vector<int> framesThere(const std::string& path) {
    std::vector<int> frames;
    for (const FileNumbers& numbers : numbersThere(path, false))
        frames.push_back(numbers.frame);
    return frames;
}

bool hasViewToken(const std::string& path) {
    return findToken(path, nameBegin(path), kViewSign).has_value();
}

std::string viewPath(const std::string& path, int view) {
    return numbered(path, view, kViewSign);
}

bool isSafetensors(std::string_view begin, std::uint64_t size) {
    constexpr std::uint64_t kMostHeader = 100'000'000;
    std::uint64_t length = 0;
    if (begin.size() <= sizeof length || begin[sizeof length] != '{') return false;
    std::memcpy(&length, begin.data(), sizeof length);
    return length <= kMostHeader && length <= size - sizeof length;
}

FileKind fileKind(const std::string& path) {
    const RegularFile file(path);
    file.check();
    std::array<char, 256> bytes{};
    const std::string_view all(bytes.data(), file.readSome(0, bytes));
    if (isSafetensors(all, file.size())) return FileKind::kSafetensors;
    const std::string_view start = withoutBlanks(all);
    for (const Magic& magic : kMagics) {
        if (start.starts_with(magic.bytes)) return magic.kind;
    }
    return FileKind::kUnknown;
}

}  // namespace peeler
