// SPDX-License-Identifier: Apache-2.0
// Tests the manifest of ID names. Both peeler and OpenEXR's own class read the names back.
#include "formats/exr/exr_header.h"

#include <gtest/gtest.h>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfIDManifest.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <libdeflate.h>

#include <cstring>
#include <random>

#include <peeler/error.h>
#include "formats/exr/exr_files.h"
#include "formats/exr/exr_writers.h"
#include "support/test_support.h"
#include "synthetic_image.h"

namespace peeler::test {
namespace {

const IdNames kNames{
    {"body", "body", "Übergröße", ""}, {"glass", "default material"}, {0, 1, 2, 1}};

/// Returns the header's attribute as stored: its length and a zlib stream.
std::vector<std::byte> stored(const IdNames& names) {
    Imf::Header header;
    for (const char* channel : {"layer_000.id.object", "layer_000.id.material", "id.objects"})
        header.channels().insert(channel, Imf::Channel(Imf::UINT));
    addIdManifest(header, names);
    const Imf::CompressedIDManifest& manifest = Imf::idManifest(header);
    std::vector<std::byte> bytes(8 + static_cast<std::size_t>(manifest._compressedDataSize));
    const auto size = static_cast<std::uint64_t>(manifest._uncompressedDataSize);
    std::memcpy(bytes.data(), &size, 8);
    std::memcpy(bytes.data() + 8, manifest._data, bytes.size() - 8);
    return bytes;
}

TEST(IdManifest, ReadsBack) {
    EXPECT_EQ(idNamesFromManifest(stored(kNames)), kNames);
}

TEST(IdManifest, ParentsNeedNotBeKnown) {
    IdNames names = kNames;
    names.parents.clear();
    EXPECT_EQ(idNamesFromManifest(stored(names)), names);
}

TEST(IdManifest, NeedsIds) {
    Imf::Header header;
    addIdManifest(header, kNames);
    EXPECT_FALSE(Imf::hasIDManifest(header));
}

TEST(IdManifest, IsInEveryPartWithIdsAndReadByOpenExr) {
    SyntheticPicture picture = makePicture({});
    LayeredImage& image = picture.image;
    image.extra = {{{"id.object", "id.material"}, PixelType::kUint, {}}};
    image.extra[0].data.resize(image.fragments() * 8);
    const ScratchDir folder;
    const std::string path = folder / "ids.exr";
    Provenance provenance;
    provenance.version = "test";
    provenance.ids = kNames;
    {
        ExrLdiWriter writer(path, {.cryptomatte = true, .provenance = provenance});
        writer.begin(picture.plan);
        writer.write(LayeredImage(image));
        writer.finish();
    }
    Imf::MultiPartInputFile file(path.c_str());
    ASSERT_GT(file.parts(), 2);
    EXPECT_FALSE(Imf::hasIDManifest(file.header(0))) << "the composite has no ids";
    for (int part = 1; part < file.parts(); ++part) {
        ASSERT_TRUE(Imf::hasIDManifest(file.header(part)));
        const Imf::IDManifest manifest(Imf::idManifest(file.header(part)));
        ASSERT_EQ(manifest.size(), 2U);
        const auto& objects = manifest[manifest.find("id.object")];
        EXPECT_EQ(objects.getEncodingScheme(), Imf::IDManifest::ID_SCHEME);
        EXPECT_EQ(objects.getHashScheme(), Imf::IDManifest::NOTHASHED);
        ASSERT_EQ(objects.size(), 4U);
        EXPECT_EQ(objects.getComponents(), (std::vector<std::string>{"name", "parent"}));
        EXPECT_EQ(objects.find(3).text(), (std::vector<std::string>{"Übergröße", "2"}));
        EXPECT_EQ(manifest[manifest.find("id.material")].getComponents().size(), 1U);
    }
    EXPECT_EQ(readExrInfo(path).provenance.ids, kNames);
}

TEST(IdManifest, DamageIsAnError) {
    const std::vector<std::byte> good = stored(kNames);
    for (std::size_t size = 0; size < good.size(); ++size)
        EXPECT_THROW(idNamesFromManifest(std::span(good).first(size)), Error) << size;
    std::vector<std::byte> huge = good;
    huge[7] = std::byte{0x7f};
    EXPECT_THROW(idNamesFromManifest(huge), Error);
    std::mt19937 random(7);
    for (int i = 0; i < 2000; ++i) {
        std::vector<std::byte> bytes = good;
        for (int n = 0; n < 3; ++n)
            bytes[random() % bytes.size()] = static_cast<std::byte>(random());
        try {
            idNamesFromManifest(bytes);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
        }
    }
}

TEST(IdManifest, ShorterThanItsVersion) {
    for (std::uint8_t n = 0; n < 4; ++n) {
        // A zlib stream (RFC 1950): a stored block, n zeros, and their Adler-32, n * 2^16 + 1.
        std::vector<std::uint8_t> bytes = {n, 0, 0, 0, 0, 0, 0, 0, 0x78, 0x01, 1, n, 0};
        bytes.insert(bytes.end(), {static_cast<std::uint8_t>(~n), 0xFF});
        bytes.insert(bytes.end(), n, 0);
        bytes.insert(bytes.end(), {0, n, 0, 1});
        try {
            idNamesFromManifest(std::as_bytes(std::span(bytes)));
            ADD_FAILURE() << int{n};
        } catch (const Error& error) {
            EXPECT_STREQ(error.what(), "the manifest is damaged: it ends too early") << int{n};
        }
    }
}

/// OpenEXR writes common prefixes once, and the most frequent names first. So some names here have
/// common prefixes, or are empty, repeated or longer than 255 bytes.
TEST(IdManifest, AnyNamesReadBack) {
    std::mt19937 random(11);
    for (int round = 0; round < 60; ++round) {
        IdNames names;
        const std::size_t count = 1 + random() % 300;
        for (std::size_t i = 0; i < count; ++i) {
            std::string name(random() % 4 == 0 ? random() % 700 : random() % 12, 'a');
            for (char& c : name)
                if (random() % 40 == 0) c = static_cast<char>(random() % 256);
            names.objects.push_back(random() % 3 == 0 && i > 0 ? names.objects[random() % i]
                                                               : name);
            names.parents.push_back(static_cast<std::uint32_t>(random() % (i + 1)));
            if (random() % 2 == 0) names.materials.push_back(name + "m");
        }
        EXPECT_EQ(idNamesFromManifest(stored(names)), names) << round;
    }
}

/// A manifest written piece by piece, as uncompressed bytes.
class ManifestBytes {
  public:
    ManifestBytes& number(std::uint32_t value) {
        for (int shift = 0; shift < 32; shift += 8)
            bytes_ += static_cast<char>(value >> shift);
        return *this;
    }
    ManifestBytes& text(const std::string& text, std::size_t times = 1) {
        for (; times > 0; --times)
            bytes_ += text;
        return *this;
    }
    /// Returns the reason for rejecting the manifest; "" if it is accepted.
    std::string problem() const {
        const auto size = static_cast<std::uint64_t>(bytes_.size());
        std::vector<std::byte> stored(8 + bytes_.size() / 500 + 1000);
        std::memcpy(stored.data(), &size, 8);
        libdeflate_compressor* const packer = libdeflate_alloc_compressor(9);
        stored.resize(8 + libdeflate_zlib_compress(packer, bytes_.data(), bytes_.size(),
                                                   stored.data() + 8, stored.size() - 8));
        libdeflate_free_compressor(packer);
        EXPECT_GT(stored.size(), 8U);
        EXPECT_LT(stored.size(), 200'000U);
        try {
            idNamesFromManifest(stored);
            return "";
        } catch (const Error& error) {
            return error.what();
        }
    }

  private:
    std::string bytes_ = std::string(4, '\0');  // begins with the version number, 0
};

/// Manifests that compress to less than 200 KB, but take gigabytes or minutes to decode naively.
TEST(IdManifest, AsksForNoMoreThanNamesNeed) {
    constexpr std::uint32_t kTexts = 2'000'000, kRuns = 1'000'000, kIds = 4'000'000;
    const std::string too_much = "the manifest is damaged: its names are too many or too long";
    // All texts repeat one text of 255 letters.
    ManifestBytes again;
    again.number(kTexts).text("\xFF\1").text("\1", kTexts - 1);
    again.text(std::string(255, 'a')).text("\xFF", kTexts - 1);
    EXPECT_EQ(again.problem(), too_much);
    // The manifest has a million runs of a hundred thousand texts each.
    ManifestBytes runs;
    runs.number(100'000).text(std::string(1, '\0')).text("\1", 99'999);
    runs.text(std::string(1, '\0'), 99'999).number(kRuns);
    for (std::uint32_t i = 0; i < kRuns; ++i)
        runs.number(0).number(99'999);
    runs.number(0);
    EXPECT_EQ(runs.problem(), "");
    // Millions of IDs share one text of 60,000 letters.
    ManifestBytes ids;
    ids.number(1).text("\xE0\xD4\3").text("a", 60'000).number(1).number(0).number(0);
    ids.number(1).number(1).text("\x09id.object").number(1).text("\4name");
    ids.text(std::string(1, '\0')).number(0).number(0).text("\2").number(kIds);
    for (std::uint32_t i = 0; i < kIds; ++i)
        ids.text(std::string("\1\0", 2));
    EXPECT_EQ(ids.problem(), too_much);
}

}  // namespace
}  // namespace peeler::test
