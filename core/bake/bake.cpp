// SPDX-License-Identifier: Apache-2.0
#include "core/bake/bake.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/bake/integrators.h"
#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/capture/bands.h"
#include "core/rays/bundle.h"

namespace peeler {
namespace {

constexpr std::size_t kReceiversAtOnce = 4096;  // that a thread takes
// Hits nearer than this share of the distance of rays are taken for the receiver's own surface:
// between rays a surface is known as a plane, which a curved one leaves by less.
constexpr double kOwnSurface = 0.2;

/// Where receivers are among the rays of a bundle.
class RayLattice {
  public:
    explicit RayLattice(const Bundle& bundle)
        : view_(bundle.view),
          origin_(bundle.origin()),
          right_(bundle.right()),
          up_(bundle.up()),
          direction_(bundle.direction()),
          rays_a_unit_(bundle.view.width / bundle.size().x),
          own_surface_(static_cast<float>(kOwnSurface / rays_a_unit_)) {
        const double depth = view_.projection.far - view_.projection.near;
        z_step_ = {static_cast<float>(-depth), static_cast<float>(depth)};
    }

    struct Place {
        int x = 0, y = 0;     // the nearest ray
        glm::vec2 offset{0};  // from it, in rays, y down
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

    /// The next fragment along the hits. Those of the nearest ray are followed, as planes, to the
    /// receiver's own.
    VisibleHit next(const DirectedHits& hits, const Place& place) const {
        const LayeredImage& band = hits.band;
        const std::size_t pixel = band.pixelIndex(place.x, place.y);
        const auto slopes = band.color.as<const glm::vec2>();
        const glm::vec2 step = place.offset * z_step_;
        const float sign = hits.forward ? 1.0F : -1.0F;
        VisibleHit seen;
        for (std::uint32_t f = band.offsets[pixel]; f < band.offsets[pixel + 1]; ++f) {
            const float z = band.z[f] + glm::dot(slopes[f], step);
            const float distance = sign * (z - place.t);
            if (distance > own_surface_ && distance < seen.distance) seen = {f, distance};
        }
        return seen;
    }

  private:
    const View& view_;
    glm::dvec3 origin_, right_, up_, direction_;
    double rays_a_unit_;
    float own_surface_;
    glm::vec2 z_step_{0};  // from depth a ray (y up) to Z a ray (y down)
};

/// Takes the bands of a bundle and lets the receivers whose rays they have see them.
class ReceiverSink final : public Sink {
  public:
    ReceiverSink(const Bundle& bundle, const Receivers& receivers, Integrator& integrator,
                 std::vector<Sum>& sums)
        : bundle_(bundle), receivers_(receivers), integrator_(integrator), sums_(sums) {}

    void begin(const Plan&) override {}
    void finish() override {}
    void write(LayeredImage&& band) override {
        integrator_.beginBand(band);
        const RayLattice lattice(bundle_);
        const glm::vec3 direction(bundle_.direction());
        const DirectedHits ahead{band, true, direction}, back{band, false, -direction};
        const float side = integrator_.looksInside() ? -1.0F : 1.0F;
        const std::size_t groups = (receivers_.size() + kReceiversAtOnce - 1) / kReceiversAtOnce;
        parallelFor(groups, [&](std::size_t group) {
            const std::size_t end = std::min(receivers_.size(), (group + 1) * kReceiversAtOnce);
            for (std::size_t r = group * kReceiversAtOnce; r < end; ++r) {
                const float cosine = side * glm::dot(receivers_.normals[r], direction);
                if (cosine == 0) continue;
                const glm::dvec3& position = receivers_.positions[r];
                const RayLattice::Place place = lattice.placeOf(position);
                if (place.y < band.window.y0 || place.y >= band.window.y1) continue;
                const DirectedHits& hits = cosine > 0 ? ahead : back;
                integrator_.add(hits, lattice.next(hits, place), position, std::abs(cosine),
                                sums_[r]);
            }
        });
    }

  private:
    const Bundle& bundle_;
    const Receivers& receivers_;
    Integrator& integrator_;
    std::vector<Sum>& sums_;
};

/// Lattices of successive bundles are turned and shifted against each other: what falls between the
/// rays of one is met by others.
RayGrid gridOf(const BakeSettings& settings, int bundle) {
    constexpr double kGolden = 0.6180339887498949;
    // Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences": R2.
    constexpr double kR2X = 0.7548776662466927, kR2Y = 0.5698402909980532;
    const auto fraction = [&](double step) { return std::fmod(0.5 + step * bundle, 1.0); };
    RayGrid grid;
    grid.resolution = settings.resolution;
    grid.roll = 2 * std::numbers::pi * fraction(kGolden);
    grid.shift = {fraction(kR2X), fraction(kR2Y)};
    return grid;
}

/// What the receivers need has to leave room for the bundles. Throws Error (kMemory) before it is
/// allocated.
void checkMemory(std::uint64_t bytes, std::size_t receivers, const MemoryBudget& budget) {
    const std::uint64_t needed = residentBytes() + bytes;
    if (budget == 0 || needed < budget) return;
    throw Error(ErrorKind::kMemory,
                "the memory budget is " + mebibytesText(budget) + ", and the scene and its " +
                    std::to_string(receivers) + " receivers take " + mebibytesText(needed) +
                    " besides the bundles",
                budget.where(), "raise it, or bake for fewer vertices or texels");
}

}  // namespace

std::vector<float> bake(HitSource& source, const Receivers& receivers, const BakeSettings& settings,
                        const CaptureSettings& capture, const SurfaceLookup& lookup,
                        const Progress& progress) {
    const std::size_t components = componentsOf(settings.quantity);
    const auto integrator = makeIntegrator(settings, {source.posed(), lookup});
    // The values of this round, and of the one before.
    const std::size_t kept = integrator->rounds() > 1 ? 2 : 1;
    checkMemory(receivers.size() * (sizeof(Sum) + kept * components * sizeof(float)),
                receivers.size(), capture.memory);
    std::vector<float> values(receivers.size() * components);
    const std::optional<Bounds> all = source.posed().bounds();
    if (!all) return values;
    CaptureSettings hits = capture;
    hits.hit_mode = HitMode::kSloped;
    hits.depth_clamp = true;
    hits.color_type = PixelType::kFloat;
    hits.channels = integrator->channels();
    const auto directions = hemisphereDirections(std::max(1, settings.directions / 2));
    const auto steps = static_cast<double>(directions.size()) * integrator->rounds();
    double done = 0;
    std::vector<Sum> sums(receivers.size());
    std::vector<float> gathered;
    for (int round = 0; round < integrator->rounds(); ++round) {
        if (round > 0) gathered = values;
        integrator->beginRound(gathered);
        sums.assign(receivers.size(), {});
        for (std::size_t i = 0; i < directions.size(); ++i) {
            const Bundle bundle = parallelBundle("bundle", *all, *all, directions[i],
                                                 gridOf(settings, static_cast<int>(i)));
            source.plan(bundle.view, hits);
            ReceiverSink sink(bundle, receivers, *integrator, sums);
            source.capture(sink);
            if (progress) progress(++done / steps);
        }
        for (std::size_t r = 0; r < receivers.size(); ++r)
            integrator->finish(sums[r], values.data() + r * components);
    }
    return values;
}

}  // namespace peeler
