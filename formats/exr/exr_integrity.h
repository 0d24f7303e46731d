// SPDX-License-Identifier: Apache-2.0
// What proves that an OpenEXR file is to the bit what was written: a hash in the header of each
// part (formats/README.md, "The hash of a part"); and what of a header can be held against itself.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace peeler {

inline constexpr const char* kPixelHash = "peeler:pixelHash";

/// The value of the attribute, always of one length.
std::string pixelHashText(std::uint64_t hash);
/// The attribute as it stands in a file: name, type, size and value.
std::string pixelHashRecord(std::uint64_t hash);

struct ExrIntegrity {
    /// Of several files the worst, which stands last, is that of all.
    enum State : std::uint8_t {
        kProven,   ///< every bit is as it was written
        kNone,     ///< it has no such hash: by another program, or an older one of ours
        kChanged,  ///< it is not what the hash says
    };
    State state = kProven;
    std::string where;  ///< the changed file, and the part if one can be told

    /// What is wrong with it, without the place; "" unless it has changed.
    std::string problem() const;
};

/// Reads all of the file's bytes (of a set all of its files') and holds them against their hashes.
/// Every byte counts: a file that has bytes which belong to no part has changed. Throws Error
/// (kInput) if it cannot be read, or its headers are none.
ExrIntegrity exrIntegrity(const std::string& path);

/// Throws Error (kInput) if the file has changed since it was written.
void requireUnchanged(const std::string& path);

/// Opens the file (of a set all files) by OpenEXR's classes, which check other things than
/// OpenEXRCore does, and tells in what the camera's attributes are not those of `peeler:cameraJson`
/// but for rounding: a sentence for each, of the first part where it is so. Throws Error (kInput)
/// if they cannot open it.
std::vector<std::string> headerContradictions(const std::string& path);

}  // namespace peeler
