// SPDX-License-Identifier: Apache-2.0
#include "core/bake/visibility_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <peeler/bundle.h>

namespace peeler {
namespace {

// The density of the grid, tuned on receivers at vertices and at texels. Fewer rows mean fewer
// ranges of receivers to look up for each triangle. More rows mean fewer tests of receivers outside
// the triangle.
constexpr double kReceiversASquare = 10;  // the side of a square is the height of a row
constexpr double kColumnsASquare = 16;
// Minimum side of a square, as a fraction of the scene's diagonal.
constexpr double kLeastSquare = 1e-6;

glm::vec3 rowOf(const glm::dmat3& m, int row) {
    return glm::vec3(m[0][row], m[1][row], m[2][row]);
}

/// Returns `count` plus room for a block of padding receivers.
std::size_t padded(std::size_t count) {
    return count + CellReceivers::kBlock;
}

/// Returns the cell that contains a coordinate; the first cell for NaN.
int cellOf(float at, int cells) {
    return at > 0 ? static_cast<int>(std::min(at, static_cast<float>(cells - 1))) : 0;
}

}  // namespace

std::uint64_t VisibilityRays::bytes(std::size_t receivers) {
    constexpr std::size_t kFloats = 3 * 4 + 5;
    constexpr auto kCells = static_cast<std::size_t>(kColumnsASquare / kReceiversASquare) + 1;
    return padded(receivers) * (kFloats + kCells) * sizeof(float);
}

void VisibilityRays::place(const Receivers& receivers, std::span<const std::uint32_t> chosen) {
    count_ = chosen.size();
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (auto* values : {&position_, &normal_, &place_})
            (*values)[axis].resize(count_);
        sorted_[axis].resize(padded(count_));
    }
    cosine_.resize(count_);
    distance_.resize(count_);
    cell_.resize(count_);
    side_.resize(padded(count_));
    nearest_.resize(padded(count_));
    for (std::size_t i = 0; i < count_; ++i) {
        const glm::dvec3 position = receivers.positions[chosen[i]] - occluders_.origin();
        const glm::vec3& normal = receivers.normals[chosen[i]];
        for (int axis = 0; axis < 3; ++axis) {
            position_[static_cast<std::size_t>(axis)][i] = static_cast<float>(position[axis]);
            normal_[static_cast<std::size_t>(axis)][i] = normal[axis];
        }
    }
}

void VisibilityRays::project(const glm::dmat3& frame, bool inside) {
    const auto dots = [&](const glm::vec3& row, const auto& vectors, std::vector<float>& out) {
        const float *const x = vectors[0].data(), *const y = vectors[1].data(),
                           *const z = vectors[2].data();
        float* const to = out.data();
        for (std::size_t i = 0; i < count_; ++i)
            to[i] = row.x * x[i] + row.y * y[i] + row.z * z[i];
    };
    for (int axis = 0; axis < 3; ++axis)
        dots(rowOf(frame, axis), position_, place_[static_cast<std::size_t>(axis)]);
    dots(inside ? -rowOf(frame, 2) : rowOf(frame, 2), normal_, cosine_);
    grid_ = {};
    glm::dvec2 size(0);
    for (int axis = 0; axis < 2; ++axis) {
        const std::vector<float>& at = place_[static_cast<std::size_t>(axis)];
        float least = std::numeric_limits<float>::max(), most = -least;
        for (const float value : at) {
            least = std::min(least, value);
            most = std::max(most, value);
        }
        grid_.first[axis] = double{least};
        size[axis] = std::max(0.0, double{most} - double{least});
    }
    const double squares = std::max(1.0, static_cast<double>(count_) / kReceiversASquare);
    const double square =
        std::max({std::sqrt(size.x * size.y / squares), std::max(size.x, size.y) / squares,
                  kLeastSquare * occluders_.diagonal()});
    if (!(square > 0)) return;  // the scene is a point
    grid_.cells_a_unit = glm::dvec2(kColumnsASquare, 1) / square;
    grid_.width = static_cast<int>(size.x * grid_.cells_a_unit.x) + 1;
    grid_.height = static_cast<int>(size.y * grid_.cells_a_unit.y) + 1;
}

void VisibilityRays::sort(float max_distance) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<int>(axis);
        const auto first = static_cast<float>(grid_.first[a]);
        const auto scale = static_cast<float>(grid_.cells_a_unit[a]);
        for (float& value : place_[axis])
            value = (value - first) * scale;
    }
    const auto width = static_cast<std::size_t>(grid_.width);
    const std::size_t cells = width * static_cast<std::size_t>(grid_.height);
    // During the fill, first_[cell + 1] is the next free index of the cell. After the fill, it is
    // the index at which the next cell begins.
    first_.assign(cells + 2, 0);
    for (std::size_t i = 0; i < count_; ++i) {
        const auto column = static_cast<std::uint32_t>(cellOf(place_[0][i], grid_.width));
        const auto row = static_cast<std::uint32_t>(cellOf(place_[1][i], grid_.height));
        cell_[i] = row * static_cast<std::uint32_t>(width) + column;
        ++first_[cell_[i] + 2];
    }
    for (std::size_t c = 2; c < first_.size(); ++c)
        first_[c] += first_[c - 1];
    for (std::size_t i = 0; i < count_; ++i) {
        const std::uint32_t to = first_[cell_[i] + 1]++;
        cell_[i] = to;
        for (std::size_t axis = 0; axis < 3; ++axis)
            sorted_[axis][to] = place_[axis][i];
        side_[to] = cosine_[i] < 0 ? -1.0F : 1.0F;
        nearest_[to] = max_distance;
    }
    // Padding receivers see nothing: their distance is 0, so no hit is nearer.
    std::fill(nearest_.begin() + static_cast<std::ptrdiff_t>(count_), nearest_.end(), 0.0F);
}

void VisibilityRays::lookAt(const OccluderPiece& piece, const glm::dmat3& frame) {
    glm::dmat3 turn = frame * piece.turn;
    glm::dvec3 offset = frame * piece.offset;
    for (int axis = 0; axis < 2; ++axis) {
        const double scale = grid_.cells_a_unit[axis];
        for (int column = 0; column < 3; ++column)
            turn[column][axis] *= scale;
        offset[axis] = (offset[axis] - grid_.first[axis]) * scale;
    }
    PatchView view;
    for (int axis = 0; axis < 3; ++axis)
        view.rows[static_cast<std::size_t>(axis)] = glm::vec4(rowOf(turn, axis), offset[axis]);
    CellReceivers receivers;
    receivers.first = first_.data();
    receivers.width = grid_.width;
    receivers.height = grid_.height;
    receivers.units_a_cell = glm::vec2(1.0 / grid_.cells_a_unit);
    for (std::size_t axis = 0; axis < 3; ++axis)
        receivers.at[axis] = sorted_[axis].data();
    receivers.side = side_.data();
    receivers.nearest = nearest_.data();
    receivers.own_surface = own_surface_;
    const CoverPatch cover = coverPatchFor(piece);
    for (const OccluderPatch& patch : occluders_.patches(piece)) {
        const auto reaches = [&](std::size_t axis, int cells) {
            const glm::vec3 row(view.rows[axis]);
            const float middle = glm::dot(row, patch.middle) + view.rows[axis].w;
            const float half = glm::dot(glm::abs(row), patch.half);
            return middle + half >= 0 && middle - half <= static_cast<float>(cells);
        };
        if (reaches(0, grid_.width) && reaches(1, grid_.height))
            cover(occluders_, piece, patch, view, receivers);
    }
}

void VisibilityRays::look(const glm::dvec3& direction, bool inside, float max_distance) {
    glm::dmat3 frame = bundleSides(direction);
    frame[2] = -frame[2];
    frame = glm::transpose(frame);  // the rows are right, up and forward
    project(frame, inside);
    sort(max_distance);
    for (const OccluderPiece& piece : occluders_.pieces())
        lookAt(piece, frame);
    constexpr float kNothing = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < count_; ++i) {
        const float nearest = nearest_[cell_[i]];
        distance_[i] = nearest < max_distance ? nearest : kNothing;
    }
}

}  // namespace peeler
