// SPDX-License-Identifier: Apache-2.0
// Tests every layout: written and read, and converted to deep files and back. Also tests sets of
// one file per layer.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <fstream>

#include <peeler/error.h>
#include "core/image/layers.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/exr_layout.h"
#include "formats/exr/exr_writers.h"
#include "formats/exr/read_all.h"
#include "formats/exr/same_image.h"
#include "formats/exr/synthetic_image.h"
#include "formats/layered/opened_picture.h"
#include "support/test_support.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;
using test::expectSame;
using test::makePicture;
using test::readAll;
using test::ScratchDir;
using test::SyntheticPicture;

Provenance shortProvenance() {
    Provenance provenance;
    provenance.version = "1.2.3";
    provenance.settings_hash = "cd";
    return provenance;
}

void writeLayout(const fs::path& path, const SyntheticPicture& picture, std::string_view layout,
                 bool composite = true, const std::string& compression = "") {
    ExrLdiWriter writer(path, {.no_composite = !composite,
                               .layout = std::string(layout),
                               .compression = compression,
                               .provenance = shortProvenance()});
    test::writePicture(writer, picture, {7, 20});
}

/// Converts a file like `peeler convert`.
void convert(const fs::path& from, Sink& to) {
    const auto reader = openLayered(from);
    const Window crop = reader->info().plan.view.crop;
    LayeredImage band;
    Plan plan = reader->info().plan;
    reader->read(crop, band);
    DepthComplexity complexity(crop);
    complexity.addBand(band);
    plan.layers = complexity.layers();
    to.begin(plan);
    for (int y = crop.y0; y < crop.y1; y += 9) {
        reader->read({crop.x0, y, crop.x1, std::min(y + 9, crop.y1)}, band);
        to.write(std::move(band));
    }
    to.finish();
}

std::vector<std::string> channelsOf(const Imf::Header& header) {
    std::vector<std::string> names;
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
        names.emplace_back(c.name());
    return names;
}

class ExrLayouts : public testing::Test {
  protected:
    ScratchDir scratch;
};

TEST_F(ExrLayouts, EveryLayoutReadsBackTheSameImage) {
    for (const ExrLayout& layout : exrLayouts()) {
        for (const bool extra : {false, true}) {
            SCOPED_TRACE(std::string(layout.name) + (extra ? " extra" : ""));
            const SyntheticPicture picture =
                makePicture({.seed = 5, .crop = {3, 4, 80, 50}, .extra = extra});
            const fs::path path = scratch / "out.exr";
            writeLayout(path, picture, layout.name);
            expectSame(readAll(path), picture.image);
            const ExrInfo info = readExrInfo(path);
            EXPECT_EQ(info.attributes().at("peeler:layout"), layout.name);
            ASSERT_EQ(info.layers.size(), picture.plan.layers.size());
            CompositeImage stored, wanted;
            openLayered(path)->readComposite(picture.image.window, stored);
            compositeOver(picture.image, {}, wanted);
            EXPECT_EQ(stored.z, wanted.z);
        }
    }
}

TEST_F(ExrLayouts, WithoutCompositeAndEmptyAndCompressedOtherwise) {
    for (const ExrLayout& layout : exrLayouts()) {
        SCOPED_TRACE(layout.name);
        const fs::path path = scratch / "out.exr";
        const SyntheticPicture picture = makePicture({.seed = 6, .width = 40, .height = 37});
        for (const ExrCompression& compression : exrCompressions()) {
            writeLayout(path, picture, layout.name, true, std::string(compression.name));
            expectSame(readAll(path), picture.image);
            Imf::MultiPartInputFile file(path.c_str());
            EXPECT_EQ(file.header(0).compression(), compression.value);
        }
        writeLayout(path, picture, layout.name, false);
        expectSame(readAll(path), picture.image);
        const SyntheticPicture empty = makePicture({.most_layers = 0});
        writeLayout(path, empty, layout.name, false);
        expectSame(readAll(path), empty.image);
    }
}

TEST_F(ExrLayouts, LayeredToDeepAndBackIsTheSameFile) {
    for (const ExrLayout& layout : exrLayouts()) {
        for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
            for (const int most : {7, 0}) {
                SCOPED_TRACE(std::string(layout.name) + " " + std::to_string(most));
                const SyntheticPicture picture = makePicture({.seed = 8,
                                                              .width = 50,
                                                              .height = 45,
                                                              .crop = {3, 4, 47, 41},
                                                              .most_layers = most,
                                                              .color_type = type,
                                                              .extra = most > 0});
                const fs::path path = scratch / "out.exr", deep = scratch / "deep.exr",
                               back = scratch / "back.exr";
                writeLayout(path, picture, layout.name);
                {
                    ExrDeepWriter direct(scratch / "direct.exr", {.provenance = shortProvenance()});
                    test::writePicture(direct, picture);
                }
                {
                    ExrDeepWriter writer(deep, {.provenance = shortProvenance()});
                    convert(path, writer);
                }
                EXPECT_TRUE(test::bytesOf(deep) == test::bytesOf(scratch / "direct.exr"));
                ExrLdiWriter writer(
                    back, {.layout = std::string(layout.name), .provenance = shortProvenance()});
                convert(deep, writer);
                EXPECT_TRUE(test::bytesOf(back) == test::bytesOf(path));
                for (std::size_t k = 0; layout.one_file_a_layer && k < picture.plan.layers.size();
                     ++k) {
                    EXPECT_TRUE(test::bytesOf(exrLayerFile(back, k)) ==
                                test::bytesOf(exrLayerFile(path, k)));
                }
            }
        }
    }
}

TEST_F(ExrLayouts, NamesAreThoseOfTheContract) {
    const SyntheticPicture picture = makePicture({.seed = 7, .most_layers = 2, .extra = true});
    writeLayout(scratch / "nuke.exr", picture, "nuke");
    Imf::MultiPartInputFile nuke((scratch / "nuke.exr").c_str());
    ASSERT_EQ(nuke.parts(), 3);
    EXPECT_EQ(nuke.header(0).name(), "rgba");
    EXPECT_EQ(channelsOf(nuke.header(0)), (std::vector<std::string>{"A", "B", "G", "R", "Z"}));
    EXPECT_EQ(nuke.header(2).name(), "layer_001");
    EXPECT_EQ(channelsOf(nuke.header(2)),
              (std::vector<std::string>{"layer_001.A", "layer_001.B", "layer_001.G",
                                        "layer_001.N.X", "layer_001.N.Y", "layer_001.N.Z",
                                        "layer_001.R", "layer_001.Z", "layer_001.id"}));
    writeLayout(scratch / "one.exr", picture, "single-part");
    Imf::MultiPartInputFile one((scratch / "one.exr").c_str());
    ASSERT_EQ(one.parts(), 1);
    EXPECT_EQ(channelsOf(one.header(0)).size(), 5U + 2 * 9);
    EXPECT_TRUE(one.header(0).channels().findChannel("layer_000.Z"));
    writeLayout(scratch / "set.exr", picture, "per-file");
    for (const char* name : {"set.exr", "set.layer_000.exr", "set.layer_001.exr"}) {
        Imf::MultiPartInputFile file((scratch / name).c_str());
        ASSERT_EQ(file.parts(), 1) << name;
    }
    EXPECT_FALSE(fs::exists(scratch / "set.layer_002.exr"));
}

TEST_F(ExrLayouts, AFileOfASetAloneIsThatLayer) {
    const SyntheticPicture picture = makePicture({.seed = 9});
    writeLayout(scratch / "out.exr", picture, "per-file");
    const LayeredImage layer = readAll(scratch / "out.layer_001.exr");
    EXPECT_EQ(layer.fragments(), picture.plan.layers[1].pixels);
    EXPECT_EQ(readExrInfo(scratch / "out.layer_001.exr").plan.fragments_stored, layer.fragments());
    std::size_t f = 0;
    for (std::size_t p = 0; p < picture.image.window.pixels(); ++p) {
        if (picture.image.count(p) < 2) continue;
        ASSERT_EQ(layer.count(p), 1U);
        ASSERT_EQ(layer.z[f++], picture.image.z[picture.image.offsets[p] + 1]);
    }
}

TEST_F(ExrLayouts, ASetWithAMissingOrForeignFileIsRefused) {
    const SyntheticPicture picture = makePicture({.seed = 10}), other = makePicture({.seed = 11});
    const auto refusal = [&]() -> std::string {
        try {
            readAll(scratch / "out.exr");
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_NE(error.hint(), "");
            return error.where();
        }
        return "nothing";
    };
    writeLayout(scratch / "other.exr", other, "per-file");
    writeLayout(scratch / "out.exr", picture, "per-file");
    EXPECT_EQ(refusal(), "nothing");
    fs::rename(scratch / "out.layer_002.exr", scratch / "kept.exr");
    EXPECT_EQ(refusal(), (scratch / "out.layer_002.exr").string());
    fs::copy(scratch / "out.layer_001.exr", scratch / "out.layer_002.exr");
    EXPECT_EQ(refusal(), (scratch / "out.layer_002.exr").string());
    fs::rename(scratch / "kept.exr", scratch / "out.layer_002.exr");
    EXPECT_EQ(refusal(), "nothing");
}

TEST_F(ExrLayouts, ASetThatCannotBeFinishedLeavesNothing) {
    const SyntheticPicture picture = makePicture({.seed = 12});
    const fs::path path = scratch / "out.exr";
    {
        ExrLdiWriter writer(
            path, {.layout = std::string(kPerFileLayout), .provenance = shortProvenance()});
        writer.begin(picture.plan);
        writer.write(LayeredImage(picture.image));
        // This folder blocks the file that is renamed last, when the others already have their
        // final names.
        fs::create_directory(scratch / "out.layer_000.exr");
        std::ofstream(scratch / "out.layer_000.exr" / "full") << "x";
        EXPECT_THROW(writer.finish(), Error);
    }
    fs::remove_all(scratch / "out.layer_000.exr");
    EXPECT_TRUE(fs::is_empty(scratch.path()));
}

TEST_F(ExrLayouts, APictureOfOthersIsOneLayer) {
    const SyntheticPicture picture = makePicture({.seed = 13});
    ExrCompositeWriter writer(scratch / "ours.exr", {.provenance = shortProvenance()});
    test::writePicture(writer, picture);
    // A composite by peeler itself is not read as a layered picture.
    EXPECT_THROW(openLayered(scratch / "ours.exr"), Error);
    // oiiotool would copy peeler's attributes, so the command erases them.
    for (const char* channels : {"R,G,B,A,Z", "R,G,B,A", "R,G,B"}) {
        const std::string path = scratch / "flat.exr";
        const test::Outcome result =
            test::runCommand({"oiiotool", (scratch / "ours.exr").string(), "--eraseattrib",
                              "peeler:.*", "--ch", channels, "-o", path});
        ASSERT_EQ(result.exit_code, 0) << result.err;
        const auto reader = openLayered(path);
        EXPECT_EQ(reader->info().plan.layers.size(), 1U);
        LayeredImage image;
        reader->read(reader->info().plan.view.crop, image);
        const bool opaque = std::string(channels) == "R,G,B";
        const std::size_t filled = picture.plan.layers[0].pixels;
        EXPECT_EQ(image.fragments(), opaque ? image.window.pixels() : filled) << channels;
        CompositeImage before, after;
        compositeOver(picture.image, {}, before);
        compositeOver(image, {}, after);
        for (std::size_t p = 0; p < before.rgba.size(); ++p) {
            for (std::size_t c = 0; c < 3; ++c) {
                ASSERT_EQ(static_cast<float>(half(before.rgba[p][c])), after.rgba[p][c])
                    << channels;
            }
        }
    }
}

}  // namespace
}  // namespace peeler
