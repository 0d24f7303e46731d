// SPDX-License-Identifier: Apache-2.0
// Composites that are captured without what lies behind opaque surfaces: when, and how their parts
// become bands.
#include <algorithm>
#include <numeric>
#include <utility>

#include "core/base/stage_times.h"
#include "core/capture/gl_renderer_state.h"
#include "core/capture/supersampling.h"
#include "core/image/composite.h"

namespace peeler {

/// No fragment behind an opaque one changes an exact composite of all layers: its alpha is 1, so
/// that nothing gets through. Such composites are captured without them. Approximations average
/// all fragments, and limits count them.
void GlRenderer::State::chooseSurfaces() {
    CaptureSettings& settings = pass_context.settings;
    const auto& draws = posed.drawList().draws();
    opaque_first = planning = false;
    if (!settings.composite || !method->exact() || settings.max_layers != 0 ||
        settings.occlusion_ratio > 0 || settings.surfaces == Surfaces::kTransparent ||
        std::ranges::none_of(draws, &Draw::opaque))
        return;
    settings.surfaces = Surfaces::kVisible;
    if (composite_method || !layer_method->takesOpaqueFirst() || !settings.clip.nodes.empty() ||
        settings.depth_clamp)
        return;
    opaque_first = true;
    opaque_first = hasRoom(settings.memory, usedBytes(settings.memory), costs());
    if (opaque_first) drawn = band_capture.drawnWindow();
}

/// To count what is visible is most of the work of compositing it. So where there is room to keep
/// composites they are made at once, and true is returned.
bool GlRenderer::State::compositeViews() {
    const Window& crop = plan.view.crop;
    const std::uint64_t composite_bytes = CompositeImage::pixelBytes(pass_context.settings.tinted);
    if (!opaque_first || !fitsKept(crop.pixels() * (composite_bytes + sizeof(std::uint32_t))))
        return false;
    samples.emplace(crop);
    merged.reset();
    kept_counts = {};
    kept_bands.clear();
    clip_rows.clear();
    kept_passes = report.passes = 0;
    planning = true;
    if (progress) plan_share = kCompositeShare;
    for (const Window& band : bands(nullptr)) {
        composeVisible(band, [&](LayeredImage& rows) { kept_bands.push_back(std::move(rows)); });
        kept_passes = std::max(kept_passes, report.passes);
        report.passes = 0;
        reportPlanned(0, 1, static_cast<double>(band.y1 - crop.y0) / crop.height());
    }
    planning = false;
    return true;
}

/// Counts what compositeVisible() has found.
void GlRenderer::State::addVisible(const Window& rows,
                                   std::span<const std::uint32_t> visible_counts) {
    const auto width = static_cast<std::size_t>(rows.width());
    for (int y = rows.y0; planning && y < rows.y1; ++y) {
        const auto row = static_cast<std::size_t>(y - rows.y0) * width;
        samples->addRow(rows.x0, y, visible_counts.subspan(row, width));
    }
    if (!planning)
        visible += std::accumulate(visible_counts.begin(), visible_counts.end(), std::uint64_t{0});
}

/// Composites a band without what lies behind opaque surfaces. Only where the scene is: many a
/// picture is empty around it.
void GlRenderer::State::composeVisible(const Window& band, const TakeBand& take) {
    const auto handOver = [&](const CompositeImage& rows) {
        {
            const StageTimer timer(times, "composite");
            toSingleLayer(rows, {band.x0, rows.window.y0, band.x1, rows.window.y1}, image);
        }
        take(image);
    };
    const auto handOverEmpty = [&](int y0, int y1) {
        for (int y = y0; y < y1; y += kRowsHandedOver) {
            image = {};
            image.window = {band.x0, y, band.x1, std::min(y + kRowsHandedOver, y1)};
            image.offsets.resize(image.window.pixels() + 1);
            image.color = {colorNames(pass_context.settings.tinted), PixelType::kFloat, {}};
            take(image);
        }
    };
    const Window seen = intersect(band, drawn);
    if (seen.empty()) return handOverEmpty(band.y0, band.y1);
    handOverEmpty(band.y0, seen.y0);
    // Several samples are to be averaged, and the parts of several raster tiles put side by side.
    const bool whole = positions.size() > 1 || band_capture.tilesAcross(seen) > 1;
    if (whole) beginMean(seen, composite, pass_context.settings.tinted);
    for (std::size_t i = 0; i < positions.size(); ++i) {
        if (positions.size() > 1) showSample(i);
        report.passes += band_capture.compositeVisible(
            *layer_method, seen, band_limits,
            [&](const CompositeImage& rows, std::span<const std::uint32_t> counts_seen) {
                addVisible(rows.window, counts_seen);
                if (!whole) return handOver(rows);
                const StageTimer timer(times, "composite");
                addToMean(rows, static_cast<int>(positions.size()), composite);
            });
    }
    CompositeImage part;
    for (int y = seen.y0; whole && y < seen.y1; y += kRowsHandedOver) {
        part.setRows(composite, y, std::min(y + kRowsHandedOver, seen.y1));
        handOver(part);
    }
    handOverEmpty(seen.y1, band.y1);
}

}  // namespace peeler
