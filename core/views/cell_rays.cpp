// SPDX-License-Identifier: Apache-2.0
#include "core/views/cell_rays.h"

#include <peeler/error.h>
#include "core/base/parallel.h"

namespace peeler {
namespace {

void checkNeighbours(const View& view) {
    const LensCamera* const camera = lensCameraOf(view);
    if (view.rays && !camera)
        throw Error(ErrorKind::kUsage,
                    "the rays of a moving camera or of a list give no other views",
                    view.camera_name);
    if (camera && camera->lens.model == "cube")
        throw Error(ErrorKind::kUsage, "six faces in one picture give no other views",
                    view.camera_name, "trace the lens equirectangular");
}

}  // namespace

CellRays::CellRays(const View& view, const Window& window)
    : plain_(view), lens_(view.rays), window_(window), sample_(view.sample) {
    if (!lens_) return;
    checkNeighbours(view);
    const auto width = static_cast<std::size_t>(window.width()) + 1;
    const auto height = static_cast<std::size_t>(window.height()) + 1;
    corners_.resize(width * height);
    parallelFor(height, [&](std::size_t row) {
        const int y = window.y0 + static_cast<int>(row);
        std::vector<Ray> rays(width);
        lens_->fill({window.x0, y, window.x1 + 1, y + 1}, sample_ - 0.5, rays);
        for (std::size_t i = 0; i < width; ++i)
            corners_[row * width + i] = rays[i].direction;
    });
}

/// Returns the width and the height of a pixel at distance 1.
glm::dvec2 CellRays::spacing(int x, int y) const {
    const auto at = [&](bool right, bool below) { return corners_[indexOf(x, y, right, below)]; };
    return 0.5 * glm::dvec2(glm::distance(at(false, false), at(true, false)) +
                                glm::distance(at(false, true), at(true, true)),
                            glm::distance(at(false, false), at(false, true)) +
                                glm::distance(at(true, false), at(true, true)));
}

}  // namespace peeler
