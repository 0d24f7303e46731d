// SPDX-License-Identifier: Apache-2.0
// The rays of pictures that neither a pinhole nor parallel rays make.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/camera_choice.h>
#include <peeler/lens.h>
#include "core/lens/lens_rays.h"

namespace peeler {

/// The ray origin + t · direction, t >= 0.
struct Ray {
    glm::dvec3 origin{0}, direction{0};
};

/// The change of a ray from a pixel to the next, to the right and downwards (Igehy, "Tracing Ray
/// Differentials", 1999). All 0 if the rays of neighbouring pixels are unrelated.
struct RayDifferentials {
    Ray per_x{}, per_y{};
};

/// A lens and its intrinsics, which are ignored if the lens fills the picture.
struct LensCamera {
    Lens lens;
    Intrinsics intrinsics{};
};

/// The rays of the pixels of a picture (View::rays), in camera space (looking along −Z, +Y up).
/// Directions have length 1, so Z (LayeredImage::z) is the distance along the ray. Pixels without a
/// ray have the direction (0, 0, 0).
class PictureRays {
  public:
    PictureRays() = default;
    PictureRays(const PictureRays&) = delete;
    PictureRays& operator=(const PictureRays&) = delete;
    virtual ~PictureRays() = default;

    /// Returns the ray through a point of the picture, in continuous pixel coordinates, y down.
    virtual Ray at(const glm::dvec2& pixel) const = 0;
    /// Writes the rays through `sample` (0–1) within each pixel of a window, row by row.
    virtual void fill(const Window& window, const glm::dvec2& sample, std::span<Ray> rays) const;

    /// Returns the derivatives of at(); by default all 0.
    virtual RayDifferentials differentials(const glm::dvec2& pixel) const;

    /// Whether all rays begin at the camera's position, (0, 0, 0).
    virtual bool oneEye() const { return true; }
    /// Returns the lens of a camera that does not move during the picture; null for other rays.
    virtual const LensCamera* lens() const { return nullptr; }
    /// Returns "lens", "shutter" (a moving camera) or "list": what the rays are of.
    virtual std::string_view kind() const { return "list"; }
    /// Returns a text that differs for pictures with different rays.
    virtual std::string text() const = 0;
};

/// Returns the rays of a lens. Throws like LensRays::LensRays().
std::shared_ptr<const PictureRays> lensPicture(const LensCamera& camera, const Size& size);

/// Returns the rays of a picture whose pixel p is the point first + step · p of `inner`, which must
/// also have rays outside its picture.
std::shared_ptr<const PictureRays> mappedPicture(std::shared_ptr<const PictureRays> inner,
                                                 const glm::dvec2& first, const glm::dvec2& step);

/// Returns the rays of a camera that moves while the rows of its picture are exposed (rolling
/// shutter). The first pose, camera to world, is that of the upper edge of the picture, the last
/// pose that of the lower edge, and the others follow evenly. Between two poses, the position moves
/// along a line and the rotation about an axis. `still`: the rays of the camera at rest. Camera
/// space is world space.
std::shared_ptr<const PictureRays> shutterPicture(std::shared_ptr<const PictureRays> still,
                                                  std::vector<glm::dmat4> poses, int height);

}  // namespace peeler
