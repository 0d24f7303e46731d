// SPDX-License-Identifier: Apache-2.0
// The pictures of a peeler render run, prepared without a GL context.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include <peeler/scene.h>
#include <peeler/sink.h>
#include "cmd/options/capture_job.h"
#include "cmd/options/output_options.h"
#include "cmd/options/view_options.h"
#include "cmd/render/render_options.h"
#include "formats/writers.h"

namespace peeler::cmd {

struct PictureRequest {
    std::size_t index = 0;  ///< index among all pictures that this run makes
    PictureNumber number{};
    double time = 0;  ///< time of the picture, seconds
    OutputRequest output{};
    std::optional<PosedScene> posed{};
    std::optional<NextFrame> next{};  ///< the next frame, set only for the motion channel
    View view{};
    CaptureSettings capture{};
    Provenance provenance{};  ///< `renderer` is not set
};

/// All pictures of a run, in order: every view of each frame.
class RenderRequest {
  public:
    /// Checks the options. All arguments must outlive this object. Throws Error (kUsage) if the
    /// options are invalid. Throws Error (kOutput) if an output cannot be written or would replace
    /// a file under --no-clobber.
    RenderRequest(const RenderOptions& options, CaptureJob& job, Reporter& reporter);

    /// Opens the job's scene, checks that no output replaces one of its files, and places the
    /// cameras. Must be called before the functions below. Throws like CaptureJob::openScene(),
    /// CaptureJob::checkOutputs() and ViewList::place().
    void openScene();

    const Scene& scene() const { return scene_->scene(); }
    bool hasFrames() const { return options_.animation.frames.has_value(); }
    bool hasViews() const { return views_.asked(); }
    /// Whether the pictures are samples of a data set: views, shards or arrays for loaders. The
    /// results then contain the calibration.
    bool makesSamples() const;
    bool isSequence() const { return hasFrames() || hasViews(); }
    /// Returns the noun for the pictures of a sequence, "view" or "frame"; "" for a single picture.
    const char* pictureKind() const { return hasViews() ? "view" : hasFrames() ? "frame" : ""; }
    /// Returns 0 if this run's chunk is empty.
    std::size_t pictures() const { return end_ - first_; }

    PictureNumber number(std::size_t index) const;
    /// Return the view and file of the first picture of a view, even if this run does not render
    /// it.
    View firstView(std::size_t view) const;
    std::filesystem::path firstFile(std::size_t view) const;
    /// Returns the file of a picture or, if pictures go into shards, the common name of the shards.
    std::filesystem::path outputFile(std::size_t index) const {
        return options_.shards ? options_.shards->name() : outputOf(index).path;
    }
    const std::optional<Normalizing>& normalized() const { return scene_->normalized(); }
    /// Returns all views, including those that this run does not render.
    const ViewList& views() const { return views_; }
    /// Returns the picture with this index, with the scene posed at its time. Throws like
    /// ViewList::view().
    PictureRequest picture(std::size_t index) const;
    /// Whether to meter the exposure: for display pictures of scenes with lights, unless --exposure
    /// is given.
    bool metersExposure() const { return meters_exposure_; }
    /// Returns the light and the samples of display pictures as text. If `with_options` and the
    /// light or samples are the defaults of display formats, adds the options for the defaults of
    /// an EXR.
    std::string lightText(const PosedScene& posed, bool with_options) const;
    /// Returns the options for a picture's writer, including the provenance. A metered exposure is
    /// not set yet.
    OutputOptions writerOptions(const PictureRequest& picture) const;
    /// Whether the picture's file exists, is complete, and was made by the same request. Under
    /// --strict, always false if layers are limited, because only counting shows whether fragments
    /// are left out.
    bool isUpToDate(const PictureRequest& picture) const;

    /// Returns the known differences between an outdated file and the picture, as clauses joined by
    /// semicolons. The clauses name command-line options.
    std::string differenceOf(const PictureRequest& picture) const;

    /// Returns the plan for --dry-run (cmd/README.md, "JSON").
    nlohmann::ordered_json plan() const;
    /// Returns the index of the first picture with the action "render" in a plan, if any.
    static std::optional<std::size_t> firstOf(const nlohmann::ordered_json& plan);

  private:
    void choosePictures();
    void chooseForScene();
    void checkFiles() const;
    std::vector<std::filesystem::path> outputs() const;
    bool exists(const PictureRequest& picture) const;
    OutputRequest outputOf(std::size_t index) const;
    std::filesystem::path fileOf(const PictureNumber& number) const;
    const Moment& moment(std::size_t index) const;
    std::size_t view(std::size_t index) const;  ///< returns an index into views_
    Provenance provenanceOf(std::size_t index, const PictureRequest& picture) const;

    const RenderOptions& options_;
    std::vector<Moment> moments_;
    ViewList views_;
    std::size_t first_ = 0, end_ = 0;  ///< range of the pictures that this run makes
    CaptureSettings capture_;
    CaptureJob& job_;
    const OpenedScene* scene_ = nullptr;  ///< owned by job_
    bool meters_exposure_ = false;
    bool shows_splats_ = false;  ///< whether this is a display picture of splats alone
};

}  // namespace peeler::cmd
