// SPDX-License-Identifier: Apache-2.0
// Fuzz target for compressed streams of EXT_meshopt_compression. The input has the mode, filter,
// stride and count (two bytes), then the stream.
#include <array>

#include "formats/gltf/gltf_decoders.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

void takeMeshopt(Input input) {
    constexpr std::array kModes = {"ATTRIBUTES", "TRIANGLES", "INDICES", "OTHERS"};
    constexpr std::array kFilters = {"NONE",        "OCTAHEDRAL", "QUATERNION",
                                     "EXPONENTIAL", "COLOR",      "OTHER"};
    Taker taker(input);
    MeshoptStream stream;
    stream.mode = kModes[taker.below(kModes.size())];
    stream.filter = kFilters[taker.below(kFilters.size())];
    stream.stride = taker.take<std::uint16_t>() % 300U;
    stream.count = taker.take<std::uint16_t>();
    stream.bytes = taker.rest();
    checkMeshoptStream(stream);
    std::vector<std::uint8_t> out(stream.count * stream.stride);
    decodeMeshoptStream(stream, out);
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(meshopt, peeler::fuzz::takeMeshopt)
