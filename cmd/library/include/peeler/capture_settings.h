// SPDX-License-Identifier: Apache-2.0
// The settings of a capture: method, surfaces, shading, channels, samples, memory.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <peeler/channels.h>
#include <peeler/clip.h>
#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/memory_budget.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Which fragments are captured (core/README.md, "What a fragment is").
enum class Surfaces : std::uint8_t {
    kAll,         ///< every one; opaque surfaces hide nothing
    kVisible,     ///< none behind the nearest opaque one: OPAQUE or MASK, not transmissive
    kTransparent  ///< like kVisible, without the opaque fragments themselves
};

/// Which side of a triangle is rasterised.
enum class Faces : std::uint8_t {
    kGltf,   ///< as the material's doubleSided says
    kFront,  ///< front faces only
    kBack,   ///< back faces only
    kBoth
};

/// Colours of fragments: the lights of the scene on its materials, or the base colour alone.
enum class Shading : std::uint8_t { kPbr, kUnlit };

/// Rays instead of a picture: fragments have no colour, and their keys (kKeyChannel) are the first
/// extra array. Lines and points, which have no area, are not hit.
enum class HitMode : std::uint8_t {
    kNone,     ///< a picture
    kRefined,  ///< Z is found anew in double precision from the primitive, and sorted by
    kRaw,      ///< as the rasteriser has them
    kSloped    ///< likewise; in place of colours, how depth changes (LayeredImage::color)
};

/// How many components a colour has while it is captured (shaders/packed_color.glsl): of coloured
/// opacity the last says nothing.
inline constexpr std::size_t storedComponents(bool tinted) {
    return tinted ? 8 : 4;
}

/// The settings of a capture; the defaults capture every fragment of a picture.
struct CaptureSettings {
    std::string method = "a-buffer";  ///< as `peeler render --method` takes it
    Surfaces surfaces = Surfaces::kAll;
    Faces faces = Faces::kGltf;
    Shading shading = Shading::kPbr;
    bool shadows = false;      ///< directional and spot lights, the built-in one too, cast them
    int shadow_size = 2048;    ///< texels a side of each light's shadow map
    bool opaque_only = false;  ///< nothing that is BLEND or transmits light
    /// Pixels a side of the square that a point is shown as, around where it is. A raster tile of
    /// 4096 x 4096 pixels (and the picture) shows the points whose middle it has.
    int point_size = 1;
    ClipVolume clip{};                        ///< fragments on the wrong side do not count
    PixelType color_type = PixelType::kHalf;  ///< or kFloat
    /// Opacity is coloured: glass filters every channel by itself (LayeredImage::tinted). Worth its
    /// memory where hasTintedGlass(); without it glass has one alpha.
    bool tinted = false;
    HitMode hit_mode = HitMode::kNone;
    bool depth_clamp = false;  ///< nothing is cut off before the near or behind the far plane
    /// Of every fragment, in the order of the table; not of composites.
    std::vector<Channel> channels{};
    std::uint32_t max_layers = 0;  ///< nearest layers to keep; 0 = all
    double occlusion_ratio = 0;  ///< the first layer on fewer than this share of the pixels is last
    Tail tail = Tail::kDrop;
    int samples = 1;  ///< sub-pixel positions a pixel, merged into one picture
    /// Bands are handed over composited: one fragment in every pixel that has any, in 32-bit float.
    bool composite = false;
    MemoryBudget memory{};                    ///< of the process, less the budget's base
    std::uint64_t band_bytes = 384ULL << 20;  ///< most bytes of a band; less under a tight budget

    /// Bytes of what a fragment has in the place of its colour.
    std::size_t colorBytes() const {
        if (hit_mode != HitMode::kNone) return storedColorBytes();
        return colorComponents(tinted) * pixelTypeSize(color_type);
    }
    /// The same while it is captured.
    std::size_t storedColorBytes() const {
        if (hit_mode == HitMode::kNone) return storedComponents(tinted) * pixelTypeSize(color_type);
        return hit_mode == HitMode::kSloped ? 2 * sizeof(float) : 0;
    }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
