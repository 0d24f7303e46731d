// SPDX-License-Identifier: Apache-2.0
// One of the two files that are compared: layered or flat, read in bands.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/image/composite.h"
#include "core/image/layered_image.h"
#include "formats/image/flat_image.h"
#include "formats/layered_input.h"

namespace peeler::cmd {

class ComparedImage {
  public:
    /// Throws Error (kInput) for what is no image.
    explicit ComparedImage(const std::string& path);

    const std::string& path() const { return path_; }
    bool layered() const { return reader_ != nullptr; }
    std::size_t layers() const { return layered() ? reader_->info().plan.layers.size() : 0; }
    int width() const;  ///< of the display window
    int height() const;
    Window window() const;  ///< what has pixels
    /// Whether the file tells where the pixels lie in the display window (OpenEXR).
    bool placed() const { return layered() || flat_.placed; }

    /// Rows that read() can deliver with about so many bytes.
    int rowsFor(std::uint64_t bytes) const;
    /// `rows` rows from `first` on, counted from the top of window(). Layered images only.
    void read(int first, int rows, LayeredImage& out);
    /// The same of the composite over nothing.
    void read(int first, int rows, CompositeImage& out);

  private:
    std::string path_;
    std::unique_ptr<LayeredInput> reader_;  ///< none for a flat image
    FlatImage flat_;
    LayeredImage band_;
};

/// Throws Error (kUsage) unless the pixels of both can be laid on each other.
void checkComparable(const ComparedImage& a, const ComparedImage& b);

}  // namespace peeler::cmd
