// SPDX-License-Identifier: Apache-2.0
// From scene-referred light to what a display shows: exposure, tone maps, and straight pixels.
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

/// From linear Rec. 709, scene-referred and straight, to linear display values (0–1 where the curve
/// ends there; the rest is clipped).
struct ToneMap {
    std::string_view name, summary;
    std::array<float, 3> (*map)(std::array<float, 3>);
};
/// The table of tone maps; the first row is what pictures for eyes get.
std::span<const ToneMap> toneMaps();
/// The tone map with this name. Throws Error (kUsage) that lists all of them if there is none.
const ToneMap& findToneMap(const std::string& name);

/// The sRGB transfer function (IEC 61966-2-1), linear to encoded, clipped to 0–1; NaN becomes 0.
float encodeSrgb(float linear);

/// A premultiplied linear colour as viewers of point clouds show it: straight, sRGB-encoded, 8
/// bits.
std::array<std::uint8_t, 4> displayColor(const std::array<float, 4>& color);

/// A pixel as files with straight alpha have it: linear display values, 0–1, not yet encoded.
struct StraightPixel {
    std::array<float, 3> color{};
    float alpha = 0;      ///< 0–1
    bool raised = false;  ///< alpha is more than the coverage
};

/// Shows scene-referred light by exposure and tone map.
class Display {
  public:
    /// `exposure` in stops. Throws like findToneMap().
    Display(float exposure, const std::string& tone_map);

    /// What a display shows of a premultiplied linear colour: premultiplied linear display values,
    /// 0–1, and its alpha as it is. The tone map sees the straight colour, C / A, as it sees an
    /// opaque surface, so that edges are shown alike whatever their coverage. Light beyond the
    /// coverage (a reflection on clear glass, emission: C > A) has no straight colour; the tone map
    /// sees it as the camera does, over black: as C / a, a = min(1, max C).
    std::array<float, 4> shown(const std::array<float, 4>& color) const {
        const Shown s = show(color);
        return {s.area * s.color[0], s.area * s.color[1], s.area * s.color[2], color[3]};
    }

    /// The same over a background of display values (premultiplied linear RGBA, 0–1), which stays
    /// what it is. Alpha is at most 1.
    std::array<float, 4> shownOver(const std::array<float, 4>& color,
                                   const std::array<float, 4>& background) const;
    /// The same of coloured opacity: every channel of the background by its own, alpha by the mean.
    std::array<float, 4> shownOver(const std::array<float, 4>& color,
                                   const std::array<float, 3>& opacity,
                                   const std::array<float, 4>& background) const;
    /// The same of a pixel of a composite, whatever opacity it has.
    std::array<float, 4> shownOver(const CompositeImage& composite, std::size_t pixel,
                                   const std::array<float, 4>& background) const {
        const std::array<float, 4>& color = composite.rgba[pixel];
        return composite.tinted() ? shownOver(color, composite.opacity[pixel], background)
                                  : shownOver(color, background);
    }

    /// The same without a background, as a straight pixel: straightPixel() of what is shown.
    StraightPixel straight(const std::array<float, 4>& color) const;

  private:
    struct Shown {
        std::array<float, 3> color;  ///< display values, 0–1
        float area;                  ///< what they are to be multiplied with
    };
    Shown show(const std::array<float, 4>& color) const;

    float gain_;
    const ToneMap* tone_map_;
};

/// The straight pixel that comes nearest to a premultiplied one D, A (display values, linear, 0–1)
/// over every background.
///
/// Where D ≤ A it is D / A at alpha A, which linear compositing turns into D + (1 − A)·B exactly.
/// Where the brightest channel p is more than A, no straight pixel gives D over black and B over
/// its own background: a straight colour is at most 1, and at alpha A it leaves A of p. Alpha has
/// to rise, and with it some of the background is lost. Viewers and browsers put pixels over a
/// background as they are encoded, S·α + (1 − α)·B with S, B in sRGB. With e() the sRGB curve, the
/// colour is S = e(D / p) and alpha
///
///     α = A + (1 − A)·e(x) / (2 − e(least D / p)),  x = (p − A) / (1 − A).
///
/// For grey light on clear glass (A = 0) this is e(p): over black it shows e(p), as it should.
/// Alpha p, the brightest channel in linear light, would show p·255 there instead of e(p)·255 (73
/// of 255 less at p = 0.24). For coloured light it is less, since over white the channels that do
/// not shine lose α·(1 − S), and the divisor makes that loss as large as the one over black. Where
/// p = A it is A, so that nothing jumps from one pixel to the next.
///
/// The worst error over 256 greys from black to white, in 255ths, encoded: alpha as it was (A),
/// raised to p, as above, and the least that any alpha reaches:
///
///     D = 0.05 grey, A = 0              63     50     22     14
///     D = 0.18 grey, A = 0             117     72     21     13
///     D = 0.5 grey,  A = 0             187     60     18     16
///     D = 0.8 grey,  A = 0.3           155     27     11      7
///     D = 0.18, 0.09, 0.02, A = 0      117     72     48     41
///     D = 0.18, 0, 0,       A = 0      117     72     60     59
///
/// In a program that composites in linear light such a pixel is too bright over black (e(p) instead
/// of p, 63 of 255 at p = 0.18; alpha p would be exact there): such programs take OpenEXR, which
/// keeps D and A as they are.
StraightPixel straightPixel(const std::array<float, 4>& shown);

/// Finds the exposure of a picture from its light, as it comes in bands of any size: the same
/// whatever the bands and the order of pixels, because it counts.
///
/// Every pixel counts by its alpha in 255ths, with the luminance of its straight colour, in steps
/// of 1/64 stop. Two aims: the log-average comes to 0.18 (Reinhard et al., "Photographic Tone
/// Reproduction for Digital Images", 2002, eq. 1 and 2), and the 98th percentile to 1 (metering by
/// percentile, as for histograms in "Moving Frostbite to Physically Based Rendering", Lagarde and
/// de Rousiers 2014, section 5.1.2). A picture of little contrast cannot have both: the exposure is
/// halfway between, in stops. Whatever the log-average asks for, the 98th percentile stays at or
/// below 4, which the neutral tone map shows as 253 of 255. It is rounded to a tenth of a stop.
class ExposureMeter {
  public:
    /// Adds the pixels of a composite without a background, scene-referred.
    void add(const CompositeImage& picture);

    /// The exposure in stops, −20 to 20; 0 if there is no light.
    float stops() const;
    /// The same where the picture cannot be shown as it is: the 98th percentile is more than 4, or
    /// less than 1/64. Else 0. For pictures of which nobody knows what lit them.
    float stopsIfNeeded() const;

  private:
    /// log2 of the luminance that this share of the picture does not exceed; −inf if there is none.
    double percentile(double share) const;
    /// log2 of the luminance in the middle of a step.
    static double stopsOf(std::size_t step) {
        return (static_cast<double>(step) + 0.5) / kStepsAStop - kStops / 2.0;
    }

    static constexpr int kStepsAStop = 64, kStops = 64;  ///< from 2^-32 on to 2^32
    std::vector<std::uint64_t> counts_ =
        std::vector<std::uint64_t>(std::size_t{kStepsAStop} * kStops);
};

/// Whether the view shows but a part of a picture (a tile, a crop), whose exposure is that of the
/// whole.
bool isPart(const View& view);

}  // namespace peeler
