// SPDX-License-Identifier: Apache-2.0
// Capture settings: method, surfaces, shading, channels, samples, memory.
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

/// The fragments to capture (core/README.md, "What a fragment is").
enum class Surfaces : std::uint8_t {
    kAll,         ///< all; opaque surfaces hide nothing
    kVisible,     ///< up to the nearest opaque one: OPAQUE or MASK, not transmissive
    kTransparent  ///< as kVisible, without the opaque fragments
};

/// The sides of triangles to rasterise.
enum class Faces : std::uint8_t {
    kGltf,   ///< per the material's doubleSided
    kFront,  ///< front faces only
    kBack,   ///< back faces only
    kBoth
};

/// Fragment colour: lit by the scene's lights, or the base colour alone.
enum class Shading : std::uint8_t { kPbr, kUnlit };

/// Ray hits instead of a picture. Fragments have no colour; their keys (kKeyChannel) are the first
/// extra array. Lines and points have no area and are never hit.
enum class HitMode : std::uint8_t {
    kNone,     ///< a picture
    kRefined,  ///< Z recomputed from the primitive in double precision, then sorted
    kRaw,      ///< Z as rasterised
    kSloped    ///< Z as rasterised; depth slopes in place of colour (LayeredImage::color)
};

/// Returns the number of colour components stored during a capture (shaders/packed_color.glsl). The
/// eighth component of coloured opacity is padding.
inline constexpr std::size_t storedComponents(bool tinted) {
    return tinted ? 8 : 4;
}

/// The settings of a capture. The defaults capture every fragment of a picture.
struct CaptureSettings {
    std::string method = "a-buffer";  ///< a value of `peeler render --method`
    Surfaces surfaces = Surfaces::kAll;
    Faces faces = Faces::kGltf;
    Shading shading = Shading::kPbr;
    bool shadows = false;      ///< from directional and spot lights, including the built-in light
    int shadow_size = 2048;    ///< texels per side of each light's shadow map
    bool opaque_only = false;  ///< skip materials that are BLEND or transmit light
    /// Side, in pixels, of the square drawn around a point. Points whose centre is outside the
    /// picture, or outside a raster tile of 4096 x 4096 pixels, are not drawn there.
    int point_size = 1;
    ClipVolume clip{};                        ///< fragments on the wrong side are discarded
    PixelType color_type = PixelType::kHalf;  ///< or kFloat
    /// Coloured opacity: glass filters each colour channel separately (LayeredImage::tinted). Worth
    /// its memory only if hasTintedGlass(). If false, glass has one alpha.
    bool tinted = false;
    HitMode hit_mode = HitMode::kNone;
    bool depth_clamp = false;  ///< no clipping at the near and far planes
    /// Extra channels of every fragment, in the table's order. Composites have none.
    std::vector<Channel> channels{};
    std::uint32_t max_layers = 0;  ///< nearest layers to keep; 0 = all
    double occlusion_ratio = 0;    ///< last layer: the first that covers less of the pixels
    Tail tail = Tail::kDrop;
    int samples = 1;  ///< sub-pixel samples per pixel, merged into one picture
    /// Composites each band before the sink gets it: at most one fragment per pixel, in 32-bit
    /// float.
    bool composite = false;
    MemoryBudget memory{};                    ///< of the process, minus the budget's base
    std::uint64_t band_bytes = 384ULL << 20;  ///< maximum per band; less if memory is tight

    /// Returns the bytes per fragment of LayeredImage::color.
    std::size_t colorBytes() const {
        if (hit_mode != HitMode::kNone) return storedColorBytes();
        return colorComponents(tinted) * pixelTypeSize(color_type);
    }
    /// Returns the same during the capture.
    std::size_t storedColorBytes() const {
        if (hit_mode == HitMode::kNone) return storedComponents(tinted) * pixelTypeSize(color_type);
        return hit_mode == HitMode::kSloped ? 2 * sizeof(float) : 0;
    }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
