// SPDX-License-Identifier: Apache-2.0
// Fuzz target for meshes: reads a PLY, an STL, arrays, or an OBJ as a scene. The OBJ may name
// itself as its material library.
#include "core/scene/posed_scene.h"
#include "formats/gltf/glb_writer.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/meshes/scene_reader.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

void takeMeshes(Input input) {
    if (!input.empty() && input[0] == '{') return;  // glTF has its own target
    fileOf("scene.mtl", input);
    const std::string path = fileOf("scene.obj", input);
    SceneReadOptions options;
    options.max_file_bytes = std::uint64_t{1} << 20;
    options.max_image_bytes = std::uint64_t{1} << 22;
    options.max_geometry_bytes = std::uint64_t{1} << 24;
    options.max_image_dimension = 1024;
    if (!input.empty() && input.back() % 2 == 1) options.smooth_normals = input.back() % 180;
    const Scene scene = readSceneFile(path, options);
    checkScene(scene);
    const PosedScene posed(scene);
    attempt([&] {
        GlbWriter package(path, scene);
        package.write((scratchFolder() / "packed.glb").string());
        checkScene(readGltf(scratchFolder() / "packed.glb", options));
    });
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(meshes, peeler::fuzz::takeMeshes)
