// SPDX-License-Identifier: Apache-2.0
// The JSON text of a glTF file.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace peeler {

/// Parses it, a byte order mark aside. Throws Error(kInput) with `path` as `where` if it is no JSON
/// object, damaged, or nested deeper than any exporter writes.
nlohmann::json parseGltfJson(std::string_view text, const std::string& path);
/// The same, members in the order in which they stand there.
nlohmann::ordered_json parseOrderedGltfJson(std::string_view text, const std::string& path);

}  // namespace peeler
