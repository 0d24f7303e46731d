// SPDX-License-Identifier: Apache-2.0
// OpenEXR file integrity: a hash in each part's header that proves the file is bitwise unchanged
// (formats/README.md, "The hash of a part"), and consistency checks of header attributes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace peeler {

inline constexpr const char* kPixelHash = "peeler:pixelHash";

/// Returns the attribute's value, always of the same length.
std::string pixelHashText(std::uint64_t hash);
/// Returns the attribute as stored in a file: name, type, size and value.
std::string pixelHashRecord(std::uint64_t hash);

struct ExrIntegrity {
    /// Ordered from best to worst; several files together have the worst state.
    enum State : std::uint8_t {
        kProven,   ///< every bit is as written
        kNone,     ///< no hash: from another program, or an older version of ours
        kChanged,  ///< it does not match its hash
    };
    State state = kProven;
    std::string where;  ///< the changed file, and the part if known

    /// Returns the problem, without the place; "" unless it has changed.
    std::string problem() const;
};

/// Reads all bytes of the file (of a set, of all its files) and compares them with their hashes.
/// Every byte counts: a file with bytes outside its parts has changed. Throws Error (kInput) if it
/// cannot be read, or has no valid headers.
ExrIntegrity exrIntegrity(const std::string& path);

/// Throws Error (kInput) if the file has changed since it was written.
void requireUnchanged(const std::string& path);

/// Opens the file (of a set, all files) with OpenEXR's classes, which check other things than
/// OpenEXRCore, and compares the camera's attributes with `peeler:cameraJson`, allowing for
/// rounding. Returns a sentence for each contradiction, naming the first part that has it. Throws
/// Error (kInput) if the classes cannot open the file.
std::vector<std::string> headerContradictions(const std::string& path);

}  // namespace peeler
