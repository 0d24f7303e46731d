// SPDX-License-Identifier: Apache-2.0
// Layers of Gaussian splats, without GL.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <peeler/capture_settings.h>
#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>
#include "core/scene/posed_scene.h"
#include "core/splats/projected_splats.h"
#include "core/splats/splat_kernels.h"

namespace peeler {

/// The layers of the splats of a posed scene. A fragment is a splat at a pixel's sample position:
/// opacity min(0.99, opacity · G) of at least 1/255, within 3 standard deviations.
///
/// The picture is divided into tiles. A task takes a row of them, or a part of a row, and finds
/// their splats batch by batch, nearest first.
class SplatLayers {
  public:
    /// The Z of what hides splats in each pixel of a band, such as opaque surfaces. Fragments that
    /// do not lie in front of it are left out. Empty if nothing hides splats.
    using Hiding = std::span<const float>;

    /// `every_processor`: whether to use code for every processor, with the same results.
    explicit SplatLayers(PosedScene posed, bool every_processor = false)
        : posed_(std::move(posed)), kernels_(&splatKernelsFor(every_processor)) {}

    /// Sets the view and the settings of later calls.
    void begin(const View& view, const CaptureSettings& settings);

    /// Returns an upper bound of the bytes that do not depend on a band.
    std::uint64_t bytes() const;

    /// Adds the number of fragments of every pixel of a band to `counts`.
    void addCounts(const Window& band, std::span<std::uint32_t> counts, Hiding hiding = {});

    /// Captures the fragments of a band, in order, with colours of the settings' type and the keys
    /// as the only extra array. `counts`: the number of fragments of every pixel, from addCounts().
    /// Overwrites `out`.
    void capture(const Window& band, std::span<const std::uint32_t> counts, LayeredImage& out,
                 Hiding hiding = {});
    /// Counts and captures.
    void capture(const Window& band, LayeredImage& out);

    /// Whether all pixels have splats in the same order, so that composite() may be called.
    bool sameOrderEverywhere();
    /// Composites the nearest `layers` fragments (0 = all) of every pixel of a band, bit for bit
    /// like compositeNearest() of the captured layers, without storing them. Overwrites `out`.
    void composite(const Window& band, std::uint32_t layers, CompositeImage& out);

  private:
    struct Batch;

    void project();
    template <class Visit, class Finish>
    void forTiles(const Window& band, Hiding hiding, const Visit& visit, const Finish& finish);
    SplatTile tileAt(int x0, int y0, const Window& window) const;
    void listTiles(const Window& block, std::size_t& from, Batch& batch) const;

    PosedScene posed_;
    const SplatKernels* kernels_;
    View view_;
    CaptureSettings settings_;
    bool projected_ = false;
    SplatPicture picture_;
};

}  // namespace peeler
