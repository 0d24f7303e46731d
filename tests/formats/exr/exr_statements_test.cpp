// SPDX-License-Identifier: Apache-2.0
// Handling of every statement of other programs' OpenEXR files (formats/README.md).
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

/// Returns a flat single-part file with these channels, half.
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

/// Returns a deep file of one sample per pixel with this Z.
std::string sampleAt(double z) {
    return samples({"A", "R", "G", "B", "Z"}, {{1, 0.5, 0.5, 0.5, z}});
}

/// Returns two deep parts, with equal sample counts or not.
std::string deepParts(std::size_t second, const std::string& channel) {
    DeepPart a = deepPart({{0, 0}, {1, 0}}, {"A", "R", "G", "B", "Z"}, {{1, 0.5, 0.5, 0.5, 2}});
    DeepPart b = deepPart({{0, 0}, {1, 0}}, {channel, "Z"},
                          std::vector<std::vector<double>>(second, {1, 2}));
    a.name = "beauty";
    b.name = "fx";
    return deep({a, b});
}

/// Returns the file with another value of its attribute `compression`.
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

/// Reads all pixels; statements without a header use a file named pixels.exr.
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
        add("scan lines or tiles, flat or deep", "read", flat({{.values = kRgba}}, {.tile = tile}));
        add("scan lines or tiles, flat or deep", "read", deep({deep_part}, {.tile = tile}));
        for (int c = 0; c < Imf::NUM_COMPRESSION_METHODS; ++c)
            add("any compression that OpenEXR has", "read",
                flat({{.values = kRgba}},
                     {.compression = static_cast<Imf::Compression>(c), .tile = tile}));
    }
    add("a compression that this OpenEXR does not know", "refused",
        compressedAs(channels(kRgba), 99));
    add("deep samples in another compression than none, RLE, ZIPS and ZIP", "refused",
        compressedAs(deep({deep_part}), Imf::PIZ_COMPRESSION));
    add("rows from below (lineOrder)", "read",
        flat({{.values = kRgba}}, {.order = Imf::DECREASING_Y}));
    add("tiles in any order (lineOrder)", "read",
        flat({{.values = kRgba}}, {.tile = 4, .order = Imf::RANDOM_Y}));
    add("smaller levels of tiles", "read",
        flat({{.values = kRgba}}, {.tile = 4, .levels = Imf::MIPMAP_LEVELS}));
    add("smaller levels of tiles", "read",
        flat({{.values = kRgba}}, {.tile = 4, .levels = Imf::RIPMAP_LEVELS}));
    return all;
}

std::vector<Statement> colours() {
    std::vector<Statement> all;
    const auto add = [&](const char* says, const char* becomes, const std::string& bytes) {
        all.push_back({says, becomes, "a.exr", bytes});
    };
    add("R, G, B, A and Z, half or float", "read", channels(kRgba));
    add("R, G, B, A and Z, half or float", "read",
        flat({{.values = {{"R", {1}}, {"G", {1}}, {"B", {1}}, {"Z", {1}}},
               .types = {{"R", Imf::FLOAT}, {"Z", Imf::FLOAT}}}}));
    add("the same by other names: r, Red, alpha, depth, RA", "read",
        channels({{"red", {1}}, {"Green", {1}}, {"b", {1}}, {"Alpha", {1}}, {"Depth", {2}}}));
    add("opacity of each channel: AR, AG, AB, with A or without", "read",
        samples({"AR", "AG", "AB", "R", "G", "B", "Z"}, {{1, 0.5, 0, 1, 1, 1, 2}}));
    add("Y, alone or with RY and BY", "read", channels({{"Y", {1}}}));
    add("Y, alone or with RY and BY", "read",
        channels({{"Y", {1}}, {"RY", {0.5}}, {"BY", {-0.5}}}));
    add("RY and BY of deep samples", "warned",
        samples({"A", "Y", "RY", "BY", "Z"}, {{1, 1, 0.5, 0.5, 2}}));
    add("channels of less than full size", "refused",
        flat({{.window = kAll, .values = kRgba, .sampling = 2}}));
    add("integers as colour or depth", "refused", integers("R"));
    add("integers as colour or depth", "refused",
        flat({{.values = kRgba, .types = {{"A", Imf::UINT}}}}));
    add("other channels, integers, too", "read", integers("id"));
    add("a flat picture without alpha or depth", "read",
        channels({{"R", {0}}, {"G", {0}}, {"B", {0}}}));
    add("a flat file without R, G, B or Y", "refused", channels({{"N.X", {1}}, {"Z", {1}}}));
    add("deep samples without alpha", "warned",
        samples({"R", "G", "B", "Z"}, {{0.5, 0.5, 0.5, 2}}));
    add("deep samples without R, G, B and Y, or some of these", "warned",
        samples({"A", "Z"}, {{0.5, 2}}));
    add("deep samples without R, G, B and Y, or some of these", "warned",
        samples({"A", "R", "Z"}, {{0.5, 0.5, 2}}));
    add("deep samples without depth", "refused",
        samples({"A", "R", "G", "B"}, {{0.5, 0.5, 0.5, 0.5}}));
    add("colours in one layer of channels (beauty.R)", "read",
        channels({{"beauty.R", {1}}, {"beauty.G", {1}}, {"beauty.B", {1}}}));
    add("colours in several layers of channels, and none outside of them", "refused",
        channels(
            {{"a.R", {1}}, {"a.G", {1}}, {"a.B", {1}}, {"b.R", {1}}, {"b.G", {1}}, {"b.B", {1}}}));
    add("colours that are NaN, infinite or negative", "read",
        channels({{"R", {std::nan("")}}, {"G", {kInfinity}}, {"B", {-1}}}));
    return all;
}

std::vector<Statement> parts() {
    std::vector<Statement> all;
    const auto add = [&](const char* says, const char* becomes, const std::string& bytes) {
        all.push_back({says, becomes, "a.exr", bytes});
    };
    add("several pictures in parts", "warned",
        flat({{.name = "a", .values = kRgba}, {.name = "b", .values = kRgba}}));
    add("several pictures in parts", "warned", deepParts(2, "mask"));
    add("parts with more of the same deep samples", "read", deepParts(1, "mask"));
    add("several views, in parts or in channels", "warned",
        flat({{.name = "a", .values = kRgba}, {.name = "b", .values = kRgba}},
             {.header = views(true)}));
    FlatPart both{.values = kRgba};
    for (const auto& [name, values] : kRgba)
        both.values["right." + name] = values;
    add("several views, in parts or in channels", "warned", flat({both}, {.header = views(false)}));
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
            add("a data window inside, around or beside the display window", "read",
                flat({{.window = window, .values = kRgba}}), name);
    }
    add("a display window that does not begin at (0, 0)", "warned",
        flat({{.window = {{12, 8}, {13, 9}}, .values = kRgba}}, {.display = {{10, 7}, {17, 12}}}));
    add("a display window far larger than what is stored", "refused",
        flat({{.values = kRgba}}, {.display = {{0, 0}, {99999, 99999}}}));
    const auto aspect = [](std::size_t, Imf::Header& h) { h.pixelAspectRatio() = 2; };
    const auto primaries = [](std::size_t, Imf::Header& h) {
        Imf::addChromaticities(h, Imf::Chromaticities({0.7347F, 0.2653F}, {0, 1},
                                                      {0.0001F, -0.077F}, {0.32168F, 0.33767F}));
    };
    add("pixelAspectRatio that is not 1, into OpenEXR", "read", header(aspect));
    add("the same, into anything else", "warned", header(aspect), "pixels.exr");
    add("chromaticities that are not those of Rec. 709, into OpenEXR", "read", header(primaries));
    add("these, into anything else", "warned", header(primaries), "pixels.exr");
    add("other attributes, standard ones or not", "read", header([](std::size_t, Imf::Header& h) {
            h.screenWindowWidth() = 3;
            Imf::addOwner(h, "somebody");
            Imf::addEnvmap(h, Imf::ENVMAP_CUBE);
            Imf::addWhiteLuminance(h, 100);
            Imf::addXDensity(h, 72);
            Imf::addWrapmodes(h, "clamp");
            h.insert("ours", Imf::FloatAttribute(4));
        }));
    add("attributes of more than 1 MiB together", "warned", header([](std::size_t, Imf::Header& h) {
            h.insert("large", Imf::StringAttribute(std::string((1 << 20) + 1, 'x')));
        }));
    add("attributes of types that they cannot have", "warned",
        header([](std::size_t, Imf::Header& h) { h.insert("capDate", Imf::FloatAttribute(1)); }));
    add("a preview", "read",
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
    add("samples in any order", "read",
        samples(names, {{0.5, 0.5, 0.5, 0.5, 3}, {0.5, 0.1, 0.1, 0.1, 1}}));
    add("Z that is infinite", "read", sampleAt(kInfinity));
    add("Z that is infinite", "read", channels({{"Y", {1}}, {"Z", {kInfinity}}}));
    add("Z that is NaN or -inf", "warned", sampleAt(std::nan("")));
    add("Z that is NaN or -inf", "warned", sampleAt(-kInfinity));
    add("Z that is NaN or -inf", "warned", channels({{"Y", {1}}, {"Z", {std::nan("")}}}));
    add("volumes (ZBack) that lie apart", "read",
        samples(volume, {{0.5, 0.5, 0.5, 0.5, 1, 2}, {0.5, 0.1, 0.1, 0.1, 2, 3}}));
    add("volumes (ZBack) that overlap", "warned",
        samples(volume, {{0.5, 0.5, 0.5, 0.5, 1, 3}, {0.5, 0.1, 0.1, 0.1, 2, 4}}));
    add("more than 65,536 samples in a pixel", "refused",
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
