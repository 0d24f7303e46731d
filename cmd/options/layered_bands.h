// SPDX-License-Identifier: Apache-2.0
// Going through a layered file band by band.
#pragma once

#include <algorithm>
#include <cstdint>

#include "cmd/session/progress_report.h"
#include "core/base/stage_times.h"
#include "core/image/layers.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

/// Bytes that a band may take: enough for wide chunks of many layers, little beside what a render
/// takes.
inline constexpr std::uint64_t kBandBytes = std::uint64_t{256} << 20;

/// Reads the picture from top to bottom in bands of about `band_bytes`, and hands each to `take`,
/// which may move from it. Throws like LayeredInput::read().
template <class Take>
void forEachBand(LayeredInput& reader, std::uint64_t band_bytes, Take&& take) {
    const Window& crop = reader.info().plan.view.crop;
    const int rows = reader.rowsFor(band_bytes);
    LayeredImage band;
    for (int y = crop.y0; y < crop.y1; y += rows) {
        reader.read({crop.x0, y, crop.x1, std::min(y + rows, crop.y1)}, band);
        take(band);
    }
}

/// The same with progress, of the nearest `max_layers` fragments of every pixel (0 = all). Reading
/// counts as "load" among `times`.
template <class Take>
void forEachBand(LayeredInput& reader, std::uint32_t max_layers, StageTimes& times,
                 ProgressReport& progress, Take&& take, std::uint64_t band_bytes = kBandBytes) {
    const Window& crop = reader.info().plan.view.crop;
    const int rows = reader.rowsFor(band_bytes);
    LayeredImage band;
    for (int y = crop.y0; y < crop.y1; y += rows) {
        {
            const StageTimer timer(times, "load");
            reader.read({crop.x0, y, crop.x1, std::min(y + rows, crop.y1)}, band);
            keepLayers(band, {.nearest = max_layers});
        }
        const double share = static_cast<double>(band.window.y1 - crop.y0) / crop.height();
        take(band);
        progress.update(share);
    }
}

}  // namespace peeler::cmd
