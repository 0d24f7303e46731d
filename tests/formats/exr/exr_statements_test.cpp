// SPDX-License-Identifier: Apache-2.0
// Tests the table for other programs' OpenEXR files in formats/README.md, "Supported content".
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfPreviewImage.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <cmath>
#include <limits>

#include "formats/exr/deep_file.h"
#include "formats/exr/flat_file.h"
#include "formats/file/file_statements.h"
#include "formats/layered/opened_picture.h"

namespace peeler::test {
namespace {

constexpr const char* kExrStorage =
    "scan lines or tiles (the largest level), flat or deep, any lineOrder, any compression that "
    "OpenEXR has";
constexpr const char* kExrColours =
    "R, G, B, A, Z, half or float, also as r, Red, alpha, depth, RA … in any case; AR, AG, AB "
    "(default A: their mean); Y, alone or with RY and BY; colours of one layer (`beauty.R`)";
constexpr const char* kExrKept =
    "kept: NaN, infinite and negative colours, other channels, also integers, parts with more "
    "channels of the same deep samples";
constexpr const char* kExrSamples =
    "flat pictures without alpha (1) or depth (0); unsorted samples; infinite Z (largest number); "
    "volumes (ZBack) that do not overlap; any data window (the display window is the picture)";
constexpr const char* kExrAttributes =
    "pixelAspectRatio and chromaticities, into OpenEXR; other attributes, except previews";
constexpr const char* kExrLostAttributes =
    "pixelAspectRatio except 1, chromaticities except Rec. 709, into other formats; attributes "
    "beyond 1 MiB, or of wrong types (a `capDate` that is no string)";
constexpr const char* kExrOddSamples =
    "deep samples without alpha or colours, or with RY and BY; NaN or −inf as Z; overlapping "
    "volumes";
constexpr const char* kExrSeveral =
    "several pictures (`--part` selects) or views (`--view`); a display window that starts "
    "elsewhere than (0, 0)";
constexpr const char* kExrNotSupported =
    "unknown compression, deep samples except in none, RLE, ZIPS, ZIP; subsampled channels; "
    "integer colour or depth; deep samples without Z; flat files without R, G, B or Y; several "
    "layers of colours and none outside (`--part` selects)";
constexpr const char* kExrTooLarge =
    "over 65,536 samples in a pixel; a display window over 2²⁵ pixels and over 256 times the "
    "stored ones";

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Imath::Box2i kAll{{0, 0}, {7, 5}};
const std::map<std::string, std::vector<double>> kRgba{
    {"R", {0.5}}, {"G", {0.25}}, {"B", {0.125}}, {"A", {1}}};

using ChangeHeader = std::function<void(std::size_t, Imf::Header&)>;

std::string flat(const std::vector<FlatPart>& parts, const FlatFileOptions& options = {}) {
    const ScratchDir folder;
    writeFlatFile(folder / "a.exr", parts, options);
    return bytesOf(folder / "a.exr");
}

/// Returns a flat single-part file with these channels of type half.
std::string channels(const std::map<std::string, std::vector<double>>& values) {
    return flat({{.values = values}});
}

std::string integers(const std::string& channel) {
    FlatPart part{.values = kRgba, .types = {{channel, Imf::UINT}}};
    part.values[channel] = {1};
    return flat({part});
}

std::string header(const ChangeHeader& change) {
    return flat({{.values = kRgba}}, {.header = change});
}

std::string deep(const std::vector<DeepPart>& parts, const DeepFileOptions& options = {}) {
    const ScratchDir folder;
    writeDeepFile(folder / "a.exr", parts, options);
    return bytesOf(folder / "a.exr");
}

/// Returns a deep single-part file with these channels and samples.
std::string samples(const std::vector<std::string>& names,
                    const std::vector<std::vector<double>>& values) {
    return deep({deepPart({{0, 0}, {1, 0}}, names, values)});
}

/// Returns a deep file with one sample per pixel, at this Z.
std::string sampleAt(double z) {
    return samples({"A", "R", "G", "B", "Z"}, {{1, 0.5, 0.5, 0.5, z}});
}

/// Returns two deep parts; the second has this number of samples per pixel.
std::string deepParts(std::size_t second, const std::string& channel) {
    DeepPart a = deepPart({{0, 0}, {1, 0}}, {"A", "R", "G", "B", "Z"}, {{1, 0.5, 0.5, 0.5, 2}});
    DeepPart b = deepPart({{0, 0}, {1, 0}}, {channel, "Z"},
                          std::vector<std::vector<double>>(second, {1, 2}));
    a.name = "beauty";
    b.name = "fx";
    return deep({a, b});
}

/// Returns the file with another value of the attribute `compression`.
std::string compressedAs(std::string bytes, char compression) {
    const std::string record("compression\0compression\0\1\0\0\0", 28);
    bytes.at(bytes.find(record) + record.size()) = compression;
    return bytes;
}

ChangeHeader views(bool parts) {
    return [parts](std::size_t part, Imf::Header& header) {
        if (parts)
            header.setView(part == 0 ? "left" : "right");
        else
            Imf::addMultiView(header, {"left", "right"});
    };
}

/// Reads all pixels and returns the warnings. For files named pixels.exr, sets `pixels_only`.
std::vector<Text> readStatement(const std::filesystem::path& file, bool strict) {
    LayeredReadOptions options;
    options.strict = strict;
    options.pixels_only = file.filename() == "pixels.exr";
    const auto input = openLayered(file, options);
    LayeredImage image;
    input->read(input->info().plan.view.crop, image);
    return input->takeWarnings();
}

std::vector<Statement> storage() {
    const DeepPart deep_part = deepPart(kAll, {"A", "R", "G", "B", "Z"}, {{1, 0.5, 0.5, 0.5, 2}});
    std::vector<Statement> all;
    const auto add = [&](const char* says, const char* becomes, const std::string& bytes) {
        all.push_back({says, becomes, "a.exr", bytes});
    };
    for (const int tile : {0, 4}) {
        add(kExrStorage, "read", flat({{.values = kRgba}}, {.tile = tile}));
        add(kExrStorage, "read", deep({deep_part}, {.tile = tile}));
        for (int c = 0; c < Imf::NUM_COMPRESSION_METHODS; ++c)
            add(kExrStorage, "read",
                flat({{.values = kRgba}},
                     {.compression = static_cast<Imf::Compression>(c), .tile = tile}));
    }
    add(kExrNotSupported, "refused", compressedAs(channels(kRgba), 99));
    add(kExrNotSupported, "refused", compressedAs(deep({deep_part}), Imf::PIZ_COMPRESSION));
    add(kExrStorage, "read", flat({{.values = kRgba}}, {.order = Imf::DECREASING_Y}));
    add(kExrStorage, "read", flat({{.values = kRgba}}, {.tile = 4, .order = Imf::RANDOM_Y}));
    add(kExrStorage, "read", flat({{.values = kRgba}}, {.tile = 4, .levels = Imf::MIPMAP_LEVELS}));
    add(kExrStorage, "read", flat({{.values = kRgba}}, {.tile = 4, .levels = Imf::RIPMAP_LEVELS}));
    return all;
}

std::vector<Statement> colours() {
    std::vector<Statement> all;
    const auto add = [&](const char* says, const char* becomes, const std::string& bytes) {
        all.push_back({says, becomes, "a.exr", bytes});
    };
    add(kExrColours, "read", channels(kRgba));
    add(kExrColours, "read",
        flat({{.values = {{"R", {1}}, {"G", {1}}, {"B", {1}}, {"Z", {1}}},
               .types = {{"R", Imf::FLOAT}, {"Z", Imf::FLOAT}}}}));
    add(kExrColours, "read",
        channels({{"red", {1}}, {"Green", {1}}, {"b", {1}}, {"Alpha", {1}}, {"Depth", {2}}}));
    add(kExrColours, "read",
        samples({"AR", "AG", "AB", "R", "G", "B", "Z"}, {{1, 0.5, 0, 1, 1, 1, 2}}));
    add(kExrColours, "read", channels({{"Y", {1}}}));
    add(kExrColours, "read", channels({{"Y", {1}}, {"RY", {0.5}}, {"BY", {-0.5}}}));
    add(kExrOddSamples, "warned", samples({"A", "Y", "RY", "BY", "Z"}, {{1, 1, 0.5, 0.5, 2}}));
    add(kExrNotSupported, "refused", flat({{.window = kAll, .values = kRgba, .sampling = 2}}));
    add(kExrNotSupported, "refused", integers("R"));
    add(kExrNotSupported, "refused", flat({{.values = kRgba, .types = {{"A", Imf::UINT}}}}));
    add(kExrKept, "read", integers("id"));
    add(kExrSamples, "read", channels({{"R", {0}}, {"G", {0}}, {"B", {0}}}));
    add(kExrNotSupported, "refused", channels({{"N.X", {1}}, {"Z", {1}}}));
    add(kExrOddSamples, "warned", samples({"R", "G", "B", "Z"}, {{0.5, 0.5, 0.5, 2}}));
    add(kExrOddSamples, "warned", samples({"A", "Z"}, {{0.5, 2}}));
    add(kExrOddSamples, "warned", samples({"A", "R", "Z"}, {{0.5, 0.5, 2}}));
    add(kExrNotSupported, "refused", samples({"A", "R", "G", "B"}, {{0.5, 0.5, 0.5, 0.5}}));
    add(kExrColours, "read", channels({{"beauty.R", {1}}, {"beauty.G", {1}}, {"beauty.B", {1}}}));
    add(kExrNotSupported, "refused",
        channels(
            {{"a.R", {1}}, {"a.G", {1}}, {"a.B", {1}}, {"b.R", {1}}, {"b.G", {1}}, {"b.B", {1}}}));
    add(kExrKept, "read", channels({{"R", {std::nan("")}}, {"G", {kInfinity}}, {"B", {-1}}}));
    return all;
}

std::vector<Statement> parts() {
    std::vector<Statement> all;
    const auto add = [&](const char* says, const char* becomes, const std::string& bytes) {
        all.push_back({says, becomes, "a.exr", bytes});
    };
    add(kExrSeveral, "warned",
        flat({{.name = "a", .values = kRgba}, {.name = "b", .values = kRgba}}));
    add(kExrSeveral, "warned", deepParts(2, "mask"));
    add(kExrKept, "read", deepParts(1, "mask"));
    add(kExrSeveral, "warned",
        flat({{.name = "a", .values = kRgba}, {.name = "b", .values = kRgba}},
             {.header = views(true)}));
    FlatPart both{.values = kRgba};
    for (const auto& [name, values] : kRgba)
        both.values["right." + name] = values;
    add(kExrSeveral, "warned", flat({both}, {.header = views(false)}));
    return all;
}

std::vector<Statement> headers() {
    std::vector<Statement> all;
    const auto add = [&](const char* says, const char* becomes, const std::string& bytes,
                         const char* name = "a.exr") {
        all.push_back({says, becomes, name, bytes});
    };
    for (const Imath::Box2i& window : {Imath::Box2i{{2, 1}, {5, 3}}, Imath::Box2i{{-4, -3}, {9, 9}},
                                       Imath::Box2i{{20, 20}, {21, 21}}}) {
        for (const char* name : {"a.exr", "pixels.exr"})
            add(kExrSamples, "read", flat({{.window = window, .values = kRgba}}), name);
    }
    add(kExrSeveral, "warned",
        flat({{.window = {{12, 8}, {13, 9}}, .values = kRgba}}, {.display = {{10, 7}, {17, 12}}}));
    add(kExrTooLarge, "refused", flat({{.values = kRgba}}, {.display = {{0, 0}, {99999, 99999}}}));
    const auto aspect = [](std::size_t, Imf::Header& h) { h.pixelAspectRatio() = 2; };
    const auto primaries = [](std::size_t, Imf::Header& h) {
        Imf::addChromaticities(h, Imf::Chromaticities({0.7347F, 0.2653F}, {0, 1},
                                                      {0.0001F, -0.077F}, {0.32168F, 0.33767F}));
    };
    add(kExrAttributes, "read", header(aspect));
    add(kExrLostAttributes, "warned", header(aspect), "pixels.exr");
    add(kExrAttributes, "read", header(primaries));
    add(kExrLostAttributes, "warned", header(primaries), "pixels.exr");
    add(kExrAttributes, "read", header([](std::size_t, Imf::Header& h) {
            h.screenWindowWidth() = 3;
            Imf::addOwner(h, "somebody");
            Imf::addEnvmap(h, Imf::ENVMAP_CUBE);
            Imf::addWhiteLuminance(h, 100);
            Imf::addXDensity(h, 72);
            Imf::addWrapmodes(h, "clamp");
            h.insert("ours", Imf::FloatAttribute(4));
        }));
    add(kExrLostAttributes, "warned", header([](std::size_t, Imf::Header& h) {
            h.insert("large", Imf::StringAttribute(std::string((1 << 20) + 1, 'x')));
        }));
    add(kExrLostAttributes, "warned",
        header([](std::size_t, Imf::Header& h) { h.insert("capDate", Imf::FloatAttribute(1)); }));
    add(kExrAttributes, "read",
        header([](std::size_t, Imf::Header& h) { h.setPreviewImage(Imf::PreviewImage(2, 2)); }));
    return all;
}

std::vector<Statement> depths() {
    std::vector<Statement> all;
    const auto add = [&](const char* says, const char* becomes, const std::string& bytes) {
        all.push_back({says, becomes, "a.exr", bytes});
    };
    const std::vector<std::string> names{"A", "R", "G", "B", "Z"};
    const std::vector<std::string> volume{"A", "R", "G", "B", "Z", "ZBack"};
    add(kExrSamples, "read", samples(names, {{0.5, 0.5, 0.5, 0.5, 3}, {0.5, 0.1, 0.1, 0.1, 1}}));
    add(kExrSamples, "read", sampleAt(kInfinity));
    add(kExrSamples, "read", channels({{"Y", {1}}, {"Z", {kInfinity}}}));
    add(kExrOddSamples, "warned", sampleAt(std::nan("")));
    add(kExrOddSamples, "warned", sampleAt(-kInfinity));
    add(kExrOddSamples, "warned", channels({{"Y", {1}}, {"Z", {std::nan("")}}}));
    add(kExrSamples, "read",
        samples(volume, {{0.5, 0.5, 0.5, 0.5, 1, 2}, {0.5, 0.1, 0.1, 0.1, 2, 3}}));
    add(kExrOddSamples, "warned",
        samples(volume, {{0.5, 0.5, 0.5, 0.5, 1, 3}, {0.5, 0.1, 0.1, 0.1, 2, 4}}));
    add(kExrTooLarge, "refused",
        samples(names, std::vector<std::vector<double>>(65537, {1, 1, 1, 1, 1})));
    return all;
}

TEST(Statements, OfAnOpenExr) {
    std::vector<Statement> statements;
    for (auto* const group : {storage, colours, parts, headers, depths}) {
        std::vector<Statement> more = group();
        std::ranges::move(more, std::back_inserter(statements));
    }
    expectStatements("OpenEXR", statements, readStatement);
}

}  // namespace
}  // namespace peeler::test
