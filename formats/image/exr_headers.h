// SPDX-License-Identifier: Apache-2.0
// OpenEXR headers checked as raw bytes before a library reads them: OpenEXR's time per attribute
// grows with their number (OpenEXRCore 3.1 takes a minute for a million), and its classes allocate
// the declared size of an attribute.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "formats/file/regular_file.h"

namespace peeler {

/// A walk through the headers, from the first attribute of the first part to the last of the last
/// ("OpenEXR File Layout", Header). All members throw Error (kInput) if the headers are invalid: a
/// name longer than 255 bytes, a value that exceeds the file or has the wrong size for its type, or
/// more parts and attributes than any program writes.
class ExrHeaders {
  public:
    static constexpr std::uint64_t kBegin = 8;  ///< after the magic number and the version

    struct Attribute {
        std::string name, type;
        std::uint64_t place = 0, size = 0;  ///< of its value, in bytes of the file
    };

    /// `file` must be open and outlive this; `path` is for messages.
    ExrHeaders(const RegularFile& file, std::string path);

    bool multiPart() const { return multi_part_; }
    /// Goes to the next part's header; every file has at least one. Call it after nextAttribute()
    /// has returned false. Returns false after the last part.
    bool nextPart();
    /// Reads the part's next attribute; false after the last.
    bool nextAttribute(Attribute& attribute);
    /// Returns the file position of the next byte, which is the end of the headers once nextPart()
    /// has returned false.
    std::uint64_t place() const { return place_; }

  private:
    /// Whether a value has the size its type requires, if any. Changes the position.
    bool fitsType(const Attribute& attribute);
    bool isChannelList(const Attribute& attribute);
    char byteAt(std::uint64_t place);
    std::uint32_t number();
    std::string name();
    [[noreturn]] void fail(const std::string& what) const;

    const RegularFile& file_;
    std::string path_;
    bool multi_part_ = false;
    int parts_ = 0, attributes_ = 0;
    std::uint64_t place_ = 4;  ///< of the version
    std::uint64_t block_begin_ = 0;
    std::size_t block_size_ = 0;
    std::array<char, 1 << 16> block_{};
};

/// Throws Error (kInput) as ExrHeaders does; ignores files that are not OpenEXR. `file` must be
/// open.
void checkExrHeaders(const RegularFile& file, const std::string& path);

}  // namespace peeler
