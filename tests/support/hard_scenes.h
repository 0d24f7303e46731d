// SPDX-License-Identifier: Apache-2.0
// Scenes that once broke peeler.
#pragma once

#include <vector>

#include <peeler/scene.h>

namespace peeler::test {

struct HardScene {
    const char* name;
    Scene scene;
};

/// Returns the scenes, which are the same in every run.
std::vector<HardScene> hardScenes();

/// Returns the first scene of hardScenes() with every other surface made of glass, mostly coloured,
/// in each alpha mode, lit and unlit.
Scene glassScene();

}  // namespace peeler::test
