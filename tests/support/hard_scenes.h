// SPDX-License-Identifier: Apache-2.0
// Scenes that have broken peelers before.
#pragma once

#include <vector>

#include <peeler/scene.h>

namespace peeler::test {

struct HardScene {
    const char* name;
    Scene scene;
};

/// The scenes, which are the same every time.
std::vector<HardScene> hardScenes();

/// The first of them, in which every other surface is glass, mostly coloured: of each alpha mode,
/// lit and unlit.
Scene glassScene();

}  // namespace peeler::test
