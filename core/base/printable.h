// SPDX-License-Identifier: Apache-2.0
// Sanitised text: untrusted strings made safe to print.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <peeler/text.h>

namespace peeler {

/// The maximum bytes shown of a name, and of a path or a line of a message. Error truncates its
/// texts to kMostOfLine, too.
inline constexpr std::size_t kMostOfName = 200, kMostOfLine = 8000;

/// Returns the length in bytes of the UTF-8 character at the start of `text` (Unicode 15, table
/// 3-7); 0 if `text` does not start with a valid character.
std::size_t utf8Length(std::string_view text);

/// Returns a byte as \xNN.
std::string escapedByte(char byte);

/// Returns `text` in a form that is safe in a message: file content must not control a terminal,
/// imitate other lines, or flood a log. Control characters, characters that reorder or break lines,
/// and invalid UTF-8 are shown as \xNN bytes. "…" replaces everything after the first `most` bytes.
std::string printable(std::string_view text, std::size_t most = kMostOfName);

/// Returns a copy of `text` in which everything except the parameters is printable().
Text printableText(const Text& text, std::size_t most);

}  // namespace peeler
