// SPDX-License-Identifier: Apache-2.0
#include "core/capture/captured_fragments.h"

#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "core/base/parallel.h"
#include "core/scene/elements.h"
#include "core/scene/view.h"

namespace peeler {
namespace {

/// World to pixels of the picture, y down.
class PixelProjection {
  public:
    explicit PixelProjection(const View& view)
        : rays_(view), camera_from_world_(glm::inverse(view.camera_to_world)) {}

    /// False if the point is not in front of the camera.
    bool project(const glm::dvec3& world, glm::dvec2& pixel) const {
        const glm::dvec3 point(camera_from_world_ * glm::dvec4(world, 1));
        if (rays_.perspective() && !(point.z < 0)) return false;
        pixel = rays_.pixel(point);
        return true;
    }

  private:
    PixelRays rays_;
    glm::dmat4 camera_from_world_;
};

/// What all fragments of a band share.
struct Band {
    explicit Band(const FragmentSources& s)
        : sources(s),
          now(s.view),
          next(s.next ? s.next->view : s.view),
          ordinals(s.posed.instanceOrdinals()) {}

    const FragmentSources& sources;
    PixelProjection now, next;
    std::vector<std::uint32_t> ordinals;  // of every instance among those of its node
};

/// Everything about the fragment at hand.
struct Fragment {
    glm::dvec2 at{0};  // in the picture
    double z = 0;
    WorldElement element;
    // The rest, and the element's corners, only if a channel asks for it.
    glm::dvec3 direction{0};         // of the pixel's ray; not of unit length
    std::array<double, 3> weight{};  // of the corners
};

void findPoint(const Band& band, Fragment& f) {
    const View& view = band.sources.view;
    placeCorners(band.sources.posed, f.element);
    const glm::dvec3 origin = worldPosition(view, f.at.x, f.at.y, 0);
    f.direction = worldPosition(view, f.at.x, f.at.y, 1) - origin;
    f.weight = f.element.weightsAt(origin, f.direction);
}

// One function a channel: its components, as doubles, which hold any id.

void normalOfTriangle(const Band&, const Fragment& f, double* out) {
    glm::dvec3 normal = f.element.normal();
    if (glm::dot(normal, f.direction) > 0) normal = -normal;
    const double size = glm::length(normal);
    normal = size > 0 ? normal / size : -glm::normalize(f.direction);
    std::copy_n(&normal.x, 3, out);
}

void position(const Band& band, const Fragment& f, double* out) {
    const glm::dvec3 world = worldPosition(band.sources.view, f.at.x, f.at.y, f.z);
    std::copy_n(&world.x, 3, out);
}

void facing(const Band&, const Fragment& f, double* out) {
    *out = glm::dot(f.element.normal(), f.direction) > 0 ? -1 : 1;
}

void motion(const Band& band, const Fragment& f, double* out) {
    const NextFrame* next = band.sources.next;
    glm::dvec2 before, after;
    if (!next || !band.now.project(f.element.weighted(f.weight), before)) return;
    WorldElement moved = f.element;
    placeCorners(next->posed, moved);
    if (!band.next.project(moved.weighted(f.weight), after)) return;
    out[0] = after.x - before.x;
    out[1] = after.y - before.y;
}

void identity(const Band& band, const Fragment& f, double* out) {
    const WorldElement& element = f.element;
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
    *out = glm::distance(worldPosition(view, f.at.x, f.at.y, f.z),
                         worldPosition(view, f.at.x, f.at.y, 0));
}

/// How a channel follows from Z and primitive; none: a shader says it.
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

void storeValue(double value, PixelType type, std::byte* to) {
    if (type == PixelType::kHalf) {
        const std::uint16_t bits = imath_float_to_half(static_cast<float>(value));
        std::memcpy(to, &bits, sizeof bits);
    } else if (type == PixelType::kFloat) {
        const auto number = static_cast<float>(value);
        std::memcpy(to, &number, sizeof number);
    } else {
        const auto number = static_cast<std::uint32_t>(value);
        std::memcpy(to, &number, sizeof number);
    }
}

/// Fills in the channels of one fragment after the other.
class ChannelFiller {
  public:
    ChannelFiller(const FragmentSources& sources, std::span<const Channel> channels,
                  std::span<FragmentArray> arrays)
        : band_(sources), channels_(channels), arrays_(arrays) {
        for (const Channel channel : channels) {
            const Evaluation evaluation = evaluationOf(channel);
            evaluations_.push_back(evaluation);
            shaded_components_ += evaluation.evaluate ? 0 : infoOf(channel).components.size();
            needs_point_ = needs_point_ || evaluation.needs_point;
        }
    }

    void fill(std::size_t fragment, const glm::dvec2& at, float z) const {
        const FragmentSources& sources = band_.sources;
        Fragment f;
        f.at = at;
        f.z = static_cast<double>(z);
        f.element = elementOf(sources.posed, sources.keys[fragment]);
        if (needs_point_) findPoint(band_, f);
        const float* shaded = shaded_components_ == 0
                                  ? nullptr
                                  : sources.values + sources.shaded[fragment] * shaded_components_;
        for (std::size_t c = 0; c < channels_.size(); ++c) {
            FragmentArray& array = arrays_[c];
            std::array<double, 4> values{};
            if (evaluations_[c].evaluate) {
                evaluations_[c].evaluate(band_, f, values.data());
            } else {
                std::copy_n(shaded, array.components(), values.data());
                shaded += array.components();
            }
            std::byte* to = array.data.data() + fragment * array.stride();
            for (std::size_t i = 0; i < array.components(); ++i, to += pixelTypeSize(array.type))
                storeValue(values[i], array.type, to);
        }
    }

  private:
    Band band_;
    std::span<const Channel> channels_;
    std::span<FragmentArray> arrays_;
    std::vector<Evaluation> evaluations_;
    std::size_t shaded_components_ = 0;
    bool needs_point_ = false;
};

}  // namespace

void appendChannels(const FragmentSources& sources, std::span<const Channel> channels,
                    LayeredImage& image) {
    if (channels.empty()) return;
    const std::size_t first = image.extra.size();
    for (const Channel channel : channels) {
        image.extra.push_back(emptyArray(channel, image.color.type));
        FragmentArray& array = image.extra.back();
        array.data.resize(image.fragments() * array.stride());
    }
    const ChannelFiller filler(sources, channels, std::span(image.extra).subspan(first));
    const auto width = static_cast<std::size_t>(image.window.width());
    parallelFor(static_cast<std::size_t>(image.window.height()), [&](std::size_t row) {
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t pixel = row * width + x;
            const glm::dvec2 at(image.window.x0 + static_cast<double>(x),
                                image.window.y0 + static_cast<double>(row));
            for (std::uint32_t f = image.offsets[pixel]; f < image.offsets[pixel + 1]; ++f)
                filler.fill(f, at + sources.view.sample, image.z[f]);
        }
    });
}

namespace {

struct RefinedHit {
    double z;
    std::uint32_t key, shaded;
};

bool precedes(const RefinedHit& a, const RefinedHit& b) {
    return a.z < b.z || (a.z == b.z && a.key < b.key);
}

}  // namespace

double refineHits(const FragmentSources& sources, LayeredImage& image,
                  std::span<std::uint32_t> keys, std::span<std::uint32_t> shaded) {
    const View& view = sources.view;
    const glm::dvec3 eye(view.camera_to_world[3]), axis(-view.camera_to_world[2]);
    const auto width = static_cast<std::size_t>(image.window.width());
    const auto height = static_cast<std::size_t>(image.window.height());
    std::vector<double> largest(height);
    parallelFor(height, [&](std::size_t row) {
        thread_local std::vector<RefinedHit> hits;
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t pixel = row * width + x;
            const std::uint32_t begin = image.offsets[pixel], end = image.offsets[pixel + 1];
            if (begin == end) continue;
            const glm::dvec2 at = glm::dvec2(image.window.x0 + static_cast<double>(x),
                                             image.window.y0 + static_cast<double>(row)) +
                                  view.sample;
            const glm::dvec3 origin = worldPosition(view, at.x, at.y, 0);
            const glm::dvec3 direction = worldPosition(view, at.x, at.y, 1) - origin;
            hits.clear();
            for (std::uint32_t f = begin; f < end; ++f) {
                WorldElement element = elementOf(sources.posed, keys[f]);
                placeCorners(sources.posed, element);
                const auto weight = element.weightsAt(origin, direction);
                const double before = static_cast<double>(image.z[f]);
                double z = glm::dot(element.weighted(weight) - eye, axis);
                if (!std::isfinite(z)) z = before;
                largest[row] = std::max(largest[row], std::abs(z - before));
                hits.push_back({z, keys[f], shaded[f]});
            }
            std::sort(hits.begin(), hits.end(), precedes);
            for (std::uint32_t f = begin; f < end; ++f) {
                image.z[f] = static_cast<float>(hits[f - begin].z);
                keys[f] = hits[f - begin].key;
                shaded[f] = hits[f - begin].shaded;
            }
        }
    });
    return height == 0 ? 0 : *std::max_element(largest.begin(), largest.end());
}

}  // namespace peeler
