// SPDX-License-Identifier: Apache-2.0
#include "core/image/box_filter.h"

#include <algorithm>

namespace peeler {
namespace {

void addScaled(BoxFilter::Pixel& sum, const BoxFilter::Pixel& value, float factor) {
    for (std::size_t c = 0; c < sum.size(); ++c)
        sum[c] += factor * value[c];
}

}  // namespace

BoxFilter::BoxFilter(int source_width, int source_height, int width, int height)
    : width_(static_cast<std::size_t>(width)),
      columns_(splits(source_width, width)),
      rows_(splits(source_height, height)),
      pixels_(width_ * static_cast<std::size_t>(height)),
      narrow_(width_) {}

std::vector<BoxFilter::Split> BoxFilter::splits(int source, int result) {
    std::vector<Split> all(static_cast<std::size_t>(source));
    const double scale = static_cast<double>(result) / source;
    for (int i = 0; i < source; ++i) {
        Split& split = all[static_cast<std::size_t>(i)];
        const double begin = i * scale, end = (i + 1) * scale;
        split.first =
            std::min(static_cast<std::size_t>(begin), static_cast<std::size_t>(result - 1));
        const double edge = static_cast<double>(split.first) + 1;
        const bool crosses = end > edge && edge < result;
        split.in_first = static_cast<float>((crosses ? edge : end) - begin);
        split.in_next = crosses ? static_cast<float>(end - edge) : 0;
    }
    return all;
}

void BoxFilter::addRow(std::span<const Pixel> row) {
    std::fill(narrow_.begin(), narrow_.end(), Pixel{});
    for (std::size_t x = 0; x < columns_.size(); ++x) {
        const Split& split = columns_[x];
        addScaled(narrow_[split.first], row[x], split.in_first);
        if (split.in_next > 0) addScaled(narrow_[split.first + 1], row[x], split.in_next);
    }
    add(rows_[next_row_++]);
}

void BoxFilter::add(const Split& row) {
    Pixel* first = pixels_.data() + row.first * width_;
    for (std::size_t x = 0; x < width_; ++x)
        addScaled(first[x], narrow_[x], row.in_first);
    if (row.in_next == 0) return;
    for (std::size_t x = 0; x < width_; ++x)
        addScaled(first[width_ + x], narrow_[x], row.in_next);
}

}  // namespace peeler
