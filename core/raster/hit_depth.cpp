// SPDX-License-Identifier: Apache-2.0
#include "core/raster/hit_depth.h"

#include <algorithm>
#include <cmath>

#include "core/raster/scene_triangles.h"

namespace peeler {

HitTriangle hitTriangle(const CornerPlacement& placement, const HitView& seen,
                        const std::array<glm::vec3, 3>& positions) {
    const PlacedCorner p = placement.unprojected(positions[0]),
                       q = placement.unprojected(positions[1]),
                       r = placement.unprojected(positions[2]);
    const double px = q.x - p.x, py = q.y - p.y, pz = q.z - p.z;
    const double rx = r.x - p.x, ry = r.y - p.y, rz = r.z - p.z;
    const double nx = py * rz - pz * ry, ny = pz * rx - px * rz, nz = px * ry - py * rx;
    const double least = std::min({p.z, q.z, r.z}), most = std::max({p.z, q.z, r.z});
    const double steps = seen.grid.steps();
    HitTriangle triangle;
    if (placement.perspective()) {
        // The plane is n · P = d. With P = Z · (x, y, 1), where x and y are grid steps from the
        // centre, n · (x, y, 1) / d = 1/Z. So 1/Z is linear in x and y.
        const double d = nx * p.x + ny * p.y + nz * p.z;
        const glm::dvec2 middle = placement.middle() / steps - glm::dvec2(seen.grid.origin());
        triangle.along_x = nx / d * steps;
        triangle.along_y = ny / d * steps;
        triangle.at_origin = nz / d - triangle.along_x * middle.x - triangle.along_y * middle.y;
        triangle.nearest = static_cast<float>(std::max(least, placement.nearest()));
    } else {
        const double scale = -steps / nz;
        triangle.along_x = nx * scale;
        triangle.along_y = ny * scale;
        triangle.at_origin = p.z - triangle.along_x * (p.x / steps - seen.grid.origin().x) -
                             triangle.along_y * (p.y / steps - seen.grid.origin().y);
        triangle.nearest = static_cast<float>(least);
    }
    triangle.farthest = static_cast<float>(most);
    if (!std::isfinite(triangle.along_x) || !std::isfinite(triangle.along_y) ||
        !std::isfinite(triangle.at_origin)) {
        const double mean = 0.5 * (double{triangle.nearest} + double{triangle.farthest});
        triangle.along_x = triangle.along_y = 0;
        triangle.at_origin = placement.perspective() ? 1 / mean : mean;
    }
    return triangle;
}

TriangleTest::TriangleTest(const HitView& seen, const CornerPlacement& placement,
                           const HitTriangle& triangle, const AlphaTest* alpha,
                           const std::array<std::uint32_t, 3>& vertex,
                           const std::array<glm::vec3, 3>& positions)
    : seen_(seen), triangle_(triangle), alpha_(alpha), vertex_(vertex) {
    if (!alpha) return;
    std::array<glm::dvec3, 3> at;
    for (std::size_t i = 0; i < 3; ++i) {
        const PlacedCorner corner = placement.unprojected(positions[i]);
        at[i] = placement.perspective() ? glm::dvec3(corner.x, corner.y, corner.z)
                                        : glm::dvec3(corner.x, corner.y, 1);
    }
    // A ray's direction is (x, y, 1) in grid steps; for a pinhole, x and y are counted from the
    // centre. A corner's weight is the volume of the tetrahedron spanned by the ray and the other
    // two corners.
    const double steps = seen.grid.steps();
    const glm::dvec2 origin = placement.perspective()
                                  ? glm::dvec2(seen.grid.origin()) * steps - placement.middle()
                                  : glm::dvec2(seen.grid.origin()) * steps;
    for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec3 across = glm::cross(at[(i + 1) % 3], at[(i + 2) % 3]);
        weights_[i] = {across.x * steps, across.y * steps,
                       across.x * origin.x + across.y * origin.y + across.z};
    }
}

std::array<double, 3> TriangleTest::weightsAt(int x, int y) const {
    std::array<double, 3> weight;
    for (std::size_t i = 0; i < 3; ++i)
        weight[i] = weights_[i].x * x + weights_[i].y * y + weights_[i].z;
    const double sum = weight[0] + weight[1] + weight[2];
    double rest = 0;
    for (double& w : weight) {
        w /= sum;
        w = w > 0 ? w : 0;  // NaN (edge-on triangle) becomes 0
        rest += w;
    }
    if (!(rest > 0)) return {1, 0, 0};
    for (double& w : weight)
        w /= rest;
    return weight;
}

bool TriangleTest::passes(int x, int y) const {
    if (seen_.cut) {
        const Projection& projection = seen_.view.projection;
        const auto z = double{hitZAt(triangle_, projection.perspective, x, y)};
        if (!(z >= projection.near && z < projection.far)) return false;
    }
    return !alpha_ || alpha_->passes(vertex_, weightsAt(x, y));
}

}  // namespace peeler
