// SPDX-License-Identifier: Apache-2.0
// Tests that the built-in decoders give the same bits as OpenImageIO's, and that both read the
// output of the encoders.
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "formats/image/image_codecs.h"
#include "formats/image/image_library.h"
#include "formats/image/image_metadata.h"
#include "formats/image/png_builder.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// A decoded file; empty if it was rejected.
struct Decoded {
    std::vector<std::string> channels;
    int width = 0, height = 0;
    bool floating_point = false, straight_alpha = false, deep = false;
    std::string description;
    Bytes bytes;
    std::vector<float> floats;
    Bytes last_channel;

    bool operator==(const Decoded&) const = default;
};

Decoded decoded(ImageDecoder& decoder) {
    const StoredImage& image = decoder.image();
    Decoded result{image.channels,
                   image.width,
                   image.height,
                   image.floating_point,
                   image.straight_alpha,
                   image.deep,
                   image.description,
                   {},
                   {},
                   {}};
    const auto pixels =
        static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
    const auto channels = static_cast<int>(image.channels.size());
    result.bytes.resize(pixels * image.channels.size());
    result.floats.resize(pixels * image.channels.size());
    result.last_channel.resize(pixels);
    decoder.read(0, channels, result.bytes.data());
    decoder.read(0, channels, result.floats.data());
    decoder.read(channels - 1, channels, result.last_channel.data());
    return result;
}

/// Decodes with only the OpenImageIO module.
Decoded byOpenImageIo(const std::string& format, const Bytes& file) {
    try {
        return decoded(*imageLibrary().decoder(format, "picture." + format, file));
    } catch (const std::runtime_error&) {
        return {};
    }
}

Decoded builtInPng(const Bytes& file) {
    try {
        return decoded(*pngDecoder("picture.png", file));
    } catch (const std::runtime_error&) {
        return {};
    }
}

/// Decodes with only the built-in decoder, which rejects files that need the module.
Decoded builtInJpeg(const Bytes& file) {
    try {
        const auto decoder = jpegDecoder("picture.jpg", file);
        return decoder ? decoded(*decoder) : Decoded{};
    } catch (const std::runtime_error&) {
        return {};
    }
}

void expectSameDecoded(const Decoded& ours, const Decoded& theirs) {
    EXPECT_GT(theirs.bytes.size(), 0U) << "OpenImageIO refuses it";
    EXPECT_EQ(ours.channels, theirs.channels);
    EXPECT_EQ(ours.straight_alpha, theirs.straight_alpha);
    EXPECT_EQ(ours.description, theirs.description);
    EXPECT_TRUE(ours.bytes == theirs.bytes);
    EXPECT_TRUE(ours.floats == theirs.floats);
    EXPECT_TRUE(ours.last_channel == theirs.last_channel);
    EXPECT_TRUE(ours == theirs);
}

Bytes randomBytes(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    Bytes bytes(count);
    for (std::uint8_t& byte : bytes)
        byte = static_cast<std::uint8_t>(random());
    return bytes;
}

struct Kind {
    PngColor color;
    std::uint8_t depth;
    std::vector<PngChunk> chunks{};
};

/// Returns kinds of PNG. Some tRNS chunks contain the first sample values of the pictures, whose
/// data is randomBytes(…, 5), so that at least one pixel is transparent.
std::vector<Kind> kinds() {
    const PngChunk palette = {"PLTE", randomBytes(768, 1)};
    const auto colors = [&](std::size_t count) {
        return PngChunk{"PLTE",
                        {palette.data.begin(), palette.data.begin() + std::ptrdiff_t(count) * 3}};
    };
    std::vector<Kind> all;
    for (const std::uint8_t depth : Bytes{1, 2, 4, 8}) {
        const std::size_t most = std::size_t{1} << depth;
        all.push_back({PngColor::kGrey, depth});
        all.push_back({PngColor::kGrey, depth, {{"tRNS", {0, 1}}}});
        all.push_back({PngColor::kPalette, depth, {colors(most)}});
        all.push_back({PngColor::kPalette, depth, {colors(most), {"tRNS", {7, 200}}}});
        all.push_back(
            {PngColor::kPalette, depth, {colors(most - most / 4)}});  // lacks some palette entries
    }
    const Bytes first = randomBytes(6, 5);
    for (const std::uint8_t depth : Bytes{8, 16}) {
        for (const PngColor color :
             {PngColor::kGrey, PngColor::kRgb, PngColor::kGreyAlpha, PngColor::kRgba})
            all.push_back({color, depth});
        // For RGB, a palette is only a suggestion.
        all.push_back({PngColor::kRgb, depth, {colors(9)}});
    }
    all.push_back({PngColor::kGrey, 16, {{"tRNS", {first[0], first[1]}}}});
    // The transparent value has more than 8 bits.
    all.push_back({PngColor::kGrey, 8, {{"tRNS", {9, first[0]}}}});
    all.push_back({PngColor::kGrey, 8, {{"tRNS", {first[0]}}}});
    all.push_back({PngColor::kPalette, 8, {colors(2), {"tRNS", {1, 2, 3}}}});
    all.push_back({PngColor::kRgba, 8, {{"tRNS", first}}});
    all.push_back({PngColor::kRgb, 8, {{"tRNS", {0, first[0], 0, first[1], 0, first[2]}}}});
    all.push_back({PngColor::kRgb, 16, {{"tRNS", first}}});
    return all;
}

TEST(BuiltInPng, IsOpenImageIosInEveryKind) {
    for (const Kind& kind : kinds())
        for (const auto& [width, height] : {std::pair(37U, 19U), {1U, 1U}, {5U, 3U}})
            for (const bool interlaced : {false, true}) {
                SCOPED_TRACE("color " + std::to_string(static_cast<int>(kind.color)) + ", " +
                             std::to_string(kind.depth) + " bits, " +
                             std::to_string(kind.chunks.size()) + " chunks, " +
                             std::to_string(width) + " wide" + (interlaced ? ", interlaced" : ""));
                const std::size_t row = (width * channelsOf(kind.color) * kind.depth + 7) / 8;
                const Bytes file = png(width, height, kind.color, kind.depth,
                                       randomBytes(row * height, 5), kind.chunks, interlaced);
                expectSameDecoded(builtInPng(file), byOpenImageIo("png", file));
            }
}

/// Encodes samples. 16-bit samples are in machine byte order.
Bytes encodedPng(const ImageToEncode& image, const Bytes& samples, int rows_at_once) {
    struct : EncodedFile {
        std::uint64_t size() const override { return bytes.size(); }
        std::size_t writeAt(std::uint64_t offset, std::span<const std::byte> written) override {
            EXPECT_EQ(offset, bytes.size());
            for (const std::byte byte : written)
                bytes.push_back(static_cast<std::uint8_t>(byte));
            return written.size();
        }
        std::size_t readAt(std::uint64_t, std::span<std::byte>) override { return 0; }
        Bytes bytes;
    } file;
    const std::size_t row =
        static_cast<std::size_t>(image.width * image.channels) * (image.bits == 16 ? 2 : 1);
    const auto encoder = pngEncoder();
    encoder->open(image, file);
    for (int y = 0; y < image.height; y += rows_at_once) {
        encoder->writeRows(y, std::min(y + rows_at_once, image.height),
                           samples.data() + static_cast<std::size_t>(y) * row);
    }
    encoder->close();
    return file.bytes;
}

// The encoder compresses pieces of rows in parallel. The largest picture has more pieces than the
// encoder keeps in memory at once.
TEST(BuiltInPng, EncodesTheSameBytesOnAnyNumberOfThreads) {
    for (const auto& [width, height] : {std::pair(1, 1), {3, 200}, {300, 500}, {1100, 1300}}) {
        for (const int channels : {1, 2, 3, 4}) {
            for (const int bits : {8, 16}) {
                if (width > 1000 && bits == 16) continue;
                SCOPED_TRACE(std::to_string(width) + " wide, " + std::to_string(channels) +
                             " channels of " + std::to_string(bits) + " bits");
                ImageToEncode image{"", width, height, channels, bits, "peeler", "a picture", true};
                Bytes samples =
                    randomBytes(static_cast<std::size_t>(width * height * channels * bits / 8), 11);
                // Half of the data compresses well.
                for (std::size_t i = 0; i < samples.size(); ++i)
                    if (i % 4096 < 2048) samples[i] = static_cast<std::uint8_t>(i / 4096);
                setThreadCount(1);
                const Bytes alone = encodedPng(image, samples, 64);
                setThreadCount(5);
                EXPECT_TRUE(encodedPng(image, samples, 7) == alone);
                setThreadCount(0);
                const Decoded read = builtInPng(alone);
                expectSameDecoded(read, byOpenImageIo("png", alone));
                EXPECT_EQ(read.description, "a picture");
                if (bits == 8) {
                    EXPECT_TRUE(read.bytes == samples);
                } else {
                    std::vector<std::uint16_t> wide(samples.size() / 2);
                    std::memcpy(wide.data(), samples.data(), samples.size());
                    std::vector<float> floats(wide.size());
                    for (std::size_t i = 0; i < wide.size(); ++i)
                        floats[i] = convertedSample<float>(wide[i]);
                    EXPECT_TRUE(read.floats == floats);
                }
            }
        }
    }
}

TEST(BuiltInPng, ConvertsEverySampleOfSixteenBitsAlike) {
    for (unsigned block = 0; block < 4; ++block) {
        Bytes samples;
        for (unsigned value = block << 14U; value < (block + 1) << 14U; ++value)
            samples.insert(samples.end(), {static_cast<std::uint8_t>(value >> 8U),
                                           static_cast<std::uint8_t>(value)});
        const Bytes file = png(128, 128, PngColor::kGrey, 16, samples);
        expectSameDecoded(builtInPng(file), byOpenImageIo("png", file));
    }
}

TEST(BuiltInPng, TellsTheSameDescription) {
    const auto text = [](const std::string& type, const std::string& data) {
        return PngChunk{type, Bytes(data.begin(), data.end())};
    };
    using namespace std::string_literals;
    const std::vector<PngChunk> described = {text("tEXt", "Description\0of peeler"s)},
                                international = {text("iTXt", "Description\0\0\0en\0\0ä"s)},
                                twice = {text("tEXt", "description\0one"s),
                                         text("tEXt", "ImageDescription\0two"s)},
                                other = {text("tEXt", "Software\0peeler"s)};
    for (const auto& chunks : {described, international, twice, other}) {
        const Bytes file = png(1, 1, PngColor::kRgb, 8, {1, 2, 3}, chunks);
        expectSameDecoded(builtInPng(file), byOpenImageIo("png", file));
    }
    const ScratchDir scratch;
    const fs::path path = scratch / "described.png";
    const Bytes file = png(1, 1, PngColor::kRgb, 8, {1, 2, 3}, described);
    std::ofstream(path, std::ios::binary) << std::string(file.begin(), file.end());
    EXPECT_EQ(imageDecoder("png", path)->image().description, "of peeler");
    EXPECT_THROW(imageDecoder("png", scratch / "missing.png"), std::runtime_error);
}

/// Damages a file at random, with a fixed seed. Calls attempt(damaged file) each time.
template <class Attempt>
void damage(const Bytes& file, unsigned rounds, const Attempt& attempt) {
    std::mt19937 random(3);
    for (unsigned round = 0; round < rounds; ++round) {
        Bytes damaged = file;
        if (round % 3 == 0) damaged.resize(random() % file.size());
        for (unsigned i = 0; i < round % 3; ++i)
            damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
        if (!damaged.empty()) attempt(damaged);
    }
}

TEST(BuiltInPng, NeverTakesDamageThatOpenImageIoRefuses) {
    const Bytes whole = png(16, 16, PngColor::kRgba, 8, randomBytes(1024, 2));
    damage(whole, 600, [](const Bytes& file) {
        Bytes reduced;
        try {
            reduced = withoutPngMetadata(file).bytes;
        } catch (const Error&) {
            return;  // withoutPngMetadata() refuses this damage, so decoders never get it
        }
        const Decoded ours = builtInPng(reduced);
        if (!ours.bytes.empty()) {
            EXPECT_TRUE(ours == byOpenImageIo("png", reduced));
        }
    });
    // The decoder accepts a file without IEND (12 bytes), so each cut is before IEND.
    for (std::size_t size = 1; size < whole.size() - 12; size += 7)
        EXPECT_TRUE(
            builtInPng(Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(size))).bytes.empty())
            << size;
}

TEST(BuiltInDecoders, AllocateNothingForPicturesThatAreTooLarge) {
    Bytes file = png(1, 1, PngColor::kGrey, 8, {0});
    for (const std::size_t offset : {16U, 20U})
        std::memcpy(file.data() + offset, "\x7F\xFF\xFF\xFF", 4);
    limitDecodedSize(4096);
    EXPECT_THROW(imageDecoder("png", "huge.png", file), std::runtime_error);
}

/// The host program may have set limits for OpenImageIO in environment variables.
TEST(ImageLibrary, LeavesTheEnvironmentAlone) {
    unsetenv("OPENIMAGEIO_THREADS");
    setLibraryThreads(1);
    imageLibrary();
    EXPECT_EQ(std::getenv("OPENIMAGEIO_THREADS"), nullptr);
}

struct JpegKind {
    const char* name;
    int pixels = TJPF_RGB;
    int subsampling = TJSAMP_444;
    int flags = 0;
    int adobe = -1;  ///< colour transform in Adobe's marker; −1 = unchanged
};
constexpr JpegKind kJpegs[] = {
    {"4:4:4"},
    {"4:2:2", TJPF_RGB, TJSAMP_422},
    {"4:2:0", TJPF_RGB, TJSAMP_420},
    {"4:4:0", TJPF_RGB, TJSAMP_440},
    {"4:1:1", TJPF_RGB, TJSAMP_411},
    {"grey", TJPF_RGB, TJSAMP_GRAY},
    {"progressive", TJPF_RGB, TJSAMP_420, TJFLAG_PROGRESSIVE},
    {"progressive grey", TJPF_RGB, TJSAMP_GRAY, TJFLAG_PROGRESSIVE},
    {"RGB", TJPF_RGB, TJSAMP_444, 0, 0},
    {"YCCK", TJPF_CMYK, TJSAMP_444},
    {"YCCK 4:2:0", TJPF_CMYK, TJSAMP_420, TJFLAG_PROGRESSIVE},
    {"CMYK", TJPF_CMYK, TJSAMP_444, 0, 0},
};

Bytes jpeg(const JpegKind& kind, int width, int height) {
    const Bytes pixels =
        randomBytes(static_cast<std::size_t>(width * height * tjPixelSize[kind.pixels]), 8);
    unsigned char* memory = nullptr;
    unsigned long size = 0;
    const tjhandle compressor = tjInitCompress();
    EXPECT_EQ(tjCompress2(compressor, pixels.data(), width, 0, height, kind.pixels, &memory, &size,
                          kind.subsampling, 90, kind.flags),
              0);
    Bytes file(memory, memory + size);
    tjFree(memory);
    tjDestroy(compressor);
    if (kind.adobe < 0) return file;
    // Replaces the start-of-image marker and the segment after it (JFIF or Adobe) by the same
    // marker and an Adobe segment.
    const Bytes adobe = {0xFF, 0xD8, 0xFF, 0xEE, 0,   14,
                         'A',  'd',  'o',  'b',  'e', 0,
                         100,  0,    0,    0,    0,   static_cast<std::uint8_t>(kind.adobe)};
    const std::size_t end = 4U + file[4] * 256U + file[5];
    file.erase(file.begin(), file.begin() + std::ptrdiff_t(end));
    file.insert(file.begin(), adobe.begin(), adobe.end());
    return file;
}

TEST(BuiltInJpeg, IsOpenImageIosInEveryKind) {
    for (const JpegKind& kind : kJpegs)
        for (const auto& [width, height] : {std::pair(67, 45), {1, 1}, {16, 16}, {200, 200}}) {
            SCOPED_TRACE(std::string(kind.name) + ", " + std::to_string(width) + " wide");
            const Bytes file = jpeg(kind, width, height);
            expectSameDecoded(builtInJpeg(file), byOpenImageIo("jpeg", file));
        }
}

TEST(BuiltInJpeg, TakesDamageAsOpenImageIoDoes) {
    int accepted = 0, refused = 0;
    for (const JpegKind& kind : {kJpegs[2], kJpegs[6], kJpegs[9]})
        damage(jpeg(kind, 48, 32), 300, [&](const Bytes& file) {
            const Decoded theirs = byOpenImageIo("jpeg", file);
            ++(theirs.bytes.empty() ? refused : accepted);
            const Decoded ours = builtInJpeg(file);
            if (!ours.bytes.empty()) {
                EXPECT_TRUE(ours == theirs) << kind.name;
            }
        });
    EXPECT_GT(accepted, 50) << "what is cut off is grey";
    EXPECT_GT(refused, 50);
}

TEST(BuiltInJpeg, LeavesTheRestToTheModule) {
    const ScratchDir scratch;
    const Bytes file = jpeg(kJpegs[0], 8, 8);
    const fs::path path = scratch / "picture.jpg";
    std::ofstream(path, std::ios::binary) << std::string(file.begin(), file.end());
    EXPECT_EQ(jpegDecoder(path, {}), nullptr);
    EXPECT_EQ(imageDecoder("jpeg", path)->image().width, 8);
}

TEST(BuiltInDecoders, AreOpenImageIosOnRealTextures) {
    PEELER_REQUIRE_ASSETS(assets);
    constexpr std::size_t kEvery = 5;  // decoding every fifth file takes half a second per format
    std::size_t found = 0, compared = 0;
    for (const auto& entry : fs::recursive_directory_iterator(assets)) {
        const std::string extension = entry.path().extension();
        const bool is_png = extension == ".png";
        if (!is_png && extension != ".jpg" && extension != ".jpeg") continue;
        if (found++ % kEvery != 0) continue;
        SCOPED_TRACE(entry.path().string());
        const std::string text = bytesOf(entry.path());
        const Bytes stored(text.begin(), text.end());
        if (is_png) {
            const Bytes file = withoutPngMetadata(stored).bytes;
            expectSameDecoded(builtInPng(file), byOpenImageIo("png", file));
        } else {
            const Bytes file = withoutJpegMetadata(stored).bytes;
            expectSameDecoded(builtInJpeg(file), byOpenImageIo("jpeg", file));
        }
        ++compared;
    }
    EXPECT_GT(compared, 5U);
}

}  // namespace
}  // namespace peeler::test
