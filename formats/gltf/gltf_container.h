// SPDX-License-Identifier: Apache-2.0
// The .glb container and the JSON of glTF files.
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

/// The chunks of a glTF file (glTF 2.0 §4.4), as views of the file's bytes.
struct GltfContainer {
    std::string_view json;
    std::optional<std::span<const std::uint8_t>> binary;  ///< the BIN chunk, if any
};

/// Whether the bytes begin with "glTF".
bool isGlb(std::span<const std::uint8_t> bytes);

/// Splits a .glb into its chunks. Takes any other file for JSON. Warns about harmless
/// irregularities. Throws Error (kInput) with `path` as `where` if the container is damaged or has
/// an unknown version.
GltfContainer splitGltfContainer(std::span<const std::uint8_t> bytes, const std::string& path,
                                 ReadWarnings& warnings);

/// Parses the JSON of a glTF file, with or without a byte order mark. Throws Error (kInput) with
/// `path` as `where` if the JSON is damaged, is not an object, or is nested deeper than any
/// exporter writes.
nlohmann::json parseGltfJson(std::string_view text, const std::string& path);
/// Parses like parseGltfJson(), but keeps the members in the order of the text.
nlohmann::ordered_json parseOrderedGltfJson(std::string_view text, const std::string& path);

}  // namespace peeler
