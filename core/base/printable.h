// SPDX-License-Identifier: Apache-2.0
// Strings that come from files or from outside, as people may be shown them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <peeler/text.h>

namespace peeler {

/// Bytes of a name, and of a line of a message, that are shown; paths are lines, and Error cuts at
/// as many.
inline constexpr std::size_t kMostOfName = 200, kMostOfLine = 8000;

/// The bytes of the UTF-8 character that `text` begins with (Unicode 15, table 3-7); 0 if it begins
/// with none.
std::size_t utf8Length(std::string_view text);

/// A byte as \xNN.
std::string escapedByte(char byte);

/// `text` as it may stand in a message: what a file says must neither steer a terminal, look like
/// other lines, nor flood a log. Bytes of control characters, of what reorders or breaks lines, and
/// of what is no UTF-8 are shown as \xNN; after `most` bytes "…" stands for the rest.
std::string printable(std::string_view text, std::size_t most = kMostOfName);

/// Returns the same of the words of a text.
Text printableText(const Text& text, std::size_t most);

}  // namespace peeler
