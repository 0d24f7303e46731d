// SPDX-License-Identifier: Apache-2.0
// A regular file mapped into memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "formats/file/regular_file.h"

namespace peeler {

/// The bytes of a regular file, which the system reads when they are used and may drop again, so
/// that files larger than the memory can be read. The file must not become shorter meanwhile.
class MappedFile {
  public:
    /// Throws Error (kInput) like readRegularFile(), or if the file cannot be mapped.
    explicit MappedFile(const std::filesystem::path& path);
    ~MappedFile();
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;

    std::span<const std::uint8_t> bytes() const { return bytes_; }

  private:
    RegularFile file_;
    std::span<const std::uint8_t> bytes_;
};

}  // namespace peeler
