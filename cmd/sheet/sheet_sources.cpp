// SPDX-License-Identifier: Apache-2.0
#include "cmd/sheet/sheet_sources.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "cmd/cli/progress.h"
#include "cmd/options/capture_options.h"
#include "cmd/options/layered_bands.h"
#include "cmd/options/opened_scene.h"
#include "cmd/options/output_options.h"
#include "cmd/sheet/sheet_methods.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

namespace {

/// The sheet of a scene in the making. make() lists its stages.
class SceneSheet {
  public:
    SceneSheet(const SheetRequest& request, ProgressStyle progress, Console& console)
        : request_(request), progress_(progress), console_(console), capture_(request.capture) {}

    SheetContent make() {
        readScene();
        makeRenderer();
        if (request_.methods == SheetMethods::kAll) {
            compareMethods();
        } else {
            showLayers();
        }
        add(content_.result.milliseconds, renderer_->takeTimes());
        return std::move(content_);
    }

  private:
    void readScene();
    void makeRenderer();
    void compareMethods();
    void showLayers();
    bool showsUnsorted() const;
    void tellPlan(const Plan& plan, int passes);
    SheetCell capture(const MethodInfo& method, bool exact);

    const SheetRequest& request_;
    ProgressStyle progress_;
    Console& console_;
    CaptureSettings capture_;
    std::optional<OpenedScene> scene_;
    std::optional<PosedScene> posed_;
    View view_;
    std::unique_ptr<gl::Context> context_;  // before what lives in it
    std::unique_ptr<Renderer> renderer_;
    CompositeImage exact_;
    SheetContent content_;
};

void SceneSheet::readScene() {
    const StageTimer timer(content_.result.milliseconds, "load");
    scene_.emplace(request_.input, request_.look, request_.animation, capture_.shadows, console_);
    checkSceneFiles(scene_->scene(), request_.outputs);
    posed_ = scene_->at(request_.animation.time.value_or(0));
    view_ = scene_->view(*posed_, request_.camera);
    capture_.clip = clipVolume(request_.clip, *posed_);
}

void SceneSheet::makeRenderer() {
    {
        const StageTimer timer(content_.result.milliseconds, "context");
        context_ = openContext(request_.device, console_);
    }
    renderer_ = std::make_unique<Renderer>(*context_, *posed_);
    content_.result.renderer = context_->device().renderer;
    content_.result.backend = context_->device().backend;
}

/// Blending without a limit stands beside the composite of everything, and of colours only.
bool SceneSheet::showsUnsorted() const {
    return request_.methods == SheetMethods::kUnsorted && capture_.max_layers == 0 &&
           !(capture_.occlusion_ratio > 0) && request_.cells.show == SheetShow::kColor &&
           !request_.cells.progression && request_.cells.most_cells > 1;
}

void SceneSheet::tellPlan(const Plan& plan, int passes) {
    PictureResult& result = content_.result;
    result.layers = plan.layers.size();
    result.fragments_counted = plan.fragments_counted;
    result.fragments_stored = plan.fragments_stored;
    result.method = capture_.method;
    result.passes = passes;
}

void SceneSheet::showLayers() {
    SheetSettings settings = request_.cells;
    const bool unsorted = showsUnsorted();
    if (unsorted) --settings.most_cells;
    SheetCells cells(settings);
    const Plan plan = renderer_->plan(view_, capture_);
    CompositeKeeper keeper(exact_, cells);
    Sink& sink = unsorted ? static_cast<Sink&>(keeper) : cells;
    sink.begin(plan);
    {
        ProgressReport progress(console_, progress_, {"render", unsorted ? 0.6 : 1});
        tellPlan(plan,
                 renderer_->capture(sink, [&](double share) { progress.update(share); }).passes);
    }
    sink.finish();
    content_.cells = std::move(cells.cells());
    content_.omitted = cells.omitted();
    if (unsorted) {
        SheetCell cell = capture(*findPeelMethod("unsorted"), false);
        cell.label = "unsorted";
        content_.cells.insert(content_.cells.begin() + 1, std::move(cell));
    }
    add(content_.result.milliseconds, cells.times());
}

void SceneSheet::compareMethods() {
    const auto methods = peelMethods();
    const auto most = static_cast<std::size_t>(request_.cells.most_cells);
    content_.omitted = methods.size() - std::min(methods.size(), most);
    for (const MethodInfo& method : methods.first(methods.size() - content_.omitted)) {
        const bool first = &method == &methods.front();
        content_.cells.push_back(capture(method, first));
        if (!first) continue;
        CaptureSettings settings = capture_;
        settings.method = method.name;
        tellPlan(renderer_->plan(view_, settings), content_.cells.back().passes);
        content_.result.method = method.name;
    }
}

/// The cell of a method; of the exact one, whose composite is kept, or with the difference from it.
SheetCell SceneSheet::capture(const MethodInfo& method, bool exact) {
    const CompositeImage nothing;
    CompositeCell cell(request_.cells.cell_width, exact ? nothing : exact_);
    CompositeKeeper keeper(exact_, cell);
    Sink& sink = exact ? static_cast<Sink&>(keeper) : cell;
    CaptureSettings settings = capture_;
    // Differences of methods, not of how colours are rounded.
    if (request_.methods == SheetMethods::kAll) settings.color_type = PixelType::kFloat;
    // Cells that are there and those that are left out are all that will be.
    const auto cells = static_cast<double>(content_.cells.size() + 1);
    const bool last = request_.methods != SheetMethods::kAll;
    const auto all = static_cast<double>(peelMethods().size() - content_.omitted);
    ProgressReport progress(console_, progress_,
                            {std::string(method.name), last ? 1 : cells / all});
    SheetCell result = captureMethod(*renderer_, view_, settings, method, cell, sink,
                                     [&](double share) { progress.update(share); });
    add(content_.result.milliseconds, cell.times());
    return result;
}

}  // namespace

SheetContent sheetOfScene(const SheetRequest& request, ProgressStyle progress, Console& console) {
    return SceneSheet(request, progress, console).make();
}

SheetContent sheetOfFile(const SheetRequest& request, ProgressStyle progress, Console& console) {
    SheetContent content;
    PictureResult& result = content.result;
    const std::uint32_t limit = request.capture.max_layers;
    const std::unique_ptr<LayeredInput> reader = openLayered(request.input.file.string());
    Plan plan = reader->info().plan;
    if (limit != 0 && limit < plan.layers.size()) plan.layers.resize(limit);
    SheetCells cells(request.cells);
    cells.begin(plan);
    ProgressReport report(console, progress, "sheet");
    forEachBand(*reader, limit, result.milliseconds, report, [&](LayeredImage& band) {
        result.fragments_stored += band.fragments();
        cells.write(std::move(band));
    });
    cells.finish();
    content.cells = std::move(cells.cells());
    content.omitted = cells.omitted();
    result.layers = plan.layers.size();
    result.fragments_counted = plan.fragments_counted;
    result.method = reader->info().provenance.method;
    result.settings_hash = reader->info().provenance.settings_hash;
    result.renderer = reader->info().provenance.renderer;
    add(result.milliseconds, cells.times());
    return content;
}

}  // namespace peeler::cmd
