// SPDX-License-Identifier: Apache-2.0
// Tests Cryptomatte: hashes from the specification and from Psyop's own tests, and analytic
// coverage.
#include "formats/exr/cryptomatte.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

namespace peeler {
namespace {

TEST(Cryptomatte, HashesNamesAsTheSpecificationDoes) {
    // From the specification's example manifest.
    EXPECT_EQ(cryptomatteHex(cryptomatteHash("bunny")), "13851a76");
    EXPECT_EQ(cryptomatteHex(cryptomatteHash("default")), "42c9679f");
    // From the tests of Psyop's Nuke plugin (test_mm3hash_float).
    EXPECT_FLOAT_EQ(std::bit_cast<float>(cryptomatteHash("hello")), 6.07056271024e-17F);
    EXPECT_FLOAT_EQ(std::bit_cast<float>(cryptomatteHash("cube")), -4.08461912519e+15F);
    EXPECT_FLOAT_EQ(std::bit_cast<float>(cryptomatteHash("sphere")), 2.79018604383e+15F);
    EXPECT_FLOAT_EQ(std::bit_cast<float>(cryptomatteHash("plane")), 3.66557617593e-11F);
}

TEST(Cryptomatte, HashesAreNormalFloats) {
    for (int i = 0; i < 20000; ++i) {
        const auto value = std::bit_cast<float>(cryptomatteHash("name" + std::to_string(i)));
        ASSERT_TRUE(std::isnormal(value)) << i;
    }
}

TEST(Cryptomatte, DescribesItselfInFourAttributes) {
    const CryptomatteLayer layer{"CryptoObject", "id.object", {"bunny", "default", "bunny"}};
    std::map<std::string, std::string> found;
    for (const auto& [name, text] : cryptomatteAttributes(layer))
        found[name] = text;
    ASSERT_EQ(found.size(), 4U);
    // The key is the first seven digits of the hash of the layer's name, as in Blender's files.
    const std::string key =
        "cryptomatte/" + cryptomatteHex(cryptomatteHash("CryptoObject")).substr(0, 7);
    EXPECT_EQ(found[key + "/name"], "CryptoObject");
    EXPECT_EQ(found[key + "/hash"], "MurmurHash3_32");
    EXPECT_EQ(found[key + "/conversion"], "uint32_to_float32");
    EXPECT_EQ(nlohmann::json::parse(found[key + "/manifest"]),
              (nlohmann::json{{"bunny", "13851a76"}, {"default", "42c9679f"}}));
}

/// Returns a picture of one pixel, with fragments of these objects and alphas from front to back.
LayeredImage pixelOfObjects(const std::vector<std::pair<std::uint32_t, float>>& fragments) {
    LayeredImage image;
    image.window = {0, 0, 1, 1};
    image.offsets = {0, static_cast<std::uint32_t>(fragments.size())};
    image.color = {{"R", "G", "B", "A"}, PixelType::kFloat, {}};
    image.extra = {{{"id.object", "id.material"}, PixelType::kUint, {}}};
    image.color.data.resize(fragments.size() * 16);
    image.extra[0].data.resize(fragments.size() * 8);
    for (std::size_t i = 0; i < fragments.size(); ++i) {
        image.z.push_back(static_cast<float>(i + 1));
        image.color.as<float>()[4 * i + 3] = fragments[i].second;
        image.extra[0].as<std::uint32_t>()[2 * i] = fragments[i].first;
        image.extra[0].as<std::uint32_t>()[2 * i + 1] = 77;
    }
    return image;
}

std::vector<std::pair<std::string, float>> ranks(const LayeredImage& image,
                                                 const std::vector<std::string>& names) {
    CompositeImage composite;
    composite.window = image.window;
    appendCryptomatte(image, cryptomatteLayers({names, {}}).front(), composite);
    const FragmentArray& array = composite.extra.at(0);
    EXPECT_EQ(array.channels.size(), 12U);
    EXPECT_EQ(array.channels.front(), "CryptoObject00.R");
    EXPECT_EQ(array.channels.back(), "CryptoObject02.A");
    std::vector<std::pair<std::string, float>> found;
    for (std::size_t i = 0; i < kCryptomatteRanks; ++i) {
        const float hash = array.as<float>()[2 * i], coverage = array.as<float>()[2 * i + 1];
        if (coverage == 0) continue;
        std::string name = "?";
        for (const std::string& candidate : names)
            if (std::bit_cast<std::uint32_t>(hash) == cryptomatteHash(candidate)) name = candidate;
        found.emplace_back(name, coverage);
    }
    return found;
}

TEST(Cryptomatte, CoverageIsWhatEachObjectAddsToAlpha) {
    const auto found =
        ranks(pixelOfObjects({{1, 0.25F}, {2, 0.5F}, {1, 0.5F}, {3, 1}, {2, 1}}), {"a", "b", "c"});
    // a gets 0.25 + 0.75·0.5·0.5, b gets 0.75·0.5, and c, which is opaque, gets the rest.
    ASSERT_EQ(found.size(), 3U);
    EXPECT_EQ(found[0], (std::pair<std::string, float>{"a", 0.4375F}));
    EXPECT_EQ(found[1], (std::pair<std::string, float>{"b", 0.375F}));
    EXPECT_EQ(found[2], (std::pair<std::string, float>{"c", 0.1875F}));
}

TEST(Cryptomatte, NamesThatAreAlikeAreOne) {
    const auto found = ranks(pixelOfObjects({{1, 0.5F}, {2, 0.5F}}), {"twin", "twin"});
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0], (std::pair<std::string, float>{"twin", 0.75F}));
}

TEST(Cryptomatte, KeepsTheSixThatCoverMost) {
    std::vector<std::pair<std::uint32_t, float>> fragments;
    std::vector<std::string> names;
    for (std::uint32_t i = 0; i < 9; ++i) {
        fragments.emplace_back(i + 1, 0.25F);
        names.push_back("object " + std::to_string(i));
    }
    const auto found = ranks(pixelOfObjects(fragments), names);
    ASSERT_EQ(found.size(), kCryptomatteRanks);
    for (std::size_t i = 0; i < found.size(); ++i)
        EXPECT_EQ(found[i].first, names[i]);
}

TEST(Cryptomatte, AnEmptyPixelHasNothing) {
    EXPECT_TRUE(ranks(pixelOfObjects({}), {"a"}).empty());
}

}  // namespace
}  // namespace peeler
