// SPDX-License-Identifier: Apache-2.0
// Handling of every statement of textures, environments and compared pictures (formats/README.md).
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

std::string text(const Bytes& bytes) {
    return {bytes.begin(), bytes.end()};
}

/// Returns a picture written by OpenImageIO.
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

/// Returns the bytes of a black EXR.
std::string exrWith(const std::function<void(Imf::Header&)>& change, std::size_t parts = 1) {
    const ScratchDir folder;
    writeBlackFile(folder / "a.exr", {{0, 0}, {1, 0}}, {{0, 0}, {7, 3}}, change, parts);
    return bytesOf(folder / "a.exr");
}

std::string envmap(Imf::Envmap kind) {
    return exrWith([&](Imf::Header& header) { Imf::addEnvmap(header, kind); });
}

/// Textures are in files t…, environments in e…, compared pictures in c….
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
        {"PNG of every kind of colour, 1 to 16 bits, interlaced or not", "read", "t.png", pngOf()},
        {"PNG of every kind of colour, 1 to 16 bits, interlaced or not", "read", "t.png",
         text(png(1, 1, PngColor::kRgba, 16, Bytes(8)))},
        {"JPEG, grey, RGB or CMYK, progressive or not", "read", "t.jpg", jpeg},
        {"JPEG, grey, RGB or CMYK, progressive or not", "read", "t.jpg", jpegOf(1, 1)},
        {"JPEG that is cut off or damaged", "warned", "t.jpg", jpeg.substr(0, jpeg.size() * 2 / 3)},
        {"JPEG that is cut off or damaged", "warned", "c.jpg", jpeg.substr(0, jpeg.size() * 2 / 3)},
        {"JPEG that is cut off or damaged", "warned", "t.jpg", damaged_jpeg},
        {"other pictures that are cut off or damaged", "refused", "t.png", pngOf().substr(0, 50)},
        {"other pictures that are cut off or damaged", "refused", "e.hdr",
         radiance("").substr(0, 48)},
        {"gamma, chromaticities, profiles, texts and other metadata", "read", "t.png",
         pngOf({{"gAMA", {0, 0, 0x80, 0}}, {"tEXt", {'a', 0, 'b'}}})},
        {"animations (PNG, WebP)", "warned", "t.png", pngOf({{"acTL", {0, 0, 0, 2, 0, 0, 0, 0}}})},
        {"Exif's orientation, of a texture", "warned", "t.jpg", jpegOf(6)},
        {"Exif's and TIFF's orientation, of a picture that is compared", "read", "c.jpg",
         jpegOf(6)},
        {"Exif's and TIFF's orientation, of a picture that is compared", "read", "c.tif",
         tiffOf(3)},
        {"KTX2 of UASTC, ETC1S, RGB8 or RGBA8; Zstandard, ZLIB", "read", "t.ktx2",
         text(ktx2Of().bytes())},
        {"KTX2 of UASTC, ETC1S, RGB8 or RGBA8; Zstandard, ZLIB", "read", "t.ktx2",
         text(grey.bytes())},
        {"KTX2 with a swizzle, with other primaries or transfer functions, turned, or of sides "
         "that are no multiples of 4",
         "warned", "t.ktx2", text(swizzled.bytes())},
        {"KTX2 with premultiplied alpha; arrays, cube maps, volumes, other texels", "refused",
         "t.ktx2", text(premultiplied.bytes())},
        {"KTX2 with premultiplied alpha; arrays, cube maps, volumes, other texels", "refused",
         "t.ktx2", text(cube)},
        {"textures in BMP, TGA or TIFF", "read", "t.tif", tiffOf(1)},
        {"textures in other formats", "refused", "t.gif", "GIF89a"},
    };
}

std::vector<Statement> environments() {
    const Imf::Chromaticities aces({0.7347F, 0.2653F}, {0, 1}, {0.0001F, -0.077F},
                                   {0.3217F, 0.3377F});
    return {
        {"environments: Radiance, of all eight orientations", "read", "e.hdr", radiance("")},
        {"environments: Radiance, of all eight orientations", "read", "e.hdr",
         radiance("", "-X 2 +Y 1")},
        {"`EXPOSURE`, `GAMMA`, `COLORCORR`, `PRIMARIES` of Radiance", "warned", "e.hdr",
         radiance("EXPOSURE=2\n")},
        {"Radiance of XYZ", "refused", "e.hdr", radiance("", "-Y 1 +X 2", "32-bit_rle_xyze")},
        {"environments: OpenEXR, with any data window; `envmap` of latitude and longitude", "read",
         "e.exr", exrWith({})},
        {"environments: OpenEXR, with any data window; `envmap` of latitude and longitude", "read",
         "e.exr", envmap(Imf::ENVMAP_LATLONG)},
        {"`envmap` of a cube", "refused", "e.exr", envmap(Imf::ENVMAP_CUBE)},
        {"several parts of an environment", "warned", "e.exr", exrWith({}, 2)},
        {"`chromaticities` of an environment that are not those of Rec. 709", "warned", "e.exr",
         exrWith([&](Imf::Header& header) { Imf::addChromaticities(header, aces); })},
        {"an environment that is not twice as wide as high", "warned", "e.exr",
         written("a.exr", floats(6, 8), std::vector<float>(144))},
        {"negative light", "warned", "e.exr", written("a.exr", floats(2, 1), {-1, 0, 0, 0, 0, 0})},
        {"light that is not finite", "refused", "e.exr",
         written("a.exr", floats(2, 1), {INFINITY, 0, 0, 0, 0, 0})},
        {"environments in other formats", "refused", "e.png", pngOf()},
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
