// SPDX-License-Identifier: Apache-2.0
// The headers of an OpenEXR file as its bytes, before a library reads them: what OpenEXR does for
// each attribute grows with their number (OpenEXRCore 3.1 takes a minute for a million), and its
// classes take memory for as many bytes as an attribute says that it has.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "formats/file/regular_file.h"

namespace peeler {

/// Walks through the headers, from the first attribute of the first part to the last of the last
/// ("OpenEXR File Layout", Header). Everything throws Error (kInput) where the headers are not
/// whole: a name that is longer than 255 bytes, a value that reaches beyond the end of the file or
/// is not as long as its type says, or more parts and attributes than any program writes.
class ExrHeaders {
  public:
    static constexpr std::uint64_t kBegin = 8;  ///< behind the magic number and the version

    struct Attribute {
        std::string name, type;
        std::uint64_t place = 0, size = 0;  ///< of its value, in bytes of the file
    };

    /// `file` is open and stays so; `path` is what messages name.
    ExrHeaders(const RegularFile& file, std::string path);

    bool multiPart() const { return multi_part_; }
    /// Goes to the header of the next part, of which there is one in any file. Call it when
    /// nextAttribute() has returned false. False behind the last.
    bool nextPart();
    /// The next attribute of the part; false behind its last.
    bool nextAttribute(Attribute& attribute);
    /// Where the byte is that comes next: behind the headers when nextPart() has returned false.
    std::uint64_t place() const { return place_; }

  private:
    /// Whether a value is as long as its type says, if that does. Leaves the place anywhere.
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
    std::uint64_t place_ = 4;  ///< the version's
    std::uint64_t block_begin_ = 0;
    std::size_t block_size_ = 0;
    std::array<char, 1 << 16> block_{};
};

/// Throws Error (kInput) as ExrHeaders does; not for a file that is no OpenEXR at all. The file is
/// open.
void checkExrHeaders(const RegularFile& file, const std::string& path);

}  // namespace peeler
