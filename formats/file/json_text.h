// SPDX-License-Identifier: Apache-2.0
// JSON parser for untrusted input, JSON pointers, and JSON output.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace peeler {

/// Parses a JSON text, after an optional byte order mark. Throws Error (kInput) with `where` if the
/// text is not JSON or is nested too deeply, because parsers and destructors recurse. The limit
/// exceeds the depth that programs write.
nlohmann::json parseJson(std::string_view text, const std::string& where);
/// Parses like parseJson(), but keeps the order of object members.
nlohmann::ordered_json parseOrderedJson(std::string_view text, const std::string& where);

/// Parses like parseJson() and parseOrderedJson(), but returns null instead of throwing. Meant for
/// optional data that may be damaged.
nlohmann::json parseJsonOrNull(std::string_view text);
nlohmann::ordered_json parseOrderedJsonOrNull(std::string_view text);

/// Throws Error (kInput) with `where` if a text is nested more deeply than parseJson() allows.
void checkJsonDepth(std::string_view text, const std::string& where);

/// Returns the text of a value, on one line or indented by `indentation` spaces. With `ascii`,
/// escapes all non-ASCII characters. Never fails: replaces bytes that are not UTF-8 by \xNN, so
/// that different texts stay different.
std::string dumpJson(const nlohmann::json& value, int indentation = -1, bool ascii = false);
std::string dumpJson(const nlohmann::ordered_json& value, int indentation = -1, bool ascii = false);

/// Returns the JSON pointer (RFC 6901) of a value's child.
std::string childPointer(const std::string& parent, std::string_view key);
std::string childPointer(const std::string& parent, std::size_t index);

/// Returns a value's text, shortened for use in messages.
std::string shownJson(const nlohmann::json& value);

}  // namespace peeler
