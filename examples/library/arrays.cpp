// SPDX-License-Identifier: Apache-2.0
// Makes a scene from arrays, and renders all its layers into memory: arrays
#include <peeler/error.h>
#include <peeler/renderer.h>

#include <cstdio>
#include <memory>
#include <utility>

int main() try {
    peeler::Scene scene;
    peeler::Material& glass = scene.materials.emplace_back();
    glass.base_color = {0.2F, 0.6F, 1, 0.5F};
    glass.alpha_mode = peeler::AlphaMode::kBlend;
    glass.double_sided = true;

    peeler::Primitive square;
    square.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    square.indices = {0, 1, 2, 0, 2, 3};
    square.material = 0;
    scene.meshes.push_back({"square", {square}});
    peeler::SceneRoots roots;
    for (const double z : {-1.0, 0.0, 1.0}) {  // three nodes place the mesh, one behind the other
        peeler::Node node;
        node.mesh = 0;
        node.local[3] = {0, 0, z, 1};
        roots.roots.push_back(static_cast<int>(scene.nodes.size()));
        scene.nodes.push_back(node);
    }
    scene.scenes.push_back(roots);

    const peeler::Shown shown{std::make_shared<const peeler::Scene>(std::move(scene))};
    peeler::CameraChoice camera;  // an orthographic camera that looks along -Z, 8 pixels per unit
    camera.eye = {0, 0, 3};
    camera.target = {0, 0, 0};
    camera.ortho_height = 4;
    camera.size = {32, 32};
    const auto image = peeler::Renderer().layers(shown, peeler::viewOf(shown, camera));

    const std::size_t middle = image.pixelIndex(16, 16);
    std::printf("%zu fragments, of the pixel in the middle at", image.fragments());
    for (std::size_t i = image.offsets[middle]; i < image.offsets[middle + 1]; ++i)
        std::printf(" %g", static_cast<double>(image.z[i]));
    std::printf("\n");
    return 0;
} catch (const peeler::Error& error) {
    std::fprintf(stderr, "%s (%s) %s\n", error.what(), error.where().c_str(), error.hint().c_str());
    return static_cast<int>(error.kind());
}
