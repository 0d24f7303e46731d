// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

#include "formats/meshes/mesh_parts.h"

namespace peeler {
namespace {

/// An edge of a triangle, between two positions.
struct Side {
    std::uint32_t low, high;  ///< indices of the positions at both ends
    std::uint32_t corner;     ///< the corner where the edge starts: 3 · triangle + 0, 1 or 2
    bool rises;               ///< whether the edge runs from low to high
};

std::size_t nextCorner(std::size_t corner) {
    return corner % 3 == 2 ? corner - 2 : corner + 1;
}

/// Sets of corners that share a normal (union-find).
class Patches {
  public:
    explicit Patches(std::size_t corners) : parent_(corners) {
        std::iota(parent_.begin(), parent_.end(), 0U);
    }
    std::uint32_t of(std::size_t corner) {
        auto at = static_cast<std::uint32_t>(corner);
        while (parent_[at] != at)
            at = parent_[at] = parent_[parent_[at]];
        return at;
    }
    /// Joins two sets. The joined set keeps the lower index, so that the result does not depend on
    /// the order of calls.
    void join(std::size_t a, std::size_t b) {
        const std::uint32_t first = of(a), second = of(b);
        parent_[std::max(first, second)] = std::min(first, second);
    }

  private:
    std::vector<std::uint32_t> parent_;
};

class SmoothNormals {
  public:
    SmoothNormals(Primitive& primitive, double degrees,
                  const std::function<void(std::uint64_t bytes)>& allow)
        : primitive_(primitive),
          allow_(allow),
          least_cosine_(std::cos(degrees * std::numbers::pi / 180)) {}

    void add() {
        const std::size_t corners = primitive_.indices.size();
        allow_(corners * (sizeof(Side) + 2 * sizeof(std::uint32_t) + sizeof(glm::dvec3) * 4 / 3));
        findPositions();
        for (std::size_t i = 0; i < corners; i += 3)
            faces_.push_back(glm::cross(at(i + 1) - at(i), at(i + 2) - at(i)));
        Patches patches(corners);
        joinSides(patches);
        std::vector<glm::dvec3> sums(corners, glm::dvec3(0));
        for (std::size_t i = 0; i < corners; ++i)
            sums[patches.of(i)] += angle(i) * unit(faces_[i / 3]);
        splitVertices(patches, sums);
    }

  private:
    glm::dvec3 at(std::size_t corner) const {
        return primitive_.positions[primitive_.indices[corner]];
    }
    static glm::dvec3 unit(const glm::dvec3& v) {
        const double length = glm::length(v);
        return length > 0 ? v / length : glm::dvec3(0);
    }
    double angle(std::size_t corner) const {
        const std::size_t next = nextCorner(corner);
        const glm::dvec3 a = at(next) - at(corner), b = at(nextCorner(next)) - at(corner);
        return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
    }

    /// Gives the same number to vertices at the same position (−0 equals 0).
    void findPositions() {
        CornerIndex positions(allow_);
        for (const glm::vec3& p : primitive_.positions) {
            const glm::vec3 zero = p + glm::vec3(0);
            position_.push_back(positions.indexOf(std::bit_cast<CornerIndex::Key>(zero)));
        }
    }

    void joinSides(Patches& patches) const {
        std::vector<Side> sides(primitive_.indices.size());
        for (std::size_t i = 0; i < sides.size(); ++i) {
            const std::uint32_t a = position_[primitive_.indices[i]];
            const std::uint32_t b = position_[primitive_.indices[nextCorner(i)]];
            sides[i] = {std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(i), a < b};
        }
        std::ranges::sort(
            sides, {}, [](const Side& side) { return std::tie(side.low, side.high, side.corner); });
        for (std::size_t i = 0; i < sides.size();) {
            std::size_t end = i + 1;
            while (end < sides.size() && sides[end].low == sides[i].low &&
                   sides[end].high == sides[i].high)
                ++end;
            if (end == i + 2 && sides[i].rises != sides[i + 1].rises &&
                isSmooth(sides[i], sides[i + 1])) {
                patches.join(sides[i].corner, nextCorner(sides[i + 1].corner));
                patches.join(nextCorner(sides[i].corner), sides[i + 1].corner);
            }
            i = end;
        }
    }

    bool isSmooth(const Side& a, const Side& b) const {
        return glm::dot(unit(faces_[a.corner / 3]), unit(faces_[b.corner / 3])) >= least_cosine_;
    }

    /// Splits each vertex that has several normals, in the order of triangles.
    void splitVertices(Patches& patches, const std::vector<glm::dvec3>& sums) {
        CornerIndex split(allow_);
        for (std::size_t i = 0; i < primitive_.indices.size(); ++i)
            primitive_.indices[i] = split.indexOf({primitive_.indices[i], patches.of(i), 0});
        const auto gather = [&](auto& values) {
            if (values.empty()) return;
            allow_(split.keys().size() * sizeof values[0]);
            std::remove_reference_t<decltype(values)> gathered;
            gathered.reserve(split.keys().size());
            for (const CornerIndex::Key& key : split.keys())
                gathered.push_back(values[key[0]]);
            values.swap(gathered);
        };
        gather(primitive_.positions);
        gather(primitive_.colors);
        gather(primitive_.texcoords[0]);
        primitive_.normals.reserve(split.keys().size());
        for (const CornerIndex::Key& key : split.keys()) {
            const glm::dvec3 normal = unit(sums[key[1]]);
            // Degenerate triangles have no normal and are invisible, so any normal will do.
            primitive_.normals.emplace_back(normal == glm::dvec3(0) ? glm::dvec3(0, 1, 0) : normal);
        }
    }

    Primitive& primitive_;
    const std::function<void(std::uint64_t bytes)>& allow_;
    double least_cosine_;
    std::vector<std::uint32_t> position_;  ///< position number of each vertex
    /// Normal of each triangle, with twice the area as length.
    std::vector<glm::dvec3> faces_;
};

}  // namespace

void addSmoothNormals(Primitive& primitive, double degrees,
                      const std::function<void(std::uint64_t bytes)>& allow) {
    SmoothNormals(primitive, degrees, allow).add();
}

}  // namespace peeler
