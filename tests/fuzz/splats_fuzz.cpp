// SPDX-License-Identifier: Apache-2.0
// Fuzz target for Gaussian splats: reads a 3DGS PLY, a compressed PLY, an SPZ (also without gzip,
// whose checksum few mutations pass) or a .splat as a scene.
#include <cstdlib>

#include "core/scene/posed_scene.h"
#include "formats/meshes/scene_reader.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

void takeSplats(Input input) {
    const std::string path = fileOf("scene.splat", input);
    SceneReadOptions options;
    options.max_file_bytes = std::uint64_t{1} << 20;
    options.max_geometry_bytes = std::uint64_t{1} << 24;
    const Scene scene = readSceneFile(path, options);
    checkScene(scene);
    const PosedScene posed(scene);
    for (const Mesh& mesh : scene.meshes) {
        for (const Primitive& primitive : mesh.primitives) {
            if (!primitive.splats) continue;
            const Splats& splats = *primitive.splats;
            const std::size_t count = primitive.positions.size();
            if (splats.size() != count || splats.scales.size() != count ||
                splats.rotations.size() != count ||
                splats.harmonics.size() != count * splats.coefficients())
                std::abort();
        }
    }
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(splats, peeler::fuzz::takeSplats)
