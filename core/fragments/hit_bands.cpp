// SPDX-License-Identifier: Apache-2.0
#include "core/fragments/hit_bands.h"

#include <algorithm>
#include <limits>

#include "core/base/resize_anew.h"
#include "core/fragments/supersampling.h"
#include "core/image/channels.h"

namespace peeler {
Plan hitPlan(const View& view, const CaptureSettings& settings, const DepthComplexity& complexity) {
    Plan plan;
    plan.view = view;
    plan.color_type = settings.color_type;
    plan.channel_bytes = channelBytes(settings.channels, plan.color_type) + sizeof(std::uint32_t);
    plan.layers = complexity.layers();
    plan.fragments_counted = plan.fragments_stored = complexity.counted();
    return plan;
}

BandCosts hitBandCosts(const Plan& plan, const CaptureSettings& settings,
                       const DepthComplexity& complexity, const Sink& sink) {
    const auto width = static_cast<std::uint64_t>(plan.view.crop.width());
    const std::uint64_t hit = sizeof(float) + settings.colorBytes() + plan.channel_bytes;
    BandCosts costs;
    costs.use = sinkUse(sink, plan, hit, [&](int rows) { return complexity.mostFragments(rows); });
    costs.use.pixel += sizeof(std::uint32_t);
    costs.use.fragment += hit;
    if (const std::size_t floats = shadedComponents(settings.channels); floats > 0)
        costs.use.fragment += floats * sizeof(float) + sizeof(std::uint32_t);
    // A quarter of a band's bytes is for its pixels. Therefore the limit is at least four times the
    // bytes of a row's pixels, so that even a wide row fits.
    costs.band_bytes =
        std::max(std::min(settings.band_bytes, kHitBandBytes), 4 * width * costs.use.pixel);
    // With these values, the number of hits in a band fits into an offset of 32 bits.
    costs.largest_array_bytes = 1;
    costs.storage_block_bytes = std::numeric_limits<std::uint32_t>::max();
    return costs;
}

void beginHitBand(const Window& window, std::size_t hits, const HitBandSize& most,
                  const CaptureSettings& settings, LayeredImage& band) {
    const bool sloped = settings.hit_mode == HitMode::kSloped;
    band.window = window;
    resizeAnew(band.offsets, window.pixels() + 1, most.pixels + 1);
    resizeAnew(band.z, hits, most.hits);
    band.color.type = sloped ? PixelType::kFloat : settings.color_type;
    band.color.channels.clear();
    if (sloped) band.color.channels = {"dDepth.X", "dDepth.Y"};
    resizeAnew(band.color.data, hits * band.color.stride(), most.hits * band.color.stride());
    band.extra.resize(1 + settings.channels.size());
    band.extra.front().channels = {kKeyChannel};
    band.extra.front().type = PixelType::kUint;
    resizeAnew(band.extra.front().data, hits * sizeof(std::uint32_t),
               most.hits * sizeof(std::uint32_t));
}

}  // namespace peeler
