// SPDX-License-Identifier: Apache-2.0
#include "cmd/rays/median_path.h"

#include <algorithm>

namespace peeler::cmd {

void MedianPath::begin(std::span<const Bundle> bundles, std::span<const std::uint64_t>) {
    bundles_.assign(bundles.begin(), bundles.end());
    std::uint64_t rays = 0;
    for (const Bundle& bundle : bundles_) {
        first_.push_back(rays);
        rays += bundle.rays();
    }
    step_ = rays / kMostPaths + 1;
}

void MedianPath::take(std::size_t bundle, const LayeredImage& band) {
    const Window &rows = band.window, &all = bundles_[bundle].view.crop;
    if (rows.y0 == all.y0) maps_.begin(bundles_[bundle]);
    maps_.evaluateRows(bundles_[bundle], band, rows.y0, rows.y1, values_);
    const std::uint64_t before = first_[bundle] + static_cast<std::uint64_t>(rows.y0 - all.y0) *
                                                      static_cast<std::uint64_t>(all.width());
    for (std::size_t i = 0; i < values_.size(); ++i)
        if (values_[i] > 0 && (before + i) % step_ == 0) lengths_.push_back(values_[i]);
}

std::optional<double> MedianPath::median() {
    if (lengths_.empty()) return {};
    const auto middle = lengths_.begin() + static_cast<std::ptrdiff_t>(lengths_.size() / 2);
    std::nth_element(lengths_.begin(), middle, lengths_.end());
    return *middle;
}

}  // namespace peeler::cmd
