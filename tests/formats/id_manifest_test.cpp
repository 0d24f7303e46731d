// SPDX-License-Identifier: Apache-2.0
// Names of ids: through OpenEXR's own manifest, and back from the bytes of the attribute.
#include "formats/exr/exr_header.h"

#include <gtest/gtest.h>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfIDManifest.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>

#include <cstring>
#include <random>

#include "core/base/error.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/exr_writers.h"
#include "support/test_support.h"
#include "synthetic_image.h"

namespace peeler::test {
namespace {

const IdNames kNames{
    {"body", "body", "Übergröße", ""}, {"glass", "default material"}, {0, 1, 2, 1}};

/// What a header holds, as a file has it: the length, and what zlib has packed.
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
        // RFC 1950: a block that is stored, n zeros, and their Adler-32, n * 2^16 + 1.
        std::vector<std::uint8_t> bytes = {n, 0, 0, 0, 0, 0, 0, 0, 0x78, 0x01, 1, n, 0};
        bytes.insert(bytes.end(), {static_cast<std::uint8_t>(~n), 0xFF});
        bytes.insert(bytes.end(), n, 0);
        bytes.insert(bytes.end(), {0, n, 0, 1});
        try {
            idNamesFromManifest(std::as_bytes(std::span(bytes)));
            ADD_FAILURE() << int{n};
        } catch (const Error& error) {
            EXPECT_STREQ(error.what(), "the manifest has no plausible size") << int{n};
        }
    }
}

}  // namespace
}  // namespace peeler::test
