// SPDX-License-Identifier: Apache-2.0
// Building blocks for the readers of Gaussian splats: the scene that they make, and the encodings
// that formats share.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <peeler/scene.h>
#include "formats/meshes/mesh_parts.h"

namespace peeler {

/// The number of spherical harmonics of degrees 0 to 3.
inline constexpr std::size_t kMostHarmonics = 16;
/// The variance that the paper's code adds to projected splats, in square pixels.
inline constexpr double kDilation = 0.3;

/// A Gaussian splat of a file.
struct Splat {
    glm::dvec3 mean{0};
    glm::dvec3 scale{0};              ///< standard deviations along its own axes
    glm::dvec4 rotation{0, 0, 0, 1};  ///< quaternion x, y, z, w of any length
    double opacity = 0;               ///< 0 to 1
    std::array<glm::dvec3, kMostHarmonics> harmonics{};
};

/// The scene of a file of splats: one node, whose mesh has one primitive.
class SplatScene {
  public:
    /// Checks the limits of memory and geometry for `count` splats.
    SplatScene(MeshFile& file, std::uint64_t count, int degree);

    /// The properties of all splats, such as their dilation.
    Splats& properties() { return *splats_; }

    /// Adds a splat. Leaves it out if its numbers are not finite floats or if a scale is negative;
    /// a rotation of zeros becomes the identity. finish() warns about both.
    void add(const Splat& splat);
    Scene finish();

  private:
    /// Splats that have a problem.
    struct Fault {
        std::uint64_t count = 0, first = 0;
    };
    void note(Fault& fault) const;
    void warnOf(const Fault& fault, const std::string& what);

    MeshFile& file_;
    std::shared_ptr<Splats> splats_ = std::make_shared<Splats>();
    Primitive primitive_;
    std::uint64_t number_ = 0;  ///< of the next splat in the file
    Fault unusable_, unturned_;
};

/// Returns the opacity of a logit.
double sigmoid(double logit);
/// Returns the coefficient of degree 0 that makes a colour component, 0 to 1.
double harmonicOf(double color);
/// Returns the degree that has this many coefficients after the first, or nothing.
std::optional<int> degreeOf(std::uint64_t coefficients);
/// Returns a unit quaternion from its largest component's index and the others, in order.
std::array<double, 4> withLargest(std::uint32_t largest, const std::array<double, 3>& others);

}  // namespace peeler
