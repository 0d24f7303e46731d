// SPDX-License-Identifier: Apache-2.0
// Hits of bundles of rays: a deep scan-line part a bundle.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/sink.h"

namespace peeler {

/// One part: its name, the view whose pixels are the rays, and how many hits they have.
struct ExrBundle {
    std::string name;
    View view;
    std::uint64_t hits = 0;
};

/// Every hit of a ray is a point sample of its pixel, in the order of the list: Z (camera Z) and
/// the components of the extra arrays, integers among them, but no colours. Compressed ZIPS. Parts
/// come one after the other; all views have the same display window, a part's data window is its
/// view's crop. Bands are as wide, and may lie elsewhere. The same hits make the same bytes,
/// however cut into bands.
class ExrHitsWriter {
  public:
    /// Throws Error (kOutput) if the file cannot be created.
    ExrHitsWriter(const std::string& path, std::vector<ExrBundle> bundles, Provenance provenance);
    ~ExrHitsWriter();

    /// Bands of a bundle come top to bottom; all have the same extra arrays. Of those, one of the
    /// name `left_out` is not written. Throws Error (kOutput).
    void write(std::size_t bundle, const LayeredImage& band, std::string_view left_out);
    void finish();

  private:
    struct File;
    std::unique_ptr<File> file_;
};

}  // namespace peeler
