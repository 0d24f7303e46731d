// SPDX-License-Identifier: Apache-2.0
// Takes a .glb file apart, and parses the JSON of it or of a .gltf file.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace peeler {

class ReadWarnings;

/// The two chunks of a glTF file (glTF 2.0 §4.4); both point into the bytes they were taken from.
struct GltfContainer {
    std::string_view json;
    std::optional<std::span<const std::uint8_t>> binary;  ///< the BIN chunk, if there is one
};

/// Whether the bytes begin with "glTF".
bool isGlb(std::span<const std::uint8_t> bytes);

/// The chunks of a .glb; of anything else all of it as JSON. Throws Error(kInput) with `path` as
/// `where` if the container is damaged or of another version; oddities that do no harm become
/// warnings.
GltfContainer splitGltfContainer(std::span<const std::uint8_t> bytes, const std::string& path,
                                 ReadWarnings& warnings);

/// Parses the JSON of a glTF file, a byte order mark aside. Throws Error(kInput) with `path` as
/// `where` if it is no JSON object, damaged, or nested deeper than any exporter writes.
nlohmann::json parseGltfJson(std::string_view text, const std::string& path);
/// Likewise, with the members of objects in the order in which they stand in the text.
nlohmann::ordered_json parseOrderedGltfJson(std::string_view text, const std::string& path);

}  // namespace peeler
