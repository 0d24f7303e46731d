// SPDX-License-Identifier: Apache-2.0
// Fuzz target for flat pictures: reads PNG, JPEG, TIFF, Radiance and OpenEXR as pictures and
// environments, and PNG, JPEG and WebP as textures.
#include "formats/gltf/gltf_decoders.h"
#include "formats/image/environment_file.h"
#include "formats/image/flat_image.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

void takeImage(Input input) {
    constexpr int kMostSide = 256;
    constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20;
    attempt([&] { decodeTexture(input, "texture", {kMostSide, kMostBytes}); });
    const std::string path = fileOf("picture", input);
    attempt([&] { readFlatImage(path, {kMostSide, kMostBytes}); });
    attempt([&] { imageDescription(path); });
    ReadWarnings warnings(false, path);
    attempt([&] { readEnvironment(path, warnings, {kMostSide, kMostBytes}); });
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(image, peeler::fuzz::takeImage)
