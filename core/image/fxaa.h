// SPDX-License-Identifier: Apache-2.0
// Fast approximate anti-aliasing (FXAA) of finished pictures, as their bands arrive.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/sink.h>

namespace peeler {

/// How far along an edge its ends are searched for, in pixels. Filtering a row needs this many rows
/// above and below it. (FXAA 3.11 reaches 20.5 with quality preset 12 and 26.5 with 39, in strides;
/// here every pixel is tested.)
inline constexpr int kFxaaReach = 24;

/// Applies fast approximate anti-aliasing (Lottes, "FXAA", NVIDIA white paper 2009, "Algorithm
/// Details": local contrast check, edge detection, end-of-edge search, sub-pixel aliasing; FXAA
/// 3.11, quality version) to the rows [y0, y1) of `picture` and writes them to `out`, whose window
/// becomes these rows. Beyond the picture's borders, its outermost pixels are repeated.
///
/// Contrast is measured on the square root of Rec. 709 luma, which approximates perception. If
/// `background` (premultiplied) is not opaque, contrast is measured with black and with white
/// behind it. All premultiplied components are blended with the same weights, in linear light;
/// `background` itself is not added. Z is kept. An empty pixel that gets colour from a neighbour
/// also gets the neighbour's Z (of two, the nearer), so that it counts as covered.
///
/// This differs from 3.11 in three ways, since light is linear here and speed matters less:
/// straight edges along the pixel grid are unchanged; edge ends are located between two pixels; and
/// if two directions are equal, their mean is used, so that a mirrored or transposed picture gives
/// the mirrored or transposed result, bit for bit.
void applyFxaa(const CompositeImage& picture, const std::array<float, 4>& background, int y0,
               int y1, CompositeImage& out);

/// A sink that composites incoming bands, filters them (applyFxaa) and passes them to another Sink,
/// as bands of one layer. The result does not depend on how the picture is cut into bands. Keeps
/// the rows that later rows need: twice kFxaaReach, plus those being filtered.
class FxaaFilter : public Sink {
  public:
    /// `background`: premultiplied linear RGBA that `next` will put behind the picture. If it is
    /// not opaque, the filter allows for any colour behind it.
    FxaaFilter(std::unique_ptr<Sink> next, const std::array<float, 4>& background);

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    /// Adds its own time to "composite".
    StageTimes times() const override;

  private:
    void keep(int y0, int y1);
    void passOn();

    std::unique_ptr<Sink> next_;
    std::array<float, 4> background_;
    Window crop_;
    bool tinted_ = false;       ///< opacity is coloured
    int slice_rows_ = 0;        ///< maximum rows filtered at once
    int next_row_ = 0;          ///< the first row not yet passed on
    CompositeImage composite_;  ///< of the current band
    CompositeImage kept_;       ///< rows of this band and of earlier ones
    CompositeImage filtered_;
    LayeredImage layer_;
    StageTimes times_;
};

}  // namespace peeler
