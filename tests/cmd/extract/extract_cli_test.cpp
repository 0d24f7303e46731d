// SPDX-License-Identifier: Apache-2.0
// Tests peeler extract: known fragments become known points, arrays and files. Other programs read
// these back.
#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputFile.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/base/color.h"
#include "formats/exr/cut_window.h"
#include "formats/exr/exr_readers.h"
#include "formats/exr/exr_writers.h"
#include "formats/image/flat_image.h"
#include "support/capture.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// A Python program that prints {"property": [values]} of a binary PLY. It is an independent reader
/// that follows the standard.
constexpr const char* kReadPly = R"(
import json, sys, numpy
types = {'float': '<f4', 'double': '<f8', 'uchar': 'u1', 'uint': '<u4'}
file = open(sys.argv[1], 'rb')
assert file.readline() == b'ply\n' and file.readline() == b'format binary_little_endian 1.0\n'
fields, count = [], None
while (words := file.readline().decode().split())[0] != 'end_header':
    if words[0] == 'element':
        assert words[1] == 'vertex' and count is None
        count = int(words[2])
    if words[0] == 'property':
        fields.append((words[2], types[words[1]]))
rest = file.read()
table = numpy.frombuffer(rest, dtype=fields)
assert len(table) == count, (len(table), count)
print(json.dumps({name: table[name].tolist() for name, _ in fields}))
)";

constexpr const char* kReadNpz = R"(
import json, sys, numpy
a = numpy.load(sys.argv[1], allow_pickle=False)
finite = lambda v: [None if numpy.isinf(x) else x for x in v.flatten().tolist()]
print(json.dumps({k: [str(a[k].dtype), list(a[k].shape), finite(a[k])] for k in a}))
)";

/// Returns four pixels, one with two fragments and one with none. The camera is at (10, 20, 30) and
/// looks along +X with +Y up, so right is +Z.
SyntheticPicture knownPicture() {
    SyntheticPicture picture;
    auto& view = picture.plan.view;
    view.width = 6;
    view.height = 4;
    view.crop = {2, 1, 4, 3};
    view.projection.half_width = 3;
    view.projection.half_height = 2;
    view.camera_to_world = {{0, 0, 1, 0}, {0, 1, 0, 0}, {-1, 0, 0, 0}, {10, 20, 30, 1}};
    LayeredImage& image = picture.image;
    image.window = view.crop;
    image.offsets = {0, 2, 2, 3, 4};
    image.z = {2, 8, 4, 16};
    image.color = {{"R", "G", "B", "A"}, PixelType::kHalf, {}};
    const float colors[4][4] = {
        {0.5F, 0.25F, 0, 0.5F}, {0, 1, 4, 1}, {0.125F, 0, 0, 0.25F}, {1, 1, 1, 0}};
    for (const auto& color : colors)
        for (const float c : color)
            appendColor(image.color, c);
    image.extra = {{{"N.X", "N.Y", "N.Z"}, PixelType::kHalf, {}},
                   {{"id.material", "id.object"}, PixelType::kUint, {}}};
    for (std::uint32_t f = 0; f < 4; ++f) {
        for (const float n : {-1.0F, 0.25F * static_cast<float>(f), 0.5F})
            appendValue(image.extra[0].data, half(n).bits());
        appendValue(image.extra[1].data, 100 + f);
        appendValue(image.extra[1].data, 0xFFFFFFF0U + f);
    }
    picture.plan.layers = {{{2, 1, 4, 3}, 3}, {{2, 1, 3, 2}, 1}};
    picture.plan.fragments_counted = picture.plan.fragments_stored = 4;
    return picture;
}

// Positions are on the ray through (i + 0.5, j + 0.5): 3(2(i + 0.5)/6 − 1)z to the right and 2(1 −
// 2(j + 0.5)/4)z up.
const Json kX = {12, 18, 14, 26}, kY = {21, 24, 18, 12}, kZ = {29, 26, 28, 38};

/// Returns the k-th fragment, counted from 0, of every pixel that has one.
LayeredImage layerByHand(const LayeredImage& image, std::uint32_t k) {
    LayeredImage layer = image;
    layer.offsets = {0};
    layer.z.clear();
    layer.color.data.clear();
    for (FragmentArray& array : layer.extra)
        array.data.clear();
    const auto take = [&](const FragmentArray& from, std::size_t f, FragmentArray& to) {
        const auto first = from.data.begin() + static_cast<std::ptrdiff_t>(f * from.stride());
        to.data.insert(to.data.end(), first, first + static_cast<std::ptrdiff_t>(from.stride()));
    };
    for (std::size_t p = 0; p < image.window.pixels(); ++p) {
        if (image.count(p) > k) {
            const std::size_t f = image.offsets[p] + k;
            layer.z.push_back(image.z[f]);
            take(image.color, f, layer.color);
            for (std::size_t i = 0; i < layer.extra.size(); ++i)
                take(image.extra[i], f, layer.extra[i]);
        }
        layer.offsets.push_back(static_cast<std::uint32_t>(layer.z.size()));
    }
    return layer;
}

class ExtractCommand : public testing::Test {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }
    std::string write(const std::string& name, const SyntheticPicture& picture) const {
        Provenance provenance;
        provenance.version = "test";
        provenance.scene = "s.glb";
        provenance.frame = 3;
        ExrLdiWriter writer(path(name), {.provenance = provenance});
        writePicture(writer, picture);
        return path(name);
    }
    static Outcome extract(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "extract");
        return runPeeler(arguments);
    }
    static Json read(const char* program, const std::string& file) {
        const Outcome result = runPython(program, {file});
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return result.exit_code == 0 ? Json::parse(result.out) : Json();
    }

    ScratchDir scratch_;
};

TEST_F(ExtractCommand, PointsLieWhereTheFragmentsAre) {
    PEELER_REQUIRE_PYTHON("numpy");
    const std::string in = write("in.exr", knownPicture());
    for (const bool doubles : {false, true}) {
        std::vector<std::string> arguments{in, "--points", path("p.ply")};
        if (doubles) arguments.emplace_back("--double");
        ASSERT_EQ(extract(arguments).exit_code, 0);
        const Json points = read(kReadPly, path("p.ply"));
        EXPECT_EQ(points.at("x"), kX);
        EXPECT_EQ(points.at("y"), kY);
        EXPECT_EQ(points.at("z"), kZ);
        EXPECT_EQ(points.at("nx"), (Json{-1, -1, -1, -1}));
        EXPECT_EQ(points.at("ny"), (Json{0, 0.25, 0.5, 0.75}));
        EXPECT_EQ(points.at("nz"), (Json{0.5, 0.5, 0.5, 0.5}));
        // Colours are unpremultiplied and sRGB: linear 0.5 becomes 188.
        EXPECT_EQ(points.at("red"), (Json{255, 0, 188, 0}));
        EXPECT_EQ(points.at("green"), (Json{188, 255, 0, 0}));
        EXPECT_EQ(points.at("blue"), (Json{0, 255, 0, 0}));
        EXPECT_EQ(points.at("alpha"), (Json{128, 255, 64, 0}));
        EXPECT_EQ(points.at("layer"), (Json{0, 1, 0, 0}));
        // IDs in the EXR are larger by 1.
        EXPECT_EQ(points.at("material"), (Json{99, 100, 101, 102}));
        EXPECT_EQ(points.at("node"), (Json{4294967279, 4294967280, 4294967281, 4294967282}));
        EXPECT_EQ(points.size(), 13U);
    }
    ASSERT_EQ(extract({in, "--points", path("p.ply"), "--layer", "1"}).exit_code, 0);
    const Json second = read(kReadPly, path("p.ply"));
    EXPECT_EQ(second.at("x"), (Json{18}));
    EXPECT_EQ(second.at("layer"), (Json{1}));
}

TEST_F(ExtractCommand, ArraysHoldEverything) {
    PEELER_REQUIRE_PYTHON("numpy");
    const std::string in = write("in.exr", knownPicture());
    ASSERT_EQ(extract({in, "--npz", path("a.npz")}).exit_code, 0);
    const Json expected = Json::parse(R"({
        "ray_splits": ["int64", [5], [0, 2, 2, 3, 4]],
        "z": ["float32", [4], [2, 8, 4, 16]],
        "rgba": ["float16", [4, 4], [0.5,0.25,0,0.5, 0,1,4,1, 0.125,0,0,0.25, 1,1,1,0]],
        "layer": ["uint32", [4], [0, 1, 0, 0]],
        "viewer_normals": ["float16", [4, 3],
                           [-1,0,0.5, -1,0.25,0.5, -1,0.5,0.5, -1,0.75,0.5]],
        "material_ids": ["uint32", [4], [99, 100, 101, 102]],
        "node_ids": ["uint32", [4], [4294967279, 4294967280, 4294967281, 4294967282]],
        "bundle_window": ["int64", [1, 4], [2, 1, 2, 2]],
        "bundle_resolution": ["int64", [1, 2], [6, 4]],
        "bundle_perspective": ["uint8", [1], [1]],
        "bundle_origin": ["float64", [1, 3], [10, 20, 30]],
        "bundle_direction": ["float64", [1, 3], [1, 0, 0]],
        "bundle_right": ["float64", [1, 3], [0, 0, 1]],
        "bundle_up": ["float64", [1, 3], [0, 1, 0]],
        "bundle_size": ["float64", [1, 2], [6, 4]],
        "arrays_version": ["int64", [], [2]],
        "near": ["float64", [], [0.01]],
        "far": ["float64", [], [null]]})");
    Json found = read(kReadNpz, path("a.npz"));
    EXPECT_TRUE(found.is_object());
    EXPECT_EQ(found, expected) << found.dump(1);
    ASSERT_EQ(extract({in, "--npz", path("a.npz"), "--layers", "1"}).exit_code, 0);
    found = read(kReadNpz, path("a.npz"));
    EXPECT_EQ(found.at("ray_splits").at(2), (Json{0, 1, 1, 2, 3}));
    EXPECT_EQ(found.at("z").at(2), (Json{2, 4, 16}));
}

TEST_F(ExtractCommand, LayersAreWhatTheFileHolds) {
    const SyntheticPicture picture = makePicture({.crop = {10, 5, 70, 55}, .extra = true});
    const std::string in = write("in.exr", picture);
    ASSERT_EQ(extract({in, "-o", path("l.##.exr")}).exit_code, 0);
    for (std::uint32_t k = 0; k < picture.plan.layers.size(); ++k) {
        ExrLdiReader layer(path("l.0" + std::to_string(k) + ".exr"));
        const ExrInfo& info = layer.info();
        ASSERT_EQ(info.parts.size(), 1U);
        EXPECT_EQ(info.parts[0].data_window, picture.plan.layers[k].data_window);
        EXPECT_EQ(info.plan.fragments_stored, picture.plan.layers[k].pixels);
        EXPECT_EQ(info.plan.fragments_counted, picture.image.fragments());
        EXPECT_FALSE(info.plan.complete());
        LayeredImage found;
        layer.read(picture.image.window, found);
        const LayeredImage expected = layerByHand(picture.image, k);
        EXPECT_EQ(difference(found, expected), "");
        ASSERT_EQ(found.extra.size(), 2U);
        EXPECT_EQ(found.extra[0].data, expected.extra[0].data);
        EXPECT_EQ(found.extra[1].data, expected.extra[1].data);
    }
    EXPECT_FALSE(fs::exists(path("l.07.exr")));
}

TEST_F(ExtractCommand, MoreLayersThanAreOpenAtOnce) {
    SyntheticOptions options;
    options.width = options.height = 240;
    options.most_layers = 70;
    const SyntheticPicture picture = makePicture(options);
    const std::size_t layers = picture.plan.layers.size();
    ASSERT_GT(layers, 36U);
    const std::string in = write("in.exr", picture);
    const Outcome result = extract({in, "-o", path("l.%03d.exr"), "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out).at("outputs").size(), layers);
    for (const std::size_t k : {std::size_t{0}, std::size_t{31}, std::size_t{32}, layers - 1}) {
        char name[16];
        std::snprintf(name, sizeof name, "l.%03zu.exr", k);
        EXPECT_EQ(ExrLdiReader(path(name)).info().plan.fragments_stored,
                  picture.plan.layers[k].pixels);
    }
}

TEST_F(ExtractCommand, APictureOfALayerIsStraightAndEncoded) {
    const std::string in = write("in.exr", knownPicture());
    ASSERT_EQ(extract({in, "-o", path("l.png"), "--layer", "0", "--tone-map", "none"}).exit_code,
              0);
    const FlatImage flat = readFlatImage(path("l.png"));
    // The picture covers the crop, not only the layer's data window.
    EXPECT_EQ(flat.image.window, (Window{0, 0, 2, 2}));
    // ReadFlatImage() returns premultiplied colours.
    EXPECT_NEAR(flat.image.rgba[0][0], 0.5F, 2e-3F);
    EXPECT_NEAR(flat.image.rgba[0][3], 0.5F, 2e-3F);
    EXPECT_EQ(flat.image.rgba[1][3], 0);
    ASSERT_EQ(extract({in, "-o", path("m.##.png"), "--layer", "1", "--layer", "0-1", "--tone-map",
                       "none"})
                  .exit_code,
              0);
    EXPECT_EQ(bytesOf(path("m.00.png")), bytesOf(path("l.png")));
    EXPECT_TRUE(fs::exists(path("m.01.png")));
}

TEST_F(ExtractCommand, DepthComplexityCountsFragments) {
    const std::string in = write("in.exr", knownPicture());
    ASSERT_EQ(extract({in, "--depth-complexity", path("c.exr")}).exit_code, 0);
    Imf::InputFile file(path("c.exr").c_str());
    const Imf::Channel* channel = file.header().channels().findChannel("count");
    ASSERT_NE(channel, nullptr);
    EXPECT_EQ(channel->type, Imf::UINT);
    unsigned counts[2][2];
    Imf::FrameBuffer buffer;
    buffer.insert("count", Imf::Slice::Make(Imf::UINT, counts, file.header().dataWindow()));
    file.setFrameBuffer(buffer);
    file.readPixels(1, 2);
    EXPECT_EQ(counts[0][0], 2U);
    EXPECT_EQ(counts[0][1], 0U);
    EXPECT_EQ(counts[1][0], 1U);
    EXPECT_EQ(counts[1][1], 1U);

    const Outcome result = extract({in, "--depth-complexity", path("c.png")});
    EXPECT_NE(result.err.find("0 to 2 fragments per pixel"), std::string::npos) << result.err;
    const FlatImage flat = readFlatImage(path("c.png"));
    const auto byte = [&](std::size_t pixel, std::size_t c) {
        return std::lround(255 * srgbFromLinear(flat.image.rgba[pixel][c]));
    };
    EXPECT_EQ(byte(0, 0), 252);  // red and blue at the end of the colour ramp
    EXPECT_EQ(byte(0, 2), 164);
    EXPECT_EQ(byte(1, 0), 0);
    EXPECT_EQ(byte(1, 2), 4);
    EXPECT_EQ(byte(2, 0), 188);  // red at the middle of the colour ramp
}

TEST_F(ExtractCommand, InfoPrintsTheNumbersOfThePoints) {
    const std::string in = write("in.exr", knownPicture());
    const std::string text = runPeeler({"info", in}).out;
    for (const char* line :
         {"\npoints: 4\n", "\nbounds: (12, 12, 26) to (26, 24, 38)\n",
          "\nmean: (17.5, 18.75, 30.25)\n", "\n  0  1 pixel\n  1  2 pixels\n  2  1 pixel\n",
          "\nfrom: s.glb, frame 3, 0 s", "at (10, 20, 30) looking along (1, 0, 0)"}) {
        EXPECT_NE(text.find(line), std::string::npos) << line << " not in\n" << text;
    }
    const Json json = Json::parse(runPeeler({"info", "--json", in}).out);
    EXPECT_EQ(json.at("depthComplexity"), (Json{1, 2, 1}));
    EXPECT_EQ(json.at("points").at("count"), 4);
    EXPECT_EQ(json.at("points").at("mean"), (Json{17.5, 18.75, 30.25}));
    EXPECT_EQ(json.at("layers").at(0).at("pixels"), 3);
    EXPECT_EQ(json.at("camera").at("halfWidth"), 3);
    EXPECT_EQ(json.at("provenance").at("frame"), 3);
}

TEST_F(ExtractCommand, APictureWithoutFragments) {
    SyntheticPicture empty = knownPicture();
    empty.image.offsets = {0, 0, 0, 0, 0};
    empty.image.z.clear();
    empty.image.color.data.clear();
    empty.image.extra.clear();
    empty.plan.layers.clear();
    empty.plan.fragments_counted = empty.plan.fragments_stored = 0;
    const std::string in = write("in.exr", empty);
    const Outcome result = extract({in, "-o", path("l.##.exr"), "--points", path("p.ply"), "--npz",
                                    path("a.npz"), "--depth-complexity", path("c.png")});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("no layer to write"), std::string::npos);
    EXPECT_NE(runPeeler({"info", in}).out.find("\npoints: 0\n"), std::string::npos);
    PEELER_REQUIRE_PYTHON("numpy");
    EXPECT_EQ(read(kReadPly, path("p.ply")).at("x"), Json::array());
    EXPECT_EQ(read(kReadNpz, path("a.npz")).at("ray_splits").at(2), (Json{0, 0, 0, 0, 0}));
}

TEST_F(ExtractCommand, AFileThatDoesNotTellItsCamera) {
    std::string bytes = bytesOf(write("in.exr", knownPicture()));
    const std::string name = "peeler:cameraJson";
    for (std::size_t at = 0; (at = bytes.find(name, at)) != std::string::npos;)
        bytes.replace(at, name.size(), "another:cameraXml");
    std::ofstream(path("other.exr"), std::ios::binary) << bytes;
    const Outcome result = extract({path("other.exr"), "--points", path("p.ply")});
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_NE(result.err.find("the file has no camera"), std::string::npos) << result.err;
    EXPECT_EQ(runPeeler({"info", path("other.exr")}).out.find("\npoints: "), std::string::npos);
    ASSERT_EQ(extract({path("other.exr"), "--npz", path("a.npz")}).exit_code, 0);
    PEELER_REQUIRE_PYTHON("numpy");
    const Outcome numpy = runPython(
        "import sys, numpy; print(numpy.load(sys.argv[1])['bundle_up'])", {path("a.npz")});
    EXPECT_EQ(numpy.out, "[[nan nan nan]]\n");
}

TEST_F(ExtractCommand, TellsAndKeepsToMemory) {
    const std::string in = write("in.exr", knownPicture());
    const Outcome told = extract({in, "--points", path("p.ply"), "--dry-run"});
    ASSERT_EQ(told.exit_code, 0) << told.err;
    EXPECT_GT(Json::parse(told.out).at("forecastMemory").get<std::uint64_t>(), 1'000'000U);
    EXPECT_NE(told.err.find("use at most "), std::string::npos) << told.err;
    const Outcome free = extract({in, "--points", path("p.ply"), "--json", "--verbose"});
    ASSERT_EQ(free.exit_code, 0) << free.err;
    EXPECT_GT(Json::parse(free.out).at("forecastMemory").get<std::uint64_t>(), 1'000'000U);
    EXPECT_NE(free.err.find("uses at most "), std::string::npos) << free.err;
    if (kShadowMemory) return;  // sanitizers add memory of their own
    ASSERT_EQ(extract({in, "--points", path("kept.ply"), "--memory", "8G"}).exit_code, 0);
    EXPECT_EQ(bytesOf(path("kept.ply")), bytesOf(path("p.ply")));
}

TEST_F(ExtractCommand, WhatItRefuses) {
    const std::string in = write("in.exr", knownPicture());
    std::ofstream(path("there.ply")) << "mine";
    struct Row {
        std::vector<std::string> arguments;
        int exit_code;
        const char* says;
    };
    const Row rows[] = {
        {{}, 2, "nothing to extract"},
        {{"-o", path("l.exr")}, 2, "all layers would have the same file name"},
        {{"-o", path("l.##.gif")}, 2, "unknown output format"},
        {{"-o", path("l.##.exr"), "--exposure", "1"}, 2, "stored as rendered"},
        {{"-o", in, "--layer", "0"}, 2, "the output is the input"},
        {{"--points", path("p.npz")}, 2, "ends in .ply"},
        {{"--npz", path("a.npz"), "--double"}, 2, "no points are written"},
        {{"--npz", path("a.npz"), "--layer", "2"}, 2, "there is no layer 2"},
        {{"--npz", path("a.npz"), "--layer", "-1"}, 2, "counted from 0"},
        {{"--npz", path("a.npz"), "--layer", "one"}, 2, "counted from 0"},
        {{"-o", path("l.#.png"), "--depth-complexity", path("l.0001.png")}, 2, "the same name"},
        {{"--points", path("there.ply"), "--no-clobber"}, 4, "already exists"},
        {{"--points", path("there.ply/below.ply")}, 4, "cannot make the folder"},
    };
    for (const Row& row : rows) {
        std::vector<std::string> arguments{in};
        arguments.insert(arguments.end(), row.arguments.begin(), row.arguments.end());
        const Outcome result = extract(arguments);
        EXPECT_EQ(result.exit_code, row.exit_code) << row.says << '\n' << result.err;
        EXPECT_NE(result.err.find(row.says), std::string::npos) << result.err;
    }
    EXPECT_EQ(bytesOf(path("there.ply")), "mine");
    std::string damaged = bytesOf(in);
    damaged.resize(damaged.size() - 60);
    std::ofstream(path("damaged.exr"), std::ios::binary) << damaged;
    const Outcome result = extract({path("damaged.exr"), "--points", path("p.ply")});
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_EQ(scratch_.files().size(),
              3U);  // the three earlier files; there is no output and no temporary file
}

}  // namespace
}  // namespace peeler::test
