// SPDX-License-Identifier: Apache-2.0
// Picture seeds: OpenEXR files of every kind that peeler reads, and pictures in other formats.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTiledOutputFile.h>

#include "formats/exr/deep_file.h"
#include "formats/exr/exr_layout.h"
#include "formats/exr/synthetic_image.h"
#include "formats/image/bitmap_builder.h"
#include "formats/image/image_library.h"
#include "formats/image/png_builder.h"
#include "formats/writers.h"
#include "fuzz/fuzz_target.h"
#include "fuzz/seeds.h"

namespace peeler::fuzz {
namespace {

SeedBytes bytesAt(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

std::string seedPath(const char* name) {
    return (scratchFolder() / name).string();
}

SeedBytes written(const char* name, const test::SyntheticPicture& picture,
                  const OutputOptions& options) {
    test::writePicture(*makeSink(seedPath(name), options), picture);
    return bytesAt(seedPath(name));
}

OutputOptions outputOptions(const char* layout, const char* compression) {
    OutputOptions options;
    options.layout = layout;
    options.compression = compression;
    options.provenance.version = "1";
    options.provenance.scene = "a.glb";
    options.provenance.ids = {{"a", "b"}, {"m"}, {0, 1}};
    return options;
}

/// Returns a flat picture as other programs write it: in scan lines, or in 4 × 4 tiles with all
/// mipmap levels.
SeedBytes flatPicture(Imf::Compression compression, bool tiled, const char* channel) {
    constexpr int kWidth = 9, kHeight = 7;
    Imf::Header header(kWidth, kHeight);
    header.compression() = compression;
    Imf::FrameBuffer frame;
    std::vector<float> values(kWidth * kHeight, 0.25F);
    for (const char* name : {channel, "G", "B"}) {
        header.channels().insert(name, Imf::Channel(Imf::FLOAT));
        frame.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()),
                                      sizeof(float), sizeof(float) * kWidth));
    }
    const std::string path = seedPath("flat.exr");
    if (tiled) {
        header.setTileDescription(Imf::TileDescription(4, 4, Imf::MIPMAP_LEVELS));
        Imf::TiledOutputFile file(path.c_str(), header);
        file.setFrameBuffer(frame);
        for (int level = 0; level < file.numLevels(); ++level)
            file.writeTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
    } else {
        Imf::OutputFile file(path.c_str(), header);
        file.setFrameBuffer(frame);
        file.writePixels(kHeight);
    }
    return bytesAt(path);
}

/// Returns a deep file as other programs write it.
SeedBytes deepPicture(int tile, Imf::Compression compression) {
    test::DeepPart part;
    part.window = {{1, 0}, {6, 4}};
    part.types = {{"R", Imf::HALF}, {"A", Imf::HALF}, {"Z", Imf::FLOAT}, {"ZBack", Imf::FLOAT}};
    for (std::uint32_t pixel = 0; pixel < part.pixels(); ++pixel)
        part.counts.push_back(pixel % 3);
    for (const auto& [name, type] : part.types)
        for (const std::uint32_t count : part.counts) {
            auto& list = part.values[name].emplace_back();
            for (std::uint32_t k = 0; k < count; ++k)
                list.push_back(name == "A" ? 0.5 : 3.0 - k);
        }
    const std::string path = seedPath("deep.exr");
    test::writeDeepFile(path, {part},
                        {.compression = compression, .tile = tile, .display = {{0, 0}, {7, 5}}});
    return bytesAt(path);
}

/// Returns a Radiance picture with plain pixels or, as in wide pictures, with run lengths.
SeedBytes radiance(int width, bool packed) {
    std::string text =
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X " + std::to_string(width) + "\n";
    for (int row = 0; row < 2; ++row) {
        if (!packed) {
            for (int x = 0; x < width; ++x)
                text += std::string("\x80\x40\x20\x81", 4);
            continue;
        }
        text += std::string("\x02\x02\x00", 3) + static_cast<char>(width);
        for (int component = 0; component < 4; ++component)
            text += std::string(1, static_cast<char>(128 + width)) + '\x81';
    }
    return seedOf(text);
}

void addExrSeeds(std::vector<SeedBytes>& seeds) {
    using test::makePicture;
    const test::SyntheticPicture small =
        makePicture({.width = 9, .height = 6, .crop = {1, 1, 9, 6}, .most_layers = 2});
    const test::SyntheticPicture channels =
        makePicture({.seed = 2, .width = 8, .height = 5, .most_layers = 2, .extra = true});
    const test::SyntheticPicture floats =
        makePicture({.width = 7, .height = 5, .most_layers = 3, .color_type = PixelType::kFloat});
    const test::SyntheticPicture empty = makePicture({.width = 5, .height = 4, .most_layers = 0});
    for (const ExrLayout& layout : exrLayouts())
        seeds.push_back(written("l.exr", small, outputOptions(layout.name.data(), "none")));
    for (const ExrCompression& row : exrCompressions())
        seeds.push_back(written("c.exr", floats, outputOptions("plain", row.name.data())));
    seeds.push_back(written("x.exr", channels, outputOptions("plain", "none")));
    seeds.push_back(written("x.safetensors", channels, outputOptions("", "")));
    seeds.push_back(written("e.exr", empty, outputOptions("plain", "")));
    OutputOptions options = outputOptions("", "none");
    options.as = "composite";
    seeds.push_back(written("f.exr", small, options));
    options.as = "deep";
    for (const auto& picture : {small, channels, empty})
        seeds.push_back(written("d.exr", picture, options));
    options.compression = "zips";
    seeds.push_back(written("z.exr", channels, options));
    for (const auto compression :
         {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::PIZ_COMPRESSION, Imf::PXR24_COMPRESSION,
          Imf::B44_COMPRESSION, Imf::DWAA_COMPRESSION})
        for (const bool tiled : {false, true})
            seeds.push_back(flatPicture(compression, tiled, tiled ? "R" : "Y"));
    for (const int tile : {0, 3})
        for (const auto compression : {Imf::NO_COMPRESSION, Imf::ZIPS_COMPRESSION})
            seeds.push_back(deepPicture(tile, compression));
}

void addImageSeeds(std::vector<SeedBytes>& seeds) {
    using test::PngColor;
    const test::PngChunk palette = {"PLTE", {1, 2, 3, 4, 5, 6}}, clear = {"tRNS", {0}};
    for (const bool interlaced : {false, true}) {
        seeds.push_back(test::png(5, 3, PngColor::kRgba, 8, test::Bytes(60, 99), {}, interlaced));
        seeds.push_back(test::png(5, 3, PngColor::kGrey, 16, test::Bytes(30, 7), {}, interlaced));
        seeds.push_back(test::png(5, 3, PngColor::kPalette, 1, test::Bytes(3, 0xA8),
                                  {palette, clear}, interlaced));
    }
    seeds.push_back(
        test::png(3, 2, PngColor::kGreyAlpha, 8, test::Bytes(12, 50),
                  {{"tEXt", {'D', 'e', 's', 'c', 'r', 'i', 'p', 't', 'i', 'o', 'n', 0, 'x'}}}));
    seeds.push_back(
        test::bmp(3, 2, 8, 1, test::Bytes(12, 90), {2, 1, 1, 2, 0, 0, 0, 3, 0, 1, 2, 0}));
    seeds.push_back(test::bmp(2, 1, 4, 2, test::Bytes(12, 90), {2, 0x12, 0, 2, 1, 0, 0, 1}));
    seeds.push_back(test::bmp(2, -1, 16, 3, test::Bytes(12, 31), {0, 0x7C, 0xE0, 0x03}));
    seeds.push_back(test::bmp(1, 1, 32, 0, {}, {1, 2, 3, 4}));
    seeds.push_back(test::tga(10, 3, 1, 24, 0, {0x81, 0, 0, 255, 0, 0, 255, 0}));
    seeds.push_back(test::tga(2, 1, 2, 16, 0x30, {1, 2, 3, 4}));
    seeds.push_back(radiance(5, false));
    seeds.push_back(radiance(9, true));
    CompositeImage picture;
    picture.window = {0, 0, 17, 11};
    picture.resizeColors(false);
    picture.z.resize(picture.window.pixels());
    for (std::size_t i = 0; i < picture.z.size(); ++i)
        picture.rgba[i] = {static_cast<float>(i % 17) / 17, 0.5F, static_cast<float>(i % 3) / 3, 1};
    for (const char* name : {"p.jpg", "p.tif", "p.png", "p.exr"}) {
        OutputOptions options;
        options.as = std::string_view(name) == "p.exr" ? "composite" : "";
        writePicture(seedPath(name), picture, options);
        seeds.push_back(bytesAt(seedPath(name)));
    }
}

}  // namespace

void addPictureSeeds(Seeds& seeds) {
    addExrSeeds(seeds["exr"]);
    addImageSeeds(seeds["image"]);
}

}  // namespace peeler::fuzz
