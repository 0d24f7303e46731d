// SPDX-License-Identifier: Apache-2.0
// Decoder based on OpenEXR's C++ classes, for flat parts that OpenEXRCore 3.1 cannot unpack: tiles
// and DWA.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include <peeler/layered_image.h>
#include <peeler/window.h>
#include "formats/file/regular_file.h"

namespace peeler {

/// The destination of a channel: values of type `type`, in consecutive rows as wide as the data
/// window.
struct ExrPlane {
    std::string name;
    PixelType type = PixelType::kFloat;
    std::byte* first = nullptr;
};

/// An open file. Several threads may use this object, but only one of them decodes at a time.
class ExrClasses {
  public:
    /// `file` must be open, must have passed the checks of ExrInput, and must outlive this object.
    /// Throws Error (kInput) if the classes reject the file.
    ExrClasses(const RegularFile& file, const std::string& path);
    ~ExrClasses();

    /// Decodes rows of a part, over the whole width of the data window. `rows` is in the file's
    /// coordinates. Throws Error (kInput) with `place` as `where`.
    void readRows(int part, const Window& rows, std::span<const ExrPlane> planes,
                  const std::string& place);
    /// Decodes every tile at every level of a part and discards the pixels. Throws like readRows().
    void decodeTiles(int part, const std::string& place);

  private:
    struct File;
    std::unique_ptr<File> file_;
};

}  // namespace peeler
