// SPDX-License-Identifier: Apache-2.0
// What must hold of every layered picture.
#pragma once

#include <cstdint>

#include "core/image/composite.h"
#include "core/image/layered_image.h"

namespace peeler {

/// Pixels that break a rule, and the first of them.
struct BrokenPixels {
    std::uint64_t pixels = 0;
    int x = 0, y = 0;

    void add(int at_x, int at_y) {
        if (pixels++ == 0) x = at_x, y = at_y;
    }
};

/// Adds the pixels whose Z decreases from one fragment to the next.
void findUnsorted(const LayeredImage& band, BrokenPixels& broken);

/// Adds the pixels with a fragment whose Z is not finite.
void findInfinite(const LayeredImage& band, BrokenPixels& broken);

/// Adds the pixels whose stored composite, colour or Z, is another than what the fragments make,
/// bit for bit. `stored` has the band's window, and its colours have been half or float.
void findWrongComposite(const LayeredImage& band, const CompositeImage& stored, PixelType type,
                        BrokenPixels& broken);

}  // namespace peeler
