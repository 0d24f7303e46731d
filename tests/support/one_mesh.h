// SPDX-License-Identifier: Apache-2.0
// Scenes of a single mesh.
#pragma once

#include <algorithm>
#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include <peeler/scene.h>

namespace peeler::test {

/// Returns a scene with one node, whose mesh has these primitives, and with their materials.
inline Scene oneMesh(std::vector<Primitive> primitives, const glm::dmat4& local = glm::dmat4(1)) {
    Scene scene;
    for (const Primitive& primitive : primitives)
        scene.materials.resize(
            std::max(scene.materials.size(), static_cast<std::size_t>(primitive.material) + 1));
    scene.meshes = {{"mesh", std::move(primitives)}};
    scene.nodes.resize(1);
    scene.nodes[0].mesh = 0;
    scene.nodes[0].local = local;
    scene.scenes = {{"", {0}}};
    return scene;
}

}  // namespace peeler::test
