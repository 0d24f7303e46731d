// SPDX-License-Identifier: Apache-2.0
// What a peeling method is, and the table of them.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "core/window.h"

namespace peeler {

class SceneRasterizer;

/// Captures fragments into the bound band buffers. A method is created anew for every render.
class PeelMethod {
  public:
    virtual ~PeelMethod() = default;

    /// True if capture() takes every fragment in any order; they are sorted afterwards. False if it
    /// delivers the nearest layers front to back, so that a layer limit saves work.
    virtual bool takesAll() const = 0;

    /// Bytes of textures it needs for a raster tile of so many pixels.
    virtual std::uint64_t tileBytes(std::uint64_t tile_pixels, bool float_color) const = 0;

    /// Captures the pixels of `area`, which lies in the rasterizer's tile. The slot of each pixel
    /// holds the index of its first fragment and must be advanced by one for every fragment stored.
    /// `layers` is the number of layers to capture. Returns the geometry passes it took.
    virtual int capture(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers) = 0;
};

/// One row of the table. A new method is one new file and one new row in methods.cpp.
struct MethodInfo {
    std::string_view name;     ///< as on the command line
    std::string_view summary;  ///< one line for --help
    std::unique_ptr<PeelMethod> (*create)();
};

/// The table, the default method first.
std::span<const MethodInfo> peelMethods();

/// The row with this name, or null.
const MethodInfo* findPeelMethod(std::string_view name);

}  // namespace peeler
