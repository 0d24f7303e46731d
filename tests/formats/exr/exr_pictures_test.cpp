// SPDX-License-Identifier: Apache-2.0
// Tests OpenEXR pictures of other programs: pixels, channels, parts, and header attributes.
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <array>
#include <cfloat>
#include <cmath>

#include <peeler/composite.h>
#include <peeler/error.h>
#include "formats/exr/damaged_exr.h"
#include "formats/exr/deep_file.h"
#include "formats/exr/exr_writers.h"
#include "formats/exr/flat_file.h"
#include "formats/layered/opened_picture.h"
#include "support/test_support.h"

namespace peeler {
namespace {

using Color = std::array<float, 4>;
using test::deepPart;
using test::FlatPart;

struct ReadPicture {
    LayeredImage image;
    ExrInfo info;
    std::vector<Text> warnings;

    /// Returns the index of a pixel's only fragment.
    std::size_t at(int x, int y) const {
        const std::size_t pixel = image.pixelIndex(x, y);
        EXPECT_EQ(image.count(pixel), 1U);
        return image.offsets[pixel];
    }
    Color colorAt(int x, int y) const { return colorOf(image, at(x, y)); }
};

ReadPicture read(const std::string& path, const LayeredReadOptions& options = {}) {
    const auto input = openLayered(path, options);
    ReadPicture picture{{}, input->info(), {}};
    input->read(picture.info.plan.view.crop, picture.image);
    picture.warnings = input->takeWarnings();
    return picture;
}

/// Returns a part with this value in the channels R, G and B; `prefix` precedes the channel names.
FlatPart grey(double value, const std::string& prefix = "") {
    FlatPart part;
    for (const char* name : {"R", "G", "B"})
        part.values[prefix + name] = {value};
    return part;
}

class ExrPictures : public testing::Test {
  protected:
    ReadPicture readFlat(const std::vector<FlatPart>& parts, const test::FlatFileOptions& file = {},
                         const LayeredReadOptions& options = {}) {
        test::writeFlatFile(path_, parts, file);
        return read(path_, options);
    }
    ReadPicture readDeep(const std::vector<std::string>& channels,
                         const std::vector<std::vector<double>>& samples) {
        test::writeDeepFile(path_, {deepPart({{0, 0}, {1, 0}}, channels, samples)});
        return read(path_);
    }

    test::ScratchDir scratch_;
    const std::string path_ = scratch_ / "a.exr";
};

TEST_F(ExrPictures, EveryCompressionOfScanLinesAndTilesHasTheValuesThatWereWritten) {
    FlatPart part{.window = {{-3, 2}, {37, 301}}, .types = {{"G", Imf::FLOAT}}};
    for (const char* name : {"R", "G", "B", "A"}) {
        std::vector<double>& values = part.values[name];
        for (int y = 0; y < 300; ++y)
            for (int x = 0; x < 41; ++x)
                values.push_back(0.25 + 0.5 * x / 41 + 0.001 * y);
    }
    for (const int tile : {0, 32}) {
        for (int c = 0; c < Imf::NUM_COMPRESSION_METHODS; ++c) {
            SCOPED_TRACE(testing::Message() << "compression " << c << ", tile " << tile);
            const ReadPicture picture =
                readFlat({part}, {.compression = static_cast<Imf::Compression>(c), .tile = tile});
            EXPECT_EQ(picture.info.plan.layers.size(), 1U);
            for (const int y : {2, 150, 301}) {
                const float wanted = 0.25F + 0.5F * 13 / 41 + 0.001F * static_cast<float>(y - 2);
                for (const float value : picture.colorAt(10, y))
                    EXPECT_NEAR(value, wanted, 0.02F) << y;
            }
            EXPECT_NO_THROW(ExrInput(path_).decodeAll(0));
        }
    }
}

TEST_F(ExrPictures, APictureThatWasMadeOfOurFileIsOneThoughItKeepsWhatWeSaid) {
    FlatPart part = grey(0.5);
    part.name = "color";
    const ReadPicture picture =
        readFlat({part}, {.header = [](std::size_t, Imf::Header& header) {
                     for (const auto& [name, value] :
                          {std::pair("peeler:version", "0.1.0"), std::pair("peeler:layers", "14")})
                         header.insert(name, Imf::StringAttribute(value));
                 }});
    EXPECT_EQ(picture.info.plan.layers.size(), 1U);
    EXPECT_FALSE(picture.info.is_peeler);
    EXPECT_EQ(picture.colorAt(1, 1), (Color{0.5F, 0.5F, 0.5F, 1}));
    EXPECT_TRUE(picture.warnings.empty());
}

TEST_F(ExrPictures, TheDisplayWindowIsThePictureAndTheDataWindowIsWhatIsStored) {
    const Window display{0, 0, 8, 6};
    struct Case {
        Imath::Box2i data;
        Window all;  ///< the expected window, including pixels outside the display window
    };
    for (const Case& c :
         {Case{{{2, 1}, {5, 3}}, display}, Case{{{-2, -1}, {9, 6}}, {-2, -1, 10, 7}},
          Case{{{9, 7}, {9, 7}}, {0, 0, 10, 8}}}) {
        FlatPart part = grey(0.5);
        part.window = c.data;
        test::DeepPart samples =
            deepPart(c.data, {"A", "R", "G", "B", "Z"}, {{1, 0.5, 0.5, 0.5, 2}});
        for (const bool deep : {false, true}) {
            if (deep)
                test::writeDeepFile(path_, {samples}, {.display = {{0, 0}, {7, 5}}});
            else
                test::writeFlatFile(path_, {part});
            EXPECT_EQ(read(path_).image.window, c.all);
            LayeredReadOptions pixels;
            pixels.pixels_only = true;
            const ReadPicture picture = read(path_, pixels);
            EXPECT_EQ(picture.image.window, display);
            const Window shown = intersect(
                display, {c.data.min.x, c.data.min.y, c.data.max.x + 1, c.data.max.y + 1});
            const std::uint64_t stored = shown.empty() ? 0 : shown.pixels();
            EXPECT_EQ(picture.image.fragments(), stored);
            if (deep) {
                EXPECT_EQ(picture.info.plan.fragments_stored, stored);
            }
            if (shown.empty()) continue;
            EXPECT_EQ(picture.colorAt(shown.x0, shown.y0), (Color{0.5F, 0.5F, 0.5F, 1}));
        }
    }
}

TEST_F(ExrPictures, ADisplayWindowAnywhereIsMovedToTheOrigin) {
    FlatPart part = grey(0.5);
    part.window = {{-18, 12}, {-18, 12}};
    const ReadPicture picture = readFlat({part}, {.display = {{-20, 10}, {-13, 15}}});
    EXPECT_EQ(picture.image.window, (Window{0, 0, 8, 6}));
    EXPECT_EQ(picture.image.fragments(), 1U);
    EXPECT_EQ(picture.colorAt(2, 2), (Color{0.5F, 0.5F, 0.5F, 1}));
    for (const int tile : {0, 3}) {
        test::writeDeepFile(
            path_,
            {deepPart({{-18, 12}, {-18, 12}}, {"A", "R", "G", "B", "Z"}, {{1, 0.5, 0.5, 0.5, 2}})},
            {.tile = tile, .display = {{-20, 10}, {-13, 15}}});
        EXPECT_EQ(read(path_).colorAt(2, 2), (Color{0.5F, 0.5F, 0.5F, 1}));
    }
}

TEST_F(ExrPictures, OpacityOfEachChannelNeedsNoAlpha) {
    const ReadPicture deep = readDeep({"AR", "AG", "AB", "R", "G", "B", "Z"},
                                      {{0.8, 0.4, 0, 0.2, 0.1, 0, 1}, {1, 1, 1, 0, 1, 0, 2}});
    ASSERT_TRUE(deep.image.tinted());
    EXPECT_NEAR(colorOf(deep.image, 0)[3], 0.4F, 1e-6F);
    CompositeImage flat;
    compositeOver(deep.image, {}, flat);
    EXPECT_NEAR(flat.rgba[0][1], 0.1F + (1 - 0.4F) * 1, 1e-6F);
    EXPECT_TRUE(deep.warnings.empty());

    const ReadPicture picture = readFlat({{.values = {{"AR", {0.75}},
                                                      {"AG", {0.5}},
                                                      {"AB", {0.25}},
                                                      {"R", {0.5}},
                                                      {"G", {0.25}},
                                                      {"B", {0}}}}});
    ASSERT_TRUE(picture.image.tinted());
    EXPECT_EQ(picture.colorAt(0, 0), (Color{0.5F, 0.25F, 0, 0.5F}));
}

TEST_F(ExrPictures, ColoursAlphaAndDepthHaveOtherNames) {
    const ReadPicture deep = readDeep({"alpha", "red", "Green", "b", "depth", "id.A"},
                                      {{0.5, 0.25, 0.125, 0.0625, 3, 7}});
    EXPECT_EQ(deep.colorAt(0, 0), (Color{0.25F, 0.125F, 0.0625F, 0.5F}));
    EXPECT_EQ(deep.image.z[0], 3);
    ASSERT_EQ(deep.image.extra.size(), 1U);
    EXPECT_EQ(deep.image.extra[0].channels.front(), "id.A");

    const ReadPicture flat = readFlat({{.values = {{"Red", {0.5}},
                                                   {"g", {0.25}},
                                                   {"BLUE", {0.125}},
                                                   {"Alpha", {0.5}},
                                                   {"Depth", {4}}}}});
    EXPECT_EQ(flat.colorAt(0, 0), (Color{0.5F, 0.25F, 0.125F, 0.5F}));
    EXPECT_EQ(flat.image.z[0], 4);
    EXPECT_TRUE(flat.image.extra.empty());
    EXPECT_TRUE(deep.warnings.empty() && flat.warnings.empty());
}

TEST_F(ExrPictures, TheOnlyLayerOfChannelsIsThePicture) {
    const ReadPicture deep =
        readDeep({"beauty.A", "beauty.R", "beauty.G", "beauty.B", "Z", "N.X", "N.Y", "N.Z"},
                 {{0.5, 0.25, 0.125, 0, 3, 0, 0, 1}});
    EXPECT_EQ(deep.colorAt(0, 0), (Color{0.25F, 0.125F, 0, 0.5F}));
    EXPECT_EQ(deep.image.z[0], 3);
    ASSERT_EQ(deep.image.extra.size(), 1U);

    FlatPart part = grey(0.5, "ViewLayer.Combined.");
    part.values["ViewLayer.Combined.A"] = {0.75};
    EXPECT_EQ(readFlat({part}).colorAt(0, 0), (Color{0.5F, 0.5F, 0.5F, 0.75F}));

    // With two candidates, the caller must name the colour.
    part.values.merge(grey(0.25, "diffuse.").values);
    EXPECT_THROW(readFlat({part}), Error);
    LayeredReadOptions diffuse;
    diffuse.part = "diffuse";
    EXPECT_EQ(readFlat({part}, {}, diffuse).colorAt(0, 0), (Color{0.25F, 0.25F, 0.25F, 1}));
    // If the unprefixed picture exists too, the prefixed channels are additional channels.
    part.values.merge(grey(0.125).values);
    const ReadPicture both = readFlat({part});
    EXPECT_EQ(both.colorAt(0, 0)[0], 0.125F);
    EXPECT_EQ(both.image.extra.size(), 2U);
    EXPECT_EQ(readFlat({part}, {}, diffuse).colorAt(0, 0)[0], 0.25F);
}

TEST_F(ExrPictures, LuminanceAndChromaAreAColour) {
    // R, G, B = 0.5, 0.25, 0.125 with the weights of Rec. 709.
    const double y = 0.2126 * 0.5 + 0.7152 * 0.25 + 0.0722 * 0.125;
    for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT}) {
        const ReadPicture picture = readFlat({{.values = {{"Y", {y}},
                                                          {"RY", {(0.5 - y) / y}},
                                                          {"BY", {(0.125 - y) / y}},
                                                          {"A", {1}}},
                                               .types = {{"A", type}}}});
        EXPECT_NEAR(picture.colorAt(0, 0)[0], 0.5F, 1e-3F);
        EXPECT_NEAR(picture.colorAt(0, 0)[1], 0.25F, 1e-3F);
        EXPECT_NEAR(picture.colorAt(0, 0)[2], 0.125F, 1e-3F);
        EXPECT_EQ(readFlat({{.values = {{"Y", {0.5}}, {"A", {1}}}, .types = {{"A", type}}}})
                      .colorAt(0, 0),
                  (Color{0.5F, 0.5F, 0.5F, 1}));
    }
}

TEST_F(ExrPictures, WhatLiesAtInfinityIsSeen) {
    FlatPart part = grey(0.5);
    part.values["Z"] = {HUGE_VAL};
    part.values["A"].assign(12, 0);
    part.values["A"][0] = 1;
    for (const char* name : {"R", "G", "B"}) {
        part.values[name].assign(12, 0);
        part.values[name][0] = 0.5;
    }
    const ReadPicture picture = readFlat({part});
    EXPECT_EQ(picture.image.fragments(), 1U);
    EXPECT_EQ(picture.image.z[picture.at(0, 0)], FLT_MAX);
    EXPECT_EQ(picture.colorAt(0, 0), (Color{0.5F, 0.5F, 0.5F, 1}));
}

TEST_F(ExrPictures, PartsAndViewsAreChosen) {
    FlatPart a = grey(0.5), b = grey(0.25);
    a.name = "a";
    b.name = "b";
    const test::FlatFileOptions views{.header = [](std::size_t part, Imf::Header& header) {
        header.setView(part == 0 ? "left" : "right");
    }};
    LayeredReadOptions part, view, other;
    part.part = "b";
    view.view = "right";
    other.part = "c";
    EXPECT_EQ(readFlat({a, b}).colorAt(0, 0)[0], 0.5F);
    EXPECT_EQ(readFlat({a, b}).warnings,
              (std::vector<Text>{"The part \"b\" is not read; `part` selects a part."}));
    const ReadPicture chosen = readFlat({a, b}, {}, part);
    EXPECT_EQ(chosen.colorAt(0, 0)[0], 0.25F);
    EXPECT_TRUE(chosen.warnings.empty());
    EXPECT_EQ(readFlat({a, b}, views, view).colorAt(0, 0)[0], 0.25F);
    EXPECT_EQ(readFlat({a, b}, views).warnings,
              (std::vector<Text>{"The view \"right\" is not read; `view` selects it."}));
    for (const LayeredReadOptions& wrong : {other, view}) {
        try {
            readFlat({a, b}, {}, wrong);
            FAIL() << "nothing was thrown";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
            EXPECT_NE(error.hint(), "");
        }
    }

    // A single part, even a deep one, may contain both views. The left view's channels have no
    // prefix.
    FlatPart both = grey(0.5);
    both.values.merge(grey(0.25, "right.").values);
    const test::FlatFileOptions multi_view{.header = [](std::size_t, Imf::Header& header) {
        Imf::addMultiView(header, {"left", "right"});
    }};
    EXPECT_EQ(readFlat({both}, multi_view).colorAt(0, 0)[0], 0.5F);
    EXPECT_EQ(readFlat({both}, multi_view, view).colorAt(0, 0)[0], 0.25F);

    test::DeepPart beauty =
        deepPart({{0, 0}, {1, 0}}, {"A", "R", "G", "B", "Z"}, {{1, 0.5, 0.5, 0.5, 2}});
    test::DeepPart fx = beauty;
    beauty.name = "beauty";
    fx.name = "b";
    fx.values["R"].assign(fx.pixels(), {0.125});
    test::writeDeepFile(path_, {beauty, fx});
    EXPECT_EQ(read(path_).colorAt(0, 0)[0], 0.5F);
    EXPECT_EQ(read(path_).warnings.size(), 1U);
    EXPECT_EQ(read(path_, part).colorAt(0, 0)[0], 0.125F);
}

TEST_F(ExrPictures, WhatAHeaderSaysGoesAlong) {
    const Imf::Chromaticities primaries({0.7F, 0.3F}, {0.1F, 0.8F}, {0.13F, 0.04F}, {0.31F, 0.33F});
    const auto say = [&](std::size_t, Imf::Header& header) {
        header.pixelAspectRatio() = 2;
        header.screenWindowWidth() = 3;
        header.screenWindowCenter() = {0.5F, 0.25F};
        Imf::addChromaticities(header, primaries);
        Imf::addOwner(header, "somebody");
        header.insert("renderer/samples", Imf::FloatAttribute(64));
    };
    test::DeepPart part =
        deepPart({{0, 0}, {1, 0}}, {"A", "R", "G", "B", "Z"}, {{1, 0.5, 0.5, 0.5, 2}});
    test::writeDeepFile(path_, {part}, {.header = say});
    // Attributes must survive two copies in a row.
    std::string from = path_;
    for (const std::string to : {scratch_ / "b.exr", scratch_ / "c.exr"}) {
        ReadPicture picture = read(from);
        picture.info.provenance.version = "1";
        ExrLdiWriter writer(to, {.provenance = picture.info.provenance});
        writer.begin(picture.info.plan);
        writer.write(std::move(picture.image));
        writer.finish();
        const Imf::MultiPartInputFile file(to.c_str());
        for (int i = 0; i < file.parts(); ++i) {
            const Imf::Header& header = file.header(i);
            EXPECT_EQ(header.pixelAspectRatio(), 2);
            EXPECT_EQ(header.screenWindowWidth(), 3);
            EXPECT_EQ(header.screenWindowCenter(), Imath::V2f(0.5F, 0.25F));
            EXPECT_EQ(Imf::chromaticities(header), primaries);
            EXPECT_EQ(Imf::owner(header), "somebody");
            EXPECT_EQ(header.typedAttribute<Imf::FloatAttribute>("renderer/samples").value(), 64);
            EXPECT_EQ(header.compression(), Imf::ZIP_COMPRESSION);
        }
        from = to;
    }
}

TEST_F(ExrPictures, StrictRefusesWhatIsWarnedOf) {
    LayeredReadOptions strict;
    strict.strict = true;
    EXPECT_NO_THROW(readFlat({grey(1)}, {}, strict));
    FlatPart other = grey(1);
    other.name = "other";
    EXPECT_THROW(readFlat({grey(1), other}, {}, strict), Error);
    FlatPart odd = grey(1);
    odd.values["Z"] = {std::nan("")};
    EXPECT_THROW(readFlat({odd}, {}, strict), Error);
}

TEST_F(ExrPictures, DamagedTilesAndDwaAreErrorsNotCrashes) {
    std::uint32_t seed = 11;
    const int turns = test::exhaustive() ? 2000 : 100;
    FlatPart part = grey(0.5);
    part.values["Z"] = {2};
    for (const int tile : {0, 4}) {
        for (const auto compression : {Imf::DWAA_COMPRESSION, Imf::ZIP_COMPRESSION}) {
            test::writeFlatFile(path_, {part}, {.compression = compression, .tile = tile});
            EXPECT_GT(test::refusalsOfDamaged(path_, seed++, turns), turns / 4);
        }
    }
}

}  // namespace
}  // namespace peeler
