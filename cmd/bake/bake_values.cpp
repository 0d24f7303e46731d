// SPDX-License-Identifier: Apache-2.0
#include "cmd/bake/bake_values.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include "cmd/bake/bake_options.h"

namespace peeler::cmd {

namespace {

std::uint16_t quantized(float value) {
    const float clipped = value > 0 ? std::min(value, 1.0F) : 0.0F;  // NaN becomes 0
    return static_cast<std::uint16_t>(std::lround(clipped * 65535));
}

std::vector<glm::u16vec4> colorsOf(const std::vector<glm::vec4>& own, std::span<const float> values,
                                   std::size_t components, bool darkens, const ShownValues& shown) {
    std::vector<glm::u16vec4> colors(values.size() / components);
    for (std::size_t i = 0; i < colors.size(); ++i) {
        glm::vec4 color = own.empty() ? glm::vec4(1) : own[i];
        for (int c = 0; c < 3; ++c) {
            const auto place = std::min(static_cast<std::size_t>(c), components - 1);
            const float value = shown(values[i * components + place]);
            color[c] = darkens ? color[c] * value : value;
        }
        for (int c = 0; c < 4; ++c)
            colors[i][c] = quantized(color[c]);
    }
    return colors;
}

}  // namespace

ValueRange rangeOf(std::span<const float> values) {
    if (values.empty()) return {};
    ValueRange range{double{values[0]}, 0, double{values[0]}};
    for (const float value : values) {
        range.least = std::min(range.least, double{value});
        range.greatest = std::max(range.greatest, double{value});
        range.mean += double{value};
    }
    range.mean /= static_cast<double>(values.size());
    return range;
}

ShownValues::ShownValues(BakeQuantity quantity, const ValueRange& range) {
    if (quantity == BakeQuantity::kBentNormal) scale_ = offset_ = 0.5F;
    if (quantity == BakeQuantity::kThickness && range.greatest > 0)
        scale_ = static_cast<float>(1 / range.greatest);
    if (quantity == BakeQuantity::kIrradiance) scale_ = std::numbers::inv_pi_v<float>;
}

std::string attributeOf(BakeQuantity quantity) {
    std::string name = "_";
    for (const char c : nameOf<BakeQuantity>(kBakeQuantities, quantity))
        name += c == '-' ? '_' : static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
    return name;
}

std::vector<BakedPrimitive> bakedPrimitives(const PosedScene& posed,
                                            const VertexReceivers& vertices,
                                            std::span<const float> values, BakeQuantity quantity,
                                            const ShownValues& shown) {
    const std::size_t components = componentsOf(quantity);
    struct Shows {
        std::size_t baked;  // index into `result`
        std::size_t instances;
    };
    std::map<std::pair<int, std::size_t>, Shows> places;  // keys: node and primitive
    std::vector<BakedPrimitive> result;
    // Original colours of each entry in `result`.
    std::vector<const std::vector<glm::vec4>*> colors;
    for (const VertexRange& range : vertices.ranges()) {
        if (range.count == 0) continue;
        const MeshInstance& instance = posed.meshes()[range.instance];
        const Primitive& primitive = posed.primitives(instance)[range.primitive];
        const auto own = values.subspan(range.first * components, range.count * components);
        const auto [place, fresh] =
            places.try_emplace({instance.node, range.primitive}, Shows{result.size(), 0});
        ++place->second.instances;
        if (fresh) {
            result.push_back({instance.node, primitive.source, {}, {own.begin(), own.end()}});
            colors.push_back(&posed.colors({instance.mesh, range.primitive, instance.deformed}));
            continue;
        }
        std::vector<float>& sums = result[place->second.baked].values;
        std::ranges::transform(sums, own, sums.begin(), std::plus<>());
    }
    for (const auto& [key, shows] : places) {
        BakedPrimitive& baked = result[shows.baked];
        for (float& value : baked.values)
            value /= static_cast<float>(shows.instances);
        baked.colors =
            colorsOf(*colors[shows.baked], baked.values, components, isOcclusion(quantity), shown);
    }
    return result;
}

}  // namespace peeler::cmd
