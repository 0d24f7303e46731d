// SPDX-License-Identifier: Apache-2.0
// Mapping between the pixels of captured layers and points in camera space, for pinholes, parallel
// rays and lenses.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include <peeler/view.h>
#include "core/scene/view.h"

namespace peeler {

/// PixelRays for the pixels of a window, also through a lens. Planar depth through a lens is 1 / Z,
/// Z being the distance; it is nearly linear within a few pixels of a plane.
class CellRays {
  public:
    /// Throws Error (kUsage) for views whose neighbouring pixels need not see neighbouring
    /// directions: moving cameras, lists of rays and the six faces of a cube.
    CellRays(const View& view, const Window& window);

    bool perspective() const { return plain_.perspective(); }
    double planar(double z) const { return plain_.planar(z); }
    bool isSeen(double planar) const { return plain_.isSeen(planar); }

    /// Returns the point at a planar depth, in pixel coordinates of the view. (0, 0, 0) if the lens
    /// has no ray there.
    glm::dvec3 point(const glm::dvec2& pixel, double planar) const {
        return lens_ ? lens_->at(pixel).direction / planar : plain_.point(pixel, planar);
    }
    /// Returns point() at half a pixel to the left (`right`: to the right) of the sample of pixel
    /// (x, y), and above (`below`: below) it.
    glm::dvec3 corner(int x, int y, bool right, bool below, double planar) const {
        if (lens_) return corners_[indexOf(x, y, right, below)] / planar;
        return plain_.point(
            glm::dvec2(x, y) + sample_ + glm::dvec2(right ? 0.5 : -0.5, below ? 0.5 : -0.5),
            planar);
    }
    /// Returns PixelRays::unitStep() at pixel (x, y).
    glm::dvec2 unitStep(int x, int y, double planar) const {
        return lens_ ? spacing(x, y) * planar : plain_.unitStep(planar);
    }

  private:
    std::size_t indexOf(int x, int y, bool right, bool below) const {
        return static_cast<std::size_t>(y - window_.y0 + (below ? 1 : 0)) *
                   (static_cast<std::size_t>(window_.width()) + 1) +
               static_cast<std::size_t>(x - window_.x0 + (right ? 1 : 0));
    }
    glm::dvec2 spacing(int x, int y) const;

    PixelRays plain_;
    std::shared_ptr<const PictureRays> lens_;
    Window window_;
    glm::dvec2 sample_;
    std::vector<glm::dvec3> corners_;  ///< directions, in rows; (0, 0, 0) where the lens has none
};

}  // namespace peeler
