// SPDX-License-Identifier: Apache-2.0
// Plans and bands of ray hits, for the sources on the CPU.
#pragma once

#include <cstddef>
#include <cstdint>

#include <peeler/capture_settings.h>
#include <peeler/layered_image.h>
#include <peeler/sink.h>
#include <peeler/view.h>
#include "core/fragments/bands.h"
#include "core/image/layers.h"

namespace peeler {

/// The maximum bytes of a band. With small bands, the memory that the bands reuse stays in the
/// cache. Small bands cost no more than large ones, since their hits come from stored results.
inline constexpr std::uint64_t kHitBandBytes = std::uint64_t{4} << 20;

/// Returns the plan of a view whose hits have been counted.
Plan hitPlan(const View& view, const CaptureSettings& settings, const DepthComplexity& complexity);

/// Returns the memory that a band of hits and the sink take, and the limits of a band. A source
/// adds the memory of its own buffers.
BandCosts hitBandCosts(const Plan& plan, const CaptureSettings& settings,
                       const DepthComplexity& complexity, const Sink& sink);

struct HitBandSize {
    std::size_t pixels = 0, hits = 0;
};

/// Sets the window and the types of a band, and the sizes of its offsets, Z, colours and keys,
/// whose contents are then to be written. The arrays of channels are left as they are. `most`: the
/// largest sizes of all bands, to reserve memory once.
void beginHitBand(const Window& window, std::size_t hits, const HitBandSize& most,
                  const CaptureSettings& settings, LayeredImage& band);

}  // namespace peeler
