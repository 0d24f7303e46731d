// SPDX-License-Identifier: Apache-2.0
// Composites of layers; a composite made on the fly is its own single layer.
#pragma once

#include <peeler/composite.h>

namespace peeler::test {

/// Composites an image over nothing.
inline CompositeImage flat(const LayeredImage& image) {
    CompositeImage out;
    compositeOver(image, {}, out);
    return out;
}

}  // namespace peeler::test
