// SPDX-License-Identifier: Apache-2.0
// Where each layer lies, found by going through the fragments.
#pragma once

#include <cstdint>
#include <vector>

#include "core/image/layered_image.h"
#include "core/image/sink.h"

namespace peeler {

/// Adds up the layers of a picture, band after band. A pixel with n fragments is in the first n
/// layers, so it is entered once, in the last of them.
class LayerWindows {
  public:
    void add(const LayeredImage& band);
    /// The pixel (x, y) has `count` fragments.
    void add(int x, int y, std::uint32_t count);

    /// Front to back, with windows and pixels.
    std::vector<LayerPlan> layers() const;
    std::uint64_t fragments() const { return fragments_; }

  private:
    std::vector<LayerPlan> last_;  ///< of the pixels that end with this layer
    std::uint64_t fragments_ = 0;
};

}  // namespace peeler
