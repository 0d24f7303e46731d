// SPDX-License-Identifier: Apache-2.0
// Receivers at vertices and at texels, and conversion of the receivers' values to atlas pixels.
#include "core/bake/receivers.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#include <peeler/error.h>
#include "core/bake/gather.h"
#include "core/bake/texel_coverage.h"
#include "core/base/parallel.h"
#include "core/scene/elements.h"

namespace peeler {
namespace {

constexpr std::uint64_t kReceiverBytes = sizeof(glm::dvec3) + sizeof(glm::vec3);

}  // namespace

VertexReceivers::VertexReceivers(const PosedScene& posed, const MemoryBudget& budget)
    : posed_(posed) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < posed.meshes().size(); ++i) {
        first_range_.push_back(ranges_.size());
        const std::vector<Primitive>& primitives = posed.primitives(posed.meshes()[i]);
        for (std::size_t p = 0; p < primitives.size(); ++p) {
            const Primitive& primitive = primitives[p];
            const std::size_t vertices = isOfTriangles(primitive) ? primitive.positions.size() : 0;
            ranges_.push_back({i, p, count, vertices});
            count += vertices;
        }
    }
    if (count > kMostReceivers)
        throw Error(ErrorKind::kInput,
                    "the scene has " + std::to_string(count) + " visible vertices, but at most " +
                        std::to_string(kMostReceivers) + " can be baked",
                    "", "bake parts of it: " + Parameter::kInclude + ", " + Parameter::kExclude);
    checkReceiverMemory(count * kReceiverBytes, count, budget);
    receivers_.positions.resize(count);
    receivers_.normals.resize(count);
    parallelFor(ranges_.size(), [&](std::size_t range) { fill(ranges_[range]); });
}

void VertexReceivers::fill(const VertexRange& range) {
    const MeshInstance& instance = posed_.meshes()[range.instance];
    const Primitive& primitive = posed_.primitives(instance)[range.primitive];
    const auto& local = posed_.positions(instance, range.primitive);
    if (range.count == 0) return;
    const auto& normals = posed_.normals(instance, range.primitive);
    std::vector<glm::dvec3> world(local.size()), sums(local.size(), glm::dvec3(0));
    std::vector<char> used(local.size(), 0);
    for (std::size_t i = 0; i < local.size(); ++i) {
        world[i] = glm::dvec3(instance.world * glm::dvec4(local[i], 1));
        receivers_.positions[range.first + i] = world[i];
    }
    // Face normals are computed in world space, since a skin can mirror a triangle even if the
    // instance's matrix does not.
    const double side = instance.mirrored ? -1 : 1;
    for (std::uint32_t t = 0; t < elementsOf(primitive); ++t) {
        const auto [a, b, c] = cornersOf(primitive, t).vertex;
        const glm::dvec3 area = side * glm::cross(world[b] - world[a], world[c] - world[a]);
        for (const std::size_t corner : {a, b, c}) {
            sums[corner] += area;
            used[corner] = 1;
        }
    }
    const glm::dmat3 turn = normalMatrix(glm::dmat3(instance.world));
    for (std::size_t i = 0; i < local.size(); ++i) {
        if (!used[i]) continue;
        glm::vec3& normal = receivers_.normals[range.first + i];
        if (!normals.empty()) normal = unitOrZero(turn * glm::dvec3(normals[i]));
        if (normal == glm::vec3(0)) normal = unitOrZero(sums[i]);
    }
}

SurfaceLookup VertexReceivers::lookup() const {
    return [this](std::span<const float> values, std::uint32_t key, const glm::vec2& barycentric) {
        const KeyOrigin origin = posed_.drawList().originOf(key);
        const VertexRange& from = range(origin.instance, origin.primitive);
        if (from.count == 0) return glm::vec3(0);
        const Corners corners = cornersOf(posed_.primitive(origin), origin.element);
        const float weights[] = {1 - barycentric.x - barycentric.y, barycentric.x, barycentric.y};
        glm::vec3 sum(0);
        for (std::size_t i = 0; i < 3; ++i) {
            const float* value = values.data() + 3 * (from.first + corners.vertex[i]);
            sum += weights[i] * glm::vec3(value[0], value[1], value[2]);
        }
        return sum;
    };
}

namespace {

// The maximum total number of texels in all textures. The indices of this many texels take 4 GiB.
constexpr std::size_t kMostTexels = std::size_t{1} << 30;

/// The visible triangles of one material, in draw order.
struct Chart {
    struct Source {
        std::uint32_t range = 0;  ///< index into VertexReceivers::ranges()
        std::uint32_t element = 0;
    };
    std::vector<UvTriangle> triangles;
    std::vector<Source> sources;
};

/// A map from samples of triangles to positions and normals in world space.
class Placement {
  public:
    Placement(const PosedScene& posed, const VertexReceivers& vertices)
        : posed_(posed), vertices_(vertices) {}

    const Primitive& primitive(const VertexRange& range) const {
        return posed_.primitives(posed_.meshes()[range.instance])[range.primitive];
    }

    bool isDegenerate(const VertexRange& range, std::uint32_t element) const {
        return flatNormal(range, cornersOf(primitive(range), element)) == glm::vec3(0);
    }

    void place(const Chart::Source& source, const glm::vec2& barycentric, glm::dvec3& position,
               glm::vec3& normal) const {
        const VertexRange& range = vertices_.ranges()[source.range];
        const Primitive& from = primitive(range);
        const Corners corners = cornersOf(from, source.element);
        const Receivers& receivers = vertices_.receivers();
        const double weights[] = {
            1.0 - static_cast<double>(barycentric.x) - static_cast<double>(barycentric.y),
            barycentric.x, barycentric.y};
        const auto mean = [&](const auto& values) {
            glm::dvec3 sum(0);
            for (std::size_t i = 0; i < 3; ++i)
                sum += weights[i] * glm::dvec3(values[range.first + corners.vertex[i]]);
            return sum;
        };
        position = mean(receivers.positions);
        normal =
            from.normals.empty() ? glm::vec3(0) : unitOrZero(glm::vec3(mean(receivers.normals)));
        if (normal == glm::vec3(0)) normal = flatNormal(range, corners);
    }

  private:
    glm::vec3 flatNormal(const VertexRange& range, const Corners& corners) const {
        const glm::dvec3* const p = vertices_.receivers().positions.data() + range.first;
        const glm::dvec3 a = p[corners.vertex[0]];
        const glm::dvec3 normal = glm::cross(p[corners.vertex[1]] - a, p[corners.vertex[2]] - a);
        const double length = glm::length(normal);
        if (!(length > 0)) return glm::vec3(0);
        const double side = posed_.meshes()[range.instance].mirrored ? -1 : 1;
        return glm::vec3(side / length * normal);
    }

    const PosedScene& posed_;
    const VertexReceivers& vertices_;
};

[[noreturn]] void failTooLarge() {
    throw Error(ErrorKind::kInput, "too many textures of this size to bake at once", "",
                "choose a smaller " + Parameter::kSize + ", or bake parts of the scene: " +
                    Parameter::kInclude + ", " + Parameter::kExclude);
}

/// Returns the UVs in texels, shifted by whole repeats to keep the numbers small.
UvTriangle uvTriangle(const std::vector<glm::vec2>& uvs, const Corners& corners, int size) {
    UvTriangle result;
    for (std::size_t i = 0; i < 3; ++i)
        result[i] = glm::dvec2(uvs[corners.vertex[i]]);
    const glm::dvec2 turns = glm::floor(glm::min(result[0], glm::min(result[1], result[2])));
    for (glm::dvec2& corner : result)
        corner = (corner - turns) * static_cast<double>(size);
    return result;
}

void rasterize(const Chart& chart, const Placement& placement, int size, TexelAtlas& atlas,
               Receivers& receivers, const MemoryBudget& budget) {
    const std::size_t texels = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
    checkReceiverMemory(texels * (2 * sizeof(std::uint32_t) + sizeof(TexelSample)), texels, budget);
    const TexelCoverage coverage(chart.triangles, size);
    const auto side = static_cast<std::size_t>(size);
    std::vector<TexelRow> rows(side);
    parallelFor(side, [&](std::size_t y) { rows[y] = coverage.row(static_cast<int>(y)); });
    std::size_t count = receivers.size();
    atlas.first.reserve(side * side + 1);
    std::vector<std::size_t> starts;
    for (const TexelRow& row : rows) {
        starts.push_back(count);
        for (std::size_t x = 0; x < side; ++x)
            atlas.first.push_back(static_cast<std::uint32_t>(count + row.first[x]));
        count += row.samples.size();
        atlas.covered += row.covered;
        atlas.shared += row.shared;
    }
    if (count > kMostReceivers) failTooLarge();
    atlas.first.push_back(static_cast<std::uint32_t>(count));
    // Resizing briefly holds the receivers of earlier textures twice.
    checkReceiverMemory(count * kReceiverBytes, count, budget);
    receivers.positions.resize(count);
    receivers.normals.resize(count);
    parallelFor(side, [&](std::size_t y) {
        std::size_t at = starts[y];
        for (const TexelSample& sample : rows[y].samples) {
            placement.place(chart.sources[sample.triangle], sample.barycentric,
                            receivers.positions[at], receivers.normals[at]);
            ++at;
        }
    });
}

}  // namespace

TexelReceivers::TexelReceivers(const PosedScene& posed, const VertexReceivers& vertices,
                               const TexelSettings& settings, const MemoryBudget& budget)
    : posed_(posed), settings_(settings) {
    const std::size_t materials = posed.scene().materials.size();
    const Placement placement(posed, vertices);
    std::vector<Chart> charts(materials);
    for (std::size_t r = 0; r < vertices.ranges().size(); ++r) {
        const VertexRange& range = vertices.ranges()[r];
        if (range.count == 0) continue;
        const Primitive& primitive = placement.primitive(range);
        const MeshInstance& instance = posed.meshes()[range.instance];
        const std::vector<glm::vec2>& uvs =
            posed.texcoords({instance.mesh, range.primitive, instance.deformed}, settings.uv_set);
        if (uvs.empty()) {
            ++without_uvs_;
            continue;
        }
        Chart& chart = charts[static_cast<std::size_t>(primitive.material)];
        for (std::uint32_t t = 0; t < elementsOf(primitive); ++t) {
            if (placement.isDegenerate(range, t)) continue;  // a degenerate triangle is invisible
            chart.triangles.push_back(uvTriangle(uvs, cornersOf(primitive, t), settings.size));
            chart.sources.push_back({static_cast<std::uint32_t>(r), t});
        }
    }
    const auto used = static_cast<std::size_t>(
        std::ranges::count_if(charts, [](const Chart& chart) { return !chart.triangles.empty(); }));
    const auto side = static_cast<std::size_t>(settings.size);
    if (used * side * side > kMostTexels) failTooLarge();
    atlas_of_material_.assign(materials, -1);
    for (std::size_t material = 0; material < charts.size(); ++material) {
        if (charts[material].triangles.empty()) continue;
        atlas_of_material_[material] = static_cast<int>(atlases_.size());
        TexelAtlas& atlas = atlases_.emplace_back();
        atlas.material = static_cast<int>(material);
        rasterize(charts[material], placement, settings.size, atlas, receivers_, budget);
    }
    if (atlases_.empty())
        throw Error(ErrorKind::kInput,
                    "no visible triangle has TEXCOORD_" + std::to_string(settings.uv_set), "",
                    "use " + Parameter::kTarget + " vertices, or another " + Parameter::kUvSet);
}

SurfaceLookup TexelReceivers::lookup() const {
    return [this](std::span<const float> values, std::uint32_t key, const glm::vec2& barycentric) {
        const KeyOrigin origin = posed_.drawList().originOf(key);
        const Primitive& primitive = posed_.primitive(origin);
        const MeshInstance& instance = posed_.meshes()[origin.instance];
        const auto& uvs = posed_.texcoords({instance.mesh, origin.primitive, instance.deformed},
                                           settings_.uv_set);
        const int place = atlas_of_material_[static_cast<std::size_t>(primitive.material)];
        if (place < 0 || uvs.empty() || !isOfTriangles(primitive)) return glm::vec3(0);
        const TexelAtlas& atlas = atlases_[static_cast<std::size_t>(place)];
        const Corners corners = cornersOf(primitive, origin.element);
        const double second = double{barycentric.x}, third = double{barycentric.y};
        const glm::dvec2 uv = (1 - second - third) * glm::dvec2(uvs[corners.vertex[0]]) +
                              second * glm::dvec2(uvs[corners.vertex[1]]) +
                              third * glm::dvec2(uvs[corners.vertex[2]]);
        const auto side = static_cast<std::size_t>(settings_.size);
        // Clamped, since fract() can round up to 1.
        const glm::dvec2 within = glm::fract(uv) * static_cast<double>(settings_.size);
        const std::size_t x = std::min(static_cast<std::size_t>(within.x), side - 1);
        const std::size_t y = std::min(static_cast<std::size_t>(within.y), side - 1);
        glm::vec3 sum(0);
        const std::uint32_t first = atlas.first[y * side + x], end = atlas.first[y * side + x + 1];
        for (std::size_t i = first; i < end; ++i)
            sum += glm::vec3(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
        return first == end ? sum : sum / static_cast<float>(end - first);
    };
}

std::vector<float> TexelReceivers::pixels(const TexelAtlas& atlas, std::span<const float> values,
                                          std::size_t components, int padding) const {
    const std::size_t texels = atlas.first.size() - 1;
    std::vector<float> result(texels * components, 0.0F);
    std::vector<char> filled(texels, 0);
    std::vector<double> mean(components, 0.0);
    std::size_t known = 0;
    for (std::size_t texel = 0; texel < texels; ++texel) {
        const std::uint32_t first = atlas.first[texel], end = atlas.first[texel + 1];
        if (first == end) continue;
        filled[texel] = 1;
        ++known;
        for (std::size_t c = 0; c < components; ++c) {
            double sum = 0;
            for (std::size_t i = first; i < end; ++i)
                sum += double{values[i * components + c]};
            const double value = sum / (end - first);
            result[texel * components + c] = static_cast<float>(value);
            mean[c] += value;
        }
    }
    if (known == 0) return result;
    const auto nearest = nearestFilled(filled, settings_.size, padding);
    for (std::size_t texel = 0; texel < texels; ++texel) {
        if (filled[texel]) continue;
        const auto from = static_cast<std::size_t>(std::max(nearest[texel], 0));
        for (std::size_t c = 0; c < components; ++c)
            result[texel * components + c] =
                nearest[texel] >= 0 ? result[from * components + c]
                                    : static_cast<float>(mean[c] / static_cast<double>(known));
    }
    return result;
}

std::vector<std::int32_t> nearestFilled(const std::vector<char>& filled, int size, int reach) {
    const auto side = static_cast<std::size_t>(size);
    const int most = std::min(reach, size / 2);
    const auto wrapped = [&](int i) { return static_cast<std::size_t>((i + size) % size); };
    constexpr int kNone = std::numeric_limits<int>::max();
    // For each texel: the vertical offset to the nearest filled texel in the same column.
    std::vector<int> offsets(filled.size(), kNone);
    parallelFor(side, [&](std::size_t x) {
        for (int y = 0; y < size; ++y)
            for (int d = 0; d <= most && offsets[wrapped(y) * side + x] == kNone; ++d)
                for (const int offset : {d, -d})
                    if (filled[wrapped(y + offset) * side + x])
                        offsets[wrapped(y) * side + x] = offset;
    });
    std::vector<std::int32_t> result(filled.size(), -1);
    parallelFor(side, [&](std::size_t y) {
        for (int x = 0; x < size; ++x) {
            int best = reach * reach + 1;
            for (int d = 0; d <= most && d * d < best; ++d) {
                for (const int dx : {d, -d}) {
                    const std::size_t from = wrapped(x + dx);
                    const int dy = offsets[y * side + from];
                    if (dy == kNone || dx * dx + dy * dy >= best) continue;
                    best = dx * dx + dy * dy;
                    result[y * side + static_cast<std::size_t>(x)] =
                        static_cast<std::int32_t>(wrapped(static_cast<int>(y) + dy) * side + from);
                }
            }
        }
    });
    return result;
}

}  // namespace peeler
