// SPDX-License-Identifier: Apache-2.0
// Checks of OpenEXR headers as raw bytes before a library reads them.
//
// OpenEXR's time per attribute grows with the number of attributes (OpenEXRCore 3.1 takes a minute
// for a million attributes), and its classes allocate any size that an attribute declares.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "formats/file/regular_file.h"

namespace peeler {

/// An iterator over the attributes in all headers ("OpenEXR File Layout", Header), part by part.
/// All members throw Error (kInput) if a name is longer than 255 bytes, if a value exceeds the file
/// or has the wrong size for its type, or if there are more parts or attributes than any program
/// writes.
class ExrHeaders {
  public:
    static constexpr std::uint64_t kBegin = 8;  ///< offset of the first header

    struct Attribute {
        std::string name, type;
        std::uint64_t place = 0, size = 0;  ///< position and size of the value in the file
    };

    /// `file` must be open and outlive this object. `path` names the file in messages.
    ExrHeaders(const RegularFile& file, std::string path);

    bool multiPart() const { return multi_part_; }
    /// Moves to the header of the first or next part. Returns false after the last part. Every file
    /// has at least one part. May be called only at the beginning, or after nextAttribute() has
    /// returned false.
    bool nextPart();
    /// Reads the next attribute of the part. Returns false after the last attribute.
    bool nextAttribute(Attribute& attribute);
    /// Returns the position of the next byte in the file. After nextPart() has returned false, this
    /// is the end of the headers.
    std::uint64_t place() const { return place_; }

  private:
    /// Whether a value has the size that its type requires. Changes the current position.
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
    std::uint64_t place_ = 4;  ///< offset of the next byte; starts after the magic number
    std::uint64_t block_begin_ = 0;
    std::size_t block_size_ = 0;
    std::array<char, 1 << 16> block_{};
};

/// Checks a file's headers. Accepts any file that is not OpenEXR. Throws the errors of ExrHeaders.
/// `file` must be open.
void checkExrHeaders(const RegularFile& file, const std::string& path);

}  // namespace peeler
