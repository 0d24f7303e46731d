// SPDX-License-Identifier: Apache-2.0
// Tests that PNG, BMP and TGA of every kind give exactly their RGBA, that JPEG, WebP and TIFF can
// be read, and that damage is rejected.
#include "formats/gltf/gltf_decoders.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string_view>

#include <peeler/error.h>
#include "formats/image/bitmap_builder.h"
#include "formats/image/image_metadata.h"
#include "formats/image/png_builder.h"

namespace peeler::test {
namespace {

Bytes rgbaOf(const Bytes& file) {
    return decodeTexture(file, "image").image.rgba;
}

/// Returns a picture of 8-bit RGB, encoded by OpenImageIO; empty if OpenImageIO cannot write the
/// format. `color` is a single colour, or the colours of all pixels.
Bytes encoded(const std::string& format, int width, int height, const Bytes& color) {
    const auto output = OIIO::ImageOutput::create(format);
    if (!output) return {};
    Bytes file;
    OIIO::Filesystem::IOVecOutput memory(file);
    if (!output->supports("ioproxy")) return {};
    OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
    OIIO::Filesystem::IOProxy* proxy = &memory;
    spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    spec.attribute("CompressionQuality", 100);
    Bytes pixels;
    while (pixels.size() < static_cast<std::size_t>(3 * width * height))
        pixels.insert(pixels.end(), color.begin(), color.end());
    if (!output->open("image." + format, spec) ||
        !output->write_image(OIIO::TypeDesc::UINT8, pixels.data()) || !output->close())
        return {};
    return file;
}

TEST(TextureDecoder, KeepsRgbaAsStored) {
    // Alpha is straight: colours under alpha 0 are kept, and no colour is premultiplied.
    const Bytes pixels = {10, 20, 30, 0, 200, 100, 50, 128};
    const Image image = decodeTexture(png(2, 1, PngColor::kRgba, 8, pixels), "name").image;
    EXPECT_EQ(image.name, "name");
    EXPECT_EQ(image.width, 2);
    EXPECT_EQ(image.height, 1);
    EXPECT_EQ(image.rgba, pixels);
}

TEST(TextureDecoder, KeepsRowsTopToBottom) {
    const Image image = decodeTexture(png(1, 2, PngColor::kRgb, 8, {1, 2, 3, 4, 5, 6}), "").image;
    EXPECT_EQ(image.height, 2);
    EXPECT_EQ(image.rgba, (Bytes{1, 2, 3, 255, 4, 5, 6, 255}));
}

TEST(TextureDecoder, IgnoresGammaAndColorSpaces) {
    const std::vector<PngChunk> chunks = {{"gAMA", {0, 0, 0xFF, 0xFF}}};
    EXPECT_EQ(rgbaOf(png(1, 1, PngColor::kRgba, 8, {100, 150, 200, 100}, chunks)),
              (Bytes{100, 150, 200, 100}));
}

TEST(TextureDecoder, ExpandsGrey) {
    EXPECT_EQ(rgbaOf(png(2, 1, PngColor::kGrey, 8, {0, 77})),
              (Bytes{0, 0, 0, 255, 77, 77, 77, 255}));
    EXPECT_EQ(rgbaOf(png(2, 1, PngColor::kGreyAlpha, 8, {9, 0, 77, 33})),
              (Bytes{9, 9, 9, 0, 77, 77, 77, 33}));
    // The image has one bit per pixel: 0b01000000.
    EXPECT_EQ(rgbaOf(png(2, 1, PngColor::kGrey, 1, {0x40})),
              (Bytes{0, 0, 0, 255, 255, 255, 255, 255}));
}

TEST(TextureDecoder, ExpandsPalettes) {
    const PngChunk palette = {"PLTE", {1, 2, 3, 4, 5, 6}};
    EXPECT_EQ(rgbaOf(png(2, 1, PngColor::kPalette, 8, {1, 0}, {palette})),
              (Bytes{4, 5, 6, 255, 1, 2, 3, 255}));
    EXPECT_EQ(rgbaOf(png(2, 1, PngColor::kPalette, 8, {1, 0}, {palette, {"tRNS", {255, 128}}})),
              (Bytes{4, 5, 6, 128, 1, 2, 3, 255}));
}

TEST(TextureDecoder, ReadsTransparentColors) {
    EXPECT_EQ(
        rgbaOf(png(2, 1, PngColor::kRgb, 8, {1, 2, 3, 4, 5, 6}, {{"tRNS", {0, 4, 0, 5, 0, 6}}})),
        (Bytes{1, 2, 3, 255, 4, 5, 6, 0}));
    EXPECT_EQ(rgbaOf(png(2, 1, PngColor::kGrey, 8, {7, 8}, {{"tRNS", {0, 8}}})),
              (Bytes{7, 7, 7, 255, 8, 8, 8, 0}));
}

TEST(TextureDecoder, RoundsSixteenBits) {
    EXPECT_EQ(rgbaOf(png(1, 1, PngColor::kRgba, 16, {255, 255, 0, 0, 0x80, 0x80, 0x40, 0x40})),
              (Bytes{255, 0, 128, 64}));
}

TEST(TextureDecoder, NeverParsesMetadata) {
    // A text chunk with a wrong checksum and an invalid profile must not matter.
    Bytes file = png(1, 1, PngColor::kRgb, 8, {1, 2, 3},
                     {{"iCCP", {'x', 0, 0, 1, 2, 3}}, {"tEXt", {'a', 0, 'b'}}});
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    file[text.find("tEXt") + 4] ^= 1;
    EXPECT_EQ(rgbaOf(file), (Bytes{1, 2, 3, 255}));
    // A wrong checksum of the pixels is an error.
    file[text.find("IDAT") + 8] ^= 1;
    EXPECT_THROW(rgbaOf(file), Error);

    Bytes jpeg = encoded("jpeg", 8, 8, {9, 9, 9});
    const Bytes exif = {0xFF, 0xE1, 0, 10, 'E', 'x', 'i', 'f', 0, 0, 'I', 'I'};
    jpeg.insert(jpeg.begin() + 2, exif.begin(), exif.end());
    EXPECT_EQ(decodeTexture(jpeg, "").image.width, 8);
}

/// Returns a WebP in the extended container (RFC 9649, section 2.7): two lossless pixels among
/// chunks of metadata.
Bytes extendedWebp(const Bytes& exif) {
    Bytes chunks;
    const auto number = [](Bytes& to, std::size_t value) {
        for (std::size_t i = 0; i < 4; ++i)
            to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    };
    const auto chunk = [&](std::string_view name, const Bytes& bytes) {
        chunks.insert(chunks.end(), name.begin(), name.end());
        number(chunks, bytes.size());
        chunks.insert(chunks.end(), bytes.begin(), bytes.end());
        if (bytes.size() % 2 != 0) chunks.push_back(0);
    };
    // Flags for profile, Exif and XMP; the size is 2 x 1.
    chunk("VP8X", {0x2C, 0, 0, 0, 1, 0, 0, 0, 0, 0});
    chunk("ICCP", {1, 2, 3});
    chunk("VP8L", {0x2F, 0x01, 0x00, 0x00, 0x00, 0x0F, 0x70, 0x01, 0xB1, 0x3D, 0x26, 0xC8, 0xB6,
                   0x0D, 0x6D, 0x3B, 0xD0, 0xE7, 0x3F, 0xD8, 0x0F, 0x19, 0xD1, 0xFF, 0x00});
    chunk("EXIF", exif);
    chunk("XMP ", {'<'});
    Bytes file = {'R', 'I', 'F', 'F'};
    number(file, 4 + chunks.size());
    for (const char letter : {'W', 'E', 'B', 'P'})
        file.push_back(static_cast<std::uint8_t>(letter));
    file.insert(file.end(), chunks.begin(), chunks.end());
    return file;
}

TEST(TextureDecoder, ReadsWebpWithoutItsMetadata) {
    // Readers skip the first six bytes of Exif data; this Exif data has only five bytes.
    const Bytes file = extendedWebp({'E', 'x', 'i', 'f', 0});
    EXPECT_EQ(rgbaOf(file), (Bytes{200, 100, 50, 255, 1, 2, 3, 255}));
    const Bytes reduced = withoutWebpMetadata(file).bytes;
    const std::string_view text(reinterpret_cast<const char*>(reduced.data()), reduced.size());
    for (const char* name : {"EXIF", "XMP ", "ICCP"})
        EXPECT_EQ(text.find(name), std::string_view::npos) << name;
    EXPECT_EQ(reduced[20], 0);  // the flags of VP8X: none
    EXPECT_EQ(reduced[4], reduced.size() - 8);
    EXPECT_EQ(withoutWebpMetadata(reduced).bytes, reduced);
    // A chunk that exceeds the file is an error.
    EXPECT_THROW(rgbaOf(Bytes(file.begin(), file.end() - 2)), Error);
}

/// Returns Exif data with an orientation, in either byte order (CIPA DC-008, 4.6.2).
Bytes exifOf(std::uint8_t orientation, bool little) {
    const auto number = [&](Bytes& to, unsigned value, unsigned size) {
        for (unsigned i = 0; i < size; ++i)
            to.push_back(static_cast<std::uint8_t>(value >> 8 * (little ? i : size - 1 - i)));
    };
    Bytes exif = {'E', 'x', 'i', 'f', 0, 0};
    exif.insert(exif.end(), 2, little ? 'I' : 'M');
    number(exif, 42, 2);
    number(exif, 8, 4);
    number(exif, 2, 2);  // number of entries
    for (const unsigned tag : {0x010FU, 0x0112U}) {
        number(exif, tag, 2);
        number(exif, 3, 2);  // type: short
        number(exif, 1, 4);
        number(exif, tag == 0x0112U ? orientation : 7, 2);
        number(exif, 0, 2);
    }
    return exif;
}

/// Returns the JPEG with an Exif segment inserted after the first marker.
Bytes withExif(Bytes jpeg, const Bytes& exif) {
    Bytes segment = {0xFF, 0xE1, 0, static_cast<std::uint8_t>(exif.size() + 2)};
    segment.insert(segment.end(), exif.begin(), exif.end());
    jpeg.insert(jpeg.begin() + 2, segment.begin(), segment.end());
    return jpeg;
}

TEST(TextureDecoder, WarnsOfAnOrientationThatItDoesNotCarryOut) {
    const Bytes jpeg = encoded("jpeg", 8, 4, {9, 9, 9});
    for (const bool little : {false, true}) {
        EXPECT_TRUE(decodeTexture(withExif(jpeg, exifOf(1, little)), "").notes.empty());
        EXPECT_TRUE(decodeTexture(withExif(jpeg, exifOf(9, little)), "").notes.empty());
        const DecodedTexture turned = decodeTexture(withExif(jpeg, exifOf(6, little)), "");
        EXPECT_EQ(turned.image.width, 8);
        ASSERT_EQ(turned.notes.size(), 1U);
        EXPECT_NE(turned.notes[0].find("orientation 6"), std::string::npos) << turned.notes[0];
        // Truncated Exif has no effect, wherever it ends.
        const Bytes whole = exifOf(6, little);
        for (std::size_t size = 0; size < whole.size(); ++size)
            EXPECT_TRUE(
                decodeTexture(
                    withExif(jpeg, Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(size))), "")
                    .notes.empty());
    }
    const Bytes exif = exifOf(3, false);
    const Bytes of_png(exif.begin() + 6, exif.end());
    EXPECT_EQ(
        decodeTexture(png(1, 1, PngColor::kRgb, 8, {1, 2, 3}, {{"eXIf", of_png}}), "").notes.size(),
        1U);
    EXPECT_EQ(decodeTexture(extendedWebp(exif), "").notes.size(), 1U);
}

TEST(TextureDecoder, WarnsOfAJpegThatIsCutOff) {
    Bytes pixels(64 * 64 * 3);
    for (std::size_t i = 0; i < pixels.size(); ++i)
        pixels[i] = static_cast<std::uint8_t>(i * i / 7);
    const Bytes whole = encoded("jpeg", 64, 64, pixels);
    EXPECT_TRUE(decodeTexture(whole, "").notes.empty());
    for (const std::size_t kept : {whole.size() * 2 / 3, whole.size() - 2}) {
        const Bytes cut(whole.begin(), whole.begin() + std::ptrdiff_t(kept));
        const DecodedTexture texture = decodeTexture(cut, "");
        ASSERT_EQ(texture.notes.size(), 1U) << kept;
        EXPECT_NE(texture.notes[0].find("cut off"), std::string::npos) << texture.notes[0];
        EXPECT_EQ(texture.image.width, 64);
    }
}

TEST(TextureDecoder, WarnsOfAJpegThatIsDamaged) {
    Bytes pixels(64 * 64 * 3);
    for (std::size_t i = 0; i < pixels.size(); ++i)
        pixels[i] = static_cast<std::uint8_t>(i * i / 7);
    Bytes damaged = encoded("jpeg", 64, 64, pixels);
    const auto middle = damaged.begin() + std::ptrdiff_t(damaged.size() / 2);
    std::fill(middle, damaged.end() - 2, std::uint8_t{0});
    const DecodedTexture texture = decodeTexture(damaged, "");
    ASSERT_EQ(texture.notes.size(), 1U);
    EXPECT_NE(texture.notes[0].find("the JPEG is damaged ("), std::string::npos)
        << texture.notes[0];
}

TEST(TextureDecoder, WarnsOfAnimations) {
    const Bytes animated =
        png(1, 1, PngColor::kRgb, 8, {1, 2, 3}, {{"acTL", {0, 0, 0, 2, 0, 0, 0, 0}}});
    const DecodedTexture texture = decodeTexture(animated, "");
    EXPECT_EQ(texture.image.rgba, (Bytes{1, 2, 3, 255}));
    ASSERT_EQ(texture.notes.size(), 1U);
    EXPECT_NE(texture.notes[0].find("animated"), std::string::npos) << texture.notes[0];
}

TEST(TextureDecoder, ReadsJpeg) {
    const Bytes file = encoded("jpeg", 16, 8, {200, 100, 50});
    ASSERT_FALSE(file.empty());
    const Image image = decodeTexture(file, "").image;
    EXPECT_EQ(image.width, 16);
    EXPECT_EQ(image.height, 8);
    EXPECT_NEAR(image.rgba[0], 200, 3);
    EXPECT_NEAR(image.rgba[1], 100, 3);
    EXPECT_NEAR(image.rgba[2], 50, 3);
    EXPECT_EQ(image.rgba[3], 255);
}

/// Three palette entries as BMP stores them: red, green and blue.
const Bytes kPalette = {0, 0, 255, 0, 0, 255, 0, 0, 255, 0, 0, 0};
const Bytes kRed = {255, 0, 0, 255}, kGreen = {0, 255, 0, 255}, kBlue = {0, 0, 255, 255};

Bytes joined(std::initializer_list<Bytes> parts) {
    Bytes all;
    for (const Bytes& part : parts)
        all.insert(all.end(), part.begin(), part.end());
    return all;
}

TEST(TextureDecoder, ReadsBmpOfEveryDepth) {
    // Rows are padded to four bytes, and the lowest row is first.
    EXPECT_EQ(rgbaOf(bmp(1, 2, 24, 0, {}, {0, 0, 255, 9, 0, 255, 0, 9})), joined({kGreen, kRed}));
    EXPECT_EQ(rgbaOf(bmp(1, -2, 24, 0, {}, {0, 0, 255, 9, 0, 255, 0, 9})), joined({kRed, kGreen}));
    EXPECT_EQ(rgbaOf(bmp(3, 1, 8, 0, kPalette, {2, 0, 1, 9})), joined({kBlue, kRed, kGreen}));
    EXPECT_EQ(rgbaOf(bmp(3, 1, 4, 0, kPalette, {0x20, 0x10, 0, 0})), joined({kBlue, kRed, kGreen}));
    EXPECT_EQ(rgbaOf(bmp(3, 1, 1, 0, kPalette, {0x40, 0, 0, 0})), joined({kRed, kGreen, kRed}));
    EXPECT_EQ(rgbaOf(bmp(2, 1, 16, 0, {}, {0, 0x7C, 0xE0, 0x03})), joined({kRed, kGreen}));
    EXPECT_EQ(rgbaOf(bmp(2, 1, 16, 3, {0, 0xF8, 0, 0, 0xE0, 7, 0, 0, 31, 0, 0, 0},
                         {0, 0xF8, 0xE0, 0x07})),
              joined({kRed, kGreen}));
    EXPECT_EQ(rgbaOf(bmp(1, 1, 32, 0, {}, {0, 0, 255, 0})), kRed) << "no alpha";
    EXPECT_EQ(rgbaOf(bmp(1, 1, 32, 0, {}, {30, 20, 10, 128})), (Bytes{10, 20, 30, 128}));
    EXPECT_EQ(decodeTexture(bmp(1, 1, 24, 0, {}, {1, 2, 3, 0}), "").image.codec, "BMP");
}

TEST(TextureDecoder, ReadsBmpInRunLengths) {
    // A run, literal pixels (padded), an end of line, a jump and an end.
    EXPECT_EQ(rgbaOf(bmp(3, 2, 8, 1, kPalette, {2, 1, 1, 2, 0, 0, 0, 3, 0, 1, 2, 0, 0, 1})),
              joined({kRed, kGreen, kBlue, kGreen, kGreen, kBlue}));
    EXPECT_EQ(rgbaOf(bmp(3, 1, 4, 2, kPalette, {3, 0x12, 0, 1})), joined({kGreen, kBlue, kGreen}));
    EXPECT_EQ(rgbaOf(bmp(3, 1, 8, 1, kPalette, {0, 2, 2, 0, 1, 1, 0, 1})),
              joined({kRed, kRed, kGreen}));
    EXPECT_THROW(rgbaOf(bmp(3, 1, 8, 1, kPalette, {2, 1})), Error);
}

TEST(TextureDecoder, ReadsTgaOfEveryType) {
    const Bytes red_green = {0, 0, 255, 0, 255, 0};
    EXPECT_EQ(rgbaOf(tga(2, 1, 2, 24, 0, red_green)), joined({kGreen, kRed}));
    EXPECT_EQ(rgbaOf(tga(2, 1, 2, 24, 0x20, red_green)), joined({kRed, kGreen}));
    EXPECT_EQ(rgbaOf(tga(2, 2, 1, 24, 0x10, red_green)), joined({kGreen, kRed}));
    EXPECT_EQ(rgbaOf(tga(2, 1, 1, 32, 8, {30, 20, 10, 128})), (Bytes{10, 20, 30, 128}));
    EXPECT_EQ(rgbaOf(tga(2, 2, 1, 16, 0, {0, 0x7C, 0xE0, 0x03})), joined({kRed, kGreen}));
    EXPECT_EQ(rgbaOf(tga(3, 2, 1, 8, 0, {7, 8})), (Bytes{7, 7, 7, 255, 8, 8, 8, 255}));
    // Two run lengths: two pixels of one colour, then a literal pixel.
    EXPECT_EQ(rgbaOf(tga(10, 3, 1, 24, 0, {0x81, 0, 0, 255, 0, 0, 255, 0})),
              joined({kRed, kRed, kGreen}));
    EXPECT_EQ(rgbaOf(tga(11, 3, 1, 8, 0, {2, 1, 2, 3})),
              (Bytes{1, 1, 1, 255, 2, 2, 2, 255, 3, 3, 3, 255}));
    Bytes palette = tga(1, 2, 1, 8, 0, {0, 0, 255, 0, 255, 0, 5, 4});
    palette[1] = 1;  // the palette has two 24-bit colours, from index 4 on
    palette[3] = 4;
    palette[5] = 2;
    palette[7] = 24;
    EXPECT_EQ(rgbaOf(palette), joined({kGreen, kRed}));
    palette.back() = 6;
    EXPECT_THROW(rgbaOf(palette), Error);
    EXPECT_THROW(rgbaOf(tga(2, 2, 1, 24, 0, {0, 0, 255, 0})), Error);
    EXPECT_THROW(rgbaOf(tga(10, 3, 1, 24, 0, {0x81, 0, 0, 255})), Error);
}

TEST(TextureDecoder, ReadsTiff) {
    for (const char* format : {"tiff", "bmp", "targa"}) {
        const Bytes file = encoded(format, 2, 2, {200, 100, 50});
        if (file.empty()) continue;
        const DecodedTexture texture = decodeTexture(file, "");
        EXPECT_EQ(Bytes(texture.image.rgba.begin(), texture.image.rgba.begin() + 4),
                  (Bytes{200, 100, 50, 255}))
            << format;
        EXPECT_FALSE(texture.in_gltf);
    }
}

TEST(TextureDecoder, RefusesOtherFormats) {
    for (const char* text : {"", "GIF89a......", "\xABKTX 11\xBB\r\n\x1A\n", "II*",
                             "P6 1 1 255 abc", "v/1\1", "RIFF1234WAVE"}) {
        const std::string bytes(text);
        try {
            decodeTexture({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, "");
            ADD_FAILURE() << text;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_NE(std::string(error.what()).find("neither PNG nor JPEG"), std::string::npos);
        }
    }
}

TEST(TextureDecoder, NeverEndsOtherwiseThanInAnImageOrAnInputError) {
    const std::vector<Bytes> files = {
        png(8, 8, PngColor::kRgba, 8, Bytes(256, 99)),
        png(2, 1, PngColor::kPalette, 8, {1, 0}, {{"PLTE", {1, 2, 3, 4, 5, 6}}}),
        encoded("jpeg", 16, 16, {1, 2, 3}),
        extendedWebp(Bytes(5, 1)),
        bmp(3, 2, 8, 1, kPalette, {2, 1, 1, 2, 0, 0, 0, 3, 0, 1, 2, 0, 0, 1}),
        bmp(2, 1, 16, 0, {}, {0, 0x7C, 0xE0, 0x03}),
        tga(10, 3, 1, 24, 0, {0x81, 0, 0, 255, 0, 0, 255, 0})};
    unsigned state = 1;
    const auto random = [&] { return state = state * 1664525U + 1013904223U, state >> 8U; };
    const auto attempt = [](const Bytes& file) {
        try {
            const Image image = decodeTexture(file, "", {256, 1U << 20U}).image;
            EXPECT_EQ(image.rgba.size(), static_cast<std::size_t>(image.width * image.height) * 4);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
        }
    };
    for (const Bytes& file : files) {
        for (std::size_t size = 0; size < file.size(); ++size)
            attempt(Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size)));
        for (int round = 0; round < 500; ++round) {
            Bytes damaged = file;
            for (int i = 0; i < 3; ++i)
                damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
            attempt(damaged);
        }
    }
}

TEST(TextureDecoder, RefusesPicturesThatAreTooLargeBeforeAllocating) {
    // The header of a 70-byte file declares 2^31 − 1 pixels per side.
    Bytes file = png(1, 1, PngColor::kGrey, 8, {0});
    for (const std::size_t offset : {16U, 20U}) {
        file[offset] = 0x7F;
        for (std::size_t i = 1; i < 4; ++i)
            file[offset + i] = 0xFF;
    }
    EXPECT_THROW(decodeTexture(file, ""), Error);
}

}  // namespace
}  // namespace peeler::test
