// SPDX-License-Identifier: Apache-2.0
// The table of columns, and how a fragment becomes a hit.
#include "formats/rays/hit_columns.h"

#include <algorithm>
#include <cstring>

#include "core/base/parallel.h"
#include "core/capture/supersampling.h"
#include "core/image/layered_image.h"
#include "formats/file/byte_buffer.h"

namespace peeler {
namespace {

constexpr std::size_t kHitsAtOnce = std::size_t{1} << 16;

void storeIndex(std::size_t value, std::byte* out) {
    storeNumber(static_cast<std::uint32_t>(value), out);
}

}  // namespace

std::span<const HitColumn> hitColumns() {
    using enum NumberType;
    static const HitColumn kColumns[] = {
        {"t_hit",
         kFloat,
         {"t"},
         [](const Hit& h, std::byte* out) { storeNumber(static_cast<float>(h.t), out); }},
        {"geometry_ids",
         kUint32,
         {"geometry"},
         [](const Hit& h, std::byte* out) { storeIndex(h.origin.instance, out); }},
        {"primitive_ids",
         kUint32,
         {"primitive"},
         [](const Hit& h, std::byte* out) { storeIndex(h.origin.in_mesh, out); }},
        {"primitive_uvs",
         kFloat,
         {"u", "v"},
         [](const Hit& h, std::byte* out) { storeNumber(h.barycentric, out); }},
        {"facing",
         kInt32,
         {"facing"},
         [](const Hit& h, std::byte* out) {
             storeNumber(static_cast<std::int32_t>(h.facing), out);
         }},
        {"normals",
         kFloat,
         {"nx", "ny", "nz"},
         [](const Hit& h, std::byte* out) { storeNumber(h.normal, out); }},
        {"primitive_normals",
         kFloat,
         {"ngx", "ngy", "ngz"},
         [](const Hit& h, std::byte* out) { storeNumber(h.geometric_normal, out); }},
        {"node_ids",
         kUint32,
         {"node"},
         [](const Hit& h, std::byte* out) {
             storeIndex(static_cast<std::size_t>(h.instance->node), out);
         }},
        {"mesh_ids",
         kUint32,
         {"mesh"},
         [](const Hit& h, std::byte* out) {
             storeIndex(static_cast<std::size_t>(h.instance->mesh), out);
         }},
        {"instance_ids",
         kUint32,
         {"instance"},
         [](const Hit& h, std::byte* out) { storeIndex(h.ordinal, out); }},
        {"material_ids",
         kUint32,
         {"material"},
         [](const Hit& h, std::byte* out) { storeNumber(h.material, out); }},
    };
    return kColumns;
}

std::vector<Channel> hitChannels() {
    return {Channel::kNormal, Channel::kGeometricNormal, Channel::kFacing, Channel::kBarycentric};
}

HitReader::HitReader(PosedScene posed)
    : posed_(std::move(posed)), ordinals_(posed_.instanceOrdinals()) {}

void HitReader::read(const Bundle& bundle, std::size_t index, const LayeredImage& band,
                     const std::function<void(std::span<const Hit>)>& use) {
    const FragmentChannel key = findChannel(band, kKeyChannel),
                          facing = findChannel(band, "facing");
    std::vector<FragmentChannel> vectors;
    for (const char* name :
         {"N.X", "N.Y", "N.Z", "Ng.X", "Ng.Y", "Ng.Z", "barycentric.U", "barycentric.V"})
        vectors.push_back(findChannel(band, name));
    const auto hit_at = [&](std::size_t f, int x, int y, double scale) {
        Hit hit;
        std::uint32_t number = 0;
        std::memcpy(&number, key.data(f), sizeof number);
        const auto z = static_cast<double>(band.z[f]);
        hit.t = z * scale;
        hit.position =
            worldPosition(bundle.view, x + bundle.view.sample.x, y + bundle.view.sample.y, z);
        hit.origin = posed_.drawList().originOf(number);
        hit.instance = &posed_.meshes()[hit.origin.instance];
        hit.primitive = &posed_.primitive(hit.origin);
        // The last material of a scene is glTF's default one, which is in no file.
        const auto material = static_cast<std::size_t>(hit.primitive->material);
        hit.material = material + 1 < posed_.scene().materials.size()
                           ? static_cast<std::uint32_t>(material)
                           : 0xFFFFFFFFU;
        hit.ordinal = ordinals_[hit.origin.instance];
        hit.facing = facing.value(f);
        // Channels have normals on the side that the ray comes from, hits have them on the front.
        hit.normal =
            hit.facing * glm::vec3(vectors[0].value(f), vectors[1].value(f), vectors[2].value(f));
        hit.geometric_normal =
            hit.facing * glm::vec3(vectors[3].value(f), vectors[4].value(f), vectors[5].value(f));
        hit.barycentric = {vectors[6].value(f), vectors[7].value(f)};
        hit.bundle = static_cast<std::uint32_t>(index);
        return hit;
    };
    const auto width = static_cast<std::size_t>(band.window.width());
    const std::size_t pixels = band.window.pixels();
    for (std::size_t first = 0; first < pixels;) {
        // Hits are read by whole pixels, at least one at a time.
        std::size_t last = first + 1;
        while (last < pixels && band.offsets[last + 1] - band.offsets[first] <= kHitsAtOnce)
            ++last;
        const std::size_t begin = band.offsets[first];
        hits_.resize(band.offsets[last] - begin);
        parallelFor((last - first + width - 1) / width, [&](std::size_t part) {
            const std::size_t end = std::min(last, first + (part + 1) * width);
            for (std::size_t p = first + part * width; p < end; ++p) {
                if (band.count(p) == 0) continue;
                const int x = band.window.x0 + static_cast<int>(p % width);
                const int y = band.window.y0 + static_cast<int>(p / width);
                const double scale = bundle.tScale(x, y);
                for (std::size_t f = band.offsets[p]; f < band.offsets[p + 1]; ++f)
                    hits_[f - begin] = hit_at(f, x, y, scale);
            }
        });
        use(hits_);
        first = last;
    }
}

}  // namespace peeler
