// SPDX-License-Identifier: Apache-2.0
// View lists: many cameras for one scene, read from a file or placed around the scene.
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
    {"orbit", Around::kOrbit, "on a circle"},
    {"turntable", Around::kTurntable,
     "on a circle, at the smallest distance that shows the whole scene from every angle, with "
     "margins of 5 %"},
    {"random", Around::kRandom, "at random on all sides, the same for the same --seed"},
};

struct ViewListOptions {
    std::optional<std::filesystem::path> file;
    std::optional<CameraConvention> convention;
    std::optional<int> count;
    std::optional<Around> around;
    std::optional<std::uint64_t> seed;
    std::optional<double> distance;
    std::optional<double> elevation, azimuth;  ///< degrees
    bool clockwise = false;
    int first = 0;
    std::optional<std::filesystem::path> cameras_out;
    bool through_corners = false;  ///< ViewsAround::through_corners; set by presets
    bool lenses = false;           ///< whether the verb takes cameras with lenses

    /// Whether --cameras or --views is given, even for a single view.
    bool asked() const { return file || count; }
    /// Whether the views lie on a circle.
    bool turns() const { return around == Around::kOrbit || around == Around::kTurntable; }
};

/// Declares the options in ViewListOptions, except the two below. `options` must outlive the parse.
void addViewOptions(VerbOptions& verb, ViewListOptions& options);

/// Declares --first-view and --cameras-out, for a verb whose views have files of their own.
void addViewFileOptions(VerbOptions& verb, ViewListOptions& options);

/// The views of a run: from a file, around the scene, or the single view of the camera options.
class ViewList {
  public:
    /// Checks the options and reads the file. `camera` holds the settings common to all views. All
    /// arguments must outlive the list. Throws Error (kUsage) if the options contradict each other.
    /// Does not need the scene. Throws like readCameras(). Reports warnings about the file or, if
    /// `strict`, throws them as errors.
    ViewList(const ViewListOptions& options, const CameraOptions& camera, bool strict,
             Reporter& reporter);

    bool asked() const { return options_.asked(); }
    std::size_t size() const;  ///< returns the number of views, at least 1
    /// Returns the half-open range of views that this run makes. Throws Error (kUsage) if there is
    /// a chunk but no list of views.
    std::pair<std::size_t, std::size_t> part(const std::optional<Shard>& chunk) const;

    /// Throws Error (kUsage) if several views would have the same name, because the name has no
    /// number pattern.
    void checkName(const std::filesystem::path& output) const;

    /// Places cameras around the scene, and finds the nodes that the camera file places. Must be
    /// called before the functions below. Throws Error (kUsage) if a camera cannot be placed, Error
    /// (kInput) if the scene lacks an object.
    void place(const OpenedScene& scene);

    const std::vector<CameraOptions>& cameras() const { return cameras_; }
    /// Returns a view's number in names and results.
    int number(std::size_t index) const { return options_.first + static_cast<int>(index); }
    /// Returns a view's name in the camera file, or its number; "" for a single view.
    std::string name(std::size_t index) const { return asked() ? names_[index] : ""; }
    bool placesObjects() const { return !placed_.empty(); }
    /// Returns the nodes that a view moves, with their poses.
    std::span<const PlacedNode> placed(std::size_t index) const {
        return placed_.empty() ? std::span<const PlacedNode>() : placed_[index];
    }
    /// Adds the nodes that a view moves to the view's settings, as "placed".
    void addSettings(std::size_t index, nlohmann::json& settings) const;
    /// Returns the scene at a time, with nodes moved as in a view.
    PosedScene pose(const OpenedScene& scene, double time, std::size_t index) const {
        return scene.at(time, placed(index));
    }
    /// Returns the View. With --cameras or --views, View::camera_name is name(). Throws like
    /// makeView().
    View view(const OpenedScene& scene, const PosedScene& posed, std::size_t index) const;

    /// Whether the camera is the scene's own, chosen by default, and shows only a part of the
    /// scene.
    bool cutsSceneOff(const View& view, const PosedScene& posed) const;

  private:
    void tell(const ReadWarnings& warnings) const;
    void placeObjects(const Scene& scene);
    void warnOfUnplaced(std::size_t objects) const;

    const ViewListOptions& options_;
    const CameraOptions& camera_;
    bool strict_;
    Reporter& reporter_;
    std::vector<FileCamera> listed_;      ///< cameras from the file
    std::vector<std::string> names_;      ///< empty for a single view
    std::vector<CameraOptions> cameras_;  ///< set by place()
    /// The moved nodes of each view; empty if no view moves a node.
    std::vector<std::vector<PlacedNode>> placed_;
};

}  // namespace peeler::cmd
