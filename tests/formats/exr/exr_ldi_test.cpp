// SPDX-License-Identifier: Apache-2.0
// Tests layered EXR files: compares them with OpenEXR pixel by pixel, reads them back with our
// reader, and expects the same bytes with any bands.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string_view>

#include <peeler/composite.h>
#include <peeler/error.h>
#include "core/base/parallel.h"
#include "formats/exr/damaged_exr.h"
#include "formats/exr/exr_input.h"
#include "formats/exr/exr_readers.h"
#include "formats/exr/exr_writers.h"
#include "formats/exr/read_all.h"
#include "formats/exr/same_image.h"
#include "formats/exr/synthetic_image.h"
#include "support/numbers.h"
#include "support/test_support.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;
using test::expectSame;
using test::kFloatInfinity;
using test::makePicture;
using test::ScratchDir;
using test::SyntheticOptions;
using test::SyntheticPicture;
using test::writePicture;

Provenance fullProvenance() {
    return {.version = "1.2.3",
            .method = "a-buffer",
            .surfaces = "all",
            .scene = "s.glb",
            .scene_hash = "ab",
            .settings_hash = "cd",
            .renderer = "test",
            .frame = 7,
            .time = 0.1,
            .frames_per_second = 24};
}

void writeLdi(const fs::path& path, const SyntheticPicture& picture,
              const std::vector<int>& heights = {1 << 20}, OutputOptions options = {}) {
    options.provenance = fullProvenance();
    ExrLdiWriter writer(path, options);
    writePicture(writer, picture, heights);
}

/// Reads one channel of a part with OpenEXR's classes, as values of the channel's type.
template <class T>
std::vector<T> readChannel(Imf::MultiPartInputFile& file, int part_index, const char* name,
                           Imf::PixelType type) {
    Imf::InputPart part(file, part_index);
    const Imath::Box2i window = part.header().dataWindow();
    const auto width = static_cast<std::size_t>(window.max.x - window.min.x + 1);
    const auto height = static_cast<std::size_t>(window.max.y - window.min.y + 1);
    std::vector<T> values(width * height);
    Imf::FrameBuffer buffer;
    buffer.insert(name,
                  Imf::Slice::Make(type, values.data(), window.min, static_cast<int64_t>(width),
                                   static_cast<int64_t>(height), sizeof(T)));
    part.setFrameBuffer(buffer);
    part.readPixels(window.min.y, window.max.y);
    return values;
}

/// Compares a channel in every layer of the file with `expected(fragment)`.
template <class T, class F>
void expectLayerChannel(const fs::path& path, const LayeredImage& image, std::size_t layers,
                        const char* name, Imf::PixelType type, T missing, F&& expected) {
    Imf::MultiPartInputFile file(path.c_str());
    for (std::size_t k = 0; k < layers; ++k) {
        const int part = static_cast<int>(k) + 1;
        ASSERT_EQ(file.header(part).name(), layerName(k));
        ASSERT_EQ(file.header(part).channels()[name].type, type);
        const Imath::Box2i window = file.header(part).dataWindow();
        const std::vector<T> values = readChannel<T>(file, part, name, type);
        std::size_t i = 0;
        for (int y = window.min.y; y <= window.max.y; ++y) {
            for (int x = window.min.x; x <= window.max.x; ++x, ++i) {
                const std::size_t pixel = image.pixelIndex(x, y);
                const bool has = image.count(pixel) > k;
                ASSERT_EQ(values[i], has ? expected(image.offsets[pixel] + k) : missing)
                    << name << " of layer " << k << " at " << x << "," << y;
            }
        }
    }
}

class ExrLdi : public testing::Test {
  protected:
    void TearDown() override { setThreadCount(0); }
    ScratchDir scratch;
};

TEST_F(ExrLdi, EveryPixelOfEveryLayerReadsBackWithOpenExr) {
    for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
        const SyntheticPicture picture =
            makePicture({.seed = 11, .color_type = type, .extra = true});
        const LayeredImage& image = picture.image;
        const fs::path path = scratch / "out.exr";
        writeLdi(path, picture, {13});
        const std::size_t layers = picture.plan.layers.size();
        ASSERT_GT(layers, 3U);
        expectLayerChannel<float>(path, image, layers, "Z", Imf::FLOAT, kFloatInfinity,
                                  [&](std::size_t f) { return image.z[f]; });
        const char* names[] = {"R", "G", "B", "A"};
        for (std::size_t c = 0; c < 4; ++c) {
            if (type == PixelType::kHalf) {
                expectLayerChannel<std::uint16_t>(
                    path, image, layers, names[c], Imf::HALF, 0,
                    [&](std::size_t f) { return image.color.as<std::uint16_t>()[4 * f + c]; });
            } else {
                expectLayerChannel<float>(
                    path, image, layers, names[c], Imf::FLOAT, 0,
                    [&](std::size_t f) { return image.color.as<float>()[4 * f + c]; });
            }
        }
        expectLayerChannel<std::uint32_t>(
            path, image, layers, "id", Imf::UINT, 0,
            [&](std::size_t f) { return image.extra[1].as<std::uint32_t>()[f]; });
        expectLayerChannel<std::uint16_t>(
            path, image, layers, "N.Y", Imf::HALF, 0,
            [&](std::size_t f) { return image.extra[0].as<std::uint16_t>()[3 * f + 1]; });
    }
}

TEST_F(ExrLdi, OurReaderReturnsTheSameImage) {
    for (std::uint32_t seed = 1; seed <= 6; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        SyntheticOptions options{.seed = seed, .extra = seed % 2 == 0};
        if (seed % 3 == 0) options.color_type = PixelType::kFloat;
        if (seed > 3) options.crop = {5, 9, 70, 58};
        const SyntheticPicture picture = makePicture(options);
        const fs::path path = scratch / "out.exr";
        writeLdi(path, picture, {5, 20});
        ExrLdiReader reader(path);
        LayeredImage read;
        reader.read(picture.image.window, read);
        expectSame(read, picture.image);
        for (int y = picture.image.window.y0; y < picture.image.window.y1; y += 11) {
            const Window rows{picture.image.window.x0, y, picture.image.window.x1,
                              std::min(y + 11, picture.image.window.y1)};
            reader.read(rows, read);
            expectSame(read, test::cutRows(picture.image, rows.y0, rows.y1));
        }
    }
}

TEST_F(ExrLdi, BytesDoNotDependOnBandsOrThreads) {
    const SyntheticPicture picture = makePicture({.seed = 21, .width = 97, .height = 130});
    setThreadCount(1);
    writeLdi(scratch / "a.exr", picture);
    const std::string whole = test::bytesOf(scratch / "a.exr");
    ASSERT_FALSE(whole.empty());
    const std::vector<std::vector<int>> cuts = {{1}, {2, 15}, {16}, {17}, {31, 1, 64}};
    for (std::size_t i = 0; i < cuts.size(); ++i) {
        setThreadCount(static_cast<int>(i) + 1);
        writeLdi(scratch / "b.exr", picture, cuts[i]);
        EXPECT_TRUE(test::bytesOf(scratch / "b.exr") == whole) << "cut " << i;
    }
}

TEST_F(ExrLdi, CompositePartIsTheReadersFragmentsComposited) {
    for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
        const SyntheticPicture picture = makePicture({.seed = 31, .color_type = type});
        const fs::path path = scratch / "out.exr";
        writeLdi(path, picture, {10});
        ExrLdiReader reader(path);
        LayeredImage image;
        CompositeImage stored, computed;
        reader.read(picture.image.window, image);
        reader.readComposite(picture.image.window, stored);
        compositeOver(image, {}, computed);
        ASSERT_EQ(stored.z, computed.z);
        for (std::size_t p = 0; p < stored.rgba.size(); ++p) {
            for (std::size_t c = 0; c < 4; ++c) {
                const float value = computed.rgba[p][c];
                const float wanted =
                    type == PixelType::kHalf ? static_cast<float>(half(value)) : value;
                ASSERT_EQ(stored.rgba[p][c], wanted) << "pixel " << p << " channel " << c;
            }
        }
    }
}

TEST_F(ExrLdi, PartsAreCroppedToTheirLayersAndShareTheDisplayWindow) {
    const SyntheticPicture picture = makePicture({.seed = 41, .crop = {3, 4, 80, 50}});
    writeLdi(scratch / "out.exr", picture);
    Imf::MultiPartInputFile file((scratch / "out.exr").c_str());
    ASSERT_EQ(file.parts(), static_cast<int>(picture.plan.layers.size()) + 1);
    const auto box = [](const Window& w) {
        return Imath::Box2i({w.x0, w.y0}, {w.x1 - 1, w.y1 - 1});
    };
    for (int part = 0; part < file.parts(); ++part) {
        const Imf::Header& header = file.header(part);
        EXPECT_EQ(header.displayWindow(), box({0, 0, 83, 61}));
        EXPECT_EQ(header.type(), "scanlineimage");
        const Window window =
            part == 0 ? picture.plan.view.crop
                      : picture.plan.layers[static_cast<std::size_t>(part - 1)].data_window;
        EXPECT_EQ(header.dataWindow(), box(window));
    }
    EXPECT_EQ(file.header(0).name(), "composite");
    EXPECT_EQ(file.header(1).name(), "layer_000");
    writeLdi(scratch / "bare.exr", picture, {7}, {.no_composite = true});
    Imf::MultiPartInputFile bare((scratch / "bare.exr").c_str());
    EXPECT_EQ(bare.parts(), static_cast<int>(picture.plan.layers.size()));
    EXPECT_EQ(bare.header(0).name(), "layer_000");
    ExrLdiReader reader(scratch / "bare.exr");
    LayeredImage image;
    reader.read(picture.image.window, image);
    expectSame(image, picture.image);
}

TEST_F(ExrLdi, AnEmptyPictureIsAFileWithItsCompositeAlone) {
    for (const bool composite : {true, false}) {
        const SyntheticPicture picture = makePicture({.most_layers = 0});
        ASSERT_EQ(picture.image.fragments(), 0U);
        const fs::path path = scratch / "empty.exr";
        writeLdi(path, picture, {9}, {.no_composite = !composite});
        ExrLdiReader reader(path);
        EXPECT_EQ(reader.info().layers.size(), 0U);
        LayeredImage image;
        reader.read(picture.image.window, image);
        expectSame(image, picture.image);
        CompositeImage flat;
        reader.readComposite(picture.image.window, flat);
        EXPECT_EQ(flat.rgba[100], (std::array<float, 4>{}));
        EXPECT_EQ(flat.z[100], kFloatInfinity);
    }
}

TEST_F(ExrLdi, OnePixelAndOneColumnPictures) {
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 40}, {40, 1}, {2, 17}}) {
        SyntheticPicture picture = makePicture({.seed = 3, .width = width, .height = height});
        writeLdi(scratch / "tiny.exr", picture, {3});
        ExrLdiReader reader(scratch / "tiny.exr");
        LayeredImage image;
        reader.read(picture.image.window, image);
        expectSame(image, picture.image);
    }
}

TEST_F(ExrLdi, MoreThanAThousandLayers) {
    SyntheticPicture picture;
    constexpr int kLayers = 1200;
    picture.plan.view.width = picture.plan.view.height = 4;
    picture.plan.view.crop = picture.image.window = {0, 0, 4, 4};
    picture.image.color = {{"R", "G", "B", "A"}, PixelType::kHalf, {}};
    picture.image.offsets.assign(7, 0);
    for (int k = 0; k < kLayers; ++k) {
        picture.image.z.push_back(static_cast<float>(k + 1));
        for (int c = 0; c < 4; ++c)
            test::appendColor(picture.image.color, 0.001F * static_cast<float>(k));
        picture.plan.layers.push_back({{2, 1, 3, 2}, 1});
    }
    picture.image.offsets.resize(17, kLayers);
    picture.plan.fragments_counted = picture.plan.fragments_stored = kLayers;
    const fs::path path = scratch / "deep.exr";
    writeLdi(path, picture, {1});
    ExrLdiReader reader(path);
    ASSERT_EQ(reader.info().layers.size(), 1200U);
    EXPECT_EQ(reader.info().parts.back().name, "layer_1199");
    LayeredImage image;
    reader.read(picture.image.window, image);
    expectSame(image, picture.image);
    Imf::MultiPartInputFile file(path.c_str());
    EXPECT_EQ(readChannel<float>(file, 1000, "Z", Imf::FLOAT).at(0), 1000.0F);
}

TEST_F(ExrLdi, OtherProgramsReadIt) {
    const SyntheticPicture picture = makePicture({.seed = 51, .extra = true});
    const std::string path = scratch / "out.exr";
    writeLdi(path, picture);
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"exrinfo", "-v", path},
          {"oiiotool", "--info", "-v", "--stats", "-a", path}}) {
        const test::CommandResult result = test::runCommand(command);
        EXPECT_TRUE(test::took(command, result)) << command.front() << ": " << result.err;
        EXPECT_NE(result.out.find("layer_000"), std::string::npos) << result.out;
    }
}

TEST_F(ExrLdi, InfoGivesBackPlanAndProvenance) {
    SyntheticPicture picture = makePicture({.seed = 61, .crop = {3, 4, 80, 50}});
    picture.plan.view.camera_name = "Cam \"ä\"";
    picture.plan.view.camera_to_world[3] = {0.1, 1e-9, 1.0 / 3, 1};
    picture.plan.fragments_counted = 5'000'000'000ULL;
    writeLdi(scratch / "out.exr", picture);
    const ExrInfo info = readExrInfo(scratch / "out.exr");
    EXPECT_TRUE(info.is_peeler);
    EXPECT_EQ(info.plan.fragments_counted, 5'000'000'000ULL);
    EXPECT_EQ(info.plan.fragments_stored, picture.plan.fragments_stored);
    EXPECT_FALSE(info.plan.complete());
    EXPECT_EQ(info.attributes().at("peeler:complete"), "0");
    EXPECT_EQ(info.plan.view.camera_name, picture.plan.view.camera_name);
    EXPECT_EQ(info.plan.view.camera_to_world, picture.plan.view.camera_to_world);
    EXPECT_EQ(info.plan.view.crop, picture.plan.view.crop);
    EXPECT_EQ(info.plan.view.projection.half_width, picture.plan.view.projection.half_width);
    EXPECT_EQ(info.plan.view.projection.far, picture.plan.view.projection.far);
    EXPECT_EQ(info.provenance.scene, "s.glb");
    EXPECT_EQ(info.provenance.frame, 7);
    EXPECT_EQ(info.provenance.time, 0.1);
    EXPECT_EQ(info.provenance.frames_per_second, 24);
    EXPECT_EQ(info.provenance.settings_hash, "cd");
    EXPECT_EQ(info.bytes, fs::file_size(scratch / "out.exr"));
}

TEST_F(ExrLdi, ABandThatDoesNotFitThePlanIsRefused) {
    const SyntheticPicture picture = makePicture({.seed = 71});
    const fs::path path = scratch / "out.exr";
    const auto expectInternal = [](auto&& action) {
        try {
            action();
            FAIL() << "nothing was thrown";
        } catch (const Error& e) {
            EXPECT_EQ(e.kind(), ErrorKind::kInternal) << e.what();
        }
    };
    expectInternal([&] {  // rows are missing in the middle
        ExrLdiWriter writer(path, {.provenance = fullProvenance()});
        writer.begin(picture.plan);
        writer.write(test::cutRows(picture.image, 1, 5));
    });
    expectInternal([&] {  // rows are missing at the end
        ExrLdiWriter writer(path, {.provenance = fullProvenance()});
        writer.begin(picture.plan);
        writer.write(test::cutRows(picture.image, 0, 5));
        writer.finish();
    });
    expectInternal([&] {  // there is one fragment fewer than planned
        SyntheticPicture wrong = picture;
        ++wrong.plan.fragments_stored;
        writeLdi(path, wrong);
    });
    expectInternal([&] {  // a data window cuts off fragments
        SyntheticPicture wrong = picture;
        --wrong.plan.layers[1].data_window.x1;
        writeLdi(path, wrong);
    });
    EXPECT_TRUE(fs::is_empty(scratch.path()));
}

TEST_F(ExrLdi, DamagedFilesAreErrorsNotCrashes) {
    const SyntheticPicture picture = makePicture({.seed = 81, .width = 40, .height = 30});
    writeLdi(scratch / "out.exr", picture);
    EXPECT_GT(test::refusalsOfDamaged(scratch / "out.exr", 5, 300), 100);
}

/// An uncompressed chunk must have its full size; otherwise pixels would show uninitialised memory.
TEST_F(ExrLdi, ChunksThatAreNotCompressedAreWhole) {
    const SyntheticPicture picture = makePicture({.seed = 83, .width = 40, .height = 30});
    const std::string path = scratch / "out.exr";
    writeLdi(path, picture, {1 << 20}, {.compression = "none"});
    const ExrInputPart part = ExrInput(path).parts()[1];
    std::size_t pixel = 0;
    for (const ExrInputChannel& channel : part.channels)
        pixel += pixelTypeSize(channel.type);
    const auto size =
        static_cast<std::int32_t>(pixel * static_cast<std::size_t>(part.data_window.width()));
    const std::int32_t leader[] = {1, part.data_window.y0, size}, lower = size - 4;
    std::string bytes = test::bytesOf(path);
    const std::size_t at =
        bytes.find(std::string_view(reinterpret_cast<const char*>(leader), sizeof leader));
    ASSERT_NE(at, std::string::npos);
    std::memcpy(bytes.data() + at + 8, &lower, sizeof lower);
    std::ofstream(path, std::ios::binary) << bytes;
    EXPECT_THROW(test::readAll(path), Error);
    EXPECT_THROW(ExrInput(path).decodeAll(1), Error);
}

TEST_F(ExrLdi, WhatIsNotLayeredIsSaid) {
    const SyntheticPicture picture = makePicture({.seed = 91});
    const fs::path path = scratch / "flat.exr";
    ExrCompositeWriter writer(path, {.provenance = fullProvenance()});
    writePicture(writer, picture);
    EXPECT_THROW(ExrLdiReader{path}, Error);
    EXPECT_EQ(readExrInfo(path).parts.size(), 1U);
    EXPECT_THROW(ExrLdiReader{scratch / "missing.exr"}, Error);
    std::ofstream(scratch / "text.exr") << "not an image";
    EXPECT_THROW(ExrLdiReader{scratch / "text.exr"}, Error);
}

TEST_F(ExrLdi, FlatFileHoldsTheCompositeOverTheBackground) {
    const SyntheticPicture picture = makePicture({.seed = 95});
    const std::array<float, 4> background = {0.25F, 0.5F, 0.75F, 1};
    const fs::path path = scratch / "flat.exr";
    ExrCompositeWriter writer(path, {.background = background, .provenance = fullProvenance()});
    writePicture(writer, picture, {6});
    CompositeImage wanted;
    compositeOver(picture.image, background, wanted);
    Imf::MultiPartInputFile file(path.c_str());
    ASSERT_EQ(file.parts(), 1);
    const char* names[] = {"R", "G", "B", "A"};
    for (std::size_t c = 0; c < 4; ++c) {
        const auto values = readChannel<std::uint16_t>(file, 0, names[c], Imf::HALF);
        for (std::size_t p = 0; p < values.size(); ++p) {
            ASSERT_EQ(values[p], half(wanted.rgba[p][c]).bits());
        }
    }
    EXPECT_EQ(readChannel<float>(file, 0, "Z", Imf::FLOAT), wanted.z);
}

}  // namespace
}  // namespace peeler
