// SPDX-License-Identifier: Apache-2.0
// The display transform: exposure, tone maps, and straight-alpha pixels.
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

/// Maps linear Rec. 709, scene-referred and straight, to linear display values (0–1 where the curve
/// ends there; the rest is clipped).
struct ToneMap {
    std::string_view name, summary;
    std::array<float, 3> (*map)(std::array<float, 3>);
};
/// Returns the table of tone maps; the first row is the default for display pictures.
std::span<const ToneMap> toneMaps();
/// Returns the tone map of this name. Throws Error (kUsage), listing all names, if there is none.
const ToneMap& findToneMap(const std::string& name);

/// Applies the sRGB transfer function (IEC 61966-2-1), linear to encoded, clipped to 0–1; NaN
/// becomes 0.
float encodeSrgb(float linear);

/// Converts a premultiplied linear colour to straight, sRGB-encoded 8 bits, as point cloud viewers
/// expect.
std::array<std::uint8_t, 4> displayColor(const std::array<float, 4>& color);

/// A straight-alpha pixel of a file: linear display values, 0–1, not yet encoded.
struct StraightPixel {
    std::array<float, 3> color{};
    float alpha = 0;      ///< 0–1
    bool raised = false;  ///< alpha exceeds the coverage
};

/// The display transform of scene-referred light: exposure and tone map.
class Display {
  public:
    /// `exposure` in stops. Throws like findToneMap().
    Display(float exposure, const std::string& tone_map);

    /// Returns the display colour of a premultiplied linear colour: premultiplied linear display
    /// values, 0–1, with its alpha unchanged. The tone map gets the straight colour, C / A, as for
    /// an opaque surface, so that edges look the same at any coverage. Light beyond the coverage (a
    /// reflection on clear glass, emission: C > A) has no straight colour; the tone map then gets
    /// it as the camera sees it over black: C / a, a = min(1, max C).
    std::array<float, 4> shown(const std::array<float, 4>& color) const {
        const Shown s = show(color);
        return {s.area * s.color[0], s.area * s.color[1], s.area * s.color[2], color[3]};
    }

    /// Returns the display colour over a background of display values (premultiplied linear RGBA,
    /// 0–1), which is not tone-mapped. Alpha is at most 1.
    std::array<float, 4> shownOver(const std::array<float, 4>& color,
                                   const std::array<float, 4>& background) const;
    /// Does the same with coloured opacity: attenuates each background channel by its own opacity,
    /// alpha by the mean.
    std::array<float, 4> shownOver(const std::array<float, 4>& color,
                                   const std::array<float, 3>& opacity,
                                   const std::array<float, 4>& background) const;
    /// Does the same for a pixel of a composite, with or without coloured opacity.
    std::array<float, 4> shownOver(const CompositeImage& composite, std::size_t pixel,
                                   const std::array<float, 4>& background) const {
        const std::array<float, 4>& color = composite.rgba[pixel];
        return composite.tinted() ? shownOver(color, composite.opacity[pixel], background)
                                  : shownOver(color, background);
    }

    /// Returns straightPixel() of shown(), without a background.
    StraightPixel straight(const std::array<float, 4>& color) const;

  private:
    struct Shown {
        std::array<float, 3> color;  ///< display values, 0–1
        float area;                  ///< multiplier of the colour
    };
    Shown show(const std::array<float, 4>& color) const;

    float gain_;
    const ToneMap* tone_map_;
};

/// Returns the straight pixel nearest to a premultiplied one D, A (display values, linear, 0–1)
/// over every background.
///
/// Where D ≤ A it is D / A at alpha A, and linear compositing then gives D + (1 − A)·B exactly.
/// Where the brightest channel p exceeds A, no straight pixel gives D over black and also keeps B
/// correctly: a straight colour is at most 1, so at alpha A at most A of p remains. Alpha must
/// rise, which hides some of the background. Viewers and browsers composite encoded values, S·α +
/// (1 − α)·B with S, B in sRGB. With the sRGB curve e(), the colour is S = e(D / p) and alpha
///
///     α = A + (1 − A)·e(x) / (2 − e(least D / p)),  x = (p − A) / (1 − A).
///
/// For grey light on clear glass (A = 0) this is e(p), which shows e(p) over black, as it should.
/// Alpha p, the brightest linear channel, would show p·255 there instead of e(p)·255 (73 of 255
/// less at p = 0.24). For coloured light alpha is lower: over white the dark channels lose α·(1 −
/// S), and the divisor balances that loss against the one over black. At p = A it equals A, so
/// there is no jump between neighbouring pixels.
///
/// Worst error over 256 greys from black to white, in 1/255, encoded: with alpha A, with alpha p,
/// with alpha as above, and the minimum over all alphas:
///
///     D = 0.05 grey, A = 0              63     50     22     14
///     D = 0.18 grey, A = 0             117     72     21     13
///     D = 0.5 grey,  A = 0             187     60     18     16
///     D = 0.8 grey,  A = 0.3           155     27     11      7
///     D = 0.18, 0.09, 0.02, A = 0      117     72     48     41
///     D = 0.18, 0, 0,       A = 0      117     72     60     59
///
/// A program that composites in linear light shows such a pixel too bright over black (e(p) instead
/// of p, 63 of 255 at p = 0.18; alpha p would be exact there). Such programs should read OpenEXR,
/// which keeps D and A unchanged.
StraightPixel straightPixel(const std::array<float, 4>& shown);

/// Automatic exposure from the light of a picture, which comes in bands. The result depends neither
/// on the bands nor on the pixel order, because it is a histogram.
///
/// Each pixel is weighted by its alpha in 1/255 and binned by the luminance of its straight colour,
/// in steps of 1/64 stop. There are two targets: a log-average of 0.18 (Reinhard et al.,
/// "Photographic Tone Reproduction for Digital Images", 2002, eq. 1 and 2) and a 98th percentile of
/// 1 (percentile metering, as for histograms in "Moving Frostbite to Physically Based Rendering",
/// Lagarde and de Rousiers 2014, section 5.1.2). A low-contrast picture cannot meet both, so the
/// exposure is halfway between, in stops. In any case the 98th percentile stays at or below 4,
/// which the neutral tone map shows as 253 of 255. The result is rounded to a tenth of a stop.
class ExposureMeter {
  public:
    /// Adds the pixels of a scene-referred composite without a background.
    void add(const CompositeImage& picture);

    /// Returns the exposure in stops, −20 to 20; 0 if there is no light.
    float stops() const;
    /// Returns stops() if the picture is unusable as it is (98th percentile above 4 or below 1/64),
    /// else 0. For pictures with unknown lighting.
    float stopsIfNeeded() const;

  private:
    /// Returns log2 of the luminance that this share of the picture does not exceed; −inf if there
    /// is no light.
    double percentile(double share) const;
    /// Returns log2 of the luminance in the middle of a step.
    static double stopsOf(std::size_t step) {
        return (static_cast<double>(step) + 0.5) / kStepsAStop - kStops / 2.0;
    }

    static constexpr int kStepsAStop = 64, kStops = 64;  ///< from 2^-32 to 2^32
    std::vector<std::uint64_t> counts_ =
        std::vector<std::uint64_t>(std::size_t{kStepsAStop} * kStops);
};

/// Whether the view is only a part of a picture (a tile, a crop), whose exposure is that of the
/// whole.
bool isPart(const View& view);

}  // namespace peeler
