// SPDX-License-Identifier: Apache-2.0
// Peeling methods: their interfaces, and the table of all methods.
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

/// The keys that are stored with fragments.
enum class StoredKeys : std::uint8_t {
    kOrder,  ///< any values that increase in draw order
    /// The key of any primitive of the fragment's surface. Fragments with the same depth and key
    /// are stored in draw order.
    kSurface,
    kPrimitive  ///< the key of the fragment's primitive
};

/// The area that a layer method captures, with its framebuffer and options.
struct LayerArea {
    Window window;             ///< window to capture, inside the rasterizer's tile
    std::uint32_t layers = 0;  ///< number of layers to capture
    /// The framebuffer for passes of the method, or 0 for a method without one. It has the list
    /// heads if takesListHeadTarget(), and the depths of opaque fragments if takesOpaqueFirst().
    unsigned framebuffer = 0;
    bool list_head_target = false;  ///< whether the list heads are a render target, not a buffer
    /// Whether to capture only the transparent fragments in front of the OpaqueTarget's fragments.
    bool in_front = false;
    /// The keys to store. kPrimitive fulfils the other requests, too.
    StoredKeys keys = StoredKeys::kPrimitive;
};

/// A method that captures fragments into the bound band buffers. Every render creates a new object.
class LayerMethod {
  public:
    virtual ~LayerMethod() = default;

    /// Whether capture() captures all fragments, in any order, for the caller to sort. If false,
    /// capture() delivers the nearest layers front to back, so a layer limit saves work.
    virtual bool takesAll() const = 0;

    /// Whether the method has a single geometry pass, which can then render to the list heads
    /// (ListHeadTarget).
    virtual bool takesListHeadTarget() const { return false; }

    /// Whether the method can skip opaque fragments and the fragments behind them
    /// (LayerArea::in_front).
    virtual bool takesOpaqueFirst() const { return false; }

    /// Returns the bytes of textures for a raster tile with this many pixels.
    virtual std::uint64_t tileBytes(std::uint64_t tile_pixels,
                                    const CaptureSettings& settings) const = 0;

    /// Captures the pixels of an area. On entry, each list head holds the index of the pixel's
    /// first fragment. The method must advance the list head by one for every fragment that it
    /// stores. Returns the number of geometry passes.
    virtual int capture(SceneRasterizer& rasterizer, const LayerArea& area) = 0;
};

/// The area that a composite method composites.
struct CompositeArea {
    Window window;              ///< window to composite, inside the rasterizer's tile
    std::uint32_t layers = 0;   ///< maximum number of fragments per pixel to composite in order
    std::uint32_t deepest = 0;  ///< number of fragments of the deepest pixel
    bool tail = false;          ///< whether to blend the fragments behind `layers`
    /// Returns the number of fragments per pixel that must be composited in order. This is the
    /// maximum over all pixels whose list head shows that fragments are missing; 0 if all pixels
    /// are complete. Waits for the GPU.
    std::function<std::uint32_t()> layersMissing;
};

/// A method that composites fragments on the fly and stores only a picture. Every render creates a
/// new object.
class CompositeMethod {
  public:
    virtual ~CompositeMethod() = default;

    /// Returns the bytes of textures for a raster tile with this many pixels.
    virtual std::uint64_t tileBytes(std::uint64_t tile_pixels,
                                    const CaptureSettings& settings) const = 0;

    /// Writes the colours (PEELER_COLORS) and nearest depths (PEELER_DEPTHS) of the pixels of
    /// `area`. List heads, depths and stamps must be 0 on entry. Each composited fragment adds one
    /// to its pixel's list head. Returns the number of geometry passes.
    virtual int composite(SceneRasterizer& rasterizer, const CompositeArea& area) = 0;
};

/// A row of the table of methods. To add a method, add a file and a row in methods.cpp.
struct MethodInfo {
    std::string_view name;     ///< name on the command line
    std::string_view summary;  ///< description, one line
    /// Null if the method is an approximation that can only composite.
    std::unique_ptr<LayerMethod> (*layers)();
    /// Null if the method cannot composite by itself. Its captured layers are then composited.
    std::unique_ptr<CompositeMethod> (*composite)();

    bool exact() const { return layers != nullptr; }
};

/// Returns the table of methods. The default method is first.
std::span<const MethodInfo> peelMethods();

/// Returns the row with this name, or null.
const MethodInfo* findPeelMethod(std::string_view name);

}  // namespace peeler
