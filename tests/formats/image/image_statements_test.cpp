// SPDX-License-Identifier: Apache-2.0
// Tests the tables for textures, environments and compared pictures in formats/README.md,
// "Supported content".
#include <OpenEXR/ImfEnvmap.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "formats/exr/flat_file.h"
#include "formats/file/file_statements.h"
#include "formats/gltf/gltf_decoders.h"
#include "formats/image/environment_file.h"
#include "formats/image/flat_image.h"
#include "formats/image/ktx2_builder.h"
#include "formats/image/png_builder.h"
#include "formats/image/uastc_builder.h"

namespace peeler::test {
namespace {

constexpr const char* kImageTextures =
    "any PNG (textures: 8 bits); JPEG: grey, RGB, CMYK, progressive; textures in BMP, TGA, TIFF "
    "(in a glTF with a warning); orientation of compared pictures; ignored: other metadata, gamma, "
    "profiles";
constexpr const char* kImageKtx2 =
    "KTX2: UASTC, ETC1S, RGB8, RGBA8, Zstandard, ZLIB; the largest level (RRR: its blocks' "
    "colours)";
constexpr const char* kImageOddTextures =
    "Exif orientation of textures; damaged JPEG; animations; KTX2 with a swizzle (applied), other "
    "primaries or transfer functions, turned, or with sides that are no multiples of 4";
constexpr const char* kImageNotTextures =
    "KTX2 with premultiplied alpha, arrays, cube maps, volumes, other texels; textures in other "
    "formats; other damaged pictures";
constexpr const char* kImageEnvironments =
    "environments: Radiance in all eight orientations; OpenEXR with any data window, `envmap` "
    "latitude-longitude";
constexpr const char* kImageOddEnvironments =
    "environments: `EXPOSURE`, `GAMMA`, `COLORCORR`, `PRIMARIES`, `chromaticities` except Rec. "
    "709, several parts, sides not 2:1 (stretched), negative light";
constexpr const char* kImageNotEnvironments =
    "environments: Radiance XYZ, `envmap` cube, non-finite light, other formats";

std::string text(const Bytes& bytes) {
    return {bytes.begin(), bytes.end()};
}

/// Returns the bytes of a picture written by OpenImageIO.
std::string written(const std::string& name, const OIIO::ImageSpec& spec,
                    const std::vector<float>& values) {
    const ScratchDir folder;
    const std::string path = folder / name;
    const auto file = OIIO::ImageOutput::create(path);
    EXPECT_TRUE(file && file->open(path, spec)) << name;
    EXPECT_TRUE(file->write_image(OIIO::TypeDesc::FLOAT, values.data()) && file->close());
    return bytesOf(path);
}

OIIO::ImageSpec floats(int width, int height) {
    return {width, height, 3, OIIO::TypeDesc::FLOAT};
}

std::string jpegOf(int orientation = 1, int channels = 3) {
    OIIO::ImageSpec spec(16, 16, channels, OIIO::TypeDesc::UINT8);
    spec.attribute("Orientation", orientation);
    std::vector<float> values(static_cast<std::size_t>(256 * channels));
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<float>(i * i % 97) / 97;
    return written("a.jpg", spec, values);
}

std::string tiffOf(int orientation) {
    OIIO::ImageSpec spec(2, 1, 3, OIIO::TypeDesc::UINT8);
    spec.attribute("Orientation", orientation);
    return written("a.tif", spec, std::vector<float>(6));
}

std::string pngOf(const std::vector<PngChunk>& chunks = {}) {
    return text(png(1, 1, PngColor::kRgb, 8, {1, 2, 3}, chunks));
}

Ktx2File ktx2Of() {
    return uastcFile(4, 4, solidUastcBlock(1, 2, 3, 4));
}

std::string radiance(const std::string& header, const std::string& resolution = "-Y 1 +X 2",
                     const std::string& format = "32-bit_rle_rgbe") {
    return "#?RADIANCE\nFORMAT=" + format + '\n' + header + '\n' + resolution + '\n' +
           std::string(8, '\x81');
}

/// Returns the bytes of a black OpenEXR file with a changed header.
std::string exrWith(const std::function<void(Imf::Header&)>& change, std::size_t parts = 1) {
    const ScratchDir folder;
    writeBlackFile(folder / "a.exr", {{0, 0}, {1, 0}}, {{0, 0}, {7, 3}}, change, parts);
    return bytesOf(folder / "a.exr");
}

std::string envmap(Imf::Envmap kind) {
    return exrWith([&](Imf::Header& header) { Imf::addEnvmap(header, kind); });
}

/// Returns the test cases. File names begin with t for textures, e for environments, c for compared
/// pictures.
std::vector<Statement> texturesAndPictures() {
    Ktx2File swizzled = ktx2Of(), premultiplied = ktx2Of(), grey = ktx2Of();
    swizzled.metadata = {{"KTXswizzle", std::string("bgra\0", 5)}};
    premultiplied.flags = 1;
    grey.channels = {4};
    Bytes cube = ktx2Of().bytes();
    setNumber(cube, 36, 6);
    const std::string jpeg = jpegOf(), damaged_jpeg = [&] {
        std::string bytes = jpeg;
        std::fill(bytes.end() - 60, bytes.end() - 2, '\0');
        return bytes;
    }();
    return {
        {kImageTextures, "read", "t.png", pngOf()},
        {kImageTextures, "read", "t.png", text(png(1, 1, PngColor::kRgba, 16, Bytes(8)))},
        {kImageTextures, "read", "t.jpg", jpeg},
        {kImageTextures, "read", "t.jpg", jpegOf(1, 1)},
        {kImageOddTextures, "warned", "t.jpg", jpeg.substr(0, jpeg.size() * 2 / 3)},
        {kImageOddTextures, "warned", "c.jpg", jpeg.substr(0, jpeg.size() * 2 / 3)},
        {kImageOddTextures, "warned", "t.jpg", damaged_jpeg},
        {kImageNotTextures, "refused", "t.png", pngOf().substr(0, 50)},
        {kImageNotTextures, "refused", "e.hdr", radiance("").substr(0, 48)},
        {kImageTextures, "read", "t.png",
         pngOf({{"gAMA", {0, 0, 0x80, 0}}, {"tEXt", {'a', 0, 'b'}}})},
        {kImageOddTextures, "warned", "t.png", pngOf({{"acTL", {0, 0, 0, 2, 0, 0, 0, 0}}})},
        {kImageOddTextures, "warned", "t.jpg", jpegOf(6)},
        {kImageTextures, "read", "c.jpg", jpegOf(6)},
        {kImageTextures, "read", "c.tif", tiffOf(3)},
        {kImageKtx2, "read", "t.ktx2", text(ktx2Of().bytes())},
        {kImageKtx2, "read", "t.ktx2", text(grey.bytes())},
        {kImageOddTextures, "warned", "t.ktx2", text(swizzled.bytes())},
        {kImageNotTextures, "refused", "t.ktx2", text(premultiplied.bytes())},
        {kImageNotTextures, "refused", "t.ktx2", text(cube)},
        {kImageTextures, "read", "t.tif", tiffOf(1)},
        {kImageNotTextures, "refused", "t.gif", "GIF89a"},
    };
}

std::vector<Statement> environments() {
    const Imf::Chromaticities aces({0.7347F, 0.2653F}, {0, 1}, {0.0001F, -0.077F},
                                   {0.3217F, 0.3377F});
    return {
        {kImageEnvironments, "read", "e.hdr", radiance("")},
        {kImageEnvironments, "read", "e.hdr", radiance("", "-X 2 +Y 1")},
        {kImageOddEnvironments, "warned", "e.hdr", radiance("EXPOSURE=2\n")},
        {kImageNotEnvironments, "refused", "e.hdr", radiance("", "-Y 1 +X 2", "32-bit_rle_xyze")},
        {kImageEnvironments, "read", "e.exr", exrWith({})},
        {kImageEnvironments, "read", "e.exr", envmap(Imf::ENVMAP_LATLONG)},
        {kImageNotEnvironments, "refused", "e.exr", envmap(Imf::ENVMAP_CUBE)},
        {kImageOddEnvironments, "warned", "e.exr", exrWith({}, 2)},
        {kImageOddEnvironments, "warned", "e.exr",
         exrWith([&](Imf::Header& header) { Imf::addChromaticities(header, aces); })},
        {kImageOddEnvironments, "warned", "e.exr",
         written("a.exr", floats(6, 8), std::vector<float>(144))},
        {kImageOddEnvironments, "warned", "e.exr",
         written("a.exr", floats(2, 1), {-1, 0, 0, 0, 0, 0})},
        {kImageNotEnvironments, "refused", "e.exr",
         written("a.exr", floats(2, 1), {INFINITY, 0, 0, 0, 0, 0})},
        {kImageNotEnvironments, "refused", "e.png", pngOf()},
    };
}

std::vector<Text> warningsOf(const std::filesystem::path& file, ReadWarnings& warnings) {
    const auto warn = [&](const std::vector<std::string>& notes) {
        for (const std::string& note : notes)
            warnings.warn(note);
    };
    const std::string bytes = bytesOf(file);
    switch (file.filename().string()[0]) {
        case 't':
            warn(decodeTexture(Bytes(bytes.begin(), bytes.end()), "").notes);
            break;
        case 'e':
            readEnvironment(file, warnings);
            break;
        default:
            warn(readFlatImage(file).notes);
    }
    return warnings.take();
}

TEST(Statements, OfImagesAndEnvironments) {
    std::vector<Statement> statements = texturesAndPictures();
    const std::vector<Statement> more = environments();
    statements.insert(statements.end(), more.begin(), more.end());
    expectStatements("Images and environments", statements,
                     [](const std::filesystem::path& file, bool strict) {
                         ReadWarnings warnings(strict, file);
                         return warningsOf(file, warnings);
                     });
}

}  // namespace
}  // namespace peeler::test
