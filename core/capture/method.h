// SPDX-License-Identifier: Apache-2.0
// What a peeling method is, and the table of them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>

#include <peeler/capture_settings.h>
#include <peeler/window.h>

namespace peeler {

class SceneRasterizer;

/// What a layer method shall capture.
struct LayerArea {
    Window window;             ///< inside the rasterizer's tile
    std::uint32_t layers = 0;  ///< to capture
    /// That of the list heads, if they are a render target (takesListHeadTarget()), or of the
    /// depths of opaque fragments (takesOpaqueFirst()), or of both; 0 = there is neither.
    unsigned framebuffer = 0;
    bool list_head_target =
        false;  ///< whether the list heads are its render target; else they are the buffer
    /// Nothing but what is transparent and in front of the opaque fragments (OpaqueTarget).
    bool in_front = false;
    /// Whether fragments are stored with their primitives. If not, whatever grows in draw order
    /// will do.
    bool keys = true;
};

/// Captures fragments into the bound band buffers. Created anew for every render.
class LayerMethod {
  public:
    virtual ~LayerMethod() = default;

    /// True if capture() takes every fragment in any order; they are sorted afterwards. False if it
    /// delivers the nearest layers front to back, so that a layer limit saves work.
    virtual bool takesAll() const = 0;

    /// Whether its one geometry pass can have the list heads as its render target (ListHeadTarget).
    virtual bool takesListHeadTarget() const { return false; }

    /// Whether it can leave out the opaque fragments and what they hide (LayerArea::in_front).
    virtual bool takesOpaqueFirst() const { return false; }

    /// Bytes of textures it needs for a raster tile of so many pixels.
    virtual std::uint64_t tileBytes(std::uint64_t tile_pixels,
                                    const CaptureSettings& settings) const = 0;

    /// Captures the pixels of an area. The list head of each holds the index of its first fragment
    /// and must be advanced by one for every fragment stored. Returns the geometry passes it took.
    virtual int capture(SceneRasterizer& rasterizer, const LayerArea& area) = 0;
};

/// What a composite shall show of an area.
struct CompositeArea {
    Window window;              ///< inside the rasterizer's tile
    std::uint32_t layers = 0;   ///< the most fragments of a pixel that are shown in order
    std::uint32_t deepest = 0;  ///< the most fragments of a pixel
    bool tail = false;          ///< whether what lies behind those in order is blended
    /// The most fragments that a pixel should show in order whose list head does not say that it
    /// does. Waits for the GPU.
    std::function<std::uint32_t()> layersMissing;
};

/// Composites fragments as it finds them: nothing but one picture is kept. Created anew for every
/// render.
class CompositeMethod {
  public:
    virtual ~CompositeMethod() = default;

    /// Bytes of textures it needs for a raster tile of so many pixels.
    virtual std::uint64_t tileBytes(std::uint64_t tile_pixels,
                                    const CaptureSettings& settings) const = 0;

    /// Writes the colours (PEELER_COLORS) and nearest depths (PEELER_DEPTHS) of the pixels of
    /// `area`. List heads, depths and stamps are 0 before; each fragment that has been composited
    /// adds one to its pixel's list head. Returns the geometry passes it took.
    virtual int composite(SceneRasterizer& rasterizer, const CompositeArea& area) = 0;
};

/// One row of the table. A new method is one new file and one new row in methods.cpp.
struct MethodInfo {
    std::string_view name;                     ///< as on the command line
    std::string_view summary;                  ///< one line
    std::unique_ptr<LayerMethod> (*layers)();  ///< null: an approximation, for composites only
    std::unique_ptr<CompositeMethod> (*composite)();  ///< null: the captured layers are composited

    bool exact() const { return layers != nullptr; }
};

/// The table, the default method first.
std::span<const MethodInfo> peelMethods();

/// The row with this name, or null.
const MethodInfo* findPeelMethod(std::string_view name);

}  // namespace peeler
