// SPDX-License-Identifier: Apache-2.0
#include "core/capture/band_budget.h"

#include <algorithm>

#include "core/base/process_memory.h"
#include "core/image/channels.h"
#include "core/splats/splat_channels.h"

namespace peeler {

MemoryUse sinkUse(const GlPlan& details, const Plan& plan, const Sink& sink) {
    const std::uint64_t fragment =
        sizeof(float) + details.settings.colorBytes() + plan.channel_bytes;
    return sinkUse(sink, plan, fragment, [&](int rows) {
        const auto pixels =
            static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(plan.view.crop.width());
        if (details.settings.composite) return pixels;
        const std::uint64_t most = details.counted->mostFragments(rows);
        return details.limit ? std::min(most, pixels * details.limit) : most;
    });
}

BandBudget::BandBudget(const GlPlan& plan, const PlanMethods& methods, const BandCapture& capture,
                       bool overlaps)
    : plan_(plan), composites_(methods.composite != nullptr) {
    const CaptureSettings& settings = plan.settings;
    const PixelType type = settings.color_type;
    const std::uint64_t color = settings.colorBytes();
    const std::uint64_t tile = capture.tilePixels();
    // Bytes per pixel of a composite's coloured opacity, in addition to RGBA and Z.
    const std::uint64_t opacity = settings.tinted ? 3 * sizeof(float) : 0;
    // The default of band_bytes limits redraws of the geometry, but lets the memory that all bands
    // reuse stay in the caches.
    costs_.band_bytes = settings.band_bytes;
    costs_.use.pixel = kBandPixelBytes + opacity;
    if (!plan.clip_rows.empty()) costs_.use.pixel += 3 * sizeof(std::uint32_t);
    costs_.use.fixed = capture.tileBytes();
    if (plan.view.rays) costs_.use.fixed += TracedLayers::bufferBytes();
    if (capture.showsSplats()) costs_.use.fixed += capture.splatBytes();
    if (plan.opaque_first) {
        // Only counts, list heads and list starts, and the mean of the samples, have the size of a
        // band. The rest is made for some rows at a time.
        const std::uint64_t lists = plan.shades_pixels ? plan.positions.size() : 1;
        costs_.use.pixel = 3 * lists * sizeof(std::uint32_t) + 5 * sizeof(float) + opacity;
        costs_.use.fixed += plan.shades_pixels ? capture.sampleBytes() : capture.opaqueBytes();
    }
    if (methods.composite) {
        // A composite method's costs per pixel go into use.fragment, because rowFragments() counts
        // one fragment per pixel for composite methods.
        costs_.use.fixed += methods.composite->tileBytes(tile, settings);
        costs_.use.fragment = capture.pixelBytes() + 15 * sizeof(float) + 3 * opacity;
        costs_.largest_array_bytes = storedComponents(settings.tinted) * sizeof(float);
    } else {
        costs_.use.fixed += methods.layers->tileBytes(tile, settings);
        const std::uint64_t channels = channelBytes(settings.channels, type);
        costs_.use.fragment = capture.fragmentBytes() + sizeof(float) + color + channels;
        // The layers of surfaces and of splats, until they are merged.
        if (capture.showsSplats())
            costs_.use.fragment += 2 * (sizeof(float) + sizeof(std::uint32_t) + color + channels) +
                                   splatChannelBytes(settings.channels);
        if (overlaps) {
            costs_.use.fragment += capture.copiedFragmentBytes();
            costs_.use.pixel += capture.copiedPixelBytes();
        }
        // A key and an index into the captured lists.
        if (channels > 0 || settings.hit_mode != HitMode::kNone)
            costs_.use.fragment += 2 * sizeof(std::uint32_t);
        costs_.largest_array_bytes = std::max<std::uint64_t>(
            BandBuffers::fragmentWords(settings.storedColorBytes()) * sizeof(std::uint32_t),
            shadedComponents(settings.channels) * sizeof(float));
        // Until the samples are merged, all of them stay in memory, with Z, keys, and the sorted
        // order of one sample. Merged rows have colour, Z, and the image and index of a fragment,
        // and may take twice the memory while they grow.
        if (plan.mergesLayers()) {
            costs_.use.fragment += color + channels + 3 * sizeof(float);
            costs_.use.fragment += 2 * (color + 3 * sizeof(float));
            costs_.use.pixel += (plan.positions.size() + 1) * sizeof(std::uint32_t);
        }
        // The composite of one sample, and the composite for the sink.
        if (settings.composite && !plan.opaque_first)
            costs_.use.pixel += 2 * (sizeof(std::uint32_t) + 5 * sizeof(float) + opacity);
    }
    costs_.storage_block_bytes = capture.mostBufferBytes();
}

/// Returns the number of fragments, rounded up, that need as much memory and buffer space as the
/// clip-mesh surfaces of a row.
std::uint64_t BandBudget::clipFragments(int y) const {
    if (plan_.clip_rows.empty()) return 0;
    const auto row = static_cast<std::size_t>(y - plan_.view.crop.y0);
    const std::uint64_t a_fragment = costs_.largest_array_bytes / sizeof(float);
    return (plan_.clip_rows[row] + a_fragment - 1) / a_fragment;
}

std::uint64_t BandBudget::rowFragments(int y) const {
    return clipFragments(y) + (composites_ ? static_cast<std::uint64_t>(plan_.view.crop.width())
                                           : plan_.counted->rowFragments(y));
}

BandLimits BandBudget::limits() const {
    const MemoryBudget& memory = plan_.settings.memory;
    return bandLimits(memory, usedBytes(memory), costs_);
}

std::vector<Window> BandBudget::cut(const BandLimits& limits) const {
    return cutBands(plan_.view.crop, limits, [&](int y) { return rowFragments(y); });
}

std::vector<Window> BandBudget::cutForCounting(const BandLimits& limits) const {
    return cutBands(plan_.view.crop, limits, [&](int y) { return clipFragments(y); });
}

std::uint64_t BandBudget::largest(const std::vector<Window>& bands) const {
    return largestBandBytes(bands, costs_, [&](int y) { return rowFragments(y); });
}

}  // namespace peeler
