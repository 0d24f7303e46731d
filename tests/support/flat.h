// SPDX-License-Identifier: Apache-2.0
// The picture of layers, or of a composite made on the fly, which is the only layer that it has.
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
