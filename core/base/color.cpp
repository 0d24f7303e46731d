// SPDX-License-Identifier: Apache-2.0
#include "core/base/color.h"

#include <algorithm>
#include <cstddef>
#include <span>

namespace peeler {
namespace {

using Anchor = std::array<float, 3>;

constexpr Anchor kInferno[] = {{0, 0, 4},      {31, 12, 72},   {87, 16, 110},
                               {136, 34, 106}, {188, 55, 84},  {227, 89, 51},
                               {249, 142, 9},  {249, 201, 50}, {252, 255, 164}};
constexpr Anchor kBlueToCyan[] = {{16, 52, 140}, {40, 130, 210}, {110, 240, 255}};

std::array<float, 3> between(std::span<const Anchor> anchors, float share) {
    const auto last = static_cast<float>(anchors.size() - 1);
    const float at = share > 0 ? std::min(share, 1.0F) * last : 0;  // NaN gives 0
    const auto first = std::min(static_cast<std::size_t>(at), anchors.size() - 2);
    std::array<float, 3> color{};
    for (std::size_t c = 0; c < 3; ++c) {
        const float encoded =
            std::lerp(anchors[first][c], anchors[first + 1][c], at - static_cast<float>(first));
        color[c] = linearFromSrgb(encoded / 255);
    }
    return color;
}

}  // namespace

std::array<float, 3> inferno(float share) {
    return between(kInferno, share);
}

std::array<float, 3> blueToCyan(float share) {
    return between(kBlueToCyan, share);
}

}  // namespace peeler
