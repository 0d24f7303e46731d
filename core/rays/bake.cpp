// SPDX-License-Identifier: Apache-2.0
#include "core/rays/bake.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "core/bands.h"
#include "core/environment_maps.h"
#include "core/error.h"
#include "core/fragment_channel.h"
#include "core/parallel.h"
#include "core/placed_element.h"
#include "core/rays/bundle.h"
#include "core/rays/directions.h"
#include "core/supersampling.h"

namespace peeler {
namespace {

constexpr std::size_t kReceiversAtOnce = 4096;
// Nearer hits are taken for the receiver's own surface, as a share of the distance of rays: between
// rays a surface is known as a plane, which a curved one leaves by less than this.
constexpr double kOwnSurface = 0.2;

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
    Place placeOf(const glm::vec3& position) const {
        const glm::dvec3 from = glm::dvec3(position) - origin_;
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

    /// The next fragment along the look. Those of the nearest ray are followed, as planes, to the
    /// receiver's own.
    Seen next(const Look& look, const Place& place) const {
        const LayeredImage& band = look.band;
        const std::size_t pixel = band.pixelIndex(place.x, place.y);
        const auto slopes = band.color.as<const glm::vec2>();
        const glm::vec2 step = place.offset * z_step_;
        const float sign = look.forward ? 1.0F : -1.0F;
        Seen seen;
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

/// What a quantity makes of what receivers see.
class Gathering {
  public:
    virtual ~Gathering() = default;
    /// Whether receivers look into the surface they are on, not away from it.
    virtual bool looksInside() const { return false; }
    virtual std::vector<Channel> channels() const { return {}; }
    /// Times that all bundles are traced.
    virtual int rounds() const { return 1; }
    /// Before a round, with what the ones before have gathered.
    virtual void beginRound(std::span<const float>) {}
    /// Before the bands of a look.
    virtual void beginBand(const LayeredImage&) {}
    virtual void add(const Look& look, const Seen& seen, const glm::vec3& position, float cosine,
                     Sum& sum) const = 0;
    /// Writes componentsOf() numbers.
    virtual void finish(const Sum& sum, float* out) const {
        *out = sum.weight > 0 ? sum.value.x / sum.weight : 0;
    }
};

class Occlusion final : public Gathering {
  public:
    /// `sky`: of all directions only those upward bring light.
    Occlusion(double max_distance, bool sky)
        : max_distance_(static_cast<float>(max_distance)), sky_(sky) {}
    void add(const Look& look, const Seen& seen, const glm::vec3&, float cosine,
             Sum& sum) const override {
        sum.weight += cosine;
        if (seen.distance > max_distance_ || !seen.fragment)
            if (!sky_ || look.direction.y > 0) sum.value.x += cosine;
    }

  private:
    float max_distance_;
    bool sky_;
};

class BentNormal final : public Gathering {
  public:
    explicit BentNormal(double max_distance) : max_distance_(static_cast<float>(max_distance)) {}
    void add(const Look& look, const Seen& seen, const glm::vec3&, float cosine,
             Sum& sum) const override {
        if (seen.distance > max_distance_ || !seen.fragment) sum.value += cosine * look.direction;
    }
    void finish(const Sum& sum, float* out) const override {
        const float length = glm::length(sum.value);
        const glm::vec3 normal = length > 0 ? sum.value / length : glm::vec3(0);
        std::copy_n(&normal.x, 3, out);
    }

  private:
    float max_distance_;
};

class Thickness final : public Gathering {
  public:
    explicit Thickness(double max_distance) : max_distance_(static_cast<float>(max_distance)) {}
    bool looksInside() const override { return true; }
    void add(const Look&, const Seen& seen, const glm::vec3&, float cosine,
             Sum& sum) const override {
        const float distance = std::min(seen.distance, max_distance_);
        if (!std::isfinite(distance)) return;  // an open surface has no other side there
        sum.weight += cosine;
        sum.value.x += cosine * distance;
    }

  private:
    float max_distance_;
};

/// Lambert's surfaces send back ρ/π of what they get, on their front (on both sides if the material
/// says so); metals do not.
class Irradiance final : public Gathering {
  public:
    Irradiance(const Scene& scene, const SceneContents& contents, const DrawList& list,
               const BakeSettings& settings, const SurfaceLookup& lookup)
        : scene_(scene),
          contents_(contents),
          list_(list),
          lookup_(lookup),
          bounces_(settings.bounces),
          max_distance_(static_cast<float>(settings.max_distance)) {
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
    void add(const Look& look, const Seen& seen, const glm::vec3& position, float cosine,
             Sum& sum) const override {
        sum.weight += cosine;
        if (seen.fragment && seen.distance <= max_distance_)
            sum.value += cosine * radiance(look, *seen.fragment, position);
        else if (environment_)
            sum.value += cosine * environment_->radiance(look.direction);
    }
    void finish(const Sum& sum, float* out) const override {
        const glm::vec3 mean = sum.weight > 0 ? sum.value / sum.weight : glm::vec3(0);
        for (int i = 0; i < 3; ++i)
            out[i] = std::numbers::pi_v<float> * mean[i];
    }

  private:
    glm::vec3 radiance(const Look& look, std::uint32_t fragment, const glm::vec3& position) const {
        const std::uint32_t key = keys_.id(fragment);
        PlacedElement element = elementOf(scene_, contents_, list_, key);
        placeCorners(scene_, contents_, element);
        const auto& material =
            scene_.materials[static_cast<std::size_t>(element.primitive->material)];
        const bool front = glm::dot(element.normal(), glm::dvec3(look.direction)) <= 0;
        if (!front && !material.double_sided) return glm::vec3(0);
        const auto color = [&](std::size_t first) {
            return glm::vec3(colors_[first].value(fragment), colors_[first + 1].value(fragment),
                             colors_[first + 2].value(fragment));
        };
        const glm::vec3 emitted = color(3);
        if (gathered_.empty()) return emitted;
        const auto weight = element.weightsAt(glm::dvec3(position), glm::dvec3(look.direction));
        const glm::vec3 arriving = lookup_(gathered_, key, glm::vec2(weight[1], weight[2]));
        const float share = (1 - metallic_.value(fragment)) * std::numbers::inv_pi_v<float>;
        return emitted + share * color(0) * arriving;
    }

    const Scene& scene_;
    const SceneContents& contents_;
    const DrawList& list_;
    const SurfaceLookup& lookup_;
    int bounces_;
    float max_distance_;
    std::optional<EnvironmentSamples> environment_;
    std::span<const float> gathered_;
    FragmentChannel keys_, metallic_;
    std::array<FragmentChannel, 6> colors_;
};

/// The bands of a bundle, and the receivers whose rays they have.
class ReceiverSink final : public Sink {
  public:
    ReceiverSink(const Bundle& bundle, const Receivers& receivers, Gathering& gathering,
                 std::vector<Sum>& sums)
        : bundle_(bundle), receivers_(receivers), gathering_(gathering), sums_(sums) {}

    void begin(const Plan&) override {}
    void finish() override {}
    void write(const LayeredImage& band) override {
        gathering_.beginBand(band);
        const RayLattice lattice(bundle_);
        const glm::vec3 direction(bundle_.direction());
        const Look ahead{bundle_, band, true, direction}, back{bundle_, band, false, -direction};
        const float side = gathering_.looksInside() ? -1.0F : 1.0F;
        const std::size_t groups = (receivers_.size() + kReceiversAtOnce - 1) / kReceiversAtOnce;
        parallelFor(groups, [&](std::size_t group) {
            const std::size_t end = std::min(receivers_.size(), (group + 1) * kReceiversAtOnce);
            for (std::size_t r = group * kReceiversAtOnce; r < end; ++r) {
                const float cosine = side * glm::dot(receivers_.normals[r], direction);
                if (cosine == 0) continue;
                const RayLattice::Place place = lattice.placeOf(receivers_.positions[r]);
                if (place.y < band.window.y0 || place.y >= band.window.y1) continue;
                const Look& look = cosine > 0 ? ahead : back;
                gathering_.add(look, lattice.next(look, place), receivers_.positions[r],
                               std::abs(cosine), sums_[r]);
            }
        });
    }

  private:
    const Bundle& bundle_;
    const Receivers& receivers_;
    Gathering& gathering_;
    std::vector<Sum>& sums_;
};

std::unique_ptr<Gathering> gatheringOf(const Renderer& renderer, const Scene& scene,
                                       const SceneContents& contents, const BakeSettings& settings,
                                       const SurfaceLookup& lookup) {
    switch (settings.quantity) {
        case BakeQuantity::kAmbientOcclusion:
            return std::make_unique<Occlusion>(settings.max_distance, false);
        case BakeQuantity::kBentNormal:
            return std::make_unique<BentNormal>(settings.max_distance);
        case BakeQuantity::kSkyVisibility:
            return std::make_unique<Occlusion>(settings.max_distance, true);
        case BakeQuantity::kThickness:
            return std::make_unique<Thickness>(settings.max_distance);
        case BakeQuantity::kIrradiance:
            return std::make_unique<Irradiance>(scene, contents, renderer.drawList(), settings,
                                                lookup);
    }
    throw Error(ErrorKind::kInternal, "a quantity without a way to gather it");
}

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

/// What the receivers need besides the bundles has to leave room for those. Said before it is
/// allocated.
void checkMemory(std::uint64_t bytes, std::size_t receivers, std::uint64_t budget) {
    constexpr std::uint64_t kMegabyte = 1ULL << 20;
    const std::uint64_t needed = residentBytes() + bytes;
    if (budget == 0 || needed < budget) return;
    const auto megabytes = [](std::uint64_t size) {
        return std::to_string((size + kMegabyte - 1) / kMegabyte) + "M";
    };
    throw Error(ErrorKind::kMemory,
                "the memory budget is " + megabytes(budget) + ", and the scene and its " +
                    std::to_string(receivers) + " receivers take " + megabytes(needed) +
                    " besides the bundles",
                "--memory " + megabytes(budget), "raise it, or bake for fewer vertices or texels");
}

}  // namespace

std::size_t componentsOf(BakeQuantity quantity) {
    constexpr std::size_t kComponents[] = {1, 3, 1, 1, 3};
    return kComponents[static_cast<std::size_t>(quantity)];
}

std::vector<float> bake(Renderer& renderer, const Scene& scene, const SceneContents& contents,
                        const Receivers& receivers, const BakeSettings& settings,
                        const CaptureSettings& capture, const SurfaceLookup& lookup,
                        const Progress& progress) {
    const std::size_t components = componentsOf(settings.quantity);
    const auto gathering = gatheringOf(renderer, scene, contents, settings, lookup);
    // The values of this round, and of the one before.
    const std::size_t kept = gathering->rounds() > 1 ? 2 : 1;
    checkMemory(receivers.size() * (sizeof(Sum) + kept * components * sizeof(float)),
                receivers.size(), capture.memory);
    std::vector<float> values(receivers.size() * components);
    const std::optional<Bounds> all = bounds(scene, contents);
    if (!all) return values;
    CaptureSettings hits = capture;
    hits.hits = Hits::kSloped;
    hits.depth_clamp = true;
    hits.color_type = PixelType::kFloat;
    hits.channels = gathering->channels();
    const auto directions = hemisphereDirections(std::max(1, settings.directions / 2));
    const auto steps = static_cast<double>(directions.size()) * gathering->rounds();
    double done = 0;
    std::vector<Sum> sums(receivers.size());
    std::vector<float> gathered;
    for (int round = 0; round < gathering->rounds(); ++round) {
        if (round > 0) gathered = values;
        gathering->beginRound(gathered);
        sums.assign(receivers.size(), {});
        for (std::size_t i = 0; i < directions.size(); ++i) {
            const Bundle bundle = parallelBundle("bundle", *all, *all, directions[i],
                                                 gridOf(settings, static_cast<int>(i)));
            renderer.plan(bundle.view, hits);
            ReceiverSink sink(bundle, receivers, *gathering, sums);
            Sink* const sinks[] = {&sink};
            renderer.capture(sinks);
            if (progress) progress(++done / steps);
        }
        for (std::size_t r = 0; r < receivers.size(); ++r)
            gathering->finish(sums[r], values.data() + r * components);
    }
    return values;
}

}  // namespace peeler
