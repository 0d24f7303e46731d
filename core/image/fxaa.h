// SPDX-License-Identifier: Apache-2.0
// Fast approximate anti-aliasing (FXAA) of finished pictures, band by band.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/sink.h>

namespace peeler {

/// The maximum distance, in pixels, of the search for the ends of an edge. Filtering a row needs
/// this number of rows above and below it. (FXAA 3.11 tests pixels in strides, and reaches 20.5
/// pixels with quality preset 12 and 26.5 with preset 39. This filter tests every pixel.)
inline constexpr int kFxaaReach = 24;

/// Applies fast approximate anti-aliasing to the rows [y0, y1) of `picture` and writes them to
/// `out`, whose window becomes these rows (Lottes, "FXAA", NVIDIA white paper 2009, "Algorithm
/// Details": local contrast check, edge detection, end-of-edge search, sub-pixel aliasing; FXAA
/// 3.11, quality version). Beyond the picture's borders, its outermost pixels are repeated.
///
/// Contrast is measured on the square root of Rec. 709 luma, which approximates perception. If
/// `background` (premultiplied) is not opaque, contrast is measured with black and with white
/// behind it. All premultiplied components are blended with the same weights, in linear light;
/// `background` itself is not added. Z is kept. An empty pixel that gets colour from a neighbour
/// also gets the neighbour's Z (the nearer Z if there are two), so that it counts as covered.
///
/// The filter differs from 3.11 in three ways, since light is linear here and speed matters less.
/// Straight edges along the pixel grid are unchanged. Edge ends are located between two pixels. If
/// two directions are equal, their mean is used, so that a mirrored or transposed picture gives the
/// mirrored or transposed result, bit for bit.
void applyFxaa(const CompositeImage& picture, const std::array<float, 4>& background, int y0,
               int y1, CompositeImage& out);

/// A sink that composites incoming bands, filters them (applyFxaa()) and passes them to another
/// sink as bands of one layer. The result does not depend on how the picture is divided into bands.
/// Keeps the rows that are needed to filter later rows: twice kFxaaReach, plus the rows that are
/// being filtered.
class FxaaFilter : public Sink {
  public:
    /// `background`: the premultiplied linear RGBA that `next` composites behind the picture. If it
    /// is not opaque, the filter allows for any colour behind `background`.
    FxaaFilter(std::unique_ptr<Sink> next, const std::array<float, 4>& background);

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    /// Adds the time of compositing and filtering to "composite".
    StageTimes times() const override;

  private:
    void keep(int y0, int y1);
    void passOn();

    std::unique_ptr<Sink> next_;
    std::array<float, 4> background_;
    Window crop_;
    bool tinted_ = false;       ///< whether opacity is coloured
    int slice_rows_ = 0;        ///< maximum number of rows to filter at once
    int next_row_ = 0;          ///< first row that has not been passed to next_
    CompositeImage composite_;  ///< composite of the current band
    /// Rows of this band and earlier bands that are needed to filter later rows.
    CompositeImage kept_;
    CompositeImage filtered_;
    LayeredImage layer_;
    StageTimes times_;
};

}  // namespace peeler
