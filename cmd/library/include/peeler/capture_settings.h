// SPDX-License-Identifier: Apache-2.0
// Capture settings: method, surfaces, shading, channels, samples, memory.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <peeler/channels.h>
#include <peeler/clip.h>
#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/memory_budget.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The set of fragments to capture (core/README.md, "What a fragment is").
enum class Surfaces : std::uint8_t {
    kAll,  ///< all fragments, including those behind opaque surfaces
    /// Up to and including the nearest opaque fragment (OPAQUE or MASK, not transmissive).
    kVisible,
    kTransparent  ///< like kVisible, but without opaque fragments
};

/// The sides of triangles to rasterise.
enum class Faces : std::uint8_t {
    kGltf,  ///< both sides if the material is doubleSided, else front faces only
    kFront,
    kBack,
    kBoth
};

/// Fragment colour: lit by the scene's lights, or only the base colour.
enum class Shading : std::uint8_t { kPbr, kUnlit };

/// The kind of capture: a picture, or ray hits. The fragments of hits have no colour; the first
/// extra array holds the keys of the hit primitives (kKeyChannel). Rays never hit lines and points,
/// which have no area.
enum class HitMode : std::uint8_t {
    kNone,     ///< a picture
    kRefined,  ///< Z recomputed from the primitive in double precision; hits sorted by this Z
    kRaw,      ///< Z as computed by the rasteriser
    kSloped    ///< like kRaw, with depth slopes in place of colour (LayeredImage::color)
};

/// The depth of a Gaussian splat's fragments, by which they are sorted.
enum class SplatOrder : std::uint8_t {
    /// Camera Z of the splat's mean. With Splats::by_distance: the Z at which the pixel's ray is as
    /// far from the camera as the mean.
    kCenter,
    kRay  ///< camera Z of the largest response along the pixel's ray
};

/// The colour values in which Gaussian splats are blended.
enum class SplatBlending : std::uint8_t {
    kLinear,  ///< linear light, as surfaces are
    /// sRGB-encoded values, as most viewers do. Only for composites of splats alone, which become
    /// linear after blending.
    kDisplay
};

/// How often an opaque triangle is shaded in a pixel of a composite with several samples.
/// Visibility and transparent fragments always have every sample.
enum class ShadePer : std::uint8_t {
    kSample,  ///< once for every sample, exactly
    /// Once, at the centroid of the samples that show the triangle, like multisampling. Needs a
    /// composite of all layers by the A-buffer, 4 samples, triangles alone, no clip meshes and no
    /// lens, and a driver with the usual sample positions. If something is missing, GlRenderer
    /// throws Error (kUsage).
    kPixel,
    /// Once per pixel if that is possible, all surfaces are opaque, and the buffers take at most a
    /// quarter of `memory`; else for every sample.
    kAuto
};

/// Returns the number of colour components stored during a capture (shaders/packed_color.glsl).
/// With coloured opacity, the eighth component is padding.
inline constexpr std::size_t storedComponents(bool tinted) {
    return tinted ? 8 : 4;
}

/// The settings of a capture. The defaults capture every fragment, as a picture.
struct CaptureSettings {
    std::string method = "a-buffer";  ///< as for `peeler render --method`
    Surfaces surfaces = Surfaces::kAll;
    Faces faces = Faces::kGltf;
    Shading shading = Shading::kPbr;
    /// Whether directional lights, spot lights and the built-in light cast shadows.
    bool shadows = false;
    int shadow_size = 2048;    ///< texels per side of the shadow map of each light
    bool opaque_only = false;  ///< whether to skip materials that are BLEND or transmissive
    /// Side, in pixels, of the square drawn around a point. A point whose centre is outside the
    /// picture is not drawn. If the picture consists of several raster tiles (4096 x 4096 pixels),
    /// only the tile that contains the point's centre shows the square.
    int point_size = 1;
    ClipVolume clip{};  ///< fragments outside the kept side of the volume are discarded
    PixelType color_type = PixelType::kHalf;  ///< kHalf or kFloat
    /// Coloured opacity: glass filters each colour channel separately (LayeredImage::tinted). Needs
    /// more memory, and only makes a difference if hasTintedGlass(). If false, the opacity of glass
    /// is a single alpha.
    bool tinted = false;
    SplatOrder splat_order = SplatOrder::kCenter;
    SplatBlending splat_blending = SplatBlending::kLinear;
    /// Variance added to projected splats, square pixels; nothing for Splats::dilation.
    std::optional<double> splat_dilation{};
    HitMode hit_mode = HitMode::kNone;
    bool depth_clamp = false;  ///< whether to disable clipping at the near and far planes
    /// Extra channels to store per fragment, in the order of channelTable(). Composites have no
    /// extra channels.
    std::vector<Channel> channels{};
    std::uint32_t max_layers = 0;  ///< number of layers to keep, nearest first; 0 = all
    /// A share of the pixels, 0 to 1. The first layer that covers less than this share is the last
    /// layer to be kept.
    double occlusion_ratio = 0;
    Tail tail = Tail::kDrop;
    int samples = 1;  ///< sub-pixel samples, merged into one picture
    ShadePer shade_per = ShadePer::kSample;
    /// Whether to composite each band before the sink gets it. The band then has at most one
    /// fragment per pixel, in 32-bit float.
    bool composite = false;
    MemoryBudget memory{};  ///< limit for the process without MemoryBudget::base
    /// Maximum bytes of a band; a tight `memory` makes bands smaller.
    std::uint64_t band_bytes = 384ULL << 20;

    /// Returns the number of bytes per fragment in LayeredImage::color.
    std::size_t colorBytes() const {
        if (hit_mode != HitMode::kNone) return storedColorBytes();
        return colorComponents(tinted) * pixelTypeSize(color_type);
    }
    /// Returns the number of bytes of colour per fragment during the capture.
    std::size_t storedColorBytes() const {
        if (hit_mode == HitMode::kNone) return storedComponents(tinted) * pixelTypeSize(color_type);
        return hit_mode == HitMode::kSloped ? 2 * sizeof(float) : 0;
    }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
