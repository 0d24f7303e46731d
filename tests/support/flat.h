// SPDX-License-Identifier: Apache-2.0
// Composites of layers. An image composited on the fly has only one layer.
#pragma once

#include <peeler/composite.h>

namespace peeler::test {

/// Composites an image over an empty background. Returns the composite.
inline CompositeImage flat(const LayeredImage& image) {
    CompositeImage out;
    compositeOver(image, {}, out);
    return out;
}

}  // namespace peeler::test
