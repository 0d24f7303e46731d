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
    glm::vec3 direction{0};  ///< unit vector away from the receiver, world space
    /// Scene units; infinite if there is no surface within BakeSettings::max_distance.
    float distance = std::numeric_limits<float>::infinity();
    /// Index of the hit's fragment in the current band (beginBand()), or kNoFragment.
    std::uint32_t fragment = kNoFragment;

    bool nothing() const { return distance == std::numeric_limits<float>::infinity(); }
};

/// A receiver's sum of weighted values, and the sum of the weights.
struct Sum {
    glm::vec3 value{0};
    float weight = 0;
};

/// An accumulator of visible hits into one baked quantity.
class Integrator {
  public:
    virtual ~Integrator() = default;
    /// Whether receivers look into the body behind their surface instead of away from the surface.
    virtual bool looksInside() const { return false; }
    /// Returns the channels that add() needs besides the distance. Only bundles provide channels.
    virtual std::vector<Channel> channels() const { return {}; }
    /// Returns the number of rounds. Each round traces all directions.
    virtual int rounds() const { return 1; }
    /// Called before each round. `gathered` holds all receivers' values from the previous round,
    /// and is empty in the first round.
    virtual void beginRound(std::span<const float>) {}
    /// Called before the first add() of a band.
    virtual void beginBand(const LayeredImage&) {}
    /// Adds the hit that a receiver at `position` (world space) sees. `cosine` (greater than 0) is
    /// the cosine of the angle between the hit's direction and the receiver's normal. If
    /// looksInside(), the angle is measured from the opposite of the normal.
    virtual void add(const VisibleHit& seen, const glm::dvec3& position, float cosine,
                     Sum& sum) const = 0;
    /// Writes the receiver's value to `out`: componentsOf() floats.
    virtual void finish(const Sum& sum, float* out) const {
        *out = sum.weight > 0 ? sum.value.x / sum.weight : 0;
    }
};

struct IntegratorSources {
    const PosedScene& posed;
    const SurfaceLookup& lookup;
};

/// Returns the integrator of `settings.quantity`. The sources must outlive the integrator.
std::unique_ptr<Integrator> makeIntegrator(const BakeSettings& settings,
                                           const IntegratorSources& sources);

}  // namespace peeler
