// SPDX-License-Identifier: Apache-2.0
// Cryptomatte: hashes of names, and ranks of the names in each pixel by coverage.
#include "formats/exr/cryptomatte.h"

#include <OpenEXR/ImfIDManifest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

#include <peeler/error.h>
#include <peeler/layered_image.h>
#include "core/base/parallel.h"
#include "core/image/composite.h"
#include "formats/file/json_text.h"

namespace peeler {
namespace {

struct Cover {
    std::uint32_t hash;
    float coverage;
};

/// The coverage of each name in a pixel, sorted by falling coverage, then by hash.
class PixelCoverage {
  public:
    void add(std::uint32_t hash, float coverage) {
        const auto same = [hash](const Cover& cover) { return cover.hash == hash; };
        const auto found = std::find_if(covers_.begin(), covers_.end(), same);
        if (found == covers_.end())
            covers_.push_back({hash, coverage});
        else
            found->coverage += coverage;
    }
    const std::vector<Cover>& ranked() {
        std::sort(covers_.begin(), covers_.end(), [](const Cover& a, const Cover& b) {
            return a.coverage != b.coverage ? a.coverage > b.coverage : a.hash < b.hash;
        });
        return covers_;
    }
    void clear() { covers_.clear(); }

  private:
    std::vector<Cover> covers_;
};

}  // namespace

std::uint32_t cryptomatteHash(const std::string& name) {
    constexpr std::uint32_t kExponentBits = 23, kExponent = 255;
    std::uint32_t hash = Imf::IDManifest::MurmurHash32(name);
    const std::uint32_t exponent = hash >> kExponentBits & kExponent;
    if (exponent == 0 || exponent == kExponent) hash ^= 1U << kExponentBits;
    return hash;
}

std::string cryptomatteHex(std::uint32_t hash) {
    std::array<char, 9> text{};
    std::snprintf(text.data(), text.size(), "%08x", hash);
    return text.data();
}

std::vector<CryptomatteLayer> cryptomatteLayers(const IdNames& names) {
    std::vector<CryptomatteLayer> layers = {{"CryptoObject", "id.object", names.objects},
                                            {"CryptoMaterial", "id.material", names.materials}};
    for (CryptomatteLayer& layer : layers)
        std::ranges::transform(layer.names, std::back_inserter(layer.hashes), cryptomatteHash);
    return layers;
}

std::vector<std::pair<std::string, std::string>> cryptomatteAttributes(
    const CryptomatteLayer& layer) {
    constexpr std::size_t kKeyDigits = 7;
    const std::string key =
        "cryptomatte/" + cryptomatteHex(cryptomatteHash(layer.name)).substr(0, kKeyDigits) + "/";
    nlohmann::json manifest = nlohmann::json::object();
    for (const std::string& name : layer.names)
        manifest[name] = cryptomatteHex(cryptomatteHash(name));
    return {{key + "name", layer.name},
            {key + "hash", "MurmurHash3_32"},
            {key + "conversion", "uint32_to_float32"},
            {key + "manifest", dumpJson(manifest)}};
}

FragmentArray cryptomatteArray(const CryptomatteLayer& layer) {
    FragmentArray array;
    array.type = PixelType::kFloat;
    constexpr std::size_t kRanksOfLevel = 2;
    for (std::size_t level = 0; level < kCryptomatteRanks / kRanksOfLevel; ++level) {
        for (const char* channel : {".R", ".G", ".B", ".A"})
            array.channels.push_back(layer.name + "0" + std::to_string(level) + channel);
    }
    return array;
}

void appendCryptomatte(const LayeredImage& image, const CryptomatteLayer& layer,
                       CompositeImage& composite) {
    const FragmentChannel ids = findIds(image, layer.id_channel);
    if (!ids) throw Error(ErrorKind::kInternal, "Cryptomatte needs ids", layer.id_channel);
    FragmentArray array = cryptomatteArray(layer);
    array.data.assign(composite.window.pixels() * array.stride(), std::byte{0});
    const std::span<float> values = array.as<float>();
    const std::vector<std::uint32_t>& hashes = layer.hashes;
    const auto width = static_cast<std::size_t>(composite.window.width());
    const std::size_t first = image.pixelIndex(composite.window.x0, composite.window.y0);
    parallelFor(static_cast<std::size_t>(composite.window.height()), [&](std::size_t row) {
        PixelCoverage coverage;
        float* out = values.data() + row * width * array.components();
        for (std::size_t x = 0; x < width; ++x, out += array.components()) {
            const std::size_t pixel = first + row * width + x;
            coverage.clear();
            // Transmittance in front of the fragment, per channel.
            std::array<float, 3> through = {1, 1, 1};
            for (std::uint32_t f = image.offsets[pixel]; f < image.offsets[pixel + 1]; ++f) {
                const std::uint32_t id = ids.id(f);
                const TintedColor color = tintedColorOf(image, f);
                const float seen = meanOpacity(through[0] * color[4], through[1] * color[5],
                                               through[2] * color[6]);
                if (id > 0 && id <= hashes.size() && seen > 0) coverage.add(hashes[id - 1], seen);
                for (std::size_t c = 0; c < 3; ++c)
                    through[c] *= 1 - color[4 + c];
            }
            const std::vector<Cover>& ranked = coverage.ranked();
            for (std::size_t i = 0; i < std::min(ranked.size(), kCryptomatteRanks); ++i) {
                std::memcpy(out + 2 * i, &ranked[i].hash, sizeof(float));
                out[2 * i + 1] = ranked[i].coverage;
            }
        }
    });
    composite.extra.push_back(std::move(array));
}

}  // namespace peeler
