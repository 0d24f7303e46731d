// SPDX-License-Identifier: Apache-2.0
// The mapping between the pixels of a camera with a lens and directions.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include <peeler/camera_choice.h>
#include "core/lens/lens.h"
#include "core/lens/lens_shape.h"

namespace peeler {

/// Mapping between pixels and directions in camera space (looking along −Z, +Y up), as PixelRays is
/// for views without a lens. Pixel coordinates are continuous, y down: (0, 0) is the picture's
/// upper left corner, and the centre of pixel (x, y) is at (x + 0.5, y + 0.5). Results have the
/// same bits on every machine (core/base/portable_math.h).
class LensRays {
  public:
    /// Lenses that fill the picture (LensModel::filling) ignore the intrinsics. Throws Error
    /// (kUsage) if the picture has no size, or a size that does not fit the lens.
    LensRays(const Lens& lens, const Intrinsics& intrinsics, const Size& size);

    /// Returns the pixel coordinates that see a direction (of any length above 0), also outside the
    /// picture; nothing if the lens does not see it.
    std::optional<glm::dvec2> pixel(const glm::dvec3& direction) const;

    /// Returns the direction of a point of the picture, of length 1, and its derivatives by the
    /// pixel coordinates; nothing if the lens maps no direction to the point: beyond its largest
    /// angle, or where its distortion folds back.
    std::optional<LensRay> ray(const glm::dvec2& pixel) const;

    /// Returns the directions of the points at `sample` within the pixels of a window, row by row,
    /// with the bits of ray(); (0, 0, 0) for no direction.
    std::vector<glm::dvec3> directions(const Window& window, const glm::dvec2& sample) const;

  private:
    std::shared_ptr<const LensShape> shape_;
    Intrinsics intrinsics_;
};

/// Returns the intrinsics with square pixels and the principal point in the middle for which the
/// direction at `angle` (radians) below the axis is at the middle of the lower edge. Throws Error
/// (kUsage) if the lens does not see that direction, or if its focal lengths are not free
/// (LensModel::in_pixels, filling).
Intrinsics intrinsicsOfAngle(const Lens& lens, double angle, const Size& size);

}  // namespace peeler
