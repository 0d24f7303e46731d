// SPDX-License-Identifier: Apache-2.0
// Scenes that have broken peeler before.
#pragma once

#include <vector>

#include <peeler/scene.h>

namespace peeler::test {

struct HardScene {
    const char* name;
    Scene scene;
};

/// Returns the scenes, which are the same every time.
std::vector<HardScene> hardScenes();

/// Returns the first of them with every other surface as glass, mostly coloured: with each alpha
/// mode, lit and unlit.
Scene glassScene();

}  // namespace peeler::test
