// SPDX-License-Identifier: Apache-2.0
// Stored colours as floats. Callers inline these functions into their loops.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include "core/base/lanes.h"

namespace peeler {

/// Return four consecutive components of a stored colour.
inline FourFloats loadFour(const float* components) {
    FourFloats four;
    std::memcpy(&four, components, sizeof(four));
    return four;
}
inline FourFloats loadFour(const std::uint16_t* halfs) {
    return halfsToFloats(halfs);
}

/// Returns a colour with these components. `C` has four components, or is a TintedColor.
template <class C, class T>
C loadColor(const T* components) {
    C color;
    // Two overlapping quadruples are the seven components of a TintedColor.
    for (const std::size_t first : {std::size_t{0}, color.size() - 4}) {
        const FourFloats four = loadFour(components + first);
        std::memcpy(&color[first], &four, sizeof(four));
    }
    return color;
}

/// Returns the colour of a fragment. `C` must have as many components as a stored colour.
template <class C>
C loadColor(const FragmentArray& colors, std::size_t fragment) {
    const std::size_t first = std::tuple_size_v<C> * fragment;
    return colors.type == PixelType::kFloat
               ? loadColor<C>(colors.as<float>().data() + first)
               : loadColor<C>(colors.as<std::uint16_t>().data() + first);
}

}  // namespace peeler
