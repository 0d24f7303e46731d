// SPDX-License-Identifier: Apache-2.0
// Layers of Gaussian splats, without GL.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <peeler/capture_settings.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>
#include "core/scene/posed_scene.h"
#include "core/splats/projected_splats.h"

namespace peeler {

/// The layers of the splats of a posed scene. The picture is divided into tiles; each has the list
/// of its splats, nearest first. A fragment is a splat at a pixel's sample position: opacity
/// min(0.99, opacity · G) of at least 1/255, within 3 standard deviations.
class SplatLayers {
  public:
    explicit SplatLayers(PosedScene posed) : posed_(std::move(posed)) {}

    /// Sets the view and the settings of later calls.
    void begin(const View& view, const CaptureSettings& settings);

    /// Returns an upper bound of the bytes that do not depend on a band.
    std::uint64_t bytes() const;

    /// Adds the number of fragments of every pixel of a band to `counts`.
    void addCounts(const Window& band, std::span<std::uint32_t> counts);

    /// Captures the fragments of a band, in order, with colours of the settings' type and the keys
    /// as the only extra array. Overwrites `out`.
    void capture(const Window& band, LayeredImage& out);

  private:
    struct Tiles;

    Tiles tilesOf(const Window& band);
    void addCounts(const Tiles& tiles, std::span<std::uint32_t> counts) const;
    template <class Visit>
    void forEachFragment(const Tiles& tiles, std::size_t tile, Visit&& visit) const;

    PosedScene posed_;
    View view_;
    CaptureSettings settings_;
    bool projected_ = false;
    SplatPicture picture_;
};

}  // namespace peeler
