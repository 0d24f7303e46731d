// SPDX-License-Identifier: Apache-2.0
// Differences of pictures. Each row has its own sums, which are merged in order, so sums of doubles
// are bit-identical for any number of threads.
#include "core/image/difference.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <peeler/error.h>
#include "core/base/parallel.h"

namespace peeler {
namespace {

double absoluteDifference(double a, double b) {
    if (a == b || (std::isnan(a) && std::isnan(b))) return 0;
    const double apart = std::abs(a - b);
    return std::isnan(apart) ? std::numeric_limits<double>::infinity() : apart;
}

/// Adds the differences between the components of two colours. Returns the largest difference.
float addColor(const TintedColor& a, const TintedColor& b, std::size_t components, int x, int y,
               DifferenceStatistics& sum) {
    double largest = 0;
    for (std::size_t c = 0; c < components; ++c) {
        sum.add(a[c], b[c], x, y);
        largest = std::max(largest, absoluteDifference(a[c], b[c]));
    }
    return static_cast<float>(largest);
}

/// Adds the differences of one pixel's fragments to `sum`. Returns the largest colour difference.
/// If the pictures have different numbers of fragments in the pixel, returns the negative of the
/// difference of these numbers.
float addPixel(const LayeredImage& a, const LayeredImage& b, std::size_t pixel, int x, int y,
               LayeredDifference& sum) {
    const std::uint32_t in_a = a.count(pixel), in_b = b.count(pixel);
    const std::uint32_t all = std::max(in_a, in_b), both = std::min(in_a, in_b);
    if (sum.layers.size() < all) sum.layers.resize(all);
    const std::size_t components = colorComponents(a.tinted() || b.tinted());
    float largest = 0;
    for (std::uint32_t k = 0; k < both; ++k) {
        const std::size_t f = a.offsets[pixel] + k, g = b.offsets[pixel] + k;
        FragmentDifference& layer = sum.layers[k];
        ++layer.both;
        layer.depth.add(a.z[f], b.z[g], x, y);
        largest = std::max(largest, addColor(tintedColorOf(a, f), tintedColorOf(b, g), components,
                                             x, y, layer.color));
    }
    for (std::uint32_t k = both; k < all; ++k)
        ++(in_a > in_b ? sum.layers[k].only_a : sum.layers[k].only_b);
    ++sum.pixels;
    if (in_a == in_b) return largest;
    ++sum.count_pixels;
    sum.largest_count = std::max(sum.largest_count, all - both);
    return -static_cast<float>(all - both);
}

void checkSizes(const Window& a, const Window& b) {
    if (a.width() != b.width() || a.height() != b.height())
        throw Error(ErrorKind::kInternal, "bands of different sizes are compared");
}

/// Calls compare(pixel, x, y, sum of the row) for every pixel, and stores the results in `largest`
/// unless it is empty. Returns one sum per row. Merged in order, these sums do not depend on the
/// number of threads.
template <class Sum, class Compare>
std::vector<Sum> rowDifferences(const Window& window, std::span<float> largest, Compare&& compare) {
    const auto width = static_cast<std::size_t>(window.width());
    std::vector<Sum> rows(static_cast<std::size_t>(window.height()));
    parallelFor(rows.size(), [&](std::size_t row) {
        for (std::size_t column = 0; column < width; ++column) {
            const std::size_t pixel = row * width + column;
            const float found = compare(pixel, window.x0 + static_cast<int>(column),
                                        window.y0 + static_cast<int>(row), rows[row]);
            if (!largest.empty()) largest[pixel] = found;
        }
    });
    return rows;
}

}  // namespace

void DifferenceStatistics::add(double a, double b, int at_x, int at_y) {
    const double apart = absoluteDifference(a, b);
    ++values;
    sum += apart;
    sum_of_squares += apart * apart;
    if (apart > largest) {
        largest = apart;
        x = at_x;
        y = at_y;
    }
}

void DifferenceStatistics::merge(const DifferenceStatistics& later) {
    values += later.values;
    sum += later.sum;
    sum_of_squares += later.sum_of_squares;
    if (later.largest > largest) {
        largest = later.largest;
        x = later.x;
        y = later.y;
    }
}

double DifferenceStatistics::mean() const {
    return values == 0 ? 0 : sum / static_cast<double>(values);
}

double DifferenceStatistics::rmse() const {
    return values == 0 ? 0 : std::sqrt(sum_of_squares / static_cast<double>(values));
}

double DifferenceStatistics::psnr() const {
    return -20 * std::log10(rmse());
}

void FragmentDifference::merge(const FragmentDifference& later) {
    both += later.both;
    only_a += later.only_a;
    only_b += later.only_b;
    depth.merge(later.depth);
    color.merge(later.color);
}

void LayeredDifference::merge(const LayeredDifference& later) {
    pixels += later.pixels;
    count_pixels += later.count_pixels;
    largest_count = std::max(largest_count, later.largest_count);
    all.merge(later.all);
    if (layers.size() < later.layers.size()) layers.resize(later.layers.size());
    for (std::size_t k = 0; k < later.layers.size(); ++k)
        layers[k].merge(later.layers[k]);
    composite.merge(later.composite);
}

void addDifference(const LayeredImage& a, const LayeredImage& b, LayeredDifference& sum,
                   std::span<float> largest) {
    checkSizes(a.window, b.window);
    auto rows = rowDifferences<LayeredDifference>(
        a.window, largest, [&](std::size_t pixel, int x, int y, LayeredDifference& row) {
            return addPixel(a, b, pixel, x, y, row);
        });
    for (LayeredDifference& row : rows) {
        for (const FragmentDifference& layer : row.layers)
            row.all.merge(layer);
        sum.merge(row);
    }
    CompositeImage flat_a, flat_b;
    compositeOver(a, {}, flat_a);
    compositeOver(b, {}, flat_b);
    addDifference(flat_a, flat_b, sum.composite);
}

void addDifference(const CompositeImage& a, const CompositeImage& b, DifferenceStatistics& sum,
                   std::span<float> largest) {
    checkSizes(a.window, b.window);
    const auto components = colorComponents(a.tinted() || b.tinted());
    const auto rows = rowDifferences<DifferenceStatistics>(
        a.window, largest, [&](std::size_t pixel, int x, int y, DifferenceStatistics& row) {
            return addColor(a.colorAt(pixel), b.colorAt(pixel), components, x, y, row);
        });
    for (const DifferenceStatistics& row : rows)
        sum.merge(row);
}

}  // namespace peeler
