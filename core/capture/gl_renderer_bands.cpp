// SPDX-License-Identifier: Apache-2.0
// What a band costs, and so how large bands may be.
#include <algorithm>

#include "core/capture/gl_renderer_state.h"
#include "core/image/channels.h"

namespace peeler {
namespace {

// A pixel of a band costs a slot, an offset here and in the hand-over, and what a sink composites
// into.
constexpr std::uint64_t kPixelBytes = 3 * sizeof(std::uint32_t) + 5 * sizeof(float);

// What costs() do not count, and forecasts have to. With llvmpipe (Mesa 22.3, LLVM 15, on one and
// two threads) the captures of tests/memory_test.py take up to 35 MB more: LLVM compiles their
// passes when they are first drawn (6 MB for plain materials, 27 for those of a car's engine, more
// for peels, which have two passes), and the rasteriser's threads keep triangles in bins. Of bands
// that have been kept nothing is left to compile: up to 20 MB.
constexpr std::uint64_t kCaptureBytes = std::uint64_t{40} << 20;
constexpr std::uint64_t kHandOverBytes = std::uint64_t{24} << 20;

}  // namespace

/// What earlier bands have left, of this plan or another, is not to be counted twice under a
/// budget: as resident memory and as what the next bands take. Where there is room for both, the
/// buffers serve again.
void GlRenderer::State::freeBands() {
    if (isRoomy(pass_context.settings.memory, usedBytes(pass_context.settings.memory), costs()))
        return;
    band_capture.free();
    lists = {};
    image = {};
    composite = {};
    if (layer_method) layer_method = method->layers();
    if (composite_method) composite_method = method->composite();
    returnFreeMemory();
}

BandCosts GlRenderer::State::costs() const {
    const PixelType type = pass_context.settings.color_type;
    const std::uint64_t color = pass_context.settings.colorBytes();
    const std::uint64_t tile = band_capture.tilePixels();
    // Of a pixel's composite, besides RGBA and Z.
    const std::uint64_t opacity = pass_context.settings.tinted ? 3 * sizeof(float) : 0;
    BandCosts costs;
    // The default is large enough that geometry is not drawn many times, and small enough that the
    // memory which bands share stays warm.
    costs.band_bytes = pass_context.settings.band_bytes;
    costs.pixel_bytes = kPixelBytes + opacity;
    if (!clip_rows.empty()) costs.pixel_bytes += 3 * sizeof(std::uint32_t);
    costs.fixed_bytes = band_capture.tileBytes();
    if (opaque_first) costs.fixed_bytes += band_capture.opaqueBytes();
    if (composite_method) {
        // Every pixel counts as a fragment, as in rowFragments().
        costs.fixed_bytes += composite_method->tileBytes(tile, pass_context.settings);
        costs.fragment_bytes = band_capture.pixelBytes() + 15 * sizeof(float) + 3 * opacity;
        costs.largest_array_bytes = storedComponents(pass_context.settings.tinted) * sizeof(float);
    } else {
        costs.fixed_bytes += layer_method->tileBytes(tile, pass_context.settings);
        const std::uint64_t channels = channelBytes(pass_context.settings.channels, type);
        costs.fragment_bytes = band_capture.fragmentBytes() + sizeof(float) + color + channels;
        if (overlapsBands()) {
            costs.fragment_bytes += band_capture.copiedFragmentBytes();
            costs.pixel_bytes += band_capture.copiedPixelBytes();
        }
        // The key of a fragment, and where it was captured.
        if (channels > 0 || pass_context.settings.hit_mode != HitMode::kNone)
            costs.fragment_bytes += 2 * sizeof(std::uint32_t);
        costs.largest_array_bytes = std::max<std::uint64_t>(
            BandBuffers::fragmentWords(pass_context.settings.storedColorBytes()) *
                sizeof(std::uint32_t),
            shadedComponents(pass_context.settings.channels) * sizeof(float));
        // All samples are held until they are merged, with their primitives and while sorting.
        if (mergesLayers()) {
            costs.fragment_bytes += color + channels + 22 * sizeof(float);
            costs.pixel_bytes += (positions.size() + 1) * sizeof(std::uint32_t);
        }
        // The composite of a sample, and the one that is handed over.
        if (pass_context.settings.composite)
            costs.pixel_bytes += 2 * (sizeof(std::uint32_t) + 5 * sizeof(float) + opacity);
    }
    costs.storage_block_bytes =
        static_cast<std::uint64_t>(context.device().limits.shader_storage_block_size);
    return costs;
}

/// As many fragments as take no less room, in memory and in a buffer, than what a row's pixels have
/// of the clip meshes.
std::uint64_t GlRenderer::State::clipFragments(const BandCosts& costs, int y) const {
    if (clip_rows.empty()) return 0;
    const auto row = static_cast<std::size_t>(y - plan.view.crop.y0);
    const std::uint64_t a_fragment = costs.largest_array_bytes / sizeof(float);
    return (clip_rows[row] + a_fragment - 1) / a_fragment;
}

std::uint64_t GlRenderer::State::rowFragments(int y) const {
    return composite_method ? static_cast<std::uint64_t>(plan.view.crop.width())
                            : samples->rowFragments(y);
}

/// Adds what the sink holds besides the band at hand, and for every pixel of it.
void GlRenderer::State::addSink(const Sink& sink, BandCosts& with_sink) const {
    const std::uint64_t fragment =
        sizeof(float) + pass_context.settings.colorBytes() + plan.channel_bytes;
    const SinkMemory memory = sink.memory(plan);
    const std::uint64_t pixels = static_cast<std::uint64_t>(memory.rows) *
                                 static_cast<std::uint64_t>(plan.view.crop.width());
    std::uint64_t fragments = samples->mostFragments(memory.rows);
    if (limit) fragments = std::min(fragments, pixels * limit);
    if (pass_context.settings.composite) fragments = pixels;
    const std::uint64_t rows = fragments * fragment + pixels * (kPixelBytes + memory.pixel_bytes);
    // Counted twice: rows of the last band and of this one.
    with_sink.fixed_bytes += 2 * rows + memory.bytes;
    with_sink.pixel_bytes += memory.pixel_bytes;
    const auto kept = static_cast<std::uint64_t>(memory.bands);
    with_sink.fragment_bytes += kept * fragment;
    with_sink.pixel_bytes += kept * sizeof(std::uint32_t);
}

/// The bands that the picture is cut into; without a sink those that are merged while planning.
std::vector<Window> GlRenderer::State::bands(const Sink* sink) {
    freeBands();
    band_costs = costs();
    if (sink) addSink(*sink, band_costs);
    band_limits = bandLimits(pass_context.settings.memory, usedBytes(pass_context.settings.memory),
                             band_costs);
    return cutBands(plan.view.crop, band_limits,
                    [&](int y) { return rowFragments(y) + clipFragments(band_costs, y); });
}

/// What capture() will have resident at most. Bands that have been kept are resident already.
std::uint64_t GlRenderer::State::forecast(const Sink& sink) {
    if (!kept_bands.empty()) {
        freeBands();
        BandCosts of_sink;
        addSink(sink, of_sink);
        return residentBytes() + of_sink.fixed_bytes + kHandOverBytes;
    }
    const std::vector<Window> cut = bands(&sink);
    const std::uint64_t largest = largestBandBytes(
        cut, band_costs, [&](int y) { return rowFragments(y) + clipFragments(band_costs, y); });
    return residentBytes() + band_costs.fixed_bytes + largest + kCaptureBytes;
}

}  // namespace peeler
