// SPDX-License-Identifier: Apache-2.0
// Tests deep EXR files written by peeler: compares them with OpenEXR sample by sample, and reads
// them back with our reader.
#include <OpenEXR/ImfCompositeDeepScanLine.h>
#include <OpenEXR/ImfDeepImageStateAttribute.h>
#include <OpenEXR/ImfDeepScanLineInputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include <peeler/composite.h>
#include <peeler/error.h>
#include "core/base/parallel.h"
#include "formats/exr/cut_window.h"
#include "formats/exr/damaged_exr.h"
#include "formats/exr/deep_certificate.h"
#include "formats/exr/deep_file.h"
#include "formats/exr/exr_layout.h"
#include "formats/exr/exr_readers.h"
#include "formats/exr/exr_writers.h"
#include "formats/exr/read_all.h"
#include "formats/exr/same_image.h"
#include "formats/exr/synthetic_image.h"
#include "formats/layered/opened_picture.h"
#include "support/test_support.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;
using test::DeepPart;
using test::expectSame;
using test::makePicture;
using test::readAll;
using test::ScratchDir;
using test::SyntheticPicture;
using test::writePicture;

/// Returns makePicture() with an additional float channel.
SyntheticPicture makeRichPicture(test::SyntheticOptions options) {
    options.extra = true;
    SyntheticPicture picture = makePicture(options);
    FragmentArray position{{"P.X", "P.Y", "P.Z"}, PixelType::kFloat, {}};
    for (std::size_t i = 0; i < 3 * picture.image.fragments(); ++i)
        test::appendValue(position.data, std::sin(static_cast<float>(i)) * 1e5F);
    picture.image.extra.insert(picture.image.extra.begin() + 1, std::move(position));
    return picture;
}

void writeDeep(const fs::path& path, const SyntheticPicture& picture,
               const std::vector<int>& heights = {1 << 20}, OutputOptions options = {}) {
    options.provenance.version = "1.2.3";
    ExrDeepWriter writer(path, options);
    writePicture(writer, picture, heights);
}

/// Calls check(p, first) for every pixel of the part's data window. p is the pixel's index in the
/// part; `first` is the index of the pixel's first fragment in `image`. Asserts that the counts
/// agree, and that pixels outside the data window are empty.
template <class Check>
void forEachPixel(const DeepPart& part, const LayeredImage& image, Check&& check) {
    const Window& all = image.window;
    for (int y = all.y0; y < all.y1; ++y) {
        for (int x = all.x0; x < all.x1; ++x) {
            const std::size_t pixel = image.pixelIndex(x, y);
            if (!part.window.intersects(Imath::V2i(x, y))) {
                ASSERT_EQ(image.count(pixel), 0U) << x << "," << y;
                continue;
            }
            const std::size_t p = static_cast<std::size_t>(y - part.window.min.y) * part.width() +
                                  static_cast<std::size_t>(x - part.window.min.x);
            ASSERT_EQ(part.counts[p], image.count(pixel)) << x << "," << y;
            check(p, image.offsets[pixel]);
        }
    }
}

void expectDeepChannel(const DeepPart& part, const LayeredImage& image, const std::string& name,
                       Imf::PixelType type, const std::function<double(std::size_t)>& expected) {
    ASSERT_TRUE(part.types.contains(name)) << name;
    EXPECT_EQ(part.types.at(name), type) << name;
    const auto& lists = part.values.at(name);
    forEachPixel(part, image, [&](std::size_t p, std::size_t first) {
        for (std::size_t k = 0; k < lists[p].size(); ++k)
            ASSERT_EQ(lists[p][k], expected(first + k)) << name << " of pixel " << p;
    });
}

double halfAt(const FragmentArray& array, std::size_t i) {
    return static_cast<double>(imath_half_to_float(array.as<std::uint16_t>()[i]));
}

class ExrDeep : public testing::Test {
  protected:
    void TearDown() override { setThreadCount(0); }
    ScratchDir scratch;
};

TEST_F(ExrDeep, EverySampleReadsBackWithOpenExr) {
    for (const ExrCompression& compression : exrCompressions()) {
        if (!compression.deep) continue;
        SCOPED_TRACE(compression.name);
        const SyntheticPicture picture =
            makeRichPicture({.seed = 11, .width = 41, .height = 33, .crop = {2, 3, 40, 33}});
        const LayeredImage& image = picture.image;
        writeDeep(scratch / "out.exr", picture, {13},
                  {.compression = std::string(compression.name)});
        Imf::MultiPartInputFile file((scratch / "out.exr").c_str());
        ASSERT_EQ(file.parts(), 2);
        EXPECT_EQ(file.header(0).name(), "color");
        EXPECT_EQ(file.header(1).name(), "ids");
        EXPECT_EQ(file.header(0).type(), "deepscanline");
        const DeepPart color = test::readDeepPart(file, 0), ids = test::readDeepPart(file, 1);
        EXPECT_EQ(color.types.size(), 5U);  // RGBA and Z
        EXPECT_EQ(ids.types.size(), 8U);    // Z, N, P and IDs
        const char* names[] = {"R", "G", "B", "A"};
        for (std::size_t c = 0; c < 4; ++c) {
            expectDeepChannel(color, image, names[c], Imf::HALF,
                              [&](std::size_t f) { return halfAt(image.color, 4 * f + c); });
        }
        for (const DeepPart* part : {&color, &ids}) {
            expectDeepChannel(*part, image, "Z", Imf::FLOAT,
                              [&](std::size_t f) { return static_cast<double>(image.z[f]); });
        }
        expectDeepChannel(ids, image, "N.Y", Imf::HALF,
                          [&](std::size_t f) { return halfAt(image.extra[0], 3 * f + 1); });
        expectDeepChannel(ids, image, "P.Z", Imf::FLOAT, [&](std::size_t f) {
            return static_cast<double>(image.extra[1].as<float>()[3 * f + 2]);
        });
        expectDeepChannel(ids, image, "id", Imf::UINT, [&](std::size_t f) {
            return static_cast<double>(image.extra[2].as<std::uint32_t>()[f]);
        });
    }
}

TEST_F(ExrDeep, OnlyWhatIsCompositedStandsBesideColour) {
    const SyntheticPicture plain = makePicture({.seed = 12, .width = 20, .height = 16});
    const auto names_of = [&](const std::vector<std::string>& channels, PixelType type) {
        SyntheticPicture picture = plain;
        for (const std::string& channel : channels) {
            FragmentArray array{{channel}, type, {}};
            array.data.resize(picture.image.fragments() * array.stride());
            picture.image.extra.push_back(std::move(array));
        }
        writeDeep(scratch / "out.exr", picture);
        Imf::MultiPartInputFile file((scratch / "out.exr").c_str());
        std::string text;
        for (int part = 0; part < file.parts(); ++part) {
            text += file.header(part).name() + ":";
            const Imf::ChannelList& list = file.header(part).channels();
            for (auto c = list.begin(); c != list.end(); ++c)
                text += std::string(" ") + c.name();
            text += "\n";
        }
        return text;
    };
    const std::string color = "color: A B G R Z\n";
    EXPECT_EQ(names_of({}, PixelType::kHalf), color);
    EXPECT_EQ(names_of({"facing"}, PixelType::kHalf), color + "aovs: Z facing\n");
    EXPECT_EQ(names_of({"id.object"}, PixelType::kUint), color + "ids: Z id.object\n");
    EXPECT_EQ(names_of({"AB", "AG", "AR", "ZBack"}, PixelType::kHalf),
              "color: A AB AG AR B G R Z ZBack\n");
    EXPECT_EQ(names_of({"Ng.X", "ZBack"}, PixelType::kFloat),
              "color: A B G R Z ZBack\naovs: Ng.X Z\n");
}

TEST_F(ExrDeep, ChannelsInThePartOfTheColourAreReadToo) {
    const SyntheticPicture picture = makeRichPicture({.seed = 13, .width = 24, .height = 18});
    writeDeep(scratch / "now.exr", picture);
    // Imitates older files, in which only integer channels are in a separate part.
    Imf::MultiPartInputFile file((scratch / "now.exr").c_str());
    DeepPart color = test::readDeepPart(file, 0), ids = test::readDeepPart(file, 1);
    for (const char* name : {"N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z"}) {
        color.types[name] = ids.types.at(name);
        color.values[name] = std::move(ids.values.at(name));
        ids.types.erase(name);
    }
    test::writeDeepFile(scratch / "before.exr", {color, ids}, {.display = {{0, 0}, {23, 17}}});
    const LayeredImage before = readAll(scratch / "before.exr");
    const LayeredImage now = readAll(scratch / "now.exr");
    // `before` lacks peeler's attributes, so the reader returns only the data window, without the
    // empty columns around it.
    expectSame(before, test::cutWindow(now, before.window));
}

TEST_F(ExrDeep, OurReaderReturnsTheSameImage) {
    for (std::uint32_t seed = 1; seed <= 6; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        test::SyntheticOptions options{.seed = seed};
        if (seed % 3 == 0) options.color_type = PixelType::kFloat;
        if (seed > 3) options.crop = {5, 9, 70, 58};
        const SyntheticPicture picture =
            seed % 2 == 0 ? makeRichPicture(options) : makePicture(options);
        const LayeredImage& wanted = picture.image;
        writeDeep(scratch / "out.exr", picture, {5, 20});
        const auto opened = openLayered(scratch / "out.exr");
        LayeredInput& reader = *opened;
        EXPECT_EQ(reader.info().plan.fragments_stored, picture.image.fragments());
        ASSERT_EQ(reader.info().plan.layers.size(), picture.plan.layers.size());
        for (std::size_t k = 0; k < picture.plan.layers.size(); ++k) {
            EXPECT_EQ(reader.info().plan.layers[k].data_window, picture.plan.layers[k].data_window);
            EXPECT_EQ(reader.info().plan.layers[k].pixels, picture.plan.layers[k].pixels);
        }
        LayeredImage read;
        reader.read(picture.image.window, read);
        expectSame(read, wanted);
        for (int y = wanted.window.y0; y < wanted.window.y1; y += 11) {
            const Window rows{wanted.window.x0, y, wanted.window.x1,
                              std::min(y + 11, wanted.window.y1)};
            reader.read(rows, read);
            expectSame(read, test::cutRows(wanted, rows.y0, rows.y1));
        }
    }
}

TEST_F(ExrDeep, BytesDoNotDependOnBandsOrThreads) {
    const SyntheticPicture picture = makeRichPicture({.seed = 21, .width = 97, .height = 130});
    DeepMergeSettings thinning;
    thinning.error = 1.0 / 16;
    const DeepMergeSettings merges[] = {{}, {DeepMerge::kByZ, 0.4F, 1}, thinning};
    for (const DeepMergeSettings& merge : merges) {
        setThreadCount(1);
        writeDeep(scratch / "a.exr", picture, {1 << 20}, {.deep_merge = merge});
        const std::string whole = test::bytesOf(scratch / "a.exr");
        ASSERT_FALSE(whole.empty());
        const std::vector<std::vector<int>> cuts = {{1}, {2, 15}, {17}, {31, 1, 64}};
        for (std::size_t i = 0; i < cuts.size(); ++i) {
            setThreadCount(static_cast<int>(i) + 1);
            writeDeep(scratch / "b.exr", picture, cuts[i], {.deep_merge = merge});
            EXPECT_TRUE(test::bytesOf(scratch / "b.exr") == whole) << "cut " << i;
        }
    }
}

TEST_F(ExrDeep, TheStateSaysWhetherSamplesCoincide) {
    for (const bool coincident : {false, true}) {
        SyntheticPicture picture = makePicture({.seed = 31, .width = 20, .height = 20});
        LayeredImage& image = picture.image;
        for (std::size_t p = 0; p < image.window.pixels(); ++p) {
            for (std::uint32_t f = image.offsets[p] + 1; f < image.offsets[p + 1]; ++f)
                image.z[f] = image.z[f - 1] + 1;
        }
        // Only the last list has coincident samples, so that the writer must check all lists.
        std::size_t last = image.window.pixels() - 1;
        while (image.count(last) < 2)
            --last;
        if (coincident) image.z[image.offsets[last] + 1] = image.z[image.offsets[last]];
        writeDeep(scratch / "out.exr", picture, {3});
        Imf::MultiPartInputFile file((scratch / "out.exr").c_str());
        EXPECT_EQ(Imf::deepImageState(file.header(0)),
                  coincident ? Imf::DIS_SORTED : Imf::DIS_TIDY);
        EXPECT_EQ(file.header(0).typedAttribute<Imf::IntAttribute>("maxSamplesPerPixel").value(),
                  static_cast<int>(picture.plan.layers.size()));
    }
}

TEST_F(ExrDeep, MergedFilesSayWhatIsLeftAndCompositeAlike) {
    const SyntheticPicture picture = makePicture({.seed = 41, .color_type = PixelType::kFloat});
    writeDeep(scratch / "out.exr", picture, {7}, {.deep_merge = {DeepMerge::kExact, 0, 1}});
    const auto opened = openLayered(scratch / "out.exr");
    LayeredInput& reader = *opened;
    LayeredImage merged;
    reader.read(picture.image.window, merged);
    EXPECT_LT(merged.fragments(), picture.image.fragments());
    Imf::MultiPartInputFile file((scratch / "out.exr").c_str());
    const Imf::Header& header = file.header(0);
    EXPECT_EQ(Imf::deepImageState(header), Imf::DIS_TIDY);
    const auto text = [&](const char* name) {
        return header.typedAttribute<Imf::StringAttribute>(name).value();
    };
    EXPECT_EQ(std::stoull(text("peeler:fragmentsStored")), merged.fragments());
    EXPECT_EQ(text("peeler:deepMerge"), "exact");
    EXPECT_EQ(header.typedAttribute<Imf::IntAttribute>("peeler:complete").value(), 0);
    EXPECT_EQ(header.typedAttribute<Imf::IntAttribute>("peeler:layers").value(),
              static_cast<int>(reader.info().plan.layers.size()));
    CompositeImage before, after;
    compositeOver(picture.image, {}, before);
    compositeOver(merged, {}, after);
    EXPECT_EQ(before.z, after.z);
    for (std::size_t p = 0; p < before.rgba.size(); ++p) {
        for (std::size_t c = 0; c < 4; ++c)
            ASSERT_NEAR(before.rgba[p][c], after.rgba[p][c], 1e-5F);
    }
}

/// Composites a deep file with OpenEXR. Returns R, G, B, A of the pixels of a window.
std::vector<float> compositeWithOpenExr(const fs::path& path, const Window& window) {
    const auto width = static_cast<std::size_t>(window.width());
    std::vector<float> rgba(4 * window.pixels());
    Imf::DeepScanLineInputFile file(path.c_str());
    Imf::CompositeDeepScanLine composite;
    composite.addSource(&file);
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < 4; ++c)
        buffer.insert(
            kColorNames[c],
            Imf::Slice::Make(Imf::FLOAT, rgba.data() + c,
                             Imath::Box2i({window.x0, window.y0}, {window.x1 - 1, window.y1 - 1}),
                             4 * sizeof(float), 4 * sizeof(float) * width));
    composite.setFrameBuffer(buffer);
    const Imath::Box2i data = file.header().dataWindow();
    composite.readPixels(data.min.y, data.max.y);
    return rgba;
}

TEST_F(ExrDeep, OpenExrFlattensThinnedFilesWithinTheBound) {
    const SyntheticPicture picture = makePicture({.seed = 47, .width = 60, .height = 40});
    const Window& window = picture.image.window;
    writeDeep(scratch / "all.exr", picture);
    const std::vector<float> all = compositeWithOpenExr(scratch / "all.exr", window);
    for (const double error : {1.0 / 256, 1.0 / 16, 0.25}) {
        DeepMergeSettings settings;
        settings.error = error;
        writeDeep(scratch / "thin.exr", picture, {9}, {.deep_merge = settings});
        const std::vector<float> thin = compositeWithOpenExr(scratch / "thin.exr", window);
        double worst = 0;
        for (std::size_t i = 0; i < all.size(); i += 4) {
            const double scale = std::max({1.0F, all[i], all[i + 1], all[i + 2]});
            for (std::size_t c = 0; c < 4; ++c)
                worst = std::max(worst, std::abs(double{all[i + c]} - double{thin[i + c]}) /
                                            (c < 3 ? scale : 1));
        }
        EXPECT_LE(worst, error);
        const auto opened = openLayered(scratch / "thin.exr");
        const auto certificate =
            deepCertificateFrom(opened->info().attributes().at(kDeepCertificate));
        ASSERT_TRUE(certificate);
        EXPECT_EQ(certificate->error, error);
        EXPECT_LE(certificate->largest, error);
        EXPECT_GE(certificate->largest, worst - 1e-6);
        EXPECT_EQ(certificate->before, picture.image.fragments());
        EXPECT_EQ(certificate->after, opened->info().plan.fragments_stored);
        DeepSourceHash hash;
        hash.add(picture.image, window.y0, window.y1);
        EXPECT_EQ(certificate->source, hash.text());
    }
}

TEST_F(ExrDeep, AnEmptyPictureIsAFile) {
    const SyntheticPicture picture = makePicture({.crop = {3, 4, 80, 50}, .most_layers = 0});
    writeDeep(scratch / "empty.exr", picture, {9});
    Imf::MultiPartInputFile file((scratch / "empty.exr").c_str());
    const DeepPart part = test::readDeepPart(file, 0);
    EXPECT_EQ(part.window, Imath::Box2i({3, 4}, {79, 49}));
    EXPECT_EQ(*std::max_element(part.counts.begin(), part.counts.end()), 0U);
    expectSame(readAll(scratch / "empty.exr"), picture.image);
}

TEST_F(ExrDeep, OtherProgramsReadIt) {
    const std::string path = scratch / "out.exr";
    writeDeep(path, makeRichPicture({.seed = 51}));
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"exrheader", path},
          {"exrinfo", "-v", path},
          {"oiiotool", "--info", "-v", "--stats", "-a", path}}) {
        const test::CommandResult result = test::runCommand(command);
        EXPECT_TRUE(test::took(command, result)) << command.front() << ": " << result.err;
        EXPECT_NE(result.out.find("ids"), std::string::npos) << result.out;
    }
}

TEST_F(ExrDeep, ABandThatDoesNotFitThePlanIsRefused) {
    const SyntheticPicture picture = makePicture({.seed = 71});
    const auto expectInternal = [](auto&& action) {
        try {
            action();
            FAIL() << "nothing was thrown";
        } catch (const Error& e) {
            EXPECT_EQ(e.kind(), ErrorKind::kInternal) << e.what();
        }
    };
    expectInternal([&] {  // rows are missing in the middle
        ExrDeepWriter writer(scratch / "out.exr");
        writer.begin(picture.plan);
        writer.write(test::cutRows(picture.image, 1, 5));
    });
    expectInternal([&] {  // rows are missing at the end
        ExrDeepWriter writer(scratch / "out.exr");
        writer.begin(picture.plan);
        writer.write(test::cutRows(picture.image, 0, 5));
        writer.finish();
    });
    expectInternal([&] {  // there is one fragment fewer than planned
        SyntheticPicture wrong = picture;
        ++wrong.plan.fragments_stored;
        writeDeep(scratch / "out.exr", wrong);
    });
    expectInternal([&] {  // a data window cuts off fragments
        SyntheticPicture wrong = picture;
        for (LayerPlan& layer : wrong.plan.layers)
            --layer.data_window.x1;
        writeDeep(scratch / "out.exr", wrong);
    });
    EXPECT_TRUE(fs::is_empty(scratch.path()));
}

TEST_F(ExrDeep, DamagedFilesAreErrorsNotCrashes) {
    const SyntheticPicture picture = makeRichPicture({.seed = 81, .width = 30, .height = 24});
    std::uint32_t seed = 5;
    for (const ExrCompression& compression : exrCompressions()) {
        if (!compression.deep) continue;
        writeDeep(scratch / "ours.exr", picture, {7},
                  {.compression = std::string(compression.name)});
        EXPECT_GT(test::refusalsOfDamaged(scratch / "ours.exr", seed, 150), 37);
        seed += 2;
    }
}

}  // namespace
}  // namespace peeler
