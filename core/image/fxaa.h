// SPDX-License-Identifier: Apache-2.0
// Fast approximate anti-aliasing of finished pictures, as their bands arrive.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/sink.h>

namespace peeler {

/// How far from a pixel the ends of its edge are looked for, along the edge, in pixels. Filtering a
/// row needs as many rows above and below it. (FXAA 3.11 reaches 20.5 with quality preset 12 and
/// 26.5 with 39, in strides; here it is every pixel.)
inline constexpr int kFxaaReach = 24;

/// Fast approximate anti-aliasing (Lottes, "FXAA", NVIDIA white paper 2009, "Algorithm Details":
/// local contrast check, edge detection, end-of-edge search, sub-pixel aliasing; FXAA 3.11, quality
/// version) of the rows [y0, y1) of `picture`, into `out`, which gets that window. Next to the
/// picture's own borders the outermost pixels are taken to go on.
///
/// Contrast is that of the square root of Rec. 709 luma, as the eye has it. Where `background`
/// (premultiplied) lets through what nobody knows yet, it is looked for over black and over white.
/// All premultiplied components are blended alike, in linear light: `background` itself is not
/// added. Z stays what it is; a pixel without any that gets colour from a neighbour gets the
/// neighbour's Z (of two, the nearer), so that it counts as covered.
///
/// Three things differ from 3.11, since light is linear here and time is plenty: straight edges
/// that run along the pixels stay as they are; ends of edges count from where they are, between two
/// pixels; and where two directions are alike, the mean of both counts, so that a mirrored or
/// transposed picture gives the mirrored or transposed result, bit by bit.
void applyFxaa(const CompositeImage& picture, const std::array<float, 4>& background, int y0,
               int y1, CompositeImage& out);

/// Composites the bands it gets, filters them (applyFxaa) and hands them to another Sink, as bands
/// of one layer. The result does not depend on how the picture is cut into bands. It keeps the rows
/// that others still need: twice kFxaaReach, and those being filtered.
class FxaaFilter : public Sink {
  public:
    /// `background`: premultiplied linear RGBA that `next` will put behind the picture. What is not
    /// opaque is filtered for any.
    FxaaFilter(std::unique_ptr<Sink> next, const std::array<float, 4>& background);

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    /// Its own are part of "composite".
    StageTimes times() const override;

  private:
    void keep(int y0, int y1);
    void passOn();

    std::unique_ptr<Sink> next_;
    std::array<float, 4> background_;
    Window crop_;
    bool tinted_ = false;       ///< opacity is coloured
    int slice_rows_ = 0;        ///< most rows filtered at once
    int next_row_ = 0;          ///< the first that has not been handed on
    CompositeImage composite_;  ///< the band
    CompositeImage kept_;       ///< rows of it and of those before
    CompositeImage filtered_;
    LayeredImage layer_;
    StageTimes times_;
};

}  // namespace peeler
