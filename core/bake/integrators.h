// SPDX-License-Identifier: Apache-2.0
// What the quantities that are baked make of what receivers see: one class each.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include <peeler/channels.h>
#include <peeler/layered_image.h>
#include "core/bake/bake.h"

namespace peeler {

/// What a receiver sees first in a direction.
struct VisibleHit {
    glm::vec3 direction{0};  ///< unit, world space, away from the receiver
    /// Scene units; infinite if there is nothing within the largest distance.
    float distance = std::numeric_limits<float>::infinity();
    std::uint32_t fragment = kNoFragment;  ///< of the band at hand, if there are bands

    bool nothing() const { return distance == std::numeric_limits<float>::infinity(); }
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
    /// Of what is seen, besides how far it is: hits of bundles have them.
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
    virtual void add(const VisibleHit& seen, const glm::dvec3& position, float cosine,
                     Sum& sum) const = 0;
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
