// SPDX-License-Identifier: Apache-2.0
#include "formats/image/display.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <peeler/error.h>
#include "core/base/color.h"

namespace peeler {
namespace {

using Rgb = std::array<float, 3>;

Rgb keep(Rgb color) {
    return color;
}

/// The Khronos PBR Neutral tone map (github.com/KhronosGroup/ToneMapping, PBR_Neutral). Keeps base
/// colours below 0.8, apart from the 4 % of Fresnel reflection that it subtracts, and compresses
/// highlights.
Rgb neutral(Rgb color) {
    constexpr float kStart = 0.8F - 0.04F, kDesaturation = 0.15F, kRoom = 1 - kStart;
    const float low = std::min({color[0], color[1], color[2]});
    const float offset = low < 0.08F ? low - 6.25F * low * low : 0.04F;
    for (float& c : color)
        c -= offset;
    const float peak = std::max({color[0], color[1], color[2]});
    if (peak < kStart) return color;
    const float new_peak = 1 - kRoom * kRoom / (peak + kRoom - kStart);
    const float gray = 1 - 1 / (kDesaturation * (peak - new_peak) + 1);
    for (float& c : color)
        c = std::lerp(c * new_peak / peak, new_peak, gray);
    return color;
}

Rgb multiply(const std::array<Rgb, 3>& m, const Rgb& v) {
    Rgb out{};
    for (std::size_t i = 0; i < 3; ++i)
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
    return out;
}

/// Applies the ACES RRT and ODT as fitted by Stephen Hill (BakingLab, ACES.hlsl, MIT licence):
/// converts sRGB to a space near AP1, applies the curve to each channel, and converts back.
Rgb aces(Rgb color) {
    constexpr std::array<Rgb, 3> kIn = {{{0.59719F, 0.35458F, 0.04823F},
                                         {0.07600F, 0.90834F, 0.01566F},
                                         {0.02840F, 0.13383F, 0.83777F}}};
    constexpr std::array<Rgb, 3> kOut = {{{1.60475F, -0.53108F, -0.07367F},
                                          {-0.10208F, 1.10813F, -0.00605F},
                                          {-0.00327F, -0.07276F, 1.07602F}}};
    color = multiply(kIn, color);
    for (float& c : color) {
        c = (c * (c + 0.0245786F) - 0.000090537F) / (c * (0.983729F * c + 0.4329510F) + 0.238081F);
    }
    return multiply(kOut, color);
}

constexpr ToneMap kToneMaps[] = {
    {"neutral", "Khronos PBR Neutral: true base colours, soft highlights", neutral},
    {"none", "clip at 1", keep},
    {"aces", "ACES filmic (fit by S. Hill)", aces},
};

float brightest(const Rgb& color) {
    return std::max({color[0], color[1], color[2]});
}

// The exposure meter's targets and limits, as luminances. kHighlights is a percentile.
constexpr double kMiddleGrey = 0.18, kHighlights = 0.98, kBrightest = 4, kDarkest = 1.0 / 64;

}  // namespace

std::span<const ToneMap> toneMaps() {
    return kToneMaps;
}

const ToneMap& findToneMap(const std::string& name) {
    std::string names;
    for (const ToneMap& entry : kToneMaps) {
        if (entry.name == name) return entry;
        names += (names.empty() ? "" : ", ") + std::string(entry.name);
    }
    throw Error(ErrorKind::kUsage, "unknown tone map \"" + name + "\"", Parameter::kToneMap,
                "choose one of: " + names);
}

float encodeSrgb(float linear) {
    if (!(linear > 0)) return 0;
    if (linear >= 1) return 1;
    return srgbFromLinear(linear);
}

std::array<std::uint8_t, 4> displayColor(const std::array<float, 4>& color) {
    const float alpha = color[3], scale = alpha > 0 ? 1 / alpha : 0;
    const auto byte = [](float value) {
        return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0F, 1.0F)));
    };
    return {byte(encodeSrgb(color[0] * scale)), byte(encodeSrgb(color[1] * scale)),
            byte(encodeSrgb(color[2] * scale)), byte(alpha > 0 ? alpha : 0)};
}

Display::Display(float exposure, const std::string& tone_map, bool blends_encoded)
    : gain_(std::exp2(exposure)),
      blends_encoded_(blends_encoded),
      tone_map_(&findToneMap(tone_map)) {}

Display::Shown Display::show(const std::array<float, 4>& color) const {
    const Rgb light{color[0] * gain_, color[1] * gain_, color[2] * gain_};
    const float coverage = color[3] > 0 ? std::min(color[3], 1.0F) : 0;  // NaN gives 0
    const float area = std::max(coverage, std::min(brightest(light), 1.0F));
    if (!(area > 0)) return {{}, 0};
    Rgb mapped =
        tone_map_->map(area == coverage ? Rgb{color[0] * (gain_ / area), color[1] * (gain_ / area),
                                              color[2] * (gain_ / area)}
                                        : Rgb{light[0] / area, light[1] / area, light[2] / area});
    for (float& c : mapped)
        c = c > 0 ? std::min(c, 1.0F) : 0;  // NaN gives 0
    return {mapped, area};
}

std::array<float, 4> Display::shownOver(const std::array<float, 4>& color,
                                        const std::array<float, 4>& background) const {
    if (blends_encoded_) return encodedOver(color, background);
    return shownOver(color, {color[3], color[3], color[3]}, background);
}

/// Blends sRGB-encoded values. The straight colour of the result is then decoded.
std::array<float, 4> Display::encodedOver(const std::array<float, 4>& color,
                                          const std::array<float, 4>& background) const {
    const Shown s = show(color);
    const float rest = 1 - std::clamp(color[3], 0.0F, 1.0F);
    std::array<float, 4> out{0, 0, 0, 1 - rest + rest * background[3]};
    if (!(out[3] > 0)) return out;
    for (std::size_t c = 0; c < 3; ++c) {
        float sum = s.area * encodeSrgb(s.color[c]);
        if (background[3] > 0)
            sum += rest * background[3] * encodeSrgb(background[c] / background[3]);
        out[c] = out[3] * linearFromSrgb(std::min(sum / out[3], 1.0F));
    }
    return out;
}

std::array<float, 4> Display::shownOver(const std::array<float, 4>& color,
                                        const std::array<float, 3>& opacity,
                                        const std::array<float, 4>& background) const {
    std::array<float, 4> out = shown(color);
    // Where alpha exceeds 1 (weighted sums), the formula would subtract the background, so clamp
    // the result.
    for (std::size_t c = 0; c < 3; ++c)
        out[c] = std::clamp(out[c] + (1 - opacity[c]) * background[c], 0.0F, 1.0F);
    out[3] = std::clamp(out[3] + (1 - out[3]) * background[3], 0.0F, 1.0F);
    return out;
}

StraightPixel Display::straight(const std::array<float, 4>& color) const {
    const Shown s = show(color);
    const float alpha = color[3] > 0 ? std::min(color[3], 1.0F) : 0;
    // Return the colour as it is: multiplication and division would round it.
    if (s.area == alpha) return {s.color, alpha};
    return straightPixel({s.area * s.color[0], s.area * s.color[1], s.area * s.color[2], alpha});
}

StraightPixel straightPixel(const std::array<float, 4>& shown) {
    const Rgb color{shown[0], shown[1], shown[2]};
    const float alpha = shown[3] > 0 ? std::min(shown[3], 1.0F) : 0, bright = brightest(color);
    const auto divided = [&](float by) { return Rgb{color[0] / by, color[1] / by, color[2] / by}; };
    constexpr float kRounding = 1 + 1e-6F;
    if (!(bright > alpha * kRounding)) return {alpha > 0 ? divided(alpha) : Rgb{}, alpha};
    const Rgb straight = divided(bright);
    const float least = encodeSrgb(std::min({straight[0], straight[1], straight[2]}));
    const float beyond = encodeSrgb((bright - alpha) / (1 - alpha));
    return {straight, std::min(1.0F, alpha + (1 - alpha) * beyond / (2 - least)), true};
}

void ExposureMeter::add(const CompositeImage& picture) {
    for (const auto& [r, g, b, a] : picture.rgba) {
        if (!(a > 0)) continue;
        const auto weight = static_cast<std::uint64_t>(std::lround(255 * std::min(a, 1.0F)));
        const double luminance =
            (0.2126 * static_cast<double>(r) + 0.7152 * static_cast<double>(g) +
             0.0722 * static_cast<double>(b)) /
            std::min(static_cast<double>(a), 1.0);
        if (!(luminance > 0) || !std::isfinite(luminance)) continue;
        const double step = std::floor((std::log2(luminance) + kStops / 2.0) * kStepsAStop);
        counts_[static_cast<std::size_t>(
            std::clamp(step, 0.0, static_cast<double>(counts_.size() - 1)))] += weight;
    }
}

bool isPart(const View& view) {
    return view.crop.pixels() != Window{0, 0, view.width, view.height}.pixels();
}

double ExposureMeter::percentile(double share) const {
    std::uint64_t all = 0;
    for (const std::uint64_t count : counts_)
        all += count;
    if (all == 0) return -std::numeric_limits<double>::infinity();
    const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(all)));
    std::uint64_t below = 0;
    std::size_t step = 0;
    while ((below += counts_[step]) < wanted)
        ++step;
    return stopsOf(step);
}

float ExposureMeter::stops() const {
    double sum = 0;
    std::uint64_t all = 0;
    for (std::size_t step = 0; step < counts_.size(); ++step) {
        sum += static_cast<double>(counts_[step]) * stopsOf(step);
        all += counts_[step];
    }
    if (all == 0) return 0;
    const double highlights = percentile(kHighlights);
    const double by_mean = std::log2(kMiddleGrey) - sum / static_cast<double>(all);
    const double halfway = (by_mean - highlights) / 2;
    const double stops = std::min(halfway, std::log2(kBrightest) - highlights);
    return static_cast<float>(std::clamp(std::round(stops * 10) / 10, -20.0, 20.0));
}

float ExposureMeter::stopsIfNeeded() const {
    const double highlights = percentile(kHighlights);
    const bool shown = highlights <= std::log2(kBrightest) && highlights >= std::log2(kDarkest);
    return shown || !std::isfinite(highlights) ? 0 : stops();
}

}  // namespace peeler
