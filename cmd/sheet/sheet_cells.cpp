// SPDX-License-Identifier: Apache-2.0
#include "cmd/sheet/sheet_cells.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "cmd/cli/report.h"
#include "core/base/color.h"
#include "core/base/parallel.h"
#include "core/base/stage_times.h"
#include "core/image/composite.h"

namespace peeler::cmd {

namespace {

std::string text(const char* format, double a, double b) {
    char line[96];
    std::snprintf(line, sizeof line, format, a, b);
    return line;
}

}  // namespace

std::pair<int, int> cellSize(const Window& crop, int cell_width) {
    const int width = std::clamp(cell_width, 1, crop.width());
    const double height = static_cast<double>(crop.height()) * width / crop.width();
    return {width, std::max(1, static_cast<int>(std::lround(height)))};
}

std::string errorText(const DifferenceStatistics& error) {
    if (error.largest == 0) return "exact";
    return text("RMSE %.2g, %.1f dB", error.rmse(), error.psnr());
}

void addRows(const CompositeImage& band, BoxFilter& filter) {
    std::vector<TintedColor> row(static_cast<std::size_t>(band.window.width()));
    for (std::size_t first = 0; first < band.rgba.size(); first += row.size()) {
        for (std::size_t x = 0; x < row.size(); ++x)
            row[x] = band.colorAt(first + x);
        filter.addRow(row);
    }
}

void setColors(const std::vector<TintedColor>& pixels, CompositeImage& picture) {
    picture.resizeColors(true);
    for (std::size_t p = 0; p < pixels.size(); ++p)
        picture.setColor(p, pixels[p]);
}

void SheetCells::addCell(std::uint32_t layer, bool composites) {
    pending_.push_back({.layer = layer,
                        .composites = composites,
                        .fragments = 0,
                        .filter = BoxFilter(crop_.width(), crop_.height(), width_, height_),
                        .error = {}});
}

bool SheetCells::hasComposite(const Plan& plan) const {
    return settings_.show == SheetShow::kColor || plan.layers.empty();
}

std::uint32_t SheetCells::cellsOf(const Plan& plan) const {
    const auto layers = static_cast<std::uint32_t>(plan.layers.size());
    return settings_.progression ? std::max(1U, layers) : layers + (hasComposite(plan) ? 1 : 0);
}

void SheetCells::begin(const Plan& plan) {
    crop_ = plan.view.crop;
    std::tie(width_, height_) = cellSize(crop_, settings_.cell_width);
    layers_ = static_cast<std::uint32_t>(plan.layers.size());
    const std::uint32_t wanted = cellsOf(plan);
    const std::uint32_t cells = std::min(wanted, static_cast<std::uint32_t>(settings_.most_cells));
    omitted_ = wanted - cells;
    if (settings_.progression) {
        for (std::uint32_t k = 1; k < cells; ++k)
            addCell(k, true);
        addCell(layers_, true);
        return;
    }
    if (hasComposite(plan)) addCell(layers_, true);
    for (std::uint32_t k = 0; pending_.size() < cells; ++k)
        addCell(k, false);
}

SinkMemory SheetCells::memory(const Plan& plan) const {
    const auto [width, height] = cellSize(plan.view.crop, settings_.cell_width);
    const auto cell = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    const std::uint64_t cells =
        std::min(cellsOf(plan), static_cast<std::uint32_t>(settings_.most_cells));
    return {.rows = 0, .bytes = cells * cell * sizeof(TintedColor)};
}

void SheetCells::write(LayeredImage&& band) {
    const StageTimer timer(times_, "composite");
    findRange(band);
    compositeOver(band, {}, exact_);
    if (settings_.meters) meter_.add(exact_);
    for (Pending& cell : pending_) {
        if (cell.composites) addComposite(band, cell);
    }
    parallelFor(pending_.size(), [&](std::size_t i) {
        if (!pending_[i].composites) addLayer(band, pending_[i]);
    });
}

void SheetCells::addComposite(const LayeredImage& band, Pending& cell) {
    if (cell.layer >= layers_) {
        cell.fragments += band.fragments();
        addRows(exact_, cell.filter);
        return;
    }
    compositeNearest(band, cell.layer, Tail::kDrop, shown_);
    addDifference(shown_, exact_, cell.error);
    addRows(shown_, cell.filter);
}

void SheetCells::addLayer(const LayeredImage& band, Pending& cell) const {
    const auto width = static_cast<std::size_t>(band.window.width());
    std::vector<TintedColor> row(width);
    for (std::size_t first = 0; first < band.window.pixels(); first += width) {
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t pixel = first + x;
            row[x] = {};
            if (band.count(pixel) <= cell.layer) continue;
            ++cell.fragments;
            const std::size_t fragment = band.offsets[pixel] + cell.layer;
            // Averages depths like premultiplied colours, with coverage as alpha.
            const float z = band.z[fragment];
            row[x] = settings_.show == SheetShow::kDepth ? tinted({z, z, z, 1})
                                                         : tintedColorOf(band, fragment);
        }
        cell.filter.addRow(row);
    }
}

void SheetCells::findRange(const LayeredImage& band) {
    for (const float z : band.z) {
        if (!std::isfinite(z)) continue;
        nearest_ = has_range_ ? std::min(nearest_, z) : z;
        farthest_ = has_range_ ? std::max(farthest_, z) : z;
        has_range_ = true;
    }
}

/// Converts depth times coverage to grey times coverage. The nearest depth is white, the farthest
/// nearly black.
void SheetCells::showDepth(CompositeImage& picture) const {
    constexpr float kFarthestGrey = 0.06F;  // sRGB-encoded, for perceptually even steps
    const float range = farthest_ - nearest_;
    for (std::array<float, 4>& pixel : picture.rgba) {
        const float coverage = pixel[3];
        if (coverage <= 0) continue;
        const float depth = pixel[0] / coverage - nearest_;
        const float share = range > 0 ? std::clamp(depth / range, 0.0F, 1.0F) : 0;
        const float grey = coverage * linearFromSrgb(std::lerp(1.0F, kFarthestGrey, share));
        pixel = {grey, grey, grey, coverage};
    }
}

SheetCell SheetCells::finishCell(const Pending& pending) const {
    SheetCell cell;
    cell.picture.window = {0, 0, width_, height_};
    setColors(pending.filter.pixels(), cell.picture);
    cell.picture.z.assign(cell.picture.rgba.size(), std::numeric_limits<float>::infinity());
    const bool everything = pending.composites && pending.layer >= layers_;
    if (settings_.progression) {
        cell.label = (everything ? "all " : "") + countText(pending.layer, "layer");
        cell.error = pending.error;
        cell.has_error = true;
        cell.detail = everything ? countText(pending.fragments, "fragment") : errorText(cell.error);
        return cell;
    }
    cell.label = everything ? "composite" : "layer " + std::to_string(pending.layer);
    cell.detail = countText(pending.fragments, "fragment");
    if (settings_.show == SheetShow::kDepth && !everything) {
        cell.detail = text("Z %.3g-%.3g, near white", nearest_, farthest_);
        showDepth(cell.picture);
    }
    return cell;
}

void SheetCells::finish() {
    for (const Pending& cell : pending_)
        finished_.push_back(finishCell(cell));
    pending_.clear();
}

}  // namespace peeler::cmd
