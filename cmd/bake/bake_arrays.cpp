// SPDX-License-Identifier: Apache-2.0
#include "cmd/bake/bake_arrays.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace peeler::cmd {

namespace {

enum VertexArray : std::size_t { kValues, kPositions, kNormals, kRanges };

}  // namespace

std::vector<NamedArray> vertexArrays(const VertexReceivers& vertices, std::size_t components) {
    using enum NumberType;
    const std::uint64_t n = vertices.receivers().size();
    return {{"values", kFloat, {n, components}},
            {"positions", kFloat, {n, 3}},
            {"normals", kFloat, {n, 3}},
            {"ranges", kInt64, {vertices.ranges().size(), 5}}};
}

void writeVertexArrays(const std::string& path, const PosedScene& posed,
                       const VertexReceivers& vertices, std::span<const float> values,
                       std::size_t components) {
    constexpr std::size_t kAtOnce = std::size_t{1} << 16;
    ArrayWriter writer(path, vertexArrays(vertices, components));
    writer.append(kValues, asBytes(values));
    const std::vector<glm::dvec3>& positions = vertices.receivers().positions;
    std::vector<glm::vec3> rounded;
    for (std::size_t first = 0; first < positions.size(); first += kAtOnce) {
        const auto some =
            std::span(positions).subspan(first, std::min(kAtOnce, positions.size() - first));
        rounded.assign(some.begin(), some.end());
        writer.append(kPositions, asBytes(rounded));
    }
    writer.append(kNormals, asBytes(vertices.receivers().normals));
    for (const VertexRange& range : vertices.ranges()) {
        const std::array<std::int64_t, 5> row = {
            posed.meshes()[range.instance].node, static_cast<std::int64_t>(range.instance),
            static_cast<std::int64_t>(range.primitive), static_cast<std::int64_t>(range.first),
            static_cast<std::int64_t>(range.count)};
        writer.append(kRanges, asBytes(row));
    }
    writer.finish();
}

std::vector<NamedArray> texelArrays(const TexelReceivers& texels, std::size_t components) {
    const auto size = static_cast<std::uint64_t>(texels.settings().size);
    std::vector<NamedArray> arrays;
    for (const TexelAtlas& atlas : texels.atlases())
        arrays.push_back({"material_" + std::to_string(atlas.material),
                          NumberType::kFloat,
                          {size, size, components}});
    return arrays;
}

void writeTexelArrays(const std::string& path, const TexelReceivers& texels,
                      std::span<const float> values, std::size_t components, int padding) {
    ArrayWriter writer(path, texelArrays(texels, components));
    for (std::size_t i = 0; i < texels.atlases().size(); ++i)
        writer.append(i, asBytes(texels.pixels(texels.atlases()[i], values, components, padding)));
    writer.finish();
}

}  // namespace peeler::cmd
