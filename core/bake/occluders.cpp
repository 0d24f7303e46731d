// SPDX-License-Identifier: Apache-2.0
#include "core/bake/occluders.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/scene/elements.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

bool isFinite(const glm::vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

/// Returns the middle of the bounding box of the finite positions.
glm::dvec3 middleOf(const std::vector<glm::vec3>& positions) {
    glm::vec3 least(std::numeric_limits<float>::max()), most(-least);
    for (const glm::vec3& p : positions) {
        if (!isFinite(p)) continue;
        least = glm::min(least, p);
        most = glm::max(most, p);
    }
    return least.x <= most.x ? 0.5 * (glm::dvec3(least) + glm::dvec3(most)) : glm::dvec3(0);
}

}  // namespace

Occluders::Occluders(const PosedScene& posed, Faces faces) : posed_(posed) {
    const std::optional<Bounds> box = posed_.bounds();
    if (!box) return;
    origin_ = 0.5 * (box->min + box->max);
    diagonal_ = glm::length(box->max - box->min);
    const DrawList& list = posed_.drawList();
    const Scene& scene = posed_.scene();
    alpha_tests_.reserve(list.draws().size());
    /// The patches of a geometry, shared by all its draws.
    struct Shared {
        std::size_t first = 0, count = 0;
        glm::dvec3 middle{0};
        bool known = false;
    };
    std::vector<Shared> shared(list.geometries().size());
    for (const Draw& draw : list.draws()) {
        if ((draw.flags & PEELER_IS_TRIANGLES) == 0) continue;
        const Geometry& geometry = list.geometries()[draw.geometry];
        const Primitive& primitive =
            scene.meshes[static_cast<std::size_t>(geometry.mesh)].primitives[geometry.primitive];
        Shared& patches = shared[draw.geometry];
        if (!patches.known) {
            const std::vector<glm::vec3>& positions = posed_.positions(geometry);
            patches = {patches_.size(), 0, middleOf(positions), true};
            addPatches(primitive, positions, patches.middle);
            patches.count = patches_.size() - patches.first;
        }
        OccluderPiece piece;
        piece.primitive = &primitive;
        piece.first_patch = patches.first;
        piece.patches = patches.count;
        piece.mirrored = draw.mirrored;
        const bool single_sided = !scene.materials[draw.material].double_sided;
        piece.cull_front = faces == Faces::kBack;
        piece.cull_back = faces == Faces::kFront || (faces == Faces::kGltf && single_sided);
        if (draw.alpha_tested) piece.alpha = &alpha_tests_.emplace_back(posed_, geometry);
        for (const glm::dmat4& world : list.worlds(draw)) {
            piece.turn = glm::dmat3(world);
            piece.offset = glm::dvec3(world * glm::dvec4(patches.middle, 1)) - origin_;
            pieces_.push_back(piece);
        }
    }
}

void Occluders::addPatches(const Primitive& primitive, const std::vector<glm::vec3>& positions,
                           const glm::dvec3& middle) {
    // For each vertex: the last patch that uses the vertex, and the index of the vertex among the
    // corners of this patch.
    struct Place {
        std::size_t patch = std::numeric_limits<std::size_t>::max();
        std::uint8_t corner = 0;
    };
    std::vector<Place> places(positions.size());
    OccluderPatch patch;
    glm::vec3 least(0), most(0);
    const auto begin = [&](std::uint32_t element) {
        patch = {};
        patch.first_corner = corners_[0].size();
        patch.first_triangle = triangles_.size();
        patch.first_element = element;
    };
    const auto close = [&] {
        patch.triangles = static_cast<std::uint32_t>(triangles_.size() - patch.first_triangle);
        patch.middle = 0.5F * (least + most);
        patch.half = 0.5F * (most - least);
        if (patch.corners > 0) patches_.push_back(patch);
    };
    begin(0);
    for (std::uint32_t element = 0; element < elementsOf(primitive); ++element) {
        if (patch.corners + 3 > OccluderPatch::kMost ||
            element - patch.first_element == OccluderPatch::kMost) {
            close();
            begin(element);
        }
        Triangle triangle{};
        const auto vertices = cornersOf(primitive, element).vertex;
        // Triangles with non-finite vertices occlude nothing. They are kept, so that an index in
        // the patch gives the element.
        const bool finite = std::ranges::all_of(
            vertices, [&](std::size_t vertex) { return isFinite(positions[vertex]); });
        for (std::size_t i = 0; i < 3 && finite; ++i) {
            Place& place = places[vertices[i]];
            if (place.patch != patches_.size()) {
                const glm::vec3 at(glm::dvec3(positions[vertices[i]]) - middle);
                least = patch.corners == 0 ? at : glm::min(least, at);
                most = patch.corners == 0 ? at : glm::max(most, at);
                for (int axis = 0; axis < 3; ++axis)
                    corners_[static_cast<std::size_t>(axis)].push_back(at[axis]);
                place = {patches_.size(), static_cast<std::uint8_t>(patch.corners++)};
            }
            triangle[i] = place.corner;
        }
        triangles_.push_back(triangle);
    }
    close();
}

}  // namespace peeler
