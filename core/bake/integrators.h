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
#include "core/rays/bundle.h"

namespace peeler {

/// A direction that receivers look along, and the hits that a band of its bundle has.
struct Look {
    const Bundle& bundle;
    const LayeredImage& band;
    bool forward = true;     // along the bundle's direction, else against it
    glm::vec3 direction{0};  // unit, away from the receiver
};

/// What a receiver sees along a look: the fragment, and how far it is.
struct Seen {
    std::optional<std::uint32_t> fragment;
    float distance = std::numeric_limits<float>::infinity();
};

/// Sums of weighted values of a receiver.
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
    /// Before a round, with what the ones before have gathered.
    virtual void beginRound(std::span<const float>) {}
    /// Before the bands of a look.
    virtual void beginBand(const LayeredImage&) {}
    virtual void add(const Look& look, const Seen& seen, const glm::dvec3& position, float cosine,
                     Sum& sum) const = 0;
    /// Writes componentsOf() numbers.
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
