// SPDX-License-Identifier: Apache-2.0
// What the quantities that are baked make of what receivers see: one class each.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/bake/bake.h"
#include "core/image/channels.h"
#include "core/image/layered_image.h"

namespace peeler {

/// The hits in a band of a bundle, as receivers see them along the bundle's direction or against
/// it.
struct DirectedHits {
    const LayeredImage& band;
    bool forward = true;     ///< along the bundle's direction, else against it
    glm::vec3 direction{0};  ///< unit, world space, away from the receiver
};

/// What a receiver sees first in a direction: a fragment of the band, and how far it is in scene
/// units; none and infinity if there is nothing.
struct VisibleHit {
    std::optional<std::uint32_t> fragment;
    float distance = std::numeric_limits<float>::infinity();
};

/// The sum of a receiver's weighted values, and of their weights.
struct Sum {
    glm::vec3 value{0};
    float weight = 0;
};

/// What a quantity makes of what receivers see.
class Integrator {
  public:
    virtual ~Integrator() = default;
    /// Whether receivers look into the surface they are on, not away from it.
    virtual bool looksInside() const { return false; }
    virtual std::vector<Channel> channels() const { return {}; }
    /// Times that all bundles are traced.
    virtual int rounds() const { return 1; }
    /// Before a round, with the values of every receiver after the round before; empty before the
    /// first.
    virtual void beginRound(std::span<const float>) {}
    /// Before the hits of a band are added.
    virtual void beginBand(const LayeredImage&) {}
    /// Adds what a receiver at `position` (world space) sees; `cosine` is that of the direction to
    /// its normal, above 0.
    virtual void add(const DirectedHits& hits, const VisibleHit& seen, const glm::dvec3& position,
                     float cosine, Sum& sum) const = 0;
    /// Writes the receiver's value, componentsOf() numbers, to `out`.
    virtual void finish(const Sum& sum, float* out) const {
        *out = sum.weight > 0 ? sum.value.x / sum.weight : 0;
    }
};

struct IntegratorSources {
    const PosedScene& posed;
    const SurfaceLookup& lookup;
};

/// The one for the settings' quantity. The sources must outlive it.
std::unique_ptr<Integrator> makeIntegrator(const BakeSettings& settings,
                                           const IntegratorSources& sources);

}  // namespace peeler
