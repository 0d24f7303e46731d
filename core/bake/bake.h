// SPDX-License-Identifier: Apache-2.0
// Baking: occlusion, visibility and irradiance at surface points, gathered from bundles of rays.
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

/// Surface points in world space. Each point lies on the side of the surface to which the point's
/// unit normal points. The values of a receiver with a normal of length 0 are 0.
struct Receivers {
    std::vector<glm::dvec3> positions;
    std::vector<glm::vec3> normals;

    std::size_t size() const { return positions.size(); }
};

/// The baked quantity. Each comment below begins with the number of floats per receiver.
enum class BakeQuantity : std::uint8_t {
    kAmbientOcclusion,  ///< 1 float: cosine-weighted fraction of the hemisphere that is unoccluded
    kBentNormal,        ///< 3 floats: mean unoccluded direction, a unit vector in world space
    /// 1 float: fraction of the light of a uniform sky (+Y is up) that arrives; 1 on an open plain
    kSkyVisibility,
    kThickness,  ///< 1 float: mean distance to the opposite side, scene units
    kIrradiance  ///< 3 floats: irradiance in W/m² per W/(m² sr) of emitted radiance
};
/// Returns the number of floats in a receiver's value.
std::size_t componentsOf(BakeQuantity quantity);

struct BakeSettings {
    BakeQuantity quantity = BakeQuantity::kAmbientOcclusion;
    /// Number of directions, distributed over the sphere. Opposite directions share a bundle.
    int directions = 256;
    int resolution = 512;  ///< rays along the longer side of a bundle, if the source uses bundles
    /// Maximum length of a visibility ray, in scene units.
    double max_distance = std::numeric_limits<double>::infinity();
    int bounces = 1;  ///< number of reflections of light on its way to a receiver; irradiance only
};

/// A function that interpolates between receivers: returns the irradiance at a point of the
/// primitive that has this draw-order key. `irradiance` is the irradiance gathered so far, three
/// floats per receiver. The code that placed the receivers supplies the function.
using SurfaceLookup = std::function<glm::vec3(std::span<const float> irradiance, std::uint32_t key,
                                              const glm::vec2& barycentric)>;

/// A callback that receives a memory forecast: the peak resident bytes of the process during a
/// gather along lines, or during the next bundle.
using ReportMemory = std::function<void(std::uint64_t bytes)>;

/// Returns the values of all receivers, componentsOf() floats each. If the source prefers lines and
/// the integrator needs only distances, traces lines from each receiver (gatherByLines()).
/// Otherwise traces a parallel bundle, which covers the scene, along each direction (Szirmay-Kalos
/// & Purgathofer 1998; Hermes et al. 2010; Tokuyoshi et al. 2011); each receiver uses the ray
/// nearest to it. Memory does not grow with the number of directions. kIrradiance with several
/// bounces needs `lookup`. Throws like HitSource::capture(), and Error (kMemory) if the receivers'
/// sums alone exceed the budget. Calls `tell` before it traces lines, or before each bundle.
std::vector<float> bake(HitSource& source, const Receivers& receivers, const BakeSettings& settings,
                        const CaptureSettings& capture, const SurfaceLookup& lookup,
                        const Progress& progress, const ReportMemory& tell = {});

/// Returns the highest forecast that bake() would pass to `tell` with the same arguments. Reports
/// the same progress as bake(). Counts the hits of bundles without capturing them; traces no lines.
/// Throws like bake().
std::uint64_t forecastBake(HitSource& source, const Receivers& receivers,
                           const BakeSettings& settings, const CaptureSettings& capture,
                           const Progress& progress);

}  // namespace peeler
