// SPDX-License-Identifier: Apache-2.0
// Band-by-band iteration over a layered file.
#pragma once

#include <algorithm>
#include <cstdint>

#include "cmd/session/progress_report.h"
#include "core/base/stage_times.h"
#include "core/image/layers.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

/// The maximum size of a band, in bytes: room for wide chunks with many layers, but little compared
/// to a render's memory.
inline constexpr std::uint64_t kBandBytes = std::uint64_t{256} << 20;

/// Reads the picture from top to bottom in bands of about `band_bytes`. Passes each band to `take`,
/// which may move from the band. Throws like LayeredInput::read().
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

/// Iterates over the bands of a picture from top to bottom and reports progress. `read(window,
/// band)` fills each band and is timed as "load" in `times`; `take(band)` may move from the band.
template <class Read, class Take>
void forEachBand(const Window& crop, int rows, StageTimes& times, ProgressReport& progress,
                 Read&& read, Take&& take) {
    LayeredImage band;
    for (int y = crop.y0; y < crop.y1; y += rows) {
        const Window window{crop.x0, y, crop.x1, std::min(y + rows, crop.y1)};
        timed(times, "load", [&] { read(window, band); });
        take(band);
        progress.update(static_cast<double>(window.y1 - crop.y0) / crop.height());
    }
}

/// Iterates over the bands of a file. Keeps only the nearest `max_layers` fragments of every pixel;
/// 0 = all.
template <class Take>
void forEachBand(LayeredInput& reader, std::uint32_t max_layers, StageTimes& times,
                 ProgressReport& progress, Take&& take, std::uint64_t band_bytes = kBandBytes) {
    const auto read = [&](const Window& window, LayeredImage& band) {
        reader.read(window, band);
        keepLayers(band, {.nearest = max_layers});
    };
    forEachBand(reader.info().plan.view.crop, reader.rowsFor(band_bytes), times, progress, read,
                take);
}

}  // namespace peeler::cmd
