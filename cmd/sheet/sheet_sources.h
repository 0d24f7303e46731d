// SPDX-License-Identifier: Apache-2.0
// Sources of the cells of a contact sheet: scenes and layered files.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cmd/cli/report.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/capture_options.h"
#include "cmd/options/clip_options.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/sequence_options.h"
#include "cmd/options/view_options.h"
#include "cmd/session/reporter.h"
#include "cmd/sheet/sheet_cells.h"
#include "core/capture/method.h"

namespace peeler::cmd {

/// The methods whose composites the sheet of a scene shows.
enum class SheetMethods {
    kUnsorted,  ///< blending in draw order, if the composite of all layers is shown
    kAll,       ///< every method, but no layers
    kNone
};

/// The request for a sheet. A layered file uses only `scene.file`, `file`, `capture.max_layers`,
/// `cells` and `against`; a scene uses everything except `file` and `against`. The clip volume is
/// in `clip`, not in `capture`.
struct SheetRequest : CaptureJobOptions {
    LayeredReadOptions file;
    CameraOptions camera;
    ViewListOptions views;
    SequenceOptions sequence;
    ClipOptions clip;
    SheetSettings cells;
    SheetMethods methods = SheetMethods::kUnsorted;
    std::optional<std::filesystem::path> against;  ///< original of a thinned file
};

struct SheetContent {
    std::vector<SheetCell> cells;
    std::size_t omitted = 0;        ///< number of cells over the limit
    std::optional<float> exposure;  ///< exposure in stops; none = not metered
    PictureResult result;           ///< the source and the settings of the cells
};

/// A maker of the sheets for a scene, one per view.
class SceneSheet {
  public:
    /// place() must have been called for `views`. All arguments must outlive this object.
    SceneSheet(const SheetRequest& request, CaptureJob& job, const OpenedScene& scene,
               const ViewList& views, Reporter& reporter);

    /// Return a view and the hash of its settings. The view need not be captured yet. Throw like
    /// ViewList::view() and clipVolume().
    View view(std::size_t index) const;
    std::string settingsHash(std::size_t view) const;
    /// Captures a view and returns its sheet. Throws like view(), CaptureJob::openRenderer() and
    /// GlRenderer::capture().
    SheetContent make(std::size_t view);

  private:
    PosedScene poseOf(std::size_t view) const;
    CaptureSettings settingsOf(const PosedScene& posed) const;
    void openRenderer();
    void compareMethods();
    void showLayers();
    bool showsUnsorted() const;
    std::vector<MethodInfo> shownMethods() const;
    void describePlan(const Plan& plan, int passes);
    SheetCell capture(const MethodInfo& method, bool exact);

    const SheetRequest& request_;
    CaptureJob& job_;
    const ViewList& views_;
    Reporter& reporter_;
    CaptureSettings capture_;
    const OpenedScene& scene_;
    PosedScene posed_;
    View view_;                       ///< the view being captured
    GlRenderer* renderer_ = nullptr;  ///< owned by the job
    std::optional<float> exposure_;   ///< metered once, for all views
    CompositeImage exact_;
    SheetContent content_;
};

/// Makes the sheet of a layered file. Adds the times to those of `job`. Throws Error (kInput) like
/// openLayered().
SheetContent sheetOfFile(const SheetRequest& request, CaptureJob& job, Reporter& reporter);

}  // namespace peeler::cmd
