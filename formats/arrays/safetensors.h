// SPDX-License-Identifier: Apache-2.0
// The header of a .safetensors file (github.com/huggingface/safetensors, "Format"): its arrays by
// name, type, shape and place, and its texts.
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
    std::string name, type;  ///< "F32"
    std::vector<std::uint64_t> shape;
    std::uint64_t offset = 0, bytes = 0;  ///< of its numbers, in the file
    const ArrayNumber* number = nullptr;  ///< null if they are not decoded here (F16, BOOL, …)
};

struct SafetensorsHeader {
    std::vector<SafetensorsArray> arrays;         ///< in the order of their numbers
    std::map<std::string, std::string> metadata;  ///< `__metadata__`

    const SafetensorsArray* find(std::string_view name) const;
    /// A text of `metadata`; "" if there is none.
    std::string text(const std::string& name) const;
};

/// The header of an open file. Arrays do not overlap, have no gaps, fill the file, and have as many
/// bytes as type and shape say. Throws Error (kInput) with `where` if that is not so, the header is
/// longer than the format allows (100 MB), or it is none (isSafetensors()).
SafetensorsHeader readSafetensors(const RegularFile& file, const std::string& where);
/// Likewise of its bytes.
SafetensorsHeader readSafetensors(std::span<const std::uint8_t> file, const std::string& where);

}  // namespace peeler
