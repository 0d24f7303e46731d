// SPDX-License-Identifier: Apache-2.0
#include "formats/image/legend.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

#include "formats/image/font.h"

namespace peeler {
namespace {

using Pixel = std::array<float, 4>;

constexpr Pixel kPaper{1, 1, 1, 1}, kInk{0.01F, 0.01F, 0.01F, 1}, kFrame{0.3F, 0.3F, 0.3F, 1};

// Lengths in text dots (font.h).
constexpr int kMargin = 4, kGap = 3, kBarHeight = 8, kTick = 2;
// Room for a value, and the gap before the next value.
constexpr int kNumberWidth = 10 * kTextAdvance;
constexpr int kLeastWidth = 2 * kNumberWidth;

int scaleFor(int width) {
    return std::clamp(width / 400, 1, kMostTextScale);
}

CompositeImage paper(const LegendSize& size) {
    CompositeImage picture;
    picture.window = {0, 0, size.width, size.height};
    picture.rgba.assign(picture.window.pixels(), kPaper);
    picture.z.assign(picture.window.pixels(), 0);
    return picture;
}

void fill(CompositeImage& picture, const Window& where, const Pixel& color) {
    const Window inside = intersect(where, picture.window);
    const auto width = static_cast<std::size_t>(picture.window.width());
    for (int y = inside.y0; y < inside.y1; ++y)
        for (int x = inside.x0; x < inside.x1; ++x)
            picture.rgba[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] = color;
}

std::string numberText(double value) {
    std::array<char, 32> text{};
    // Do not use printf(): its decimal separator depends on the host's locale.
    constexpr int kDigits = 4;
    const auto [end, failure] = std::to_chars(text.data(), text.data() + text.size(), value,
                                              std::chars_format::general, kDigits);
    return {text.data(), failure == std::errc() ? end : text.data()};
}

/// Returns the smallest step of the form 1, 2 or 5 times a power of ten that divides a length into
/// at most `most` steps.
double roundStep(double length, int most) {
    const double power = std::pow(10, std::floor(std::log10(length / most)));
    for (const double step : {1.0, 2.0, 5.0})
        if (length / (step * power) <= most) return step * power;
    return 10 * power;
}

/// Returns the values to write below a bar: both ends, and those round numbers between them that
/// are not too close to the ends.
std::vector<double> numbersOf(double low, double high, int most) {
    std::vector<double> numbers{low};
    if (!(high > low)) return numbers;
    const double step = roundStep(high - low, most), room = 0.8 * (high - low) / most;
    for (double n = std::ceil(low / step); n * step < high - room; ++n)
        if (n * step > low + room) numbers.push_back(n * step);
    numbers.push_back(high);
    return numbers;
}

}  // namespace

LegendSize colorBarSize(std::string_view title, int width) {
    const int scale = scaleFor(width);
    const int text = static_cast<int>(title.size()) * kTextAdvance;
    return {scale, std::max(width, scale * (2 * kMargin + std::max(text, kLeastWidth))),
            scale * (2 * kMargin + 2 * kTextHeight + 2 * kGap + kBarHeight)};
}

CompositeImage drawColorBar(const ColorBar& bar, const LegendSize& size) {
    CompositeImage picture = paper(size);
    const int s = size.scale, left = kMargin * s, right = size.width - kMargin * s;
    int y = kMargin * s;
    drawText(picture, left, y, s, kInk, bar.title);
    y += (kTextHeight + kGap) * s;
    const int end = y + kBarHeight * s, width = right - left;
    fill(picture, {left - 1, y - 1, right + 1, end + 1}, kFrame);
    for (int x = left; x < right; ++x) {
        const float share =
            width > 1 ? static_cast<float>(x - left) / static_cast<float>(width - 1) : 0.0F;
        const auto [r, g, b] = bar.ramp(share);
        fill(picture, {x, y, x + 1, end}, {r, g, b, 1});
    }
    for (const double number :
         numbersOf(bar.low, bar.high, std::max(1, width / (kNumberWidth * s)))) {
        const double share = bar.high > bar.low ? (number - bar.low) / (bar.high - bar.low) : 0;
        const int x = left + static_cast<int>(std::lround(share * (width - 1)));
        fill(picture, {x, end, x + 1, end + kTick * s}, kInk);
        const std::string text = numberText(number);
        const int room = static_cast<int>(text.size()) * kTextAdvance * s;
        drawText(picture, std::clamp(x - room / 2, left, std::max(left, right - room)),
                 end + kGap * s, s, kInk, text);
    }
    return picture;
}

LegendSize legendSize(const std::vector<LegendLine>& lines, int width) {
    const int scale = scaleFor(width);
    std::size_t longest = 0;
    for (const LegendLine& line : lines)
        longest = std::max(longest, line.text.size());
    const auto count = static_cast<int>(lines.size());
    const int text = static_cast<int>(longest) * kTextAdvance + kTextHeight + kGap;
    return {scale, std::max(width, scale * (2 * kMargin + text)),
            scale * (2 * kMargin + count * (kTextHeight + kGap) - kGap)};
}

CompositeImage drawLegend(const std::vector<LegendLine>& lines, const LegendSize& size) {
    CompositeImage picture = paper(size);
    const int s = size.scale, left = kMargin * s;
    int y = kMargin * s;
    for (const LegendLine& line : lines) {
        const auto [r, g, b] = line.color;
        fill(picture, {left, y, left + kTextHeight * s, y + kTextHeight * s}, {r, g, b, 1});
        drawText(picture, left + (kTextHeight + kGap) * s, y, s, kInk, line.text);
        y += (kTextHeight + kGap) * s;
    }
    return picture;
}

}  // namespace peeler
