// SPDX-License-Identifier: Apache-2.0
// Flat parts as OpenEXR's C++ classes read them: tiles, and DWA, which OpenEXRCore 3.1 does not
// unpack.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include <peeler/layered_image.h>
#include <peeler/window.h>
#include "formats/file/regular_file.h"

namespace peeler {

/// A channel to decode, converted to `type`: rows as wide as the data window, one after the other.
struct ExrPlane {
    std::string name;
    PixelType type = PixelType::kFloat;
    std::byte* first = nullptr;
};

/// An open file. Safe to use from several threads, of which one decodes at a time.
class ExrClasses {
  public:
    /// `file` is open, outlives this, and has been checked as ExrInput does it. Throws Error
    /// (kInput) if the classes refuse it.
    ExrClasses(const RegularFile& file, const std::string& path);
    ~ExrClasses();

    /// Decodes these rows of a part, all of its columns: `rows` is in the file's coordinates.
    /// Throws Error (kInput), `where` being `place`.
    void readRows(int part, const Window& rows, std::span<const ExrPlane> planes,
                  const std::string& place);
    /// Decodes every tile of every level of a part, and keeps nothing. Throws likewise.
    void decodeTiles(int part, const std::string& place);

  private:
    struct File;
    std::unique_ptr<File> file_;
};

}  // namespace peeler
