// SPDX-License-Identifier: Apache-2.0
#include "cmd/sheet/sheet_sources.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cmd/options/clip_options.h"
#include "cmd/options/layered_bands.h"
#include "cmd/session/progress_report.h"
#include "cmd/sheet/deep_cells.h"
#include "core/base/stage_times.h"
#include "core/capture/method.h"
#include "core/splats/projected_splats.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

namespace {

/// A sink that forwards bands and keeps their composite at full size (20 bytes per pixel, or 32
/// with coloured opacity).
class CompositeKeeper : public Sink {
  public:
    /// The composite and the sink must outlive this object.
    CompositeKeeper(CompositeImage& composite, Sink& next) : composite_(composite), next_(next) {}

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override { next_.finish(); }
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return next_.times(); }

  private:
    CompositeImage& composite_;
    Sink& next_;
    bool tinted_ = false;  ///< whether opacity is coloured
    CompositeImage band_;
};

/// A sink that makes a cell from composited bands. Measures the cell's error relative to the exact
/// composite.
class CompositeCell : public Sink {
  public:
    /// `exact` must outlive the cell. The error is not measured while `exact` is empty.
    CompositeCell(int cell_width, const CompositeImage& exact)
        : cell_width_(cell_width), exact_(exact) {}

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    StageTimes times() const override { return times_; }

    /// Returns the cell, without labels. Valid after finish().
    SheetCell& cell() { return cell_; }

  private:
    int cell_width_;
    const CompositeImage& exact_;
    std::optional<BoxFilter> filter_;  ///< set from begin() to finish()
    CompositeImage band_, exact_band_;
    SheetCell cell_;
    StageTimes times_;
};

void CompositeKeeper::begin(const Plan& plan) {
    tinted_ = plan.tinted;
    composite_.window = plan.view.crop;
    composite_.clear();
    composite_.rgba.reserve(plan.view.crop.pixels());
    composite_.opacity.reserve(tinted_ ? plan.view.crop.pixels() : 0);
    next_.begin(plan);
}

void CompositeKeeper::write(LayeredImage&& band) {
    compositeOver(band, {}, band_);
    composite_.appendRows(band_, band.window.y0, band.window.y1);
    next_.write(std::move(band));
}

SinkMemory CompositeKeeper::memory(const Plan& plan) const {
    SinkMemory memory = next_.memory(plan);
    memory.bytes += plan.view.crop.pixels() * CompositeImage::pixelBytes(plan.tinted);
    return memory;
}

void CompositeCell::begin(const Plan& plan) {
    const Window& crop = plan.view.crop;
    const auto [width, height] = cellSize(crop, cell_width_);
    filter_.emplace(crop.width(), crop.height(), width, height);
    cell_.picture.window = {0, 0, width, height};
}

void CompositeCell::write(LayeredImage&& band) {
    const StageTimer timer(times_, "composite");
    compositeOver(band, {}, band_);
    addRows(band_, *filter_);
    if (exact_.rgba.empty()) return;
    exact_band_.setRows(exact_, band.window.y0, band.window.y1);
    addDifference(band_, exact_band_, cell_.error);
    cell_.has_error = true;
}

void CompositeCell::finish() {
    setColors(filter_->pixels(), cell_.picture);
    cell_.picture.z.assign(cell_.picture.rgba.size(), std::numeric_limits<float>::infinity());
    filter_.reset();
}

/// Captures the composite of a method into `sink`, which is `cell` or forwards to `cell`. Labels
/// the cell with the method's name, its geometry passes and its error.
SheetCell captureMethod(GlRenderer& renderer, const View& view, CaptureSettings settings,
                        const MethodInfo& method, CompositeCell& cell, Sink& sink,
                        const Progress& progress) {
    settings.method = method.name;
    settings.composite = true;
    const CapturePlan plan = renderer.plan(view, settings);
    sink.begin(plan);
    const int passes = renderer.capture(plan, sink, progress).passes;
    sink.finish();
    SheetCell result = std::move(cell.cell());
    result.passes = passes;
    result.label = std::string(method.name) + ", " + std::to_string(passes) +
                   (passes == 1 ? " pass" : " passes");
    result.detail = result.has_error ? errorText(result.error) : "the reference";
    return result;
}

}  // namespace

SceneSheet::SceneSheet(const SheetRequest& request, CaptureJob& job, const OpenedScene& scene,
                       const ViewList& views, Reporter& reporter)
    : request_(request),
      job_(job),
      views_(views),
      reporter_(reporter),
      scene_(scene),
      posed_(poseOf(0)) {}

PosedScene SceneSheet::poseOf(std::size_t view) const {
    return views_.pose(scene_, request_.animation.time.value_or(0), view);
}

CaptureSettings SceneSheet::settingsOf(const PosedScene& posed) const {
    CaptureSettings settings = request_.capture;
    settings.clip = clipVolume(request_.clip, posed);
    settings.tinted = job_.wantsTint(posed);
    return settings;
}

View SceneSheet::view(std::size_t index) const {
    return views_.view(scene_, poseOf(index), index);
}

std::string SceneSheet::settingsHash(std::size_t view) const {
    nlohmann::json more = nlohmann::json::object();
    views_.addSettings(view, more);
    return job_.settingsHash(settingsOf(poseOf(view)), std::move(more), this->view(view).crop);
}

SheetContent SceneSheet::make(std::size_t view) {
    content_ = {};
    exact_ = {};
    posed_ = poseOf(view);
    capture_ = settingsOf(posed_);
    view_ = this->view(view);
    content_.result.settings_hash = settingsHash(view);
    openRenderer();
    content_.exposure = exposure_;
    if (request_.methods == SheetMethods::kAll) {
        compareMethods();
    } else {
        showLayers();
    }
    return std::move(content_);
}

/// Opens the renderer. The first time, also meters the exposure for all views.
void SceneSheet::openRenderer() {
    const bool was_open = job_.renderer() != nullptr;
    renderer_ = &job_.openRenderer(posed_);
    if (was_open || !request_.cells.meters || posed_.lights().empty() ||
        capture_.shading == Shading::kUnlit)
        return;
    if (!exposure_) exposure_ = job_.meterExposure(capture_, views_.cameras());
    renderer_->setPose(posed_);
}

/// Whether to show a cell of unsorted blending. Unsorted blending blends the colours of all
/// fragments, so it can only be compared with the colour composite of all layers.
bool SceneSheet::showsUnsorted() const {
    return request_.methods == SheetMethods::kUnsorted && !hasSplats(posed_) &&
           capture_.max_layers == 0 && !(capture_.occlusion_ratio > 0) &&
           request_.cells.show == SheetShow::kColor && !request_.cells.progression &&
           request_.cells.most_cells > 1;
}

void SceneSheet::describePlan(const Plan& plan, int passes) {
    PictureResult& result = content_.result;
    result.layers = plan.layers.size();
    result.fragments_counted = plan.fragments_counted;
    result.fragments_stored = plan.fragments_stored;
    result.method = capture_.method;
    result.passes = passes;
}

void SceneSheet::showLayers() {
    SheetSettings settings = request_.cells;
    settings.meters = false;  // the exposure is already metered
    const bool unsorted = showsUnsorted();
    if (unsorted) --settings.most_cells;
    SheetCells cells(settings);
    const CapturePlan plan = renderer_->plan(view_, capture_);
    CompositeKeeper keeper(exact_, cells);
    Sink& sink = unsorted ? static_cast<Sink&>(keeper) : cells;
    sink.begin(plan);
    {
        ProgressReport progress(reporter_, {"render", unsorted ? 0.6 : 1});
        describePlan(
            plan,
            renderer_->capture(plan, sink, [&](double share) { progress.update(share); }).passes);
    }
    sink.finish();
    content_.cells = std::move(cells.cells());
    content_.omitted = cells.omitted();
    if (unsorted) {
        SheetCell cell = capture(*findPeelMethod("unsorted"), false);
        cell.label = "plain blending";
        cell.detail = "wrong on purpose";
        content_.cells.insert(content_.cells.begin() + 1, std::move(cell));
    }
    add(job_.times(), cells.times());
}

/// Returns the methods that can show the scene.
std::vector<MethodInfo> SceneSheet::shownMethods() const {
    std::vector<MethodInfo> methods(peelMethods().begin(), peelMethods().end());
    if (hasSplats(posed_))
        std::erase_if(methods, [](const MethodInfo& method) { return !method.exact(); });
    return methods;
}

void SceneSheet::compareMethods() {
    const std::vector<MethodInfo> methods = shownMethods();
    const auto most = static_cast<std::size_t>(request_.cells.most_cells);
    content_.omitted = methods.size() - std::min(methods.size(), most);
    if (methods.size() < peelMethods().size())
        reporter_.note("methods that only composite do not show Gaussian splats; left out");
    for (const MethodInfo& method : std::span(methods).first(methods.size() - content_.omitted)) {
        const bool first = &method == methods.data();
        content_.cells.push_back(capture(method, first));
        if (!first) continue;
        CaptureSettings settings = capture_;
        settings.method = method.name;
        describePlan(renderer_->plan(view_, settings), content_.cells.back().passes);
        content_.result.method = method.name;
    }
}

/// Captures the cell of a method. If `exact`, keeps the method's composite as the reference.
/// Otherwise measures the error relative to the reference.
SheetCell SceneSheet::capture(const MethodInfo& method, bool exact) {
    const CompositeImage nothing;
    CompositeCell cell(request_.cells.cell_width, exact ? nothing : exact_);
    CompositeKeeper keeper(exact_, cell);
    Sink& sink = exact ? static_cast<Sink&>(keeper) : cell;
    CaptureSettings settings = capture_;
    // Uses 32-bit colours, so that differences come from the methods, not from rounding.
    if (request_.methods == SheetMethods::kAll) settings.color_type = PixelType::kFloat;
    // `cells` counts the finished cells and this one; `all` is the total.
    const auto cells = static_cast<double>(content_.cells.size() + 1);
    const bool last = request_.methods != SheetMethods::kAll;
    const auto all = static_cast<double>(shownMethods().size() - content_.omitted);
    ProgressReport progress(reporter_, {std::string(method.name), last ? 1 : cells / all});
    SheetCell result = captureMethod(*renderer_, view_, settings, method, cell, sink,
                                     [&](double share) { progress.update(share); });
    add(job_.times(), cell.times());
    return result;
}

SheetContent sheetOfFile(const SheetRequest& request, CaptureJob& job, Reporter& reporter) {
    SheetContent content;
    PictureResult& result = content.result;
    const std::uint32_t limit = request.capture.max_layers;
    const std::unique_ptr<LayeredInput> reader =
        openInput(request.scene.file.string(), request.file, reporter);
    Plan plan = reader->info().plan;
    if (limit != 0 && limit < plan.layers.size()) plan.layers.resize(limit);
    SheetSettings settings = request.cells;
    settings.meters = settings.meters && !isPart(plan.view);
    if (request.against) settings.most_cells = 1;
    SheetCells cells(settings);
    cells.begin(plan);
    ProgressReport progress(reporter, "sheet");
    forEachBand(*reader, limit, job.times(), progress, [&](LayeredImage& band) {
        result.fragments_stored += band.fragments();
        cells.write(std::move(band));
    });
    cells.finish();
    content.cells = std::move(cells.cells());
    content.omitted = request.against ? 0 : cells.omitted();
    if (request.against)
        content.cells = deepCells(request, std::move(content.cells.front()),
                                  request.against->string(), reporter);
    if (settings.meters) content.exposure = cells.meter().stopsIfNeeded();
    result.layers = plan.layers.size();
    result.fragments_counted = plan.fragments_counted;
    result.method = reader->info().provenance.method;
    result.settings_hash = reader->info().provenance.settings_hash;
    result.renderer = reader->info().provenance.renderer;
    add(job.times(), cells.times());
    return content;
}

}  // namespace peeler::cmd
