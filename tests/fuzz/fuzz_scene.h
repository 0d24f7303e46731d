// SPDX-License-Identifier: Apache-2.0
// A scene with one triangle and one camera, for targets that need a scene.
#pragma once

#include <peeler/scene.h>

namespace peeler::fuzz {

inline Scene tinyScene() {
    Scene scene;
    scene.scenes = {{"", {0}}};
    scene.nodes.resize(1);
    scene.nodes[0].mesh = 0;
    scene.nodes[0].camera = 0;
    scene.cameras.resize(1);
    scene.materials.resize(1);
    Primitive triangle;
    triangle.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
    scene.meshes = {{"", {triangle}}};
    return scene;
}

}  // namespace peeler::fuzz
