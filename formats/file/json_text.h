// SPDX-License-Identifier: Apache-2.0
// Parses JSON that is not trusted, says where in it something stands, and writes JSON.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace peeler {

/// Parses a JSON text, a byte order mark aside. Throws Error (kInput) with `where` if it is no
/// JSON, or nested deeper than any program writes (parsers and destructors recurse).
nlohmann::json parseJson(std::string_view text, const std::string& where);
/// Likewise, with the members of objects in the order in which they stand in the text.
nlohmann::ordered_json parseOrderedJson(std::string_view text, const std::string& where);

/// Likewise, but null where these would throw: for what may be damaged and can be done without.
nlohmann::json parseJsonOrNull(std::string_view text);
nlohmann::ordered_json parseOrderedJsonOrNull(std::string_view text);

/// Throws Error (kInput) with `where` if a text is nested deeper than any program writes.
void checkJsonDepth(std::string_view text, const std::string& where);

/// The text of a value, in one line or with so many spaces before each member; `ascii`: of ASCII
/// characters only. It can always be written: bytes that are no UTF-8 stand in it as \xNN, so that
/// texts which are not the same stay so.
std::string dumpJson(const nlohmann::json& value, int indentation = -1, bool ascii = false);
std::string dumpJson(const nlohmann::ordered_json& value, int indentation = -1, bool ascii = false);

/// The JSON pointer (RFC 6901) of the child of a value.
std::string childPointer(const std::string& parent, std::string_view key);
std::string childPointer(const std::string& parent, std::size_t index);

/// A value as messages show it: its text, shortened.
std::string shownJson(const nlohmann::json& value);

}  // namespace peeler
