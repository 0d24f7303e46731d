// SPDX-License-Identifier: Apache-2.0
// Seeds of Gaussian splats in every format.
#include "formats/splats/splat_files.h"
#include "fuzz/seeds.h"

namespace peeler::fuzz {

void addSplatSeeds(Seeds& seeds) {
    const std::vector<Splat> splats = {test::knownSplat(), test::knownSplat(1)};
    for (const std::string& seed :
         {test::splatPly(splats, 0), test::splatPly(splats, 3, "comment SplatRenderMode: mip\n"),
          test::compressedPly(splats, 0, false), test::compressedPly(splats, 2),
          test::gzip(test::unpackedSpzOf(splats, 1, 2)), test::unpackedSpzOf(splats, 3, 3, 1),
          test::unpackedSpzOf(splats, 0, 2), test::dotSplat(splats)})
        seeds["splats"].push_back(seedOf(seed));
    test::GltfBuilder gltf = test::splatGltf(splats, 2);
    gltf.gltf["buffers"] = {{{"byteLength", gltf.bin.size()}}};
    seeds["gltf"].push_back(seedOf(test::glb(gltf.gltf.dump(), gltf.bin)));
}

}  // namespace peeler::fuzz
