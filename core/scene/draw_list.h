// SPDX-License-Identifier: Apache-2.0
// The draw calls of a scene in draw order, and the keys of their primitives.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <span>
#include <tuple>
#include <vector>

#include <peeler/scene.h>

namespace peeler {

struct MeshInstance;

/// The vertices of a primitive, owned by the mesh or, if deformed, by an instance.
struct Geometry {
    int mesh = 0;
    std::size_t primitive = 0;
    int deformed = -1;  ///< index into PosedScene::deformed(); −1 for the vertices of the mesh
    bool operator<(const Geometry& other) const {
        return std::tie(mesh, primitive, deformed) <
               std::tie(other.mesh, other.primitive, other.deformed);
    }
};

/// A draw call: one primitive of a mesh, in one or more instances.
struct Draw {
    std::size_t geometry = 0;  ///< index into DrawList::geometries()
    Topology topology = Topology::kTriangles;
    bool indexed = false;
    int count = 0;  ///< number of indices; number of vertices if not indexed
    std::size_t first_world = 0, instances = 1;
    std::size_t material = 0;
    int node = 0;
    bool mirrored = false;              ///< whether front faces are clockwise
    std::uint32_t first_primitive = 0;  ///< key of the first drawn primitive of the first instance
    std::uint32_t instance_keys = 0;    ///< offset between the keys of successive instances
    std::uint32_t flags = 0;            ///< PEELER_HAS_NORMALS and similar bits
    bool opaque = false;          ///< whether the material is OPAQUE or MASK, and not transmissive
    bool alpha_tested = false;    ///< whether fragments may be rejected because of their alpha
    bool textured_alpha = false;  ///< whether a texture gives the alpha to test
};

/// The instance, primitive and element of a key.
struct KeyOrigin {
    std::size_t instance = 0;   ///< index into PosedScene::meshes()
    std::size_t primitive = 0;  ///< index among the mesh's primitives
    std::uint32_t element = 0;  ///< index among the primitive's points, lines or triangles
    /// Index among all points, lines or triangles of the mesh, counted primitive by primitive.
    std::uint32_t in_mesh = 0;
};

/// One instance of a primitive. Its keys are consecutive.
struct DrawnSurface {
    std::uint32_t first_key = 0;
    std::uint32_t in_mesh = 0;    ///< KeyOrigin::in_mesh of the first key
    std::uint32_t instance = 0;   ///< index into PosedScene::meshes()
    std::uint32_t primitive = 0;  ///< index among the mesh's primitives
};

/// An index from keys to surfaces.
class KeyIndex {
  public:
    KeyIndex() = default;
    /// `first_keys` has the first key of each surface, in ascending order. All keys are less than
    /// `end`.
    KeyIndex(std::vector<std::uint32_t> first_keys, std::uint64_t end);

    std::uint32_t surfaceOf(std::uint32_t key) const {
        const std::size_t near = key >> shift_;
        if (near_[near] == near_[near + 1]) return near_[near];
        // Finds the last surface whose first key is at most `key`. Surfaces without elements have
        // the same first key as the next surface, and come before the surface that has the key.
        const auto begin = first_keys_.begin();
        const auto after = std::upper_bound(begin + near_[near], begin + near_[near + 1] + 1, key);
        return static_cast<std::uint32_t>(after - begin) - 1;
    }

  private:
    std::vector<std::uint32_t> first_keys_;
    /// The surface of each key that is a multiple of 2^shift_. Searches for other keys begin there.
    std::vector<std::uint32_t> near_;
    unsigned shift_ = 0;
};

/// The draw order: depth-first over the nodes, then by instance, then by primitive of the mesh.
/// Keys number GL's primitives in this order, starting at 1. Drawing instances together does not
/// change the keys.
class DrawList {
  public:
    /// Successive instances of a single-primitive mesh at the same node are drawn together. Throws
    /// Error (kInput) if the scene has 2^32 primitives or more.
    DrawList(const Scene& scene, std::span<const MeshInstance> instances);

    const std::vector<Draw>& draws() const { return draws_; }
    const std::vector<Geometry>& geometries() const { return geometries_; }
    /// Returns the world matrices of a draw's instances.
    std::span<const glm::dmat4> worlds(const Draw& draw) const {
        return {worlds_.data() + draw.first_world, draw.instances};
    }
    /// Returns the surfaces in draw order, including surfaces that draw nothing.
    const std::vector<DrawnSurface>& surfaces() const { return surfaces_; }
    /// Returns the index of the surface with this key.
    std::uint32_t surfaceOf(std::uint32_t key) const { return keys_.surfaceOf(key); }
    const KeyIndex& keys() const { return keys_; }
    KeyOrigin originOf(std::uint32_t key) const;

  private:
    void addGroup(const Scene& scene, std::span<const MeshInstance> instances);
    void addSurfaces(std::span<const Primitive> primitives, std::uint32_t first_key,
                     std::size_t instances);
    std::size_t indexOf(const Geometry& geometry);

    std::vector<Draw> draws_;
    std::vector<Geometry> geometries_;
    std::map<Geometry, std::size_t> geometry_index_;
    std::vector<glm::dmat4> worlds_;
    std::vector<DrawnSurface> surfaces_;
    // Starts at 1, since 0 is the key before the first layer in front-to-back peeling.
    std::uint64_t next_key_ = 1;
    KeyIndex keys_;
};

}  // namespace peeler
