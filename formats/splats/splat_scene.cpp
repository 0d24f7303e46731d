// SPDX-License-Identifier: Apache-2.0
#include "formats/splats/splat_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace peeler {
namespace {

/// The spherical harmonic of degree 0: √(1 / 4π).
constexpr double kY0 = 0.28209479177387814;

/// Converts numbers to floats. Returns false if one is NaN, infinite or too large.
template <class To, class From>
bool toFloats(const From& from, To& to) {
    for (int i = 0; i < From::length(); ++i) {
        const auto number = coordinate(from[i]);
        if (!number) return false;
        to[i] = *number;
    }
    return true;
}

}  // namespace

SplatScene::SplatScene(MeshFile& file, std::uint64_t count, int degree) : file_(file) {
    splats_->degree = degree;
    splats_->dilation = kDilation;
    const std::size_t coefficients = splats_->coefficients();
    constexpr std::size_t kShape = 2 * sizeof(glm::vec3) + sizeof(glm::vec4) + sizeof(float);
    file_.allowGeometry(count * (kShape + coefficients * sizeof(glm::vec3)));
    primitive_.topology = Topology::kPoints;
    primitive_.positions.reserve(count);
    splats_->scales.reserve(count);
    splats_->rotations.reserve(count);
    splats_->opacities.reserve(count);
    splats_->harmonics.reserve(count * coefficients);
}

void SplatScene::note(Fault& fault) const {
    if (fault.count++ == 0) fault.first = number_;
}

void SplatScene::add(const Splat& splat) {
    glm::vec3 mean, scale;
    std::array<glm::vec3, kMostHarmonics> harmonics;
    const std::size_t coefficients = splats_->coefficients();
    const double length = glm::length(splat.rotation);
    bool usable = toFloats(splat.mean, mean) && toFloats(splat.scale, scale) &&
                  glm::all(glm::greaterThanEqual(scale, glm::vec3(0))) && std::isfinite(length) &&
                  std::isfinite(splat.opacity);
    for (std::size_t i = 0; usable && i < coefficients; ++i)
        usable = toFloats(splat.harmonics[i], harmonics[i]);
    if (!usable) note(unusable_);
    if (usable) {
        if (length == 0) note(unturned_);
        primitive_.positions.push_back(mean);
        splats_->scales.push_back(scale);
        splats_->rotations.emplace_back(length > 0 ? splat.rotation / length
                                                   : glm::dvec4(0, 0, 0, 1));
        splats_->opacities.push_back(static_cast<float>(splat.opacity));
        splats_->harmonics.insert(splats_->harmonics.end(), harmonics.begin(),
                                  harmonics.begin() + static_cast<std::ptrdiff_t>(coefficients));
    }
    ++number_;
}

void SplatScene::warnOf(const Fault& fault, const std::string& what) {
    if (fault.count > 0)
        file_.warn(what + " (" + std::to_string(fault.count) + "; the first is splat " +
                   std::to_string(fault.first) + ").");
}

Scene SplatScene::finish() {
    warnOf(unusable_,
           "Splats with numbers that are infinite, NaN or too large, or with negative scales, are "
           "left out");
    warnOf(unturned_, "Splats whose rotation is zero are not turned");
    Mesh mesh;
    primitive_.splats = std::move(splats_);
    mesh.primitives.push_back(std::move(primitive_));
    file_.addNode(file_.stem(), std::move(mesh));
    return file_.finish();
}

double sigmoid(double logit) {
    return 1 / (1 + std::exp(-logit));
}

double harmonicOf(double color) {
    return (color - 0.5) / kY0;
}

std::optional<int> degreeOf(std::uint64_t coefficients) {
    for (int degree = 0; degree <= 3; ++degree)
        if (coefficients + 1 == Splats::coefficients(degree)) return degree;
    return {};
}

std::array<double, 4> withLargest(std::uint32_t largest, const std::array<double, 3>& others) {
    std::array<double, 4> all{};
    double rest = 1;
    for (std::size_t i = 0, other = 0; i < all.size(); ++i) {
        if (i == largest) continue;
        all[i] = others[other++];
        rest -= all[i] * all[i];
    }
    all.at(largest) = std::sqrt(std::max(rest, 0.0));
    return all;
}

}  // namespace peeler
