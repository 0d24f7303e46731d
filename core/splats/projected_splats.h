// SPDX-License-Identifier: Apache-2.0
// Gaussian splats projected to a picture.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include <peeler/capture_settings.h>
#include <peeler/view.h>
#include "core/scene/posed_scene.h"

namespace peeler {

/// A splat in a picture. Its response at the offset d from the mean is
/// G = exp(−((d.x − lean · d.y) · across)² − (d.y · down)²), its opacity there min(0.99, opacity ·
/// G). Unlike terms with the inverse of the projected covariance, these do not cancel.
struct alignas(64) ProjectedSplat {
    float x = 0, y = 0;                     ///< mean, pixels, y down
    float half_width = 0, half_height = 0;  ///< of the box with all fragments, pixels
    float lean = 0, across = 0, down = 0;
    /// Least exponent of a fragment: within 3 standard deviations, and opacity at least 1/255.
    float least = 0;
    float opacity = 0;
    float z = 0;                         ///< camera Z of the mean
    float distance = 0;                  ///< of the mean, if fragments are sorted by it; else 0
    float red = 0, green = 0, blue = 0;  ///< linear, or sRGB-encoded (SplatBlending::kDisplay)
    std::uint32_t key = 0;
};

/// The depth along rays at which a dilated splat's response is largest: the camera Z is
/// (along · r) / (rᵀ · precision · r) for the ray r = (x, y, 1) of camera space, y down, z forward.
struct SplatDepth {
    float along[3]{};
    float precision[6]{};  ///< xx, xy, xz, yy, yz, zz
};

/// The boxes with all fragments of splats, in pixels. At the end, empty boxes fill up a multiple of
/// eight.
struct SplatBoxes {
    std::vector<float> low_x, low_y, high_x, high_y;
};

/// The splats that can have fragments in a picture, in order of distance or Z, at equal ones in
/// draw order.
struct SplatPicture {
    std::vector<ProjectedSplat> splats;
    std::vector<SplatDepth> depths;  ///< of the same splats, for SplatOrder::kRay; else empty
    SplatBoxes boxes;                ///< of the same splats
    bool by_distance = false;        ///< whether any splat has a distance
    bool mixed = false;              ///< whether some splats, but not all, have a distance
};

/// Whether the scene has splats.
bool hasSplats(const PosedScene& posed);
/// Whether the scene shows splats and nothing else.
bool hasOnlySplats(const PosedScene& posed);
/// Whether colours of splats are linear in the file.
bool hasLinearSplats(const PosedScene& posed);

/// Projects the splats of a scene (Zwicker et al., "EWA Splatting", 2002) in front of the near
/// plane. Directions are limited as in the first paper's code, to 1.3 times the field of view.
/// Parallel rays are projected orthographically. Results are the same for any number of threads.
SplatPicture projectSplats(const PosedScene& posed, const View& view,
                           const CaptureSettings& settings);

/// Returns the most bytes that projectSplats() takes for this number of splats.
std::uint64_t projectionBytes(std::uint64_t splats, const CaptureSettings& settings);

/// Returns the linear colours toward a view of the splats with these keys, without opacity.
std::vector<glm::vec3> splatColors(const PosedScene& posed, const View& view,
                                   std::span<const std::uint32_t> keys);

}  // namespace peeler
