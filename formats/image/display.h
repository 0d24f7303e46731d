// SPDX-License-Identifier: Apache-2.0
// The display transform: exposure, tone maps, and conversion to straight-alpha pixels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/composite.h>
#include <peeler/view.h>

namespace peeler {

/// A tone map: a curve from linear Rec. 709 (scene-referred, not premultiplied) to linear display
/// values. The results may exceed 1 and are then clipped.
struct ToneMap {
    std::string_view name, summary;
    std::array<float, 3> (*map)(std::array<float, 3>);
};
/// Returns the table of tone maps. The first tone map is the default for display pictures.
std::span<const ToneMap> toneMaps();
/// Returns the tone map with this name. Throws Error (kUsage), with a list of the names, if the
/// name is unknown.
const ToneMap& findToneMap(const std::string& name);

/// Applies the sRGB transfer function (IEC 61966-2-1), linear to encoded. Clips to 0–1; NaN becomes
/// 0.
float encodeSrgb(float linear);

/// Converts a premultiplied linear colour to straight alpha and sRGB encoding with 8 bits, as point
/// cloud viewers expect.
std::array<std::uint8_t, 4> displayColor(const std::array<float, 4>& color);

/// A pixel for files with straight alpha. The colour is in linear display values, 0–1, not yet
/// encoded.
struct StraightPixel {
    std::array<float, 3> color{};
    float alpha = 0;      ///< 0–1
    bool raised = false;  ///< whether alpha was raised above the coverage (straightPixel())
};

/// The display transform for scene-referred light: exposure, then tone map.
class Display {
  public:
    /// `exposure` is in stops. `blends_encoded`: whether shownOver() blends sRGB-encoded values,
    /// not linear ones. Throws the errors of findToneMap().
    Display(float exposure, const std::string& tone_map, bool blends_encoded = false);

    /// Returns the display colour for a premultiplied linear colour: premultiplied linear display
    /// values, 0–1, with the same alpha.
    ///
    /// The tone map is applied to the straight colour, C / A, as for an opaque surface, so that
    /// edges look the same at any coverage. Light that exceeds the coverage (C > A: a reflection on
    /// clear glass, emission) has no straight colour. For such light, the tone map is applied to
    /// the colour that the camera would see over black: C / a, a = min(1, max C).
    std::array<float, 4> shown(const std::array<float, 4>& color) const {
        const Shown s = show(color);
        return {s.area * s.color[0], s.area * s.color[1], s.area * s.color[2], color[3]};
    }

    /// Returns the display colour over a background. The background is in display values
    /// (premultiplied linear RGBA, 0–1), so it is not tone-mapped. Alpha is at most 1.
    std::array<float, 4> shownOver(const std::array<float, 4>& color,
                                   const std::array<float, 4>& background) const;
    /// Returns the same for coloured opacity: the opacity of a channel attenuates the channel of
    /// the background, and the mean opacity attenuates the alpha of the background.
    std::array<float, 4> shownOver(const std::array<float, 4>& color,
                                   const std::array<float, 3>& opacity,
                                   const std::array<float, 4>& background) const;
    /// Returns the same for a pixel of a composite, with or without coloured opacity.
    std::array<float, 4> shownOver(const CompositeImage& composite, std::size_t pixel,
                                   const std::array<float, 4>& background) const {
        const std::array<float, 4>& color = composite.rgba[pixel];
        return composite.tinted() ? shownOver(color, composite.opacity[pixel], background)
                                  : shownOver(color, background);
    }

    /// Returns the straight-alpha pixel of shown(), without a background.
    StraightPixel straight(const std::array<float, 4>& color) const;

  private:
    struct Shown {
        std::array<float, 3> color;  ///< display values, 0–1
        /// The factor for premultiplication: alpha or, if the light exceeds alpha, `a` (see
        /// shown()).
        float area;
    };
    Shown show(const std::array<float, 4>& color) const;
    std::array<float, 4> encodedOver(const std::array<float, 4>& color,
                                     const std::array<float, 4>& background) const;

    float gain_;
    bool blends_encoded_;
    const ToneMap* tone_map_;
};

/// Returns the straight-alpha pixel that comes nearest, over any background, to a premultiplied
/// pixel D, A (display values, linear, 0–1).
///
/// Where D ≤ A, the straight-alpha pixel is D / A with alpha A, and linear compositing gives
/// exactly D + (1 − A)·B over a background B. Where the brightest channel p exceeds A, no
/// straight-alpha pixel both shows D over black and attenuates B correctly: a straight colour is at
/// most 1, so with alpha A, at most A of p is shown. Alpha must rise, which hides some of the
/// background. Viewers and browsers composite encoded values, S·α + (1 − α)·B with S, B in sRGB.
/// With the sRGB curve e(), the colour is S = e(D / p), and alpha is
///
///     α = A + (1 − A)·e(x) / (2 − e(least D / p)),  x = (p − A) / (1 − A).
///
/// For grey light on clear glass (A = 0), α is e(p), which correctly shows e(p) over black. With
/// α = p, viewers would show p·255 instead of e(p)·255 (73 of 255 less at p = 0.24). For coloured
/// light, α is lower than e(p): over white, the dark channels lose α·(1 − S), and the divisor
/// balances this loss against the loss over black. At p = A, the formula gives A, so that
/// neighbouring pixels do not jump.
///
/// The worst error over 256 greys from black to white, in 1/255, encoded, with four alphas: A, p,
/// α, and the alpha with the least error:
///
///     D = 0.05 grey, A = 0              63     50     22     14
///     D = 0.18 grey, A = 0             117     72     21     13
///     D = 0.5 grey,  A = 0             187     60     18     16
///     D = 0.8 grey,  A = 0.3           155     27     11      7
///     D = 0.18, 0.09, 0.02, A = 0      117     72     48     41
///     D = 0.18, 0, 0,       A = 0      117     72     60     59
///
/// A program that composites in linear light shows such a pixel too bright over black: e(p) instead
/// of p, an error of 63 of 255 at p = 0.18. (With alpha p, linear compositing would be exact.) Such
/// programs should read OpenEXR, which keeps D and A unchanged.
StraightPixel straightPixel(const std::array<float, 4>& shown);

/// A light meter for automatic exposure, which receives a picture band by band. It keeps a
/// histogram, so the result does not depend on the bands or on the order of pixels.
///
/// Each pixel is weighted by its alpha in 1/255, and sorted into bins of 1/64 stop by the luminance
/// of its straight colour. There are two targets: a log-average of 0.18 (Reinhard et al.,
/// "Photographic Tone Reproduction for Digital Images", 2002, eq. 1 and 2) and a 98th percentile of
/// 1 (percentile metering, as for histograms in "Moving Frostbite to Physically Based Rendering",
/// Lagarde and de Rousiers 2014, section 5.1.2). A low-contrast picture cannot meet both, so the
/// exposure is halfway between them, in stops. In any case the 98th percentile is at most 4, which
/// the neutral tone map shows as 253 of 255. The result is rounded to a tenth of a stop.
class ExposureMeter {
  public:
    /// Adds the pixels of a composite in scene-referred light, without a background.
    void add(const CompositeImage& picture);

    /// Returns the exposure in stops, −20 to 20, or 0 if there is no light.
    float stops() const;
    /// Returns 0 if the picture is usable at 0 stops (98th percentile from 1/64 to 4), else
    /// stops(). Intended for pictures with unknown lighting.
    float stopsIfNeeded() const;

  private:
    /// Returns the percentile of the luminance, `share` from 0 to 1, as log2; −inf if there is no
    /// light.
    double percentile(double share) const;
    /// Returns log2 of the luminance in the middle of a bin.
    static double stopsOf(std::size_t step) {
        return (static_cast<double>(step) + 0.5) / kStepsAStop - kStops / 2.0;
    }

    /// The number of bins per stop, and the number of stops: from 2^-32 to 2^32.
    static constexpr int kStepsAStop = 64, kStops = 64;
    std::vector<std::uint64_t> counts_ =
        std::vector<std::uint64_t>(std::size_t{kStepsAStop} * kStops);
};

/// Whether the view is a part of a picture (a tile, a crop). A part must have the exposure of the
/// whole picture.
bool isPart(const View& view);

}  // namespace peeler
