// SPDX-License-Identifier: Apache-2.0
// Many cameras of one scene, one picture or bundle each: of a file, or around the scene.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cmd/options/camera_options.h"
#include "cmd/options/capture_job.h"
#include "cmd/session/choices.h"
#include "core/scene/framing.h"
#include "core/views/many_cameras.h"
#include "formats/cameras/camera_file.h"

namespace peeler::cmd {

class VerbOptions;

inline constexpr Choice<Around> kArounds[] = {
    {"sphere", Around::kSphere, "evenly on all sides"},
    {"hemisphere", Around::kHemisphere, "evenly on the upper half"},
    {"orbit", Around::kOrbit, "on a circle, 30° above the horizon"},
    {"random", Around::kRandom, "on all sides by chance, the same for a --seed"},
};

/// --cameras, --views and what belongs to them.
struct ViewListOptions {
    std::optional<std::filesystem::path> file;
    std::optional<CameraConvention> convention;
    std::optional<int> count;
    std::optional<Around> around;
    std::optional<std::uint64_t> seed;
    std::optional<double> distance;
    std::optional<std::filesystem::path> cameras_out;
    bool through_corners = false;  ///< ViewsAround::through_corners, of presets

    /// Whether there is a list of views, however short it is.
    bool asked() const { return file || count; }
};

/// Declares the options; `options` must outlive the parse.
void addViewOptions(VerbOptions& verb, ViewListOptions& options);

/// The views of a run: of a file, around the scene, or the one of the camera's options.
class ViewList {
  public:
    /// Checks the options, and reads the file. `camera` has what is the same for all views. All
    /// must outlive it. Throws Error (kUsage) for what contradicts itself whatever the scene is,
    /// and like readCameras(), whose warnings go to the reporter; with `strict` they are errors.
    ViewList(const ViewListOptions& options, const CameraOptions& camera, bool strict,
             Reporter& reporter);

    bool asked() const { return options_.asked(); }
    std::size_t size() const;  ///< at least 1
    /// The first of the views that are this run's, and the one behind the last. Throws Error
    /// (kUsage) for a part of a lone view.
    std::pair<std::size_t, std::size_t> part(const std::optional<Shard>& chunk) const;

    /// Throws Error (kUsage) if the views would all have this name.
    void checkName(const std::filesystem::path& output) const;

    /// Places what stands around the scene, and finds the objects that a file places; to be called
    /// before what follows. Throws Error (kUsage), and (kInput) for an object that the scene lacks.
    void place(const OpenedScene& scene);

    /// The cameras of all views.
    const std::vector<CameraOptions>& cameras() const { return cameras_; }
    /// What a view is called: as its file has it, else by its number; "" of a lone one.
    std::string name(std::size_t index) const { return asked() ? names_[index] : ""; }
    /// Whether nodes stand elsewhere in some view than the scene's file says.
    bool placesObjects() const { return !placed_.empty(); }
    /// Which, and where.
    std::span<const PlacedNode> placed(std::size_t index) const {
        return placed_.empty() ? std::span<const PlacedNode>() : placed_[index];
    }
    /// The same for the settings' hash of a view: adds "placed" if there are any.
    void addSettings(std::size_t index, nlohmann::json& settings) const;
    /// The scene as a view shows it.
    PosedScene pose(const OpenedScene& scene, double time, std::size_t index) const {
        return scene.at(time, placed(index));
    }
    /// What a view sees of it, by its own name. Throws like makeView().
    View view(const OpenedScene& scene, const PosedScene& posed, std::size_t index) const;

  private:
    void tell(const ReadWarnings& warnings) const;
    void placeObjects(const Scene& scene);
    void warnOfUnplaced(std::size_t objects) const;

    const ViewListOptions& options_;
    const CameraOptions& camera_;
    bool strict_;
    Reporter& reporter_;
    std::vector<FileCamera> listed_;               ///< of the file
    std::vector<std::string> names_;               ///< none of a lone view
    std::vector<CameraOptions> cameras_;           ///< once they are placed
    std::vector<std::vector<PlacedNode>> placed_;  ///< of each view; empty if none has any
};

}  // namespace peeler::cmd
