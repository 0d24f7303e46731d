// SPDX-License-Identifier: Apache-2.0
// Word and number parsing for whitespace-separated text formats.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace peeler {

/// Whether the character is white space in the C locale (isspace()).
constexpr bool isBlank(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/// Removes the next word from the text, with the blanks before it. Returns "" if there is no word.
inline std::string_view takeWord(std::string_view& text) {
    std::size_t begin = 0;
    while (begin < text.size() && isBlank(text[begin]))
        ++begin;
    std::size_t end = begin;
    while (end < text.size() && !isBlank(text[end]))
        ++end;
    const std::string_view word = text.substr(begin, end - begin);
    text.remove_prefix(end);
    return word;
}

/// Removes the next line from the text. Returns the line without its end (LF or CR LF), which the
/// last line may lack.
inline std::string_view takeLine(std::string_view& text) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
}

/// Returns the text without leading and trailing blanks.
inline std::string_view trimmed(std::string_view text) {
    while (!text.empty() && isBlank(text.front()))
        text.remove_prefix(1);
    while (!text.empty() && isBlank(text.back()))
        text.remove_suffix(1);
    return text;
}

/// Returns the text in lower case (A to Z only, in any locale).
inline std::string lowerCase(std::string_view text) {
    std::string result(text);
    for (char& c : result)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return result;
}

/// Returns the value of a decimal number; ignores the locale. Accepts "inf" and "nan".
/// Floating-point underflow gives 0. Returns nothing if the word is not a number, or if the number
/// is too large for T.
template <class T>
std::optional<T> numberIn(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    T value{};
    const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (end != word.data() + word.size()) return {};
    if (failure == std::errc()) return value;
    if (failure == std::errc::result_out_of_range &&
        (word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos))
        return T{0};
    return {};
}

/// Returns the number of the line, from 1, at this offset in a text.
inline std::size_t lineAt(std::string_view text, std::size_t place) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(place, text.size()));
    return 1 + static_cast<std::size_t>(std::count(text.begin(), end, '\n'));
}

}  // namespace peeler
