// SPDX-License-Identifier: Apache-2.0
#include "cmd/sheet/sheet_methods.h"

#include <algorithm>
#include <limits>

#include "cmd/cli/report.h"

namespace peeler::cmd {

namespace {

/// The part of a picture that a band covers.
void cutBand(const CompositeImage& all, const Window& band, CompositeImage& out) {
    const auto width = static_cast<std::size_t>(all.window.width());
    const std::size_t first = static_cast<std::size_t>(band.y0 - all.window.y0) * width;
    out.window = band;
    out.rgba.assign(all.rgba.data() + first, all.rgba.data() + first + band.pixels());
}

}  // namespace

void CompositeKeeper::begin(const Plan& plan) {
    composite_.window = plan.view.crop;
    composite_.rgba.clear();
    composite_.rgba.reserve(plan.view.crop.pixels());
    composite_.z.clear();
    next_.begin(plan);
}

void CompositeKeeper::write(LayeredImage&& band) {
    compositeOver(band, {}, band_);
    composite_.rgba.insert(composite_.rgba.end(), band_.rgba.begin(), band_.rgba.end());
    composite_.z.insert(composite_.z.end(), band_.z.begin(), band_.z.end());
    next_.write(std::move(band));
}

SinkMemory CompositeKeeper::memory() const {
    SinkMemory memory = next_.memory();
    memory.bytes += composite_.window.pixels() * 5 * sizeof(float);
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
    cutBand(exact_, band.window, exact_band_);
    addDifference(band_, exact_band_, cell_.error);
    cell_.has_error = true;
}

void CompositeCell::finish() {
    cell_.picture.rgba = filter_->pixels();
    cell_.picture.z.assign(cell_.picture.rgba.size(), std::numeric_limits<float>::infinity());
    filter_.reset();
}

SheetCell captureMethod(Renderer& renderer, const View& view, CaptureSettings settings,
                        const MethodInfo& method, CompositeCell& cell, Sink& sink,
                        const Progress& progress) {
    settings.method = method.name;
    settings.composite = true;
    sink.begin(renderer.plan(view, settings));
    const int passes = renderer.capture(sink, progress).passes;
    sink.finish();
    SheetCell result = std::move(cell.cell());
    result.passes = passes;
    result.label = std::string(method.name) + ", " + std::to_string(passes) +
                   (passes == 1 ? " pass" : " passes");
    result.detail = result.has_error ? errorText(result.error) : "the reference";
    return result;
}

}  // namespace peeler::cmd
