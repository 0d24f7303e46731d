// SPDX-License-Identifier: Apache-2.0
// Which closed surface a hit belongs to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/scene/posed_scene.h"

namespace peeler {

/// A surface that is taken for the boundary of a body: what a ray enters it leaves again.
struct Solid {
    std::size_t instance = 0;  ///< index into PosedScene::meshes()
    int node = 0;
    std::span<const std::size_t> primitives{};  ///< of the mesh
    std::uint64_t triangles = 0;                ///< with three different corners
    std::uint64_t open_edges = 0;

    bool closed() const { return open_edges == 0; }
};

/// The solids of a scene. glTF does not say what is closed, so it follows from the topology:
/// vertices at the same position (bit for bit; −0 is 0) are one, and an edge is open if an odd
/// number of triangles has it. Every primitive of a mesh that is closed by itself is a solid; all
/// other triangles of the mesh together are one more, so a cube whose sides have different
/// materials is one solid. Lines and points belong to none. The topology of a mesh is found once
/// however often it stands in the scene, that of a deformed one for each deformation.
class Solids {
  public:
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

    /// While the topology of a mesh is found, it takes some 30 bytes a triangle and 20 a vertex.
    explicit Solids(const PosedScene& posed);
    Solids(const Solids&) = delete;
    Solids& operator=(const Solids&) = delete;

    /// In draw order.
    const std::vector<Solid>& all() const { return solids_; }
    /// Index into all(), or kNone; of a key as DrawList counts them.
    std::uint32_t solidOf(std::uint32_t key) const { return surfaceOf(key).solid; }
    /// Index into Scene::materials.
    std::size_t materialOf(std::uint32_t key) const { return surfaceOf(key).material; }

  private:
    /// A primitive of an instance.
    struct Surface {
        std::uint32_t solid = kNone, material = 0;
    };
    /// What of a mesh will be a solid of every instance.
    struct Shell {
        std::vector<std::size_t> primitives;
        std::uint64_t triangles = 0, open_edges = 0;
    };

    const Surface& surfaceOf(std::uint32_t key) const;
    const std::vector<Shell>& shellsOf(const PosedScene& posed, const MeshInstance& instance);

    std::vector<Solid> solids_;
    std::vector<std::uint32_t> first_keys_;  ///< of each surface, in draw order
    std::vector<Surface> surfaces_;
    std::map<std::pair<int, int>, std::vector<Shell>> shells_;  ///< by mesh and deformation
};

}  // namespace peeler
