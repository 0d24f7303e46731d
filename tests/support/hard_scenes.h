// SPDX-License-Identifier: Apache-2.0
// Scenes that are hard to peel correctly.
#pragma once

#include <vector>

#include <peeler/scene.h>

namespace peeler::test {

struct HardScene {
    const char* name;
    Scene scene;
};

/// Returns the scenes, the same in every run.
std::vector<HardScene> hardScenes();

/// Returns the first scene of hardScenes() with glass on every other surface: mostly coloured, in
/// each alpha mode, lit and unlit.
Scene glassScene();

}  // namespace peeler::test
