// SPDX-License-Identifier: Apache-2.0
// Composites of layers. An image that was composited on the fly is already one layer.
#pragma once

#include <peeler/composite.h>

namespace peeler::test {

/// Composites an image over nothing; returns the composite.
inline CompositeImage flat(const LayeredImage& image) {
    CompositeImage out;
    compositeOver(image, {}, out);
    return out;
}

}  // namespace peeler::test
