// SPDX-License-Identifier: Apache-2.0
#include "core/rays/solid_spans.h"

#include <algorithm>
#include <tuple>

namespace peeler {

void SolidSpans::find(std::span<const float> t, std::span<const std::uint32_t> keys,
                      const Solids& solids) {
    order_.clear();
    spans_.clear();
    hits_.clear();
    for (std::size_t i = 0; i < keys.size(); ++i) {
        const std::uint32_t solid = solids.solidOf(keys[i]);
        if (solid != Solids::kNone) order_.push_back({solid, static_cast<std::uint32_t>(i)});
    }
    std::sort(order_.begin(), order_.end(), [](const Hit& a, const Hit& b) {
        return std::tie(a.solid, a.index) < std::tie(b.solid, b.index);
    });
    for (std::size_t i = 0, end = 0; i < order_.size(); i = end) {
        const std::uint32_t solid = order_[i].solid;
        while (end < order_.size() && order_[end].solid == solid)
            ++end;
        hits_.push_back({solid, static_cast<std::uint32_t>(end - i)});
        for (std::size_t k = i; k + 1 < end; k += 2) {
            const std::uint32_t in = order_[k].index, out = order_[k + 1].index;
            if (t[out] > t[in]) spans_.push_back({{t[in], t[out]}, solid, keys[in], in});
        }
    }
    std::sort(spans_.begin(), spans_.end(), [](const SolidSpan& a, const SolidSpan& b) {
        return std::tie(a.begin, b.end, a.hit) < std::tie(b.begin, a.end, b.hit);
    });
}

}  // namespace peeler
