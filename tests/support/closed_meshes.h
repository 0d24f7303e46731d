// SPDX-License-Identifier: Apache-2.0
// Closed meshes with shared vertices and known properties.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <peeler/scene.h>

namespace peeler::test {

/// Returns a unit sphere of 20 · 4^level triangles, with vertices on the sphere.
inline Primitive icosphere(int level) {
    const float g = std::numbers::phi_v<float>;
    Primitive sphere;
    for (const glm::vec3 v : {glm::vec3(-1, g, 0),
                              {1, g, 0},
                              {-1, -g, 0},
                              {1, -g, 0},
                              {0, -1, g},
                              {0, 1, g},
                              {0, -1, -g},
                              {0, 1, -g},
                              {g, 0, -1},
                              {g, 0, 1},
                              {-g, 0, -1},
                              {-g, 0, 1}})
        sphere.positions.push_back(glm::normalize(v));
    sphere.indices = {0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
                      4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
                      6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1};
    for (; level > 0; --level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [at, is_new] = middles.try_emplace(
                std::minmax(a, b), static_cast<std::uint32_t>(sphere.positions.size()));
            if (is_new)
                sphere.positions.push_back(
                    glm::normalize(sphere.positions[a] + sphere.positions[b]));
            return at->second;
        };
        std::vector<std::uint32_t> finer;
        for (std::size_t i = 0; i < sphere.indices.size(); i += 3) {
            const std::uint32_t a = sphere.indices[i], b = sphere.indices[i + 1],
                                c = sphere.indices[i + 2];
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca});
        }
        sphere.indices = std::move(finer);
    }
    return sphere;
}

/// Returns a torus around Y of `around` times `across` quads. Its tube has the radius `minor`, and
/// the tube's centre is at distance 1 from the axis.
inline Primitive torus(double minor, std::uint32_t around, std::uint32_t across) {
    Primitive torus;
    for (std::uint32_t i = 0; i < around; ++i) {
        for (std::uint32_t j = 0; j < across; ++j) {
            const double u = 2 * std::numbers::pi * i / around,
                         v = 2 * std::numbers::pi * j / across, r = 1 + minor * std::cos(v);
            torus.positions.emplace_back(r * std::sin(u), minor * std::sin(v), r * std::cos(u));
            const std::uint32_t i1 = (i + 1) % around, j1 = (j + 1) % across;
            const std::uint32_t a = i * across + j, b = i1 * across + j, c = i1 * across + j1,
                                d = i * across + j1;
            torus.indices.insert(torus.indices.end(), {a, b, c, a, c, d});
        }
    }
    return torus;
}

/// Returns a cube from −1 to 1 along every axis.
inline Primitive cube() {
    Primitive cube;
    for (int i = 0; i < 8; ++i)
        cube.positions.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    cube.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                    2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    return cube;
}

/// Returns the volume inside the mesh, by the divergence theorem; negative if triangles face
/// inwards.
inline double volumeOf(const Primitive& mesh) {
    double volume = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const glm::dvec3 a(mesh.positions[mesh.indices[i]]), b(mesh.positions[mesh.indices[i + 1]]),
            c(mesh.positions[mesh.indices[i + 2]]);
        volume += glm::dot(a, glm::cross(b, c)) / 6;
    }
    return volume;
}

inline Primitive placed(Primitive mesh, float size, const glm::vec3& at) {
    for (glm::vec3& position : mesh.positions)
        position = size * position + at;
    return mesh;
}

/// Returns a scene with each mesh in its own node, and with materials "m0", "m1", …
inline Scene sceneOf(std::vector<Mesh> meshes) {
    Scene scene;
    scene.scenes.resize(1);
    scene.meshes = std::move(meshes);
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        scene.nodes.emplace_back().mesh = static_cast<int>(i);
        scene.scenes[0].roots.push_back(static_cast<int>(i));
        for (const Primitive& primitive : scene.meshes[i].primitives)
            scene.materials.resize(
                std::max(scene.materials.size(), static_cast<std::size_t>(primitive.material) + 1));
    }
    for (std::size_t i = 0; i < scene.materials.size(); ++i)
        scene.materials[i].name = "m" + std::to_string(i);
    return scene;
}

}  // namespace peeler::test
