// SPDX-License-Identifier: Apache-2.0
// Named choices of a capture: surfaces, faces, shading, precision, tail, engine.
#pragma once

#include <cstdint>

#include <peeler/capture_settings.h>
#include <peeler/renderer.h>
#include "cmd/session/choices.h"

namespace peeler::cmd {

// The first row of each table is the default.
inline constexpr Choice<Surfaces> kSurfaces[] = {
    {"all", Surfaces::kAll, "every surface, even behind opaque ones"},
    {"visible", Surfaces::kVisible, "surfaces up to the nearest opaque one"},
    {"transparent", Surfaces::kTransparent, "as visible, but without opaque surfaces"},
};
inline constexpr Choice<Tail> kTails[] = {
    {"drop", Tail::kDrop, "leave them out"},
    {"blend", Tail::kBlend, "blend them behind the layers as a weighted average; composites only"},
};
inline constexpr Choice<Faces> kFaces[] = {
    {"gltf", Faces::kGltf, "as set by each material's doubleSided"},
    {"front", Faces::kFront, "front faces only"},
    {"back", Faces::kBack, "back faces only"},
    {"both", Faces::kBoth, "both faces, regardless of the material"},
};
/// kFaces, with the default for rays first.
inline constexpr Choice<Faces> kRayFaces[] = {kFaces[3], kFaces[0], kFaces[1], kFaces[2]};
inline constexpr Choice<Shading> kShading[] = {
    {"pbr", Shading::kPbr, "metallic-roughness under the scene's lights, or the built-in one"},
    {"unlit", Shading::kUnlit, "base colour only"},
};
inline constexpr Choice<ShadePer> kShadePer[] = {
    {"sample", ShadePer::kSample, "once for every sample"},
    {"pixel", ShadePer::kPixel,
     "once in a pixel, at the centroid of the samples that show the triangle; faster"},
    {"auto", ShadePer::kAuto,
     "pixel if all surfaces are opaque, and it is possible with a quarter of --memory, else "
     "sample"},
};
inline constexpr Choice<SplatOrder> kSplatOrders[] = {
    {"center", SplatOrder::kCenter,
     "by camera Z of the splat's centre, in glTF by distance, as other viewers do"},
    {"ray", SplatOrder::kRay,
     "by camera Z of the largest response along the pixel's ray, so that splats and surfaces cross "
     "where they cross"},
};
inline constexpr Choice<SplatBlending> kSplatBlendings[] = {
    {"linear", SplatBlending::kLinear, "linear light, as surfaces and compositors blend"},
    {"display", SplatBlending::kDisplay,
     "sRGB values, as other viewers of splats blend; only composites of splats alone"},
};
inline constexpr Choice<PixelType> kPrecisions[] = {
    {"half", PixelType::kHalf, "16-bit colour"},
    {"float", PixelType::kFloat, "32-bit colour"},
};

inline constexpr Choice<RayEngine> kEngines[] = {
    {"auto", RayEngine::kAuto,
     "gl if there is a GPU, or --backend, --device or --require-gpu is given; else cpu"},
    {"cpu", RayEngine::kCpu,
     "software rasteriser that needs no GL and finds the same hits on every machine"},
    {"gl", RayEngine::kGl, "GL device; hits are the fragments that peeler render finds"},
};

/// The default side of points in display pictures, in pixels.
inline constexpr int kDisplayPointSize = 3;

}  // namespace peeler::cmd
