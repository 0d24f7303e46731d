// SPDX-License-Identifier: Apache-2.0
// Fuzz target for KTX 2.0 textures.
#include "formats/gltf/gltf_decoders.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

void takeKtx2(Input input) {
    constexpr std::string_view kBegin = "\xABKTX 20\xBB";
    if (input.size() < kBegin.size() ||
        std::memcmp(input.data(), kBegin.data(), kBegin.size()) != 0)
        return;  // not KTX 2.0
    constexpr int kMostSide = 256;
    constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20;
    decodeTexture(input, "texture", {kMostSide, kMostBytes});
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(ktx2, peeler::fuzz::takeKtx2)
