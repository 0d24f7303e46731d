// SPDX-License-Identifier: Apache-2.0
#include "cmd/sheet/deep_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>

#include "cmd/cli/report.h"
#include "cmd/options/deep_against.h"
#include "cmd/options/layered_bands.h"
#include "core/image/deep_curve.h"

namespace peeler::cmd {

namespace {

using Rgba = std::array<float, 4>;
constexpr Rgba kPaper{0.9F, 0.9F, 0.9F, 1}, kOriginal{0.35F, 0.35F, 0.35F, 1},
    kThin{0.9F, 0.2F, 0.0F, 1}, kPlotFrame{0.6F, 0.6F, 0.6F, 1};
constexpr int kMargin = 6;  // pixels around the plot

SheetCell compositeOf(const std::string& path, const SheetRequest& request, Reporter& reporter) {
    const auto input = openInput(path, request.file, reporter);
    SheetSettings settings = request.cells;
    settings.most_cells = 1;
    settings.meters = false;
    SheetCells cells(settings);
    cells.begin(input->info().plan);
    forEachBand(*input, kBandBytes, [&](LayeredImage& band) { cells.write(std::move(band)); });
    cells.finish();
    return std::move(cells.cells().front());
}

/// Reads the samples of one pixel; none if the file lacks the pixel, or its values have no meaning.
DeepCurve curveOf(const std::string& path, int x, int y, const SheetRequest& request,
                  Reporter& reporter) {
    const auto input = openInput(path, request.file, reporter);
    const Window pixel{x, y, x + 1, y + 1};
    DeepCurve curve;
    LayeredImage image;
    curve.clear();
    if (intersect(pixel, input->info().plan.view.crop) != pixel) return curve;
    input->read(pixel, image);
    DeepFloats floats(image);
    floats.convert(0, image.fragments());
    if (!curve.read(floats.samples(0, image.fragments()))) curve.clear();
    return curve;
}

/// A curve over depth, drawn column by column. Steps are vertical lines.
class Plot {
  public:
    Plot(CompositeImage& picture, double nearest, double farthest)
        : picture_(picture),
          width_(picture.window.width() - 2 * kMargin),
          height_(picture.window.height() - 2 * kMargin),
          nearest_(nearest),
          farthest_(farthest) {}

    /// Draws the transmittance of a colour channel (0–2).
    void draw(const DeepCurve& curve, std::size_t channel, const Rgba& color, int thickness) {
        int last = rowOf(1);
        for (int x = 0; x < width_; ++x) {
            const double share = (x + 0.5) / width_;
            const int row = rowOf(curve.at(nearest_ + share * (farthest_ - nearest_))[3 + channel]);
            const int low = std::min(row, last), high = std::max(row, last) + thickness;
            fill(x, low, x + thickness, high, color);
            last = row;
        }
    }
    void drawFrame() {
        fill(0, height_, width_, height_ + 1, kPlotFrame);
        fill(-1, 0, 0, height_ + 1, kPlotFrame);
    }

  private:
    int rowOf(double transmittance) const {
        return static_cast<int>(std::lround((1 - transmittance) * (height_ - 1)));
    }
    void fill(int x0, int y0, int x1, int y1, const Rgba& color) {
        const Window box =
            intersect({x0 + kMargin, y0 + kMargin, x1 + kMargin, y1 + kMargin}, picture_.window);
        for (int y = box.y0; y < box.y1; ++y)
            for (int x = box.x0; x < box.x1; ++x)
                picture_.rgba[static_cast<std::size_t>(y) *
                                  static_cast<std::size_t>(picture_.window.width()) +
                              static_cast<std::size_t>(x)] = color;
    }

    CompositeImage& picture_;
    int width_, height_;
    double nearest_, farthest_;
};

}  // namespace

std::vector<SheetCell> deepCells(const SheetRequest& request, SheetCell composite,
                                 const std::string& original, Reporter& reporter) {
    const std::string path = request.scene.file.string();
    const DeepAgainst against = compareDeep(path, original);
    SheetCell plot = composite;
    composite.label = "thinned";
    composite.detail = countText(against.samples, "sample");
    SheetCell before = compositeOf(original, request, reporter);
    before.label = "original";
    before.detail = countText(against.original_samples, "sample");

    const DeepCurve thin = curveOf(path, against.x, against.y, request, reporter);
    const DeepCurve whole = curveOf(original, against.x, against.y, request, reporter);
    double nearest = 0, farthest = 1;
    if (!whole.pieces().empty()) {
        const double front = whole.pieces().front().front, back = whole.pieces().back().back;
        const double margin = std::max(0.05 * (back - front), 1e-3 * std::abs(back));
        nearest = front - margin;
        farthest = back + margin;
    }
    std::array<char, 96> words{};
    std::snprintf(words.data(), words.size(), "pixel %d, %d: %.3g", against.x, against.y,
                  against.worst.error);
    plot.label = "transmittance over depth";
    plot.detail = words.data();
    plot.picture.resizeColors(false);
    std::ranges::fill(plot.picture.rgba, kPaper);
    Plot curves(plot.picture, nearest, farthest);
    const std::size_t channel = against.worst.component % 3;
    curves.drawFrame();
    curves.draw(whole, channel, kOriginal, 3);
    curves.draw(thin, channel, kThin, 1);
    return {std::move(before), std::move(composite), std::move(plot)};
}

}  // namespace peeler::cmd
