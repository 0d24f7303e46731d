// SPDX-License-Identifier: Apache-2.0
// Gathering from bundles of rays, which any HitSource can trace.
#include "core/bake/bundle_gather.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <peeler/bundle.h>
#include "core/base/parallel.h"
#include "core/base/process_memory.h"

namespace peeler {
namespace {

constexpr std::size_t kReceiversAtOnce = 4096;  // receivers per task
// Hits nearer than this fraction of the ray spacing belong to the receiver's own surface. Each hit
// is extended as a plane to the receiver's line. A curved surface deviates from this plane by less
// than kOwnSurface.
constexpr double kOwnSurface = 0.2;

/// The positions of receivers in the ray grid of a bundle.
class RayLattice {
  public:
    RayLattice(const Bundle& bundle, double max_distance)
        : view_(bundle.view),
          origin_(bundle.origin()),
          right_(bundle.right()),
          up_(bundle.up()),
          direction_(bundle.direction()),
          rays_a_unit_(bundle.view.width / bundle.size().x),
          own_surface_(static_cast<float>(kOwnSurface / rays_a_unit_)),
          max_distance_(static_cast<float>(max_distance)) {
        const double depth = view_.projection.far - view_.projection.near;
        z_step_ = {static_cast<float>(-depth), static_cast<float>(depth)};
    }

    struct Place {
        int x = 0, y = 0;     // pixel of the ray nearest to the receiver
        glm::vec2 offset{0};  // position relative to the nearest ray, in ray spacings, y down
        float t = 0;
    };
    Place placeOf(const glm::dvec3& position) const {
        const glm::dvec3 from = position - origin_;
        const glm::dvec2 at(
            glm::dot(from, right_) * rays_a_unit_ + view_.width / 2.0 - view_.sample.x,
            -glm::dot(from, up_) * rays_a_unit_ + view_.height / 2.0 - view_.sample.y);
        Place place;
        place.x = std::clamp(static_cast<int>(std::lround(at.x)), 0, view_.width - 1);
        place.y = std::clamp(static_cast<int>(std::lround(at.y)), 0, view_.height - 1);
        place.offset = glm::vec2(at - glm::dvec2(place.x, place.y));
        place.t = static_cast<float>(glm::dot(from, direction_));
        return place;
    }

    /// Returns the next hit that the receiver sees along its nearest ray, in the ray's direction or
    /// against it. Extends each hit as a plane to the receiver, which may lie beside the ray.
    VisibleHit next(const LayeredImage& band, bool forward, const Place& place) const {
        const std::size_t pixel = band.pixelIndex(place.x, place.y);
        const auto slopes = band.color.as<const glm::vec2>();
        const glm::vec2 step = place.offset * z_step_;
        const float sign = forward ? 1.0F : -1.0F;
        VisibleHit seen;
        seen.direction = sign * glm::vec3(direction_);
        for (std::uint32_t f = band.offsets[pixel]; f < band.offsets[pixel + 1]; ++f) {
            const float z = band.z[f] + glm::dot(slopes[f], step);
            const float distance = sign * (z - place.t);
            if (!(distance > own_surface_ && distance < seen.distance) || distance > max_distance_)
                continue;
            seen.distance = distance;
            seen.fragment = f;
        }
        return seen;
    }

  private:
    const View& view_;
    glm::dvec3 origin_, right_, up_, direction_;
    double rays_a_unit_;
    float own_surface_, max_distance_;
    glm::vec2 z_step_{0};  // factors from depth slope per ray (y up) to Z slope per ray (y down)
};

/// A sink that adds the hits of a bundle's bands to the receivers whose nearest rays are in the
/// band.
class ReceiverSink final : public Sink {
  public:
    ReceiverSink(const Bundle& bundle, const GatherJob& job, std::vector<Sum>& sums)
        : bundle_(bundle), job_(job), sums_(sums) {}

    void begin(const Plan&) override {}
    void finish() override {}
    void write(LayeredImage&& band) override {
        job_.integrator.beginBand(band);
        const RayLattice lattice(bundle_, job_.settings.max_distance);
        const glm::vec3 direction(bundle_.direction());
        const float side = job_.integrator.looksInside() ? -1.0F : 1.0F;
        const Receivers& receivers = job_.receivers;
        const std::size_t groups = (receivers.size() + kReceiversAtOnce - 1) / kReceiversAtOnce;
        parallelFor(groups, [&](std::size_t group) {
            const std::size_t end = std::min(receivers.size(), (group + 1) * kReceiversAtOnce);
            for (std::size_t r = group * kReceiversAtOnce; r < end; ++r) {
                const float cosine = side * glm::dot(receivers.normals[r], direction);
                if (cosine == 0) continue;
                const glm::dvec3& position = receivers.positions[r];
                const RayLattice::Place place = lattice.placeOf(position);
                if (place.y < band.window.y0 || place.y >= band.window.y1) continue;
                job_.integrator.add(lattice.next(band, cosine > 0, place), position,
                                    std::abs(cosine), sums_[r]);
            }
        });
    }

  private:
    const Bundle& bundle_;
    const GatherJob& job_;
    std::vector<Sum>& sums_;
};

/// Returns the ray grid of a bundle. Each bundle's grid has its own rotation and shift, so that its
/// rays hit details that fall between the rays of other bundles.
RayGrid gridOf(const BakeSettings& settings, int bundle) {
    constexpr double kGolden = 0.6180339887498949;
    // The R2 sequence (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences").
    constexpr double kR2X = 0.7548776662466927, kR2Y = 0.5698402909980532;
    const auto fraction = [&](double step) { return std::fmod(0.5 + step * bundle, 1.0); };
    RayGrid grid;
    grid.resolution = settings.resolution;
    grid.roll = 2 * std::numbers::pi * fraction(kGolden);
    grid.shift = {fraction(kR2X), fraction(kR2Y)};
    return grid;
}

/// Bytes of heap memory that stay allocated after a bundle (measured).
constexpr std::uint64_t kLeftBytes = std::uint64_t{4} << 20;

/// Plans one bundle after another and calls take(bundle, plan, share) for each. `share` is the
/// fraction of the total work that is done when this bundle ends.
template <class Take>
void forEachBundle(HitSource& source, const CaptureSettings& capture, const GatherJob& job,
                   const Take& take) {
    const Bounds all = source.posed().bounds().value_or(Bounds{});
    for (std::size_t i = 0; i < job.directions.size(); ++i) {
        const Bundle bundle = parallelBundle("bundle", all, all, job.directions[i],
                                             gridOf(job.settings, static_cast<int>(i)));
        take(bundle, source.plan(bundle.view, capture),
             static_cast<double>(i + 1) / static_cast<double>(job.directions.size()));
    }
}

}  // namespace

void gatherByBundles(HitSource& source, const CaptureSettings& capture, const GatherJob& job,
                     std::vector<Sum>& sums, const Progress& progress) {
    std::uint64_t kept = 0;  // bytes that remain allocated after earlier captures
    forEachBundle(source, capture, job,
                  [&](const Bundle& bundle, const CapturePlan& plan, double share) {
                      ReceiverSink sink(bundle, job, sums);
                      if (job.tell) {
                          const std::uint64_t most = source.forecastMemory(plan, sink) + kLeftBytes;
                          job.tell(most - std::min(most, kept));
                      }
                      const std::uint64_t before = residentBytes();
                      source.capture(plan, sink);
                      const std::uint64_t after = residentBytes();
                      kept += after - std::min(before, after);
                      if (progress) progress(share);
                  });
}

std::uint64_t forecastBundles(HitSource& source, const CaptureSettings& capture,
                              const GatherJob& job, const Progress& progress) {
    std::uint64_t most = 0;
    std::vector<Sum> none;
    forEachBundle(
        source, capture, job, [&](const Bundle& bundle, const CapturePlan& plan, double share) {
            most = std::max(
                most, source.forecastMemory(plan, ReceiverSink(bundle, job, none)) + kLeftBytes);
            if (progress) progress(share);
        });
    return most;
}

}  // namespace peeler
