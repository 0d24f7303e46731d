// SPDX-License-Identifier: Apache-2.0
#include "core/fragments/surface_channels.h"

#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/image/channels.h"
#include "core/scene/elements.h"
#include "core/scene/view.h"

namespace peeler {
namespace {

/// Projection from world space to the picture's pixels, y down.
class PixelProjection {
  public:
    explicit PixelProjection(const View& view)
        : rays_(view), camera_from_world_(glm::inverse(view.camera_to_world)) {
        if (const LensCamera* const camera = lensCameraOf(view))
            lens_.emplace(camera->lens, camera->intrinsics, Size{view.width, view.height});
    }

    /// Returns false if the camera does not see the point: one without a lens sees what is in front
    /// of it.
    bool project(const glm::dvec3& world, glm::dvec2& pixel) const {
        const glm::dvec3 point(camera_from_world_ * glm::dvec4(world, 1));
        if (lens_) {
            const auto seen = lens_->pixel(point);
            if (seen) pixel = *seen;
            return seen.has_value();
        }
        if (rays_.perspective() && !(point.z < 0)) return false;
        pixel = rays_.pixel(point);
        return true;
    }

  private:
    PixelRays rays_;
    std::optional<LensRays> lens_;
    glm::dmat4 camera_from_world_;
};

/// Data shared by all fragments of a band.
struct Band {
    explicit Band(const FragmentSources& s)
        : sources(s),
          now(s.view),
          next(s.next ? s.next->view : s.view),
          ordinals(s.posed.instanceOrdinals()) {}

    const FragmentSources& sources;
    PixelProjection now, next;
    std::vector<std::uint32_t> ordinals;  // index of each instance among the instances of its node
};

/// The ray of a pixel, in world space.
struct PixelRay : Ray {
    PixelRay(const View& view, const glm::dvec2& pixel) : Ray(rayOf(view, pixel)), at(pixel) {}

    glm::dvec2 at;  // pixel position in the picture
};

/// The fragment whose channels are evaluated.
struct Fragment {
    const PixelRay& ray;
    const RecentElements::Entry& entry;
    std::array<double, 3> weight{};  // barycentric weights; set only if a channel needs them
    double z = 0;

    const WorldElement& element() const { return entry.element; }
};

// The channel functions. Each writes a channel's components as doubles, which hold every id
// exactly.

void normalOfTriangle(const Band&, const Fragment& f, double* out) {
    if (f.element().primitive->splats) return;
    const glm::dvec3& front = f.entry.unit;
    glm::dvec3 normal = glm::dot(f.entry.normal, f.ray.direction) > 0 ? -front : front;
    if (front == glm::dvec3(0)) normal = -glm::normalize(f.ray.direction);
    std::copy_n(&normal.x, 3, out);
}

void position(const Band& band, const Fragment& f, double* out) {
    const View& view = band.sources.view;
    const glm::dvec3 world = view.rays ? f.ray.origin + f.z * f.ray.direction
                                       : worldPosition(view, f.ray.at.x, f.ray.at.y, f.z);
    std::copy_n(&world.x, 3, out);
}

void facing(const Band&, const Fragment& f, double* out) {
    *out = glm::dot(f.entry.normal, f.ray.direction) > 0 ? -1 : 1;
}

void motion(const Band& band, const Fragment& f, double* out) {
    const NextFrame* next = band.sources.next;
    glm::dvec2 before, after;
    if (!next || !band.now.project(f.element().weighted(f.weight), before)) return;
    WorldElement moved = f.element();
    placeCorners(next->posed, moved);
    if (!band.next.project(moved.weighted(f.weight), after)) return;
    out[0] = after.x - before.x;
    out[1] = after.y - before.y;
}

void identity(const Band& band, const Fragment& f, double* out) {
    const WorldElement& element = f.element();
    out[0] = element.instance->node + 1.0;
    out[1] = element.primitive->material + 1.0;
    out[2] = element.origin.in_mesh + 1.0;
    out[3] = band.ordinals[element.origin.instance] + 1.0;
}

void barycentric(const Band&, const Fragment& f, double* out) {
    out[0] = f.weight[1];
    out[1] = f.weight[2];
}

void distance(const Band& band, const Fragment& f, double* out) {
    const View& view = band.sources.view;
    *out = view.rays
               ? f.z
               : glm::distance(worldPosition(view, f.ray.at.x, f.ray.at.y, f.z), f.ray.origin);
}

/// The way to compute a channel from Z and the primitive. `evaluate` is null if a shader outputs
/// the channel.
struct Evaluation {
    void (*evaluate)(const Band&, const Fragment&, double* out) = nullptr;
    bool needs_point = false;
};

Evaluation evaluationOf(Channel channel) {
    static constexpr Evaluation kTable[] = {
        {},                        // normal
        {normalOfTriangle, true},  // geometric-normal
        {position},                // position
        {},                        // uv
        {},                        // tangent
        {},                        // base-color
        {},                        // emissive
        {},                        // roughness-metallic
        {facing, true},            // facing
        {motion, true},            // motion
        {identity},                // id
        {barycentric, true},       // barycentric
        {distance},                // distance
    };
    return kTable[static_cast<std::size_t>(channel)];
}

void storeValues(const double* values, std::size_t count, PixelType type, std::byte* to) {
    const auto store_as = [&](auto&& converted) {
        for (std::size_t i = 0; i < count; ++i) {
            const auto number = converted(values[i]);
            std::memcpy(to + i * sizeof number, &number, sizeof number);
        }
    };
    if (type == PixelType::kFloat)
        store_as([](double value) { return static_cast<float>(value); });
    else if (type == PixelType::kHalf)
        store_as([](double value) { return imath_float_to_half(static_cast<float>(value)); });
    else
        store_as([](double value) { return static_cast<std::uint32_t>(value); });
}

/// A writer of channels, one fragment at a time.
class ChannelFiller {
  public:
    ChannelFiller(const FragmentSources& sources, std::span<const Channel> channels,
                  const LayeredImage& image, std::span<FragmentArray> arrays)
        : band_(sources) {
        for (std::size_t c = 0; c < channels.size(); ++c) {
            FragmentArray& array = arrays[c];
            // Resets the array but keeps its storage.
            FragmentArray fresh = emptyArray(channels[c], image.color.type);
            fresh.data.swap(array.data);
            array = std::move(fresh);
            resizeAnew(array.data, image.fragments() * array.stride());
            const Evaluation evaluation = evaluationOf(channels[c]);
            targets_.push_back({evaluation.evaluate, array.components(), array.type, array.stride(),
                                array.data.data()});
            shaded_components_ += evaluation.evaluate ? 0 : array.components();
            needs_point_ = needs_point_ || evaluation.needs_point;
        }
    }

    /// Whether any channel needs the fragment's weights and corners.
    bool needsPoint() const { return needs_point_; }

    void fill(std::size_t fragment, const Fragment& f) const {
        const FragmentSources& sources = band_.sources;
        const float* shaded = shaded_components_ == 0
                                  ? nullptr
                                  : sources.values + sources.shaded[fragment] * shaded_components_;
        for (const Target& target : targets_) {
            std::array<double, 4> values{};
            if (target.evaluate) {
                target.evaluate(band_, f, values.data());
            } else {
                std::copy_n(shaded, target.components, values.data());
                shaded += target.components;
            }
            storeValues(values.data(), target.components, target.type,
                        target.data + fragment * target.stride);
        }
    }

  private:
    /// The destination of a channel's values.
    struct Target {
        void (*evaluate)(const Band&, const Fragment&, double* out);
        std::size_t components;
        PixelType type;
        std::size_t stride;
        std::byte* data;
    };

    Band band_;
    std::vector<Target> targets_;
    std::size_t shaded_components_ = 0;
    bool needs_point_ = false;
};

/// Calls take(part, elements, pixel, ray) for every non-empty pixel. Parts are processed in
/// parallel. All pixels of a part are processed on one thread. `corners`: whether the elements must
/// have corners.
template <class Take>
void forEachPixel(const FragmentSources& sources, bool corners, const LayeredImage& image,
                  const std::vector<Window>& parts, Take&& take) {
    parallelFor(parts.size(), [&](std::size_t part) {
        RecentElements elements(sources.posed, corners);
        const Window& rows = parts[part];
        for (int y = rows.y0; y < rows.y1; ++y) {
            for (int x = rows.x0; x < rows.x1; ++x) {
                const std::size_t pixel = image.pixelIndex(x, y);
                if (image.count(pixel) == 0) continue;
                const PixelRay ray(sources.view, glm::dvec2(x, y) + sources.view.sample);
                take(part, elements, pixel, ray);
            }
        }
    });
}

/// Returns groups of an image's rows, one group per task. Groups are large enough for
/// RecentElements to meet the same triangles again.
std::vector<Window> partsOf(const Window& window) {
    constexpr int kPixels = 1 << 14;
    const int rows = std::max(1, kPixels / std::max(1, window.width()));
    std::vector<Window> parts;
    for (int y = window.y0; y < window.y1; y += rows)
        parts.push_back({window.x0, y, window.x1, std::min(y + rows, window.y1)});
    return parts;
}

}  // namespace

void fillChannels(const FragmentSources& sources, std::span<const Channel> channels,
                  const LayeredImage& image, std::span<FragmentArray> arrays) {
    if (channels.empty()) return;
    const ChannelFiller filler(sources, channels, image, arrays);
    const bool point = filler.needsPoint();
    forEachPixel(
        sources, point, image, partsOf(image.window),
        [&](std::size_t, RecentElements& elements, std::size_t pixel, const PixelRay& ray) {
            for (std::size_t f = image.offsets[pixel]; f < image.offsets[pixel + 1]; ++f) {
                Fragment fragment{ray, elements.at(sources.keys[f])};
                fragment.z = static_cast<double>(image.z[f]);
                if (point)
                    fragment.weight = fragment.element().weightsAt(ray.origin, ray.direction);
                filler.fill(f, fragment);
            }
        });
}

namespace {

struct RefinedHit {
    double z;
    std::uint32_t key, shaded;
    std::array<double, 3> weight;
};

bool precedes(const RefinedHit& a, const RefinedHit& b) {
    return a.z < b.z || (a.z == b.z && a.key < b.key);
}

}  // namespace

double refineHits(const FragmentSources& sources, std::span<const Channel> channels,
                  LayeredImage& image, std::span<std::uint32_t> keys,
                  std::span<std::uint32_t> shaded, std::span<FragmentArray> arrays) {
    const View& view = sources.view;
    const glm::dvec3 eye(view.camera_to_world[3]), axis(-view.camera_to_world[2]);
    const ChannelFiller filler(sources, channels, image, arrays);
    const std::vector<Window> parts = partsOf(image.window);
    std::vector<double> largest(parts.size());
    std::vector<std::vector<RefinedHit>> hits_of(parts.size());
    forEachPixel(
        sources, true, image, parts,
        [&](std::size_t part, RecentElements& elements, std::size_t pixel, const PixelRay& ray) {
            std::vector<RefinedHit>& hits = hits_of[part];
            const std::size_t begin = image.offsets[pixel], end = image.offsets[pixel + 1];
            hits.clear();
            for (std::size_t f = begin; f < end; ++f) {
                const WorldElement& element = elements.at(keys[f]).element;
                const auto weight = element.weightsAt(ray.origin, ray.direction);
                const double before = static_cast<double>(image.z[f]);
                double z = glm::dot(element.weighted(weight) - eye, axis);
                if (!std::isfinite(z)) z = before;
                if (const double change = std::abs(z - before); change > largest[part])
                    largest[part] = change;
                hits.push_back({z, keys[f], shaded[f], weight});
            }
            std::sort(hits.begin(), hits.end(), precedes);
            for (std::size_t f = begin; f < end; ++f) {
                const RefinedHit& hit = hits[f - begin];
                image.z[f] = static_cast<float>(hit.z);
                keys[f] = hit.key;
                shaded[f] = hit.shaded;
                if (channels.empty()) continue;
                filler.fill(
                    f, {ray, elements.at(hit.key), hit.weight, static_cast<double>(image.z[f])});
            }
        });
    return parts.empty() ? 0 : *std::max_element(largest.begin(), largest.end());
}

}  // namespace peeler
