// SPDX-License-Identifier: Apache-2.0
// Conversion of a band's fragments to batches of hits.
#include <algorithm>
#include <utility>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/fragments/supersampling.h"
#include "core/scene/draw_list.h"
#include "formats/rays/hit_columns.h"

namespace peeler {
namespace {

/// The number of hits per batch. A batch and one of its columns fit into the cache of one core, but
/// are large enough for efficient writing.
constexpr std::size_t kHitsAtOnce = std::size_t{1} << 14;

/// Returns a channel's vectors, one per fragment; empty if the band lacks the channel.
template <class Vector>
std::span<const Vector> vectorsOf(const LayeredImage& band, Channel channel) {
    const auto& components = infoOf(channel).components;
    for (const FragmentArray& array : band.extra) {
        if (!std::ranges::equal(array.channels, components)) continue;
        if (array.type != PixelType::kFloat) {
            throw Error(ErrorKind::kInternal, "hits need 32-bit channels",
                        std::string(infoOf(channel).name));
        }
        return array.as<Vector>();
    }
    return {};
}

/// Returns a material's index in the scene's file, or 0xFFFFFFFF for glTF's default material.
std::uint32_t materialIn(const Scene& scene, int material) {
    // The scene's last material is glTF's default material, which the file does not list.
    const auto index = static_cast<std::size_t>(material);
    return index + 1 < scene.materials.size() ? static_cast<std::uint32_t>(index) : 0xFFFFFFFFU;
}

}  // namespace

HitReader::HitReader(PosedScene posed, std::span<const HitColumn> columns, bool positions)
    : posed_(std::move(posed)),
      positions_(positions),
      camera_z_(std::ranges::find(columns, kCameraZColumn, &HitColumn::name) != columns.end()) {
    if (std::ranges::find(columns, kBaseColorColumn, &HitColumn::name) != columns.end())
        colors_.emplace(posed_);
    const std::vector<std::uint32_t> ordinals = posed_.instanceOrdinals();
    for (std::size_t i = 0; i < ordinals.size(); ++i) {
        const MeshInstance& instance = posed_.meshes()[i];
        instances_.push_back({static_cast<std::uint32_t>(instance.node),
                              static_cast<std::uint32_t>(instance.mesh), ordinals[i]});
    }
    for (const DrawnSurface& surface : posed_.drawList().surfaces()) {
        const Primitive& primitive =
            posed_.primitives(posed_.meshes()[surface.instance])[surface.primitive];
        materials_.push_back(materialIn(posed_.scene(), primitive.material));
    }
}

void HitReader::read(const Bundle& bundle, const LayeredImage& band,
                     const std::function<void(const HitBatch&)>& use) const {
    const std::size_t all = band.fragments();
    parallelFor((all + kHitsAtOnce - 1) / kHitsAtOnce, [&](std::size_t part) {
        const std::size_t first = part * kHitsAtOnce;
        readSome(bundle, band, first, std::min(kHitsAtOnce, all - first), use);
    });
}

void HitReader::readSome(const Bundle& bundle, const LayeredImage& band, std::size_t first,
                         std::size_t size, const std::function<void(const HitBatch&)>& use) const {
    Storage storage;
    HitBatch hits;
    hits.first = first;
    hits.size = size;
    hits.instances = instances_;
    const auto cut = [&](auto values) {
        return values.empty() ? values : values.subspan(first, size);
    };
    hits.facing = cut(vectorsOf<float>(band, Channel::kFacing));
    hits.barycentrics = cut(vectorsOf<glm::vec2>(band, Channel::kBarycentric));
    hits.normals = cut(vectorsOf<glm::vec3>(band, Channel::kNormal));
    hits.geometric_normals = cut(vectorsOf<glm::vec3>(band, Channel::kGeometricNormal));
    place(band.extra.at(0).as<std::uint32_t>().subspan(first, size), storage, hits);
    measure(bundle, band, storage, hits);
    use(hits);
}

/// Finds the triangles of the hits by their keys.
void HitReader::place(std::span<const std::uint32_t> keys, Storage& storage, HitBatch& hits) const {
    const DrawList& list = posed_.drawList();
    storage.places.resize(hits.size);
    for (std::size_t i = 0; i < hits.size; ++i) {
        const std::uint32_t index = list.surfaceOf(keys[i]);
        const DrawnSurface& surface = list.surfaces()[index];
        storage.places[i] = {surface.instance, surface.in_mesh + (keys[i] - surface.first_key),
                             materials_[index]};
    }
    hits.places = storage.places;
}

/// Computes distances and, if requested, camera Z, positions and base colours.
void HitReader::measure(const Bundle& bundle, const LayeredImage& band, Storage& storage,
                        HitBatch& hits) const {
    hits.t = std::span(band.z).subspan(hits.first, hits.size);
    const View& view = bundle.view;
    if ((bundle.parallel() || view.rays) && !positions_ && !camera_z_ && !colors_) return;
    storage.t.resize(hits.size);
    storage.camera_z.resize(camera_z_ ? hits.size : 0);
    storage.positions.resize(positions_ ? hits.size : 0);
    storage.base_colors.resize(colors_ ? hits.size : 0);
    const auto width = static_cast<std::size_t>(band.window.width());
    const auto after = std::ranges::upper_bound(band.offsets, hits.first);
    auto pixel = static_cast<std::size_t>(after - band.offsets.begin()) - 1;
    for (std::size_t i = 0; i < hits.size; ++pixel) {
        const std::size_t end = std::min(band.offsets[pixel + 1] - hits.first, hits.size);
        if (i == end) continue;
        const int x = band.window.x0 + static_cast<int>(pixel % width);
        const int y = band.window.y0 + static_cast<int>(pixel / width);
        const double scale = bundle.tScale(x, y);
        if (colors_)
            colors_->ofRay(view, {x, y}, band, hits.first + i,
                           std::span(storage.base_colors).subspan(i, end - i));
        const double along_axis = camera_z_ ? cameraZScale(view, x, y) : 1;
        for (; i < end; ++i) {
            const auto z = static_cast<double>(hits.t[i]);
            storage.t[i] = static_cast<float>(z * scale);
            if (camera_z_) storage.camera_z[i] = static_cast<float>(z * along_axis);
            if (positions_)
                storage.positions[i] = worldPosition(view, x + view.sample.x, y + view.sample.y, z);
        }
    }
    hits.t = storage.t;
    hits.camera_z = storage.camera_z;
    hits.positions = storage.positions;
    hits.base_colors = storage.base_colors;
}

}  // namespace peeler
