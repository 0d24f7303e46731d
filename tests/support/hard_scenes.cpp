// SPDX-License-Identifier: Apache-2.0
#include "support/hard_scenes.h"

#include <random>

#include "support/capture.h"

namespace peeler::test {

std::vector<HardScene> hardScenes() {
    std::vector<HardScene> scenes;
    std::mt19937 random(20011);  // fixed seed, to repeat failures
    std::uniform_real_distribution<float> unit(0, 1);
    const auto point = [&](float size, float z) {
        return glm::vec3((unit(random) - 0.5F) * size, (unit(random) - 0.5F) * size,
                         z + (unit(random) - 0.5F) * size);
    };
    const auto soup = [&](int count, float size, float z) {
        SceneBuilder builder;
        for (int i = 0; i < count; ++i) {
            const int m =
                builder.material({unit(random), unit(random), unit(random), unit(random)});
            builder.triangles({point(size, z), point(size, z), point(size, z)}, m);
        }
        return builder.scene();
    };
    scenes.push_back({"interpenetrating triangles", soup(150, 3, -4)});
    scenes.push_back({"across the near plane and behind the camera", soup(100, 6, 0)});
    {
        SceneBuilder builder;  // each mesh three times in the same place
        builder.scene() = soup(40, 2, -3);
        for (int mesh = 0; mesh < 40; ++mesh)
            for (int copy = 0; copy < 2; ++copy)
                builder.instance(mesh, glm::dmat4(1));
        scenes.push_back({"duplicated mesh", builder.scene()});
    }
    {
        SceneBuilder builder;  // nearly edge-on slivers
        for (int i = 0; i < 60; ++i) {
            const float y = 0.001F * static_cast<float>(i - 30);
            builder.quad({-1, y, -1}, {1, y, -1}, {1, y * 1.01F, -9}, {-1, y * 1.01F, -9},
                         builder.material({0.4F, 0.5F, 0.6F, 0.3F}));
        }
        scenes.push_back({"grazing quads", builder.scene()});
    }
    return scenes;
}

Scene glassScene() {
    Scene scene = hardScenes()[0].scene;
    constexpr AlphaMode kModes[] = {AlphaMode::kOpaque, AlphaMode::kMask, AlphaMode::kBlend};
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        Material& m = scene.materials[i];
        m.alpha_mode = kModes[i % 3];
        m.unlit = i % 4 == 0;
        m.metallic = 0;
        m.roughness = 0.4F;
        if (i % 2 == 0) m.transmission.factor = i % 8 == 0 ? 1 : 0.6F;
    }
    return scene;
}

}  // namespace peeler::test
