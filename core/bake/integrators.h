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
    /// Scene units; infinite if there is no surface within BakeSettings::max_distance.
    float distance = std::numeric_limits<float>::infinity();
    std::uint32_t fragment = kNoFragment;  ///< index in the current band, if any (beginBand())

    bool nothing() const { return distance == std::numeric_limits<float>::infinity(); }
};

/// The weighted sum of a receiver's values, and the sum of the weights.
struct Sum {
    glm::vec3 value{0};
    float weight = 0;
};

/// An integrator, which accumulates visible hits into the value of one baked quantity.
class Integrator {
  public:
    virtual ~Integrator() = default;
    /// Whether receivers look into the surface they are on, not away from it.
    virtual bool looksInside() const { return false; }
    /// Returns the channels that add() needs besides the distance. Only hits of bundles have
    /// channels.
    virtual std::vector<Channel> channels() const { return {}; }
    /// Returns the number of rounds, each of which traces all directions.
    virtual int rounds() const { return 1; }
    /// Called before each round with every receiver's values from the round before (empty in the
    /// first round).
    virtual void beginRound(std::span<const float>) {}
    /// Called before the hits of a band are added.
    virtual void beginBand(const LayeredImage&) {}
    /// Adds the hit seen by a receiver at `position` (world space). `cosine` (above 0) is that of
    /// the angle between the hit's direction and the receiver's normal, or the opposite normal if
    /// looksInside().
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
