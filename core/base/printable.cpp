// SPDX-License-Identifier: Apache-2.0
#include "core/base/printable.h"

#include <algorithm>
#include <iterator>

namespace peeler {
namespace {

unsigned byteAt(std::string_view text, std::size_t i) {
    return static_cast<unsigned char>(text[i]);
}

/// A class of well-formed UTF-8 sequences: the ranges of the first and the second byte. Later bytes
/// are 0x80 to 0xBF.
struct Sequence {
    unsigned first, last;  ///< range of the first byte
    unsigned second_first, second_last;
    std::size_t length;
};
constexpr Sequence kSequences[] = {
    {0x00, 0x7F, 0x00, 0xFF, 1}, {0xC2, 0xDF, 0x80, 0xBF, 2}, {0xE0, 0xE0, 0xA0, 0xBF, 3},
    {0xE1, 0xEC, 0x80, 0xBF, 3}, {0xED, 0xED, 0x80, 0x9F, 3}, {0xEE, 0xEF, 0x80, 0xBF, 3},
    {0xF0, 0xF0, 0x90, 0xBF, 4}, {0xF1, 0xF3, 0x80, 0xBF, 4}, {0xF4, 0xF4, 0x80, 0x8F, 4},
};

/// A range of characters to escape.
struct Range {
    char32_t first, last;
};
constexpr Range kUnshown[] = {
    {0x00, 0x1F},      // C0 control characters
    {0x7F, 0x9F},      // DEL and C1 control characters; U+009B starts terminal control sequences
    {0x200E, 0x200F},  // directional marks
    {0x2028, 0x202E},  // line and paragraph separators, directional embeddings and overrides
    {0x2066, 0x2069},  // directional isolates
    {0xFEFF, 0xFEFF},  // byte order mark: invisible
};

/// Returns the code point that a well-formed UTF-8 sequence encodes.
char32_t characterOf(std::string_view sequence) {
    constexpr unsigned kOfFirst[] = {0x7F, 0x1F, 0x0F, 0x07};
    char32_t character = byteAt(sequence, 0) & kOfFirst[sequence.size() - 1];
    for (std::size_t i = 1; i < sequence.size(); ++i)
        character = character << 6U | (byteAt(sequence, i) & 0x3FU);
    return character;
}

bool isShown(std::string_view sequence) {
    const char32_t character = characterOf(sequence);
    return std::ranges::none_of(kUnshown, [&](const Range& range) {
        return range.first <= character && character <= range.last;
    });
}

}  // namespace

std::size_t utf8Length(std::string_view text) {
    if (text.empty()) return 0;
    const auto* const row = std::ranges::find_if(kSequences, [&](const Sequence& sequence) {
        return sequence.first <= byteAt(text, 0) && byteAt(text, 0) <= sequence.last;
    });
    if (row == std::end(kSequences) || row->length > text.size()) return 0;
    for (std::size_t i = 1; i < row->length; ++i) {
        const bool second = i == 1;
        if (byteAt(text, i) < (second ? row->second_first : 0x80U) ||
            byteAt(text, i) > (second ? row->second_last : 0xBFU))
            return 0;
    }
    return row->length;
}

std::string escapedByte(char byte) {
    static constexpr char kDigits[] = "0123456789abcdef";
    const auto value = static_cast<unsigned char>(byte);
    return {'\\', 'x', kDigits[value >> 4U], kDigits[value & 15U]};
}

std::string printable(std::string_view text, std::size_t most) {
    std::string shown;
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t length = utf8Length(text.substr(i));
        const std::string_view piece = text.substr(i, std::max<std::size_t>(length, 1));
        if (i + piece.size() > most) return shown + "…";
        if (length > 0 && isShown(piece))
            shown += piece;
        else
            for (const char byte : piece)
                shown += escapedByte(byte);
        i += piece.size();
    }
    return shown;
}

Text printableText(const Text& text, std::size_t most) {
    Text shown;
    text.visit([&](std::string_view words) { shown += printable(words, most); },
               [&](Parameter parameter) { shown += parameter; });
    return shown;
}

}  // namespace peeler
