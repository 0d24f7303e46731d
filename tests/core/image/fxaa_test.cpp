// SPDX-License-Identifier: Apache-2.0
// Tests FXAA on edges whose exact coverage is known, and its symmetries.
#include "core/image/fxaa.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <random>

namespace peeler {
namespace {

using Rgba = std::array<float, 4>;

constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr Rgba kClear{}, kOpaqueBlack{0, 0, 0, 1};

CompositeImage picture(int width, int height, const std::function<Rgba(int x, int y)>& color) {
    CompositeImage image{{0, 0, width, height}, {}, {}};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            image.rgba.push_back(color(x, y));
            image.z.push_back(image.rgba.back()[3] > 0 ? 1.0F : kNothing);
        }
    }
    return image;
}

Rgba grey(double value) {
    const auto v = static_cast<float>(value);
    return {v, v, v, 1};
}

CompositeImage filtered(const CompositeImage& image, const Rgba& background = kClear) {
    CompositeImage out;
    applyFxaa(image, background, image.window.y0, image.window.y1, out);
    EXPECT_EQ(out.window, image.window);
    return out;
}

const Rgba& pixelAt(const CompositeImage& image, int x, int y) {
    return image.rgba[static_cast<std::size_t>(y * image.window.width() + x)];
}

TEST(Fxaa, LeavesFlatAndSmoothPicturesAlone) {
    const auto flat = picture(40, 30, [](int, int) { return Rgba{0.2F, 0.5F, 0.1F, 0.7F}; });
    EXPECT_EQ(filtered(flat).rgba, flat.rgba);
    const auto smooth = picture(40, 30, [](int x, int y) {
        return grey(0.3 + 0.2 * std::sin(0.11 * x + 0.3) * std::cos(0.13 * y));
    });
    EXPECT_EQ(filtered(smooth).rgba, smooth.rgba);
    EXPECT_EQ(filtered(smooth).z, smooth.z);
}

TEST(Fxaa, LeavesEdgesAlongThePixelsAlone) {
    for (const Rgba& other : {kOpaqueBlack, Rgba{0.9F, 0.1F, 0.1F, 1}, kClear}) {
        const auto rows = picture(50, 30, [&](int, int y) { return y < 11 ? grey(1) : other; });
        EXPECT_EQ(filtered(rows).rgba, rows.rgba);
        const auto columns = picture(50, 30, [&](int x, int) { return x < 17 ? grey(1) : other; });
        EXPECT_EQ(filtered(columns).rgba, columns.rgba);
    }
}

/// Returns the share of the pixel that lies below the line y = height + slope·x, sampled in 64
/// columns.
double coverage(int x, int y, double height, double slope) {
    double sum = 0;
    for (int i = 0; i < 64; ++i)
        sum += std::clamp(y + 1 - (height + slope * (x + (i + 0.5) / 64)), 0.0, 1.0);
    return sum / 64;
}

/// Differences between a filtered line and its exact coverage: root mean square, and lost light.
struct Deviation {
    double rms = 0, lost = 0;
};
Deviation deviation(const CompositeImage& image, double height, double slope) {
    Deviation sums;
    double on_edge = 0;
    for (int y = 0; y < image.window.height(); ++y) {
        // Skip the columns where the search may reach the border.
        for (int x = kFxaaReach + 2; x < image.window.width() - kFxaaReach - 2; ++x) {
            const double expected = coverage(x, y, height, slope);
            const double difference = static_cast<double>(pixelAt(image, x, y)[0]) - expected;
            sums.rms += difference * difference;
            sums.lost -= difference;
            on_edge += expected > 0 && expected < 1 ? 1 : 0;
        }
    }
    sums.rms = std::sqrt(sums.rms / on_edge);
    sums.lost = std::abs(sums.lost) / on_edge;
    return sums;
}

TEST(Fxaa, BringsASlantedEdgeNearItsCoverage) {
    struct Row {
        // `at_most` is relative to the RMS error of the unfiltered picture.
        double slope, at_most;
    };
    for (const auto& [slope, at_most] :
         {Row{0.045, 0.2}, {0.08, 0.2}, {0.17, 0.2}, {0.29, 0.35}, {0.41, 0.6}, {0.93, 0.85}}) {
        const double height = 9.3;
        const int rows = static_cast<int>(height + slope * 200) + 10;
        const auto aliased = picture(200, rows, [&](int x, int y) {
            return grey(y + 0.5 > height + slope * (x + 0.5) ? 1 : 0);
        });
        const Deviation before = deviation(aliased, height, slope);
        const Deviation after = deviation(filtered(aliased), height, slope);
        std::printf("slope %.3f: RMS %.3f to %.3f, light off by %.4f of an edge pixel\n", slope,
                    before.rms, after.rms, after.lost);
        EXPECT_LT(after.rms, at_most * before.rms) << slope;
        EXPECT_LT(after.lost, 0.02) << slope;
    }
}

using Place = std::function<std::pair<int, int>(int x, int y)>;

/// Returns `image` with its pixels rearranged: the pixel at place(x, y) moves to (x, y).
CompositeImage rearranged(const CompositeImage& image, int width, int height, const Place& place) {
    CompositeImage out{{0, 0, width, height}, {}, {}};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const auto [from_x, from_y] = place(x, y);
            const auto p = static_cast<std::size_t>(from_y * image.window.width() + from_x);
            out.rgba.push_back(image.rgba[p]);
            out.z.push_back(image.z[p]);
        }
    }
    return out;
}

void expectSymmetric(const CompositeImage& image) {
    const int w = image.window.width(), h = image.window.height();
    const CompositeImage expected = filtered(image);
    EXPECT_NE(expected.rgba, image.rgba);
    const auto check = [&](const char* what, int width, int height, const Place& place) {
        const CompositeImage out = filtered(rearranged(image, width, height, place));
        const CompositeImage same = rearranged(expected, width, height, place);
        EXPECT_TRUE(out.rgba == same.rgba) << what;
        EXPECT_TRUE(out.z == same.z) << what;
    };
    check("left is right", w, h, [&](int x, int y) { return std::pair{w - 1 - x, y}; });
    check("up is down", w, h, [&](int x, int y) { return std::pair{x, h - 1 - y}; });
    check("rows are columns", h, w, [&](int x, int y) { return std::pair{y, x}; });
}

TEST(Fxaa, TreatsAllDirectionsAlike) {
    constexpr unsigned kSeed = 11;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    std::mt19937 random(kSeed);
    const auto share = [&] { return static_cast<float>(random() % 1000U) / 1000; };
    expectSymmetric(picture(61, 47, [&](int, int) {
        const float alpha = share();
        return Rgba{share() * alpha, share() * alpha, share() * alpha, alpha};
    }));
    // With only two values, many pixels have equal gradients in both directions; some pixels have
    // no Z.
    expectSymmetric(picture(
        61, 47, [&](int, int) { return random() % 3U ? kClear : grey(random() % 2U ? 1 : 0); }));
    expectSymmetric(picture(61, 47, [&](int x, int y) {
        return std::hypot(x - 25.3, y - 20.1) < 17 ? grey(0.1) : kClear;
    }));
}

TEST(Fxaa, TellsNoPictureFromItsBands) {
    // Long edges in both directions, so that every row of the overlap matters.
    const auto image = picture(70, 90, [](int x, int y) {
        const bool steep = x > 20 + 0.03 * y, flat = y > 50 + 0.04 * x;
        return steep == flat ? grey(0.8) : kClear;
    });
    const CompositeImage whole = filtered(image);
    for (int y = 0; y < 90; ++y) {
        const int y0 = std::max(0, y - kFxaaReach), y1 = std::min(90, y + 1 + kFxaaReach);
        CompositeImage part, out;
        part.setRows(image, y0, y1);
        applyFxaa(part, kClear, y, y + 1, out);
        EXPECT_TRUE(std::equal(out.rgba.begin(), out.rgba.end(), whole.rgba.begin() + y * 70)) << y;
        EXPECT_TRUE(std::equal(out.z.begin(), out.z.end(), whole.z.begin() + y * 70)) << y;
    }
}

/// Returns a half plane of `color` with a slanted edge, over an empty background.
CompositeImage onNothing(const Rgba& color) {
    return picture(60, 20, [&](int x, int y) { return y > 5 + 0.13 * x ? color : kClear; });
}

TEST(Fxaa, SmoothsAnythingOnNothing) {
    for (const double value : {0.0, 0.04, 0.2, 0.25, 0.5, 1.0}) {
        const auto image = onNothing(grey(value));
        const auto out = filtered(image);
        int changed = 0;
        for (std::size_t p = 0; p < out.rgba.size(); ++p) {
            const Rgba& color = out.rgba[p];
            changed += color != image.rgba[p] ? 1 : 0;
            // All components are scaled equally, so the unpremultiplied colour is unchanged.
            for (std::size_t c = 0; c < 3; ++c)
                EXPECT_NEAR(color[c], static_cast<float>(value) * color[3], 1e-6);
        }
        EXPECT_GT(changed, 50) << value;
    }
}

TEST(Fxaa, AnOpaqueBackgroundSaysWhatAnEdgeIs) {
    const auto black = onNothing(kOpaqueBlack);
    EXPECT_EQ(filtered(black, kOpaqueBlack).rgba, black.rgba);
    EXPECT_NE(filtered(black, grey(1)).rgba, black.rgba);
}

TEST(Fxaa, ColoursOfOneLumaAreNoEdge) {
    const Rgba red{0.05F / 0.2126F, 0, 0, 1}, green{0, 0.05F / 0.7152F, 0, 1},
        blue{0, 0, 0.05F / 0.0722F, 1};
    for (const auto& [a, b] : {std::pair{red, green}, {green, blue}, {blue, red}}) {
        const auto image = picture(60, 20, [&](int x, int y) { return y > 5 + 0.13 * x ? a : b; });
        EXPECT_EQ(filtered(image).rgba, image.rgba);
    }
}

TEST(Fxaa, WhatGetsColourGetsZ) {
    auto image = onNothing(grey(0.5));
    for (std::size_t p = 0; p < image.z.size(); ++p) {
        if (image.z[p] < kNothing) image.z[p] = 1 + static_cast<float>(p);
    }
    const auto out = filtered(image);
    int covered = 0;
    for (std::size_t p = 0; p < out.z.size(); ++p) {
        EXPECT_EQ(out.z[p]<kNothing, out.rgba[p][3]> 0) << p;
        if (image.z[p] < kNothing) {
            EXPECT_EQ(out.z[p], image.z[p]);
        } else if (out.z[p] < kNothing) {
            ++covered;  // the edge took Z from the pixel below or to the left
            EXPECT_TRUE(out.z[p] == image.z[p + 60] || out.z[p] == image.z[p - 1]) << p;
        }
    }
    EXPECT_GT(covered, 20);
}

TEST(Fxaa, DimsAnIsolatedPixelAndShrugsOffWhatIsNoNumber) {
    const auto dot = picture(9, 9, [](int x, int y) { return grey(x == 4 && y == 4 ? 1 : 0); });
    EXPECT_NEAR(pixelAt(filtered(dot), 4, 4)[0], 0.25, 1e-4);
    for (const float odd : {kNothing, -kNothing, std::numeric_limits<float>::quiet_NaN(), -3.0F}) {
        const auto image = picture(9, 9, [&](int x, int y) {
            return x == 4 && y == 4 ? Rgba{odd, odd, odd, 1} : grey(0.5);
        });
        const auto out = filtered(image);
        EXPECT_EQ(pixelAt(out, 0, 0), grey(0.5));
        EXPECT_EQ(pixelAt(out, 4, 7), grey(0.5));
    }
}

}  // namespace
}  // namespace peeler
