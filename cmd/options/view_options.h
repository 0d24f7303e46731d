// SPDX-License-Identifier: Apache-2.0
// Many cameras of one scene, one picture or bundle each: of a file, or around the scene.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cmd/cli/choices.h"
#include "cmd/options/camera_options.h"
#include "core/scene/framing.h"
#include "core/views/many_cameras.h"

namespace peeler::cmd {

class VerbOptions;

inline constexpr Choice<Around> kArounds[] = {
    {"sphere", Around::kSphere, "evenly on all sides"},
    {"hemisphere", Around::kHemisphere, "evenly on the upper half"},
    {"orbit", Around::kOrbit, "on a circle, 30° above the horizon"},
    {"random", Around::kRandom, "on all sides by chance, the same for a --seed"},
};

inline constexpr int kMostViews = 1'000'000;

/// --cameras, --views and what belongs to them.
struct ViewOptions {
    std::optional<std::filesystem::path> file;
    std::optional<int> count;
    std::optional<Around> around;
    std::optional<std::uint64_t> seed;
    std::optional<double> distance;
    std::optional<std::filesystem::path> cameras_out;

    /// Whether there is a list of views, however short it is.
    bool asked() const { return file || count; }
};

/// Declares the options; `options` must outlive the parse.
void addViewOptions(VerbOptions& verb, ViewOptions& options);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is; `camera` has what is
/// the same for all views.
void checkViewOptions(const ViewOptions& options, const CameraOptions& camera);

/// The views of --cameras, in the order of the file; none without it. Throws like readCameras().
std::vector<ListedCamera> readViews(const ViewOptions& options);

/// The views of --views, of the size and field of view of `camera`.
std::vector<ListedCamera> placeViews(const ViewOptions& options, const CameraOptions& camera,
                                     const SceneExtent& extent);

/// What makes the picture of a view: its own choice, and what is the same for all.
CameraOptions cameraOf(const ListedCamera& view, const CameraOptions& camera);

}  // namespace peeler::cmd
