// SPDX-License-Identifier: Apache-2.0
#include "core/rays/ray_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include <peeler/error.h>
#include <peeler/scene.h>
#include "core/base/parallel.h"
#include "core/scene/view.h"

namespace peeler {

struct MappedRay {
    std::span<const float> t;
    const Solids* solids;
    const RayMapSettings& settings;
    std::span<const std::size_t> path_materials;
    RayMapScratch& scratch;
};

namespace {

constexpr std::array kBaseColorNames = {"R", "G", "B", "A"};
constexpr float kNowhere = std::numeric_limits<float>::infinity();

void first(const MappedRay& ray, float* out) {
    *out = ray.t.empty() ? kNowhere : ray.t.front();
}

void last(const MappedRay& ray, float* out) {
    *out = ray.t.empty() ? kNowhere : ray.t.back();
}

void count(const MappedRay& ray, float* out) {
    *out = static_cast<float>(ray.t.size());
}

void thickness(const MappedRay& ray, float* out) {
    double length = 0;
    ray.scratch.spans.forEachInside(
        ray.t, [&](const RayInterval& interval) { length += interval.length(); });
    *out = static_cast<float>(length);
}

void pathLength(const MappedRay& ray, float* out) {
    for (const double length : ray.scratch.paths)
        *out++ = static_cast<float>(length);
}

void transmission(const MappedRay& ray, float* out) {
    const std::vector<double>& mu = ray.settings.attenuation;
    double exponent = 0;
    for (std::size_t i = 0; i < ray.path_materials.size(); ++i)
        if (ray.path_materials[i] < mu.size())
            exponent -= mu[ray.path_materials[i]] * ray.scratch.paths[i];
    *out = static_cast<float>(std::exp(exponent));
}

void parity(const MappedRay& ray, float* out) {
    *out = static_cast<float>(std::ranges::count_if(
        ray.scratch.spans.hits(), [](const auto& solid) { return solid.item.odd(); }));
}

/// Returns the length of the intersection of `a` and `b`, which must be sorted.
float common(std::span<const RayInterval> a, std::span<const RayInterval> b) {
    double length = 0;
    for (std::size_t i = 0, k = 0; i < a.size() && k < b.size();) {
        length += std::max(0.0, std::min(a[i].end, b[k].end) - std::max(a[i].begin, b[k].begin));
        if (a[i].end < b[k].end) {
            ++i;
        } else {
            ++k;
        }
    }
    return static_cast<float>(length);
}

void overlap(const MappedRay& ray, float* out) {
    RayMapScratch& scratch = ray.scratch;
    for (std::size_t part = 0; part < 2; ++part) {
        const auto belongs = [&](const SolidSpan& span) {
            return ray.settings
                       .parts[part][static_cast<std::size_t>(ray.solids->all()[span.solid].node)] !=
                   0;
        };
        uniteSpans(scratch.spans.all(), belongs, part == 0 ? scratch.inside : scratch.other);
    }
    *out = common(scratch.inside, scratch.other);
}

void baseColor(const MappedRay& ray, float* out) {
    std::fill_n(out, kBaseColorNames.size(), 0.0F);
    for (const glm::vec4& color : ray.scratch.colors) {
        const float passing = 1 - out[3];
        if (passing <= 0) break;
        for (int i = 0; i < 4; ++i)
            out[i] += passing * color[i];
    }
}

constexpr RayMapInfo kMaps[] = {
    {RayMap::kFirst, "first", "t of the first hit", PixelType::kFloat, first},
    {RayMap::kLast, "last", "t of the last hit", PixelType::kFloat, last},
    {RayMap::kCount, "count", "number of hits", PixelType::kUint, count},
    {RayMap::kThickness, "thickness", "length inside solids, from entry to exit", PixelType::kFloat,
     thickness, true, false, true},
    {RayMap::kPathLength, "path-length", "length inside each material", PixelType::kFloat,
     pathLength, true, true, true},
    {RayMap::kTransmission, "transmission",
     "fraction of X-rays that pass, from the materials' attenuation; in a picture 1 is black, 0 "
     "white",
     PixelType::kFloat, transmission, true, true},
    {RayMap::kParity, "parity", "number of solids hit an odd number of times", PixelType::kUint,
     parity, true},
    {RayMap::kOverlap, "overlap", "length inside both parts", PixelType::kFloat, overlap, true,
     true, true},
    {RayMap::kBaseColor, "base-color",
     "picture without light: base colours of all hits, composited; R, G, B, A, linear, "
     "premultiplied",
     PixelType::kFloat, baseColor},
};

/// Returns the name in a form that is valid in an EXR channel name. Replaces control characters,
/// and dots, because dots separate the parts of a channel name. Shortens the name, since EXR allows
/// 255 bytes for the whole channel name.
std::string channelName(const std::string& name) {
    constexpr std::size_t kLongest = 200;
    std::string result;
    for (const char c : name)
        result += c == '.' || static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? '_' : c;
    if (result.size() <= kLongest) return result;
    std::size_t end = kLongest;
    while (end > 0 && (static_cast<unsigned char>(result[end]) & 0xC0U) == 0x80U)
        --end;  // keep UTF-8 sequences whole
    result.resize(end);
    return result;
}

/// Returns the materials of the scene's solids, sorted.
std::vector<std::size_t> materialsOf(const Solids& solids, const PosedScene& posed) {
    std::set<std::size_t> found;
    for (const Solid& solid : solids.all()) {
        const auto& primitives = posed.primitives(posed.meshes()[solid.instance]);
        for (const std::size_t i : solid.primitives)
            found.insert(static_cast<std::size_t>(primitives[i].material));
    }
    return {found.begin(), found.end()};
}

}  // namespace

std::span<const RayMapInfo> rayMapTable() {
    return kMaps;
}

RayMaps::RayMaps(const PosedScene& posed, const Solids* solids, RayMapSettings settings)
    : solids_(solids), settings_(std::move(settings)) {
    const Scene& scene = posed.scene();
    std::vector<RayMap> once;
    for (const RayMap map : settings_.maps)
        if (std::ranges::find(once, map) == once.end()) once.push_back(map);
    settings_.maps = std::move(once);
    for (std::vector<char>& part : settings_.parts)
        part.resize(scene.nodes.size());
    for (const RayMap map : settings_.maps) {
        needs_solids_ |= infoOf(map).solids;
        needs_spans_ |= infoOf(map).nested;
        if (map == RayMap::kBaseColor) surface_colors_.emplace(posed);
        needs_paths_ |= map == RayMap::kPathLength || map == RayMap::kTransmission;
    }
    if (needs_solids_ && solids_ == nullptr) {
        throw Error(ErrorKind::kInternal, "the map needs solids");
    }
    if (needs_paths_) path_materials_ = materialsOf(*solids_, posed);
    path_of_.resize(scene.materials.size());
    for (std::size_t i = 0; i < path_materials_.size(); ++i)
        path_of_[path_materials_[i]] = i;

    const std::vector<std::string> names = idNames(scene).materials;
    std::set<std::string> taken;
    for (const RayMap map : settings_.maps) {
        if (map == RayMap::kBaseColor) {
            for (const char* const name : kBaseColorNames)
                channels_.push_back({map, name});
            continue;
        }
        if (map != RayMap::kPathLength) {
            channels_.push_back({map, std::string(infoOf(map).name)});
            continue;
        }
        for (const std::size_t material : path_materials_) {
            std::string name = "path." + channelName(names[material]);
            while (!taken.insert(name).second)
                name += "_" + std::to_string(material);
            channels_.push_back({map, name});
        }
    }
}

/// Adds up the path lengths per material. Walks along the ray with a stack of spans that have
/// begun. A span that has ended is removed when it reaches the top of the stack.
void RayMaps::findPaths(RayMapScratch& scratch) const {
    std::vector<SolidSpan>& open = scratch.open;
    scratch.paths.assign(path_materials_.size(), 0.0);
    open.clear();
    double at = 0;
    const auto advance = [&](double to) {
        while (!open.empty() && at < to) {
            const SolidSpan& innermost = open.back();
            if (innermost.end > at) {
                const double end = std::min(innermost.end, to);
                scratch.paths[path_of_[solids_->materialOf(innermost.key)]] += end - at;
                at = end;
            }
            if (innermost.end <= at) open.pop_back();
        }
        at = to;
    };
    for (const SolidSpan& span : scratch.spans.all()) {
        advance(span.begin);
        open.push_back(span);
    }
    advance(std::numeric_limits<double>::infinity());
}

void RayMaps::begin(const Bundle& bundle) {
    if (needs_solids_) sides_ = solids_->sides({&bundle, 1}, settings_.overlap);
}

void RayMaps::evaluate(std::span<const float> t, std::span<const std::uint32_t> keys,
                       RayMapScratch& scratch, std::span<float> out, const Ray* along) const {
    prepare(keys, scratch, along);
    evaluate(t, keys, 0, scratch, out);
}

void RayMaps::prepare(std::span<const std::uint32_t> keys, RayMapScratch& scratch,
                      const Ray* along) const {
    if (needs_solids_) scratch.spans.prepare(keys, *solids_, sides_ ? &*sides_ : nullptr, along);
}

void RayMaps::evaluate(std::span<const float> t, std::span<const std::uint32_t> keys,
                       std::size_t first, RayMapScratch& scratch, std::span<float> out) const {
    if (needs_solids_) scratch.spans.begin(first, keys.size());
    if (needs_spans_) scratch.spans.place(t, keys);
    if (needs_paths_) findPaths(scratch);
    const MappedRay ray{t, solids_, settings_, path_materials_, scratch};
    std::size_t channel = 0;
    for (const RayMap map : settings_.maps) {
        infoOf(map).evaluate(ray, out.data() + channel);
        channel += map == RayMap::kPathLength  ? path_materials_.size()
                   : map == RayMap::kBaseColor ? kBaseColorNames.size()
                                               : 1;
    }
}

void RayMaps::evaluateRows(const Bundle& bundle, const LayeredImage& band, int y0, int y1,
                           std::vector<float>& planes) const {
    const auto width = static_cast<std::size_t>(band.window.width());
    const std::size_t rows = static_cast<std::size_t>(y1 - y0), plane = rows * width;
    const std::span<const std::uint32_t> keys = band.extra[0].as<std::uint32_t>();
    planes.resize(channels_.size() * plane);
    const bool each_ray = sides_ && sides_->needRay();
    const bool scaled = !bundle.parallel() && !bundle.view.rays;  // by Bundle::tScale()
    parallelFor(rows, [&](std::size_t row) {
        scratch_.with([&](RayMapScratch& scratch) {
            scratch.values.resize(channels_.size());
            scratch.nothing.resize(channels_.size());
            scratch.colors.clear();
            evaluate({}, {}, scratch, scratch.nothing);
            const int y = y0 + static_cast<int>(row);
            const std::uint32_t* const offsets =
                band.offsets.data() + band.pixelIndex(band.window.x0, y);
            const std::size_t row_begin = offsets[0];
            if (!each_ray)
                prepare(keys.subspan(row_begin, offsets[width] - row_begin), scratch, nullptr);
            for (std::size_t i = 0; i < width; ++i) {
                const int x = band.window.x0 + static_cast<int>(i);
                const std::size_t begin = offsets[i], hits = offsets[i + 1] - begin;
                if (hits > 0) {
                    const auto ray_keys = keys.subspan(begin, hits);
                    std::span<const float> t(band.z.data() + begin, hits);
                    if (scaled) {
                        const double scale = bundle.tScale(x, y);
                        scratch.t.resize(hits);
                        for (std::size_t k = 0; k < hits; ++k)
                            scratch.t[k] = static_cast<float>(t[k] * scale);
                        t = scratch.t;
                    }
                    if (surface_colors_) {
                        scratch.colors.resize(hits);
                        surface_colors_->ofRay(bundle.view, {x, y}, band, begin, scratch.colors);
                    }
                    if (each_ray) {
                        const Ray ray = rayOf(bundle.view, glm::dvec2(x, y) + bundle.view.sample);
                        evaluate(t, ray_keys, scratch, scratch.values, &ray);
                    } else {
                        evaluate(t, ray_keys, begin - row_begin, scratch, scratch.values);
                    }
                }
                const std::vector<float>& values = hits > 0 ? scratch.values : scratch.nothing;
                for (std::size_t c = 0; c < values.size(); ++c)
                    planes[c * plane + row * width + i] = values[c];
            }
        });
    });
}

}  // namespace peeler
