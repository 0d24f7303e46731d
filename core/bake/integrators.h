// SPDX-License-Identifier: Apache-2.0
// Integrators: one class for each baked quantity.
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

/// The first surface that a receiver sees along a direction.
struct VisibleHit {
    glm::vec3 direction{0};  ///< unit, world space, away from the receiver
    /// Scene units; infinite if there is nothing within the largest distance.
    float distance = std::numeric_limits<float>::infinity();
    std::uint32_t fragment = kNoFragment;  ///< in the current band, if there are bands

    bool nothing() const { return distance == std::numeric_limits<float>::infinity(); }
};

/// The sum of a receiver's weighted values, and of their weights.
struct Sum {
    glm::vec3 value{0};
    float weight = 0;
};

/// An integrator of visible hits into the value of one baked quantity.
class Integrator {
  public:
    virtual ~Integrator() = default;
    /// Whether receivers look into the surface they are on, not away from it.
    virtual bool looksInside() const { return false; }
    /// Returns the channels needed besides distance; hits of bundles have them.
    virtual std::vector<Channel> channels() const { return {}; }
    /// Returns how often all bundles are traced.
    virtual int rounds() const { return 1; }
    /// Called before each round with every receiver's values from the round before (empty in the
    /// first round).
    virtual void beginRound(std::span<const float>) {}
    /// Called before the hits of a band are added.
    virtual void beginBand(const LayeredImage&) {}
    /// Adds the hit seen by a receiver at `position` (world space). `cosine` is between the
    /// direction and its normal, above 0.
    virtual void add(const VisibleHit& seen, const glm::dvec3& position, float cosine,
                     Sum& sum) const = 0;
    /// Writes the receiver's value, componentsOf() floats, to `out`.
    virtual void finish(const Sum& sum, float* out) const {
        *out = sum.weight > 0 ? sum.value.x / sum.weight : 0;
    }
};

struct IntegratorSources {
    const PosedScene& posed;
    const SurfaceLookup& lookup;
};

/// Returns the integrator for the settings' quantity. The sources must outlive it.
std::unique_ptr<Integrator> makeIntegrator(const BakeSettings& settings,
                                           const IntegratorSources& sources);

}  // namespace peeler
