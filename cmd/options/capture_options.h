// SPDX-License-Identifier: Apache-2.0
// What verbs that capture a scene share: which fragments, in which volume, and on which device.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cmd/cli/choices.h"
#include "cmd/cli/console.h"
#include "core/capture/capture_settings.h"
#include "core/gl/context.h"
#include "core/scene/clip.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

class VerbOptions;

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
/// The same choices, with the default of rays first.
inline constexpr Choice<Faces> kRayFaces[] = {kFaces[3], kFaces[0], kFaces[1], kFaces[2]};
inline constexpr Choice<Shading> kShading[] = {
    {"pbr", Shading::kPbr, "metallic-roughness under the scene's lights, or the built-in one"},
    {"unlit", Shading::kUnlit, "base colour alone"},
};
inline constexpr Choice<PixelType> kPrecisions[] = {
    {"half", PixelType::kHalf, "16-bit colour"},
    {"float", PixelType::kFloat, "32-bit colour"},
};

/// What finds the hits of rays.
enum class Engine : std::uint8_t { kAuto, kCpu, kGl };
inline constexpr Choice<Engine> kEngines[] = {
    {"auto", Engine::kAuto,
     "gl if there is a GPU, or --backend, --device or --require-gpu is given; else cpu"},
    {"cpu", Engine::kCpu,
     "a rasteriser of hits that needs no GL and finds the same ones on every machine"},
    {"gl", Engine::kGl, "the device that pictures are rendered by: the fragments of peeler render"},
};

/// Declares --method, --layers, --occlusion-ratio, --tail, --samples, --surfaces, --faces,
/// --shading, --point-size and --precision.
void addLayerOptions(VerbOptions& verb, CaptureSettings& capture);

/// Of those --method, --faces and --point-size, for verbs that take all layers as they are.
void addAllLayersOptions(VerbOptions& verb, CaptureSettings& capture);

/// Pixels a side of a point in pictures for eyes.
inline constexpr int kDisplayPointSize = 3;

/// Declares --faces for rays; none = the default, which depends on what they are traced for.
void addRayFacesOption(VerbOptions& verb, std::optional<Faces>& faces);

/// Declares --shadows and --shadow-size (texels a side of a shadow map; none = not given).
void addLightOptions(VerbOptions& verb, CaptureSettings& capture, std::optional<int>& shadow_size);

/// Sets the size of shadow maps if it is given. Throws Error (kUsage) for a size without shadows.
void setShadowSize(CaptureSettings& capture, const std::optional<int>& shadow_size);

/// Declares --memory (bytes), whose default is inheritedBudget() (cmd/machine/resources.h);
/// `remark` says how a verb keeps to it.
void addMemoryOption(VerbOptions& verb, MemoryBudget& budget, const std::string& remark);

/// Declares --backend, --device, --require-gpu, --threads and --memory; `memory` says how a verb
/// keeps to that.
void addMachineOptions(VerbOptions& verb, gl::ContextRequest& device, int& threads,
                       CaptureSettings& capture, const std::string& memory);

/// Declares --engine.
void addEngineOption(VerbOptions& verb, Engine& engine);

/// Whether the request says anything of which device it is.
bool asksForDevice(const gl::ContextRequest& device);

/// Throws Error (kUsage) if an engine without GL is asked for as well as a device of GL.
void checkEngine(Engine engine, const gl::ContextRequest& device);

/// --clip-box, --clip-plane, --clip-mesh and --clip.
struct ClipOptions {
    ClipVolume volume;                ///< without nodes
    std::vector<std::string> meshes;  ///< names or indices of nodes
    bool side_given = false;          ///< --clip is given
};

/// Declares the options; `options` must outlive the parse.
void addClipOptions(VerbOptions& verb, ClipOptions& options);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkClipOptions(const ClipOptions& options);

/// The volume with the nodes that are shown under the named ones. Throws Error (kUsage) for a node
/// that is not there, with the list, and for one without triangles.
ClipVolume clipVolume(const ClipOptions& options, const PosedScene& posed);

}  // namespace peeler::cmd
