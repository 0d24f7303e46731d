// SPDX-License-Identifier: Apache-2.0
// The header of a .safetensors file (github.com/huggingface/safetensors, "Format"): the name, type,
// shape and offset of each array, and the metadata texts.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/arrays/array_reader.h"
#include "formats/file/regular_file.h"

namespace peeler {

struct SafetensorsArray {
    std::string name, type;  ///< `type` is written as in the file: "F32"
    std::vector<std::uint64_t> shape;
    std::uint64_t offset = 0, bytes = 0;
    /// Decoder of the elements; null for types that cannot be decoded (F16, BOOL, …).
    const ArrayNumber* number = nullptr;
};

struct SafetensorsHeader {
    std::vector<SafetensorsArray> arrays;         ///< sorted by offset
    std::map<std::string, std::string> metadata;  ///< texts of the header's member `__metadata__`

    const SafetensorsArray* find(std::string_view name) const;
    /// Returns the text with this name in `metadata`, or "" if it is missing.
    std::string text(const std::string& name) const;
};

/// Reads the header of an open file. Throws Error (kInput) with `where` if the file is not a
/// .safetensors (isSafetensors()), if the header is longer than the format allows (100 MB), or if
/// arrays overlap, leave gaps, do not fill the file or have a size that contradicts their type and
/// shape.
SafetensorsHeader readSafetensors(const RegularFile& file, const std::string& where);
/// Reads the header from the file's bytes.
SafetensorsHeader readSafetensors(std::span<const std::uint8_t> file, const std::string& where);

}  // namespace peeler
