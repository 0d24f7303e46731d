// SPDX-License-Identifier: Apache-2.0
// The pictures that peeler render is asked for, one by one: all that is known of each before there
// is a GL context.
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

/// One picture that is asked for.
struct PictureRequest {
    std::size_t index = 0;  ///< among all that are asked for
    PictureNumber number{};
    double time = 0;  ///< seconds
    OutputRequest output{};
    std::optional<PosedScene> posed{};
    std::optional<NextFrame> next{};  ///< if motion is asked for
    View view{};
    CaptureSettings capture{};
    Provenance provenance{};  ///< without its renderer
};

/// All pictures of a run, one after the other: of each frame every view.
class RenderRequest {
  public:
    /// Checks the options. Nothing that is to be written may replace what must stay. All arguments
    /// must outlive it. Throws Error (kUsage), (kOutput).
    RenderRequest(const RenderOptions& options, CaptureJob& job, Reporter& reporter);

    /// Opens the job's scene, and places the cameras in it. Nothing that is to be written may
    /// replace what is read. Called first. Throws Error (kUsage), (kInput), (kOutput).
    void openScene();

    const Scene& scene() const { return scene_->scene(); }
    bool hasFrames() const { return options_.animation.frames.has_value(); }
    bool hasViews() const { return views_.asked(); }
    bool isSequence() const { return hasFrames() || hasViews(); }
    /// What each of several pictures is called; "" of a lone one.
    const char* pictureKind() const { return hasViews() ? "view" : hasFrames() ? "frame" : ""; }
    std::size_t pictures() const { return end_ - first_; }  ///< may be 0, of a small chunk

    PictureNumber number(std::size_t index) const;
    /// Of a view, whichever of them this run makes, its first picture: what it sees, and its file.
    View firstView(std::size_t view) const;
    std::filesystem::path firstFile(std::size_t view) const;
    /// The file of a picture, or the name of the shards that it goes to.
    std::filesystem::path outputFile(std::size_t index) const {
        return options_.shards ? options_.shards->name() : outputOf(index).path;
    }
    const std::optional<Normalizing>& normalized() const { return scene_->normalized(); }
    /// The cameras of all views, whichever of them this run makes.
    const ViewList& views() const { return views_; }
    /// The picture with this index, the scene posed at its time. Throws Error (kUsage) and (kInput)
    /// like ViewList::view().
    PictureRequest picture(std::size_t index) const;
    /// Whether the exposure is to be metered: of pictures for eyes that the scene's own lights
    /// light, unless it is given.
    bool metersExposure() const { return meters_exposure_; }
    /// The options of the writer of a picture, its provenance included; without the exposure, if
    /// that is to be metered.
    OutputOptions writerOptions(const PictureRequest& picture) const;
    /// Whether the file of a picture is there, whole, and made of the same request. Never under
    /// --strict if it may be incomplete: that is found out by counting.
    bool isUpToDate(const PictureRequest& picture) const;

    /// In what the file that is there, and not up to date, differs from the picture, as far as it
    /// tells: sentences with semicolons between, in the words of the command line.
    std::string differenceOf(const PictureRequest& picture) const;

    /// What would be done, for --dry-run (cmd/README.md, "JSON").
    nlohmann::ordered_json plan() const;
    /// The first picture that would be rendered, of such a plan; none if none would.
    static std::optional<std::size_t> firstOf(const nlohmann::ordered_json& plan);

  private:
    void choosePictures();
    void checkFiles() const;
    std::vector<std::filesystem::path> outputs() const;
    bool exists(const PictureRequest& picture) const;
    OutputRequest outputOf(std::size_t index) const;
    std::filesystem::path fileOf(const PictureNumber& number) const;
    const Moment& moment(std::size_t index) const;
    std::size_t view(std::size_t index) const;  ///< index into views_
    Provenance provenanceOf(std::size_t index, const PictureRequest& picture) const;

    const RenderOptions& options_;
    std::vector<Moment> moments_;
    ViewList views_;
    std::size_t first_ = 0, end_ = 0;  ///< of the pictures, which are this run's
    CaptureSettings capture_;
    CaptureJob& job_;
    const OpenedScene* scene_ = nullptr;  ///< owned by job_
    bool meters_exposure_ = false;
};

}  // namespace peeler::cmd
