// SPDX-License-Identifier: Apache-2.0
// Fuzz target for glTF: reads a .gltf or .glb as a scene, poses the scene, and packs the file with
// additions.
#include "core/scene/posed_scene.h"
#include "formats/gltf/glb_writer.h"
#include "formats/gltf/gltf_reader.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

void takeGltf(Input input) {
    const std::string path = fileOf("scene.glb", input);
    GltfOptions options;
    options.max_file_bytes = std::uint64_t{1} << 20;
    options.max_image_bytes = std::uint64_t{1} << 22;
    options.max_geometry_bytes = std::uint64_t{1} << 24;
    options.max_image_dimension = 1024;
    const Scene scene = readGltf(path, options);
    attempt([&] { const PosedScene posed(scene); });
    attempt([&] {
        std::vector<int> all;
        for (std::size_t i = 0; i < scene.animations.size(); ++i)
            all.push_back(static_cast<int>(i));
        const PosedScene posed(scene, scene.default_scene, poseAt(scene, all, 0.375));
    });
    attempt([&] {
        GlbWriter package(path, options);
        package.addAccessor({1, 2, 3, 4}, {5121, true, "VEC4", 1});
        package.write((scratchFolder() / "packed.glb").string());
        readGltf(scratchFolder() / "packed.glb", options);
    });
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(gltf, peeler::fuzz::takeGltf)
