// SPDX-License-Identifier: Apache-2.0
#include "core/bake/integrators.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <peeler/layered_image.h>
#include "core/fragments/supersampling.h"
#include "core/scene/elements.h"
#include "core/shading/environment_maps.h"

namespace peeler {
namespace {

class Occlusion final : public Integrator {
  public:
    /// `sky`: whether only upward directions bring light.
    explicit Occlusion(bool sky) : sky_(sky) {}
    void add(const VisibleHit& seen, const glm::dvec3&, float cosine, Sum& sum) const override {
        sum.weight += cosine;
        if (seen.nothing() && (!sky_ || seen.direction.y > 0)) sum.value.x += cosine;
    }

  private:
    bool sky_;
};

class BentNormal final : public Integrator {
  public:
    void add(const VisibleHit& seen, const glm::dvec3&, float cosine, Sum& sum) const override {
        if (seen.nothing()) sum.value += cosine * seen.direction;
    }
    void finish(const Sum& sum, float* out) const override {
        const float length = glm::length(sum.value);
        const glm::vec3 normal = length > 0 ? sum.value / length : glm::vec3(0);
        std::copy_n(&normal.x, 3, out);
    }
};

class Thickness final : public Integrator {
  public:
    explicit Thickness(double max_distance) : max_distance_(static_cast<float>(max_distance)) {}
    bool looksInside() const override { return true; }
    void add(const VisibleHit& seen, const glm::dvec3&, float cosine, Sum& sum) const override {
        const float distance = std::min(seen.distance, max_distance_);
        if (!std::isfinite(distance)) return;  // no opposite side: the surface is open
        sum.weight += cosine;
        sum.value.x += cosine * distance;
    }

  private:
    float max_distance_;
};

/// Irradiance from the environment and from surfaces. Surfaces are Lambertian: they reflect ρ/π of
/// the irradiance on their front, or on both sides if the material is double-sided. Metals reflect
/// nothing.
class Irradiance final : public Integrator {
  public:
    Irradiance(const BakeSettings& settings, const IntegratorSources& sources)
        : sources_(sources), bounces_(settings.bounces) {
        const Scene& scene = sources.posed.scene();
        if (scene.environment) environment_.emplace(*scene.environment, settings.directions);
    }
    int rounds() const override { return bounces_ + 1; }
    std::vector<Channel> channels() const override {
        return {Channel::kBaseColor, Channel::kEmissive, Channel::kRoughnessMetallic};
    }
    void beginRound(std::span<const float> gathered) override { gathered_ = gathered; }
    void beginBand(const LayeredImage& band) override {
        keys_ = findChannel(band, kKeyChannel);
        metallic_ = findChannel(band, "material.metallic");
        constexpr const char* kNames[] = {"baseColor.R", "baseColor.G", "baseColor.B",
                                          "emissive.R",  "emissive.G",  "emissive.B"};
        for (std::size_t i = 0; i < colors_.size(); ++i)
            colors_[i] = findChannel(band, kNames[i]);
    }
    void add(const VisibleHit& seen, const glm::dvec3& position, float cosine,
             Sum& sum) const override {
        sum.weight += cosine;
        if (!seen.nothing())
            sum.value += cosine * radiance(glm::dvec3(seen.direction), seen.fragment, position);
        else if (environment_)
            sum.value += cosine * environment_->radiance(seen.direction);
    }
    void finish(const Sum& sum, float* out) const override {
        const glm::vec3 mean = sum.weight > 0 ? sum.value / sum.weight : glm::vec3(0);
        for (int i = 0; i < 3; ++i)
            out[i] = std::numbers::pi_v<float> * mean[i];
    }

  private:
    glm::vec3 radiance(const glm::dvec3& direction, std::uint32_t fragment,
                       const glm::dvec3& position) const {
        const std::uint32_t key = keys_.id(fragment);
        WorldElement element = elementOf(sources_.posed, key);
        placeCorners(sources_.posed, element);
        const Material& material =
            sources_.posed.scene().materials[static_cast<std::size_t>(element.primitive->material)];
        const bool front = glm::dot(element.normal(), direction) <= 0;
        if (!front && !material.double_sided) return glm::vec3(0);
        const auto color = [&](std::size_t first) {
            return glm::vec3(colors_[first].value(fragment), colors_[first + 1].value(fragment),
                             colors_[first + 2].value(fragment));
        };
        const glm::vec3 emitted = color(3);
        if (gathered_.empty()) return emitted;
        const auto weight = element.weightsAt(position, direction);
        const glm::vec3 arriving = sources_.lookup(gathered_, key, glm::vec2(weight[1], weight[2]));
        const float share = (1 - metallic_.value(fragment)) * std::numbers::inv_pi_v<float>;
        return emitted + share * color(0) * arriving;
    }

    IntegratorSources sources_;
    int bounces_;
    std::optional<EnvironmentSamples> environment_;
    std::span<const float> gathered_;
    FragmentChannel keys_, metallic_;
    std::array<FragmentChannel, 6> colors_;
};

struct Quantity {
    std::size_t components;
    std::unique_ptr<Integrator> (*make)(const BakeSettings& settings,
                                        const IntegratorSources& sources);
};

/// The table of quantities, in the order of BakeQuantity.
constexpr Quantity kQuantities[] = {
    {1,
     [](const BakeSettings&, const IntegratorSources&) -> std::unique_ptr<Integrator> {
         return std::make_unique<Occlusion>(false);
     }},
    {3,
     [](const BakeSettings&, const IntegratorSources&) -> std::unique_ptr<Integrator> {
         return std::make_unique<BentNormal>();
     }},
    {1,
     [](const BakeSettings&, const IntegratorSources&) -> std::unique_ptr<Integrator> {
         return std::make_unique<Occlusion>(true);
     }},
    {1,
     [](const BakeSettings& settings, const IntegratorSources&) -> std::unique_ptr<Integrator> {
         return std::make_unique<Thickness>(settings.max_distance);
     }},
    {3,
     [](const BakeSettings& settings,
        const IntegratorSources& sources) -> std::unique_ptr<Integrator> {
         return std::make_unique<Irradiance>(settings, sources);
     }},
};

const Quantity& rowOf(BakeQuantity quantity) {
    return kQuantities[static_cast<std::size_t>(quantity)];
}

}  // namespace

std::size_t componentsOf(BakeQuantity quantity) {
    return rowOf(quantity).components;
}

std::unique_ptr<Integrator> makeIntegrator(const BakeSettings& settings,
                                           const IntegratorSources& sources) {
    return rowOf(settings.quantity).make(settings, sources);
}

}  // namespace peeler
