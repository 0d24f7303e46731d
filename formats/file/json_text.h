// SPDX-License-Identifier: Apache-2.0
// Parses JSON that is not trusted, and says where in it something stands.
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

/// The JSON pointer (RFC 6901) of the child of a value.
std::string childPointer(const std::string& parent, std::string_view key);
std::string childPointer(const std::string& parent, std::size_t index);

/// A value as messages show it: its text, shortened.
std::string shownJson(const nlohmann::json& value);

}  // namespace peeler
