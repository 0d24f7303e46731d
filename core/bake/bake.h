// SPDX-License-Identifier: Apache-2.0
// What points on surfaces see around them, gathered from bundles of rays.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include <peeler/capture_settings.h>
#include "core/fragments/hit_source.h"

namespace peeler {

/// Points on surfaces, in world space, on the side that their unit normals point to. A normal of
/// length 0 marks one that sees nothing: its values are 0.
struct Receivers {
    std::vector<glm::dvec3> positions;
    std::vector<glm::vec3> normals;

    std::size_t size() const { return positions.size(); }
};

/// What is baked, and how many floats a receiver gets.
enum class BakeQuantity : std::uint8_t {
    kAmbientOcclusion,  ///< 1: cosine-weighted share of the hemisphere that is not occluded
    kBentNormal,        ///< 3: unit, the mean unoccluded direction, world space
    kSkyVisibility,     ///< 1: what of a uniform sky (around +Y) arrives, 1 on an open plain
    kThickness,         ///< 1: mean distance to the other side, scene units
    kIrradiance  ///< 3: light that arrives, W/m² per W/(m² sr) of what the sources give off
};
/// How many floats a receiver's value has.
std::size_t componentsOf(BakeQuantity quantity);

struct BakeSettings {
    BakeQuantity quantity = BakeQuantity::kAmbientOcclusion;
    int directions = 256;  ///< over the sphere, in opposite pairs: one bundle serves two
    int resolution = 512;  ///< of bundles, where there are any: rays along the longer side
    double max_distance = std::numeric_limits<double>::infinity();  ///< what is farther is not seen
    int bounces = 1;  ///< of light that reaches a receiver; irradiance
};

/// What surfaces show to others: the irradiance that the receivers have gathered so far, at a point
/// of a surface. Given by whoever knows where the receivers lie.
using SurfaceLookup = std::function<glm::vec3(std::span<const float> irradiance, std::uint32_t key,
                                              const glm::vec2& barycentric)>;

/// Is told how many bytes the process will have resident at most while receivers see what has been
/// planned.
using ReportMemory = std::function<void(std::uint64_t bytes)>;

/// Values of every receiver, componentsOf() each. If the source prefers lines, and nothing is asked
/// of what is seen but how far it is, every receiver has lines of its own (gatherByLines()). Else
/// every direction is a parallel bundle that covers the scene (Szirmay-Kalos & Purgathofer 1998;
/// Hermes et al. 2010; Tokuyoshi et al. 2011), of which a receiver's ray is the one nearest to it.
/// Memory does not grow with the number of directions.
/// `lookup` is needed for kIrradiance with several bounces. Throws what captures throw, and Error
/// (kMemory) if the receivers' sums alone are over the budget.
/// `tell` is called before lines are looked along, or before each bundle.
std::vector<float> bake(HitSource& source, const Receivers& receivers, const BakeSettings& settings,
                        const CaptureSettings& capture, const SurfaceLookup& lookup,
                        const Progress& progress, const ReportMemory& tell = {});

/// The most that bake() would tell with the same arguments, whose progress this has likewise. Lines
/// are not looked along, and bundles are counted but not captured. Throws like bake().
std::uint64_t forecastBake(HitSource& source, const Receivers& receivers,
                           const BakeSettings& settings, const CaptureSettings& capture,
                           const Progress& progress);

}  // namespace peeler
