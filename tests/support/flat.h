// SPDX-License-Identifier: Apache-2.0
// Composites of layered images.
#pragma once

#include <peeler/composite.h>

namespace peeler::test {

/// Returns the composite of an image over an empty background.
inline CompositeImage flat(const LayeredImage& image) {
    CompositeImage out;
    compositeOver(image, {}, out);
    return out;
}

}  // namespace peeler::test
