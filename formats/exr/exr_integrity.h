// SPDX-License-Identifier: Apache-2.0
// Integrity of OpenEXR files: a hash in each part's header (formats/README.md, "The hash of a
// part"), and consistency checks of header attributes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace peeler {

inline constexpr const char* kPixelHash = "peeler:pixelHash";

/// Returns the hash attribute's value. All values have the same length.
std::string pixelHashText(std::uint64_t hash);
/// Returns the bytes of the hash attribute as a file stores them: name, type, size and value.
std::string pixelHashRecord(std::uint64_t hash);

struct ExrIntegrity {
    /// From best to worst. A set of files has the state of its worst file.
    enum State : std::uint8_t {
        kProven,   ///< every bit is as peeler wrote it
        kNone,     ///< no hash: by another program, or by an older version of peeler
        kChanged,  ///< the file does not match its hash
    };
    State state = kProven;
    std::string where;  ///< the changed file, and the part if known

    /// Returns the problem, without the place, if the state is kChanged; otherwise returns "".
    std::string problem() const;
};

/// Reads all bytes of the file (or of all files of a set) and compares them with their hashes.
/// Bytes that belong to no part make the state kChanged. Throws Error (kInput) if the file cannot
/// be read, or has no valid headers.
ExrIntegrity exrIntegrity(const std::string& path);

/// Throws Error (kInput) if the file has changed since it was written.
void requireUnchanged(const std::string& path);

/// Opens the file (or all files of a set) with OpenEXR's classes, which check more than OpenEXRCore
/// does. Compares the attributes of the camera with `peeler:cameraJson`, allowing for rounding.
/// Returns a sentence for each contradiction, naming the first part that has it. Throws Error
/// (kInput) if the classes cannot open the file.
std::vector<std::string> headerContradictions(const std::string& path);

}  // namespace peeler
