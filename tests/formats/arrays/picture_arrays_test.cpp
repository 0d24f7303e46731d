// SPDX-License-Identifier: Apache-2.0
// Tests layers and composites as arrays, written and read back, and invalid pictures.
#include "formats/arrays/picture_arrays.h"

#include <gtest/gtest.h>

#include <peeler/error.h>
#include "formats/arrays/tensor_file.h"
#include "formats/exr/cut_window.h"
#include "formats/exr/read_all.h"
#include "formats/exr/same_image.h"
#include "formats/exr/synthetic_image.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/layered/opened_picture.h"
#include "formats/writers.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Returns options for a picture with all optional data.
OutputOptions richOptions() {
    OutputOptions options;
    Provenance& p = options.provenance;
    p.version = "1.2";
    p.method = "a-buffer";
    p.surfaces = "all";
    p.scene = "a \"scene\".glb";
    p.scene_hash = "0123";
    p.settings = R"({"a":1})";
    p.settings_hash = "4567";
    p.output_hash = "89ab";
    p.renderer = "a renderer";
    p.tile = "2/7";
    p.frame = -3;
    p.view = 4;
    p.time = 0.1;
    p.frames_per_second = 24;
    p.ids = {{"a", "b\n"}, {"m"}, {0, 1}};
    p.carried = {{"capDate", "string", {std::byte{'2'}, std::byte{'0'}}},
                 {"note", "float", {std::byte{0}, std::byte{0}, std::byte{0x80}, std::byte{0x3f}}}};
    return options;
}

SyntheticPicture richPicture(PixelType type, bool tinted) {
    SyntheticPicture picture =
        makePicture({.seed = 5, .crop = {11, 7, 70, 52}, .color_type = type, .extra = true});
    View& view = picture.plan.view;
    view.camera_name = "kamera";
    view.camera_to_world[3] = {0.1, 1e-9, 3, 1};
    view.projection.far = std::numeric_limits<double>::infinity();
    picture.plan.fragments_counted += 5;
    picture.plan.channels = picture.image.extra;
    for (FragmentArray& array : picture.plan.channels)
        array.data.clear();
    if (!tinted) return picture;
    picture.plan.tinted = true;
    FragmentArray tints{colorNames(true), type, {}};
    const FragmentArray& plain = picture.image.color;
    for (std::size_t f = 0; f < picture.image.fragments(); ++f) {
        const auto* const from = plain.data.data() + f * plain.stride();
        tints.data.insert(tints.data.end(), from, from + plain.stride());
        for (int c = 0; c < 3; ++c)
            appendColor(tints, 0.25F * static_cast<float>(c));
    }
    picture.image.color = tints;
    return picture;
}

struct PictureKind {
    PixelType type;
    bool tinted;
};

class LayersInArrays : public testing::TestWithParam<PictureKind> {};

TEST_P(LayersInArrays, ComeBackAsTheyWere) {
    const ScratchDir scratch;
    const std::string path = scratch / "a.safetensors";
    const SyntheticPicture picture = richPicture(GetParam().type, GetParam().tinted);
    const OutputOptions options = richOptions();
    const std::uint64_t forecast = forecastPicture(path, picture.plan, options).bytes;
    writePicture(*makeSink(path, options), picture, {3, 17, 1});
    EXPECT_EQ(forecast, std::filesystem::file_size(path));

    const auto reader = openLayered(path);
    const Plan& plan = reader->info().plan;
    expectSame(readAll(path), picture.image);
    EXPECT_EQ(plan.view.camera_to_world, picture.plan.view.camera_to_world);
    EXPECT_EQ(plan.view.crop, picture.plan.view.crop);
    EXPECT_EQ(plan.view.camera_name, "kamera");
    EXPECT_EQ(plan.view.projection.far, picture.plan.view.projection.far);
    EXPECT_EQ(plan.fragments_counted, picture.plan.fragments_counted);
    EXPECT_EQ(plan.fragments_stored, picture.plan.fragments_stored);
    EXPECT_EQ(plan.color_type, GetParam().type);
    EXPECT_EQ(plan.tinted, GetParam().tinted);
    ASSERT_EQ(plan.layers.size(), picture.plan.layers.size());
    for (std::size_t k = 0; k < plan.layers.size(); ++k) {
        EXPECT_EQ(plan.layers[k].data_window, picture.plan.layers[k].data_window);
        EXPECT_EQ(plan.layers[k].pixels, picture.plan.layers[k].pixels);
    }
    const Provenance &p = reader->info().provenance, &asked = options.provenance;
    EXPECT_EQ(p.scene, asked.scene);
    EXPECT_EQ(p.settings, asked.settings);
    EXPECT_EQ(p.tile, asked.tile);
    EXPECT_EQ(p.frame, asked.frame);
    EXPECT_EQ(p.view, asked.view);
    EXPECT_EQ(p.time, asked.time);
    EXPECT_EQ(p.frames_per_second, asked.frames_per_second);
    EXPECT_EQ(p.ids, asked.ids);
    ASSERT_EQ(p.carried.size(), asked.carried.size());
    EXPECT_EQ(p.carried[1].value, asked.carried[1].value);
    EXPECT_EQ(reader->info().attributes().at("peeler:outputHash"), "89ab");

    // The window spans several of the bands in which the picture was written.
    const Window part{20, 13, 41, 30};
    LayeredImage some;
    reader->read(part, some);
    expectSame(some, cutWindow(picture.image, part));
}

TEST_P(LayersInArrays, BecomeTheSameOpenExr) {
    const ScratchDir scratch;
    const SyntheticPicture picture = richPicture(GetParam().type, GetParam().tinted);
    const OutputOptions options = richOptions();
    writePicture(*makeSink(scratch / "a.safetensors", options), picture);
    writePicture(*makeSink(scratch / "a.exr", options), picture);
    const auto reader = openLayered(scratch / "a.safetensors");
    OutputOptions again;
    again.provenance = reader->info().provenance;
    again.provenance.output_hash = options.provenance.output_hash;
    writePicture(*makeSink(scratch / "b.exr", again),
                 {reader->info().plan, readAll(scratch / "a.safetensors")});
    EXPECT_TRUE(bytesOf(scratch / "a.exr") == bytesOf(scratch / "b.exr"));
}

INSTANTIATE_TEST_SUITE_P(Kinds, LayersInArrays,
                         testing::Values(PictureKind{PixelType::kHalf, false},
                                         PictureKind{PixelType::kFloat, false},
                                         PictureKind{PixelType::kFloat, true},
                                         PictureKind{PixelType::kHalf, true}));

TEST(PictureArrays, EmptyPicturesAndUnknownCamerasComeBack) {
    const ScratchDir scratch;
    SyntheticPicture picture = makePicture({.width = 9, .height = 4, .most_layers = 0});
    picture.plan.view.known = false;
    picture.plan.view.crop = picture.image.window = {-2, 1, 7, 3};
    picture.image.offsets.assign(picture.image.window.pixels() + 1, 0);
    writePicture(*makeSink(scratch / "a.safetensors", {}), picture);
    const auto reader = openLayered(scratch / "a.safetensors");
    EXPECT_FALSE(reader->info().plan.view.known);
    EXPECT_EQ(reader->info().plan.view.width, 9);
    EXPECT_TRUE(reader->info().plan.layers.empty());
    LayeredImage image;
    reader->read(reader->info().plan.view.crop, image);
    EXPECT_EQ(image.fragments(), 0U);
}

TEST(PictureArrays, CompositesAreReadAsPixels) {
    const ScratchDir scratch;
    const SyntheticPicture picture = richPicture(PixelType::kHalf, true);
    OutputOptions options = richOptions();
    options.as = "composite";
    const std::string path = scratch / "a.safetensors";
    const std::uint64_t forecast = forecastPicture(path, picture.plan, options).bytes;
    writePicture(*makeSink(path, options), picture, {5, 9});
    EXPECT_EQ(forecast, std::filesystem::file_size(path));
    CompositeImage expected, stored;
    compositeOver(picture.image, {}, expected);
    openComposite(OpenedPicture(path))->readComposite(picture.image.window, stored);
    EXPECT_EQ(stored.rgba, expected.rgba);
    EXPECT_EQ(stored.opacity, expected.opacity);
    EXPECT_EQ(stored.z, expected.z);
    EXPECT_TRUE(isLoneComposite(OpenedPicture(path).info()));
    EXPECT_THROW(openLayered(path), Error);
    const std::string npz = scratch / "a.npz";
    writePicture(*makeSink(npz, options), picture);
    EXPECT_EQ(forecastPicture(npz, picture.plan, options).bytes, std::filesystem::file_size(npz));
}

TEST(PictureArrays, OtherProgramsWriteThemToo) {
    const ScratchDir scratch;
    TensorFile file;
    file.texts = {{"displayWindow", "[2, 1]"}, {"dataWindow", "[0, 0, 2, 1]"}};
    file.set<std::int32_t>("splits", "I32", {3}, {0, 1, 3});
    file.set<float>("z", "F32", {3}, {1, 2, 3});
    file.set<float>("rgba", "F32", {3, 4}, std::vector<float>(12, 0.5F));
    file.set<float>("depth.back", "F32", {3}, {4, 5, 6});
    const std::string path = scratch / "a.safetensors";
    writeFile(path, file.bytes());
    EXPECT_TRUE(isPictureFile(path));
    const auto reader = openLayered(path);
    EXPECT_FALSE(reader->info().is_peeler);
    EXPECT_FALSE(reader->info().plan.view.known);
    EXPECT_EQ(reader->info().plan.layers.size(), 2U);
    EXPECT_EQ(reader->info().plan.fragments_counted, 3U);
    const LayeredImage image = readAll(path);
    EXPECT_EQ(image.offsets, (std::vector<std::uint32_t>{0, 1, 3}));
    EXPECT_EQ(image.z, (std::vector<float>{1, 2, 3}));
    ASSERT_EQ(image.extra.size(), 1U);
    EXPECT_EQ(image.extra[0].channels, std::vector<std::string>{"depth.back"});
    EXPECT_THROW(openLayered(path, {.part = "a"}), Error);
}

}  // namespace
}  // namespace peeler::test
