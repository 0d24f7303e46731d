// SPDX-License-Identifier: Apache-2.0
// Named choices of a capture: surfaces, faces, shading, precision, tail, engine.
#pragma once

#include <cstdint>

#include <peeler/capture_settings.h>
#include <peeler/renderer.h>
#include "cmd/session/choices.h"

namespace peeler::cmd {

// The default of each comes first.
inline constexpr Choice<Surfaces> kSurfaces[] = {
    {"all", Surfaces::kAll, "every surface; opaque ones hide nothing"},
    {"visible", Surfaces::kVisible, "none behind the nearest opaque one"},
    {"transparent", Surfaces::kTransparent, "as visible, without the opaque ones"},
};
inline constexpr Choice<Tail> kTails[] = {
    {"drop", Tail::kDrop, "left out"},
    {"blend", Tail::kBlend, "blended behind them as a weighted average; composites only"},
};
inline constexpr Choice<Faces> kFaces[] = {
    {"gltf", Faces::kGltf, "as each material's doubleSided says"},
    {"front", Faces::kFront, "front faces only"},
    {"back", Faces::kBack, "back faces only"},
    {"both", Faces::kBoth, "both, whatever the material says"},
};
/// The same choices, with the default for rays first.
inline constexpr Choice<Faces> kRayFaces[] = {kFaces[3], kFaces[0], kFaces[1], kFaces[2]};
inline constexpr Choice<Shading> kShading[] = {
    {"pbr", Shading::kPbr, "metallic-roughness under the scene's lights, or the built-in one"},
    {"unlit", Shading::kUnlit, "base colour alone"},
};
inline constexpr Choice<PixelType> kPrecisions[] = {
    {"half", PixelType::kHalf, "16-bit colour"},
    {"float", PixelType::kFloat, "32-bit colour"},
};

inline constexpr Choice<RayEngine> kEngines[] = {
    {"auto", RayEngine::kAuto,
     "gl if there is a GPU, or --backend, --device or --require-gpu is given; else cpu"},
    {"cpu", RayEngine::kCpu,
     "a rasteriser of hits that needs no GL and finds the same ones on every machine"},
    {"gl", RayEngine::kGl,
     "the device that pictures are rendered by: the fragments of peeler render"},
};

/// Side of a point in display pictures, in pixels.
inline constexpr int kDisplayPointSize = 3;

}  // namespace peeler::cmd
