// SPDX-License-Identifier: Apache-2.0
// Tests maps and voxels of known hits, as other programs read them.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <bit>
#include <numbers>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "formats/exr/exr_header.h"
#include "formats/image/flat_image.h"
#include "formats/image/image_writer.h"
#include "formats/image/legend.h"
#include "formats/rays/ray_output.h"
#include "support/python.h"
#include "support/ray_hits.h"
#include "support/test_support.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;
using test::bytesOf;
using test::Outcome;
using test::runCommand;
using test::runPeeler;
using test::runPython;
using test::ScratchDir;

class RayOutputs : public testing::Test, protected test::TracedSpheres {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }

    std::unique_ptr<RayOutput> maps(const std::string& name, RayMapOptions options) const {
        return makeRayMapOutput(path(name), shown_, &solids_, std::move(options));
    }

    ScratchDir scratch_;
};

/// Returns the values of a channel as raw bits.
std::vector<std::uint32_t> channelBits(Imf::InputPart& part, const char* name) {
    const Imath::Box2i window = part.header().dataWindow();
    const auto width = static_cast<std::size_t>(window.max.x - window.min.x + 1);
    std::vector<std::uint32_t> bits(width * std::size_t(window.max.y - window.min.y + 1));
    const Imf::PixelType type = part.header().channels().findChannel(name)->type;
    Imf::FrameBuffer buffer;
    buffer.insert(name, Imf::Slice::Make(type, bits.data(), window));
    part.setFrameBuffer(buffer);
    part.readPixels(window.min.y, window.max.y);
    return bits;
}

TEST_F(RayOutputs, AnExrHasAPartABundle) {
    RayMapOptions options;
    options.settings.maps = {RayMap::kThickness, RayMap::kCount, RayMap::kPathLength,
                             RayMap::kFirst};
    options.settings.attenuation = {0, 2};
    options.provenance.version = "test";
    const auto output = maps("m.exr", options);
    trace(*output, bundles_);
    EXPECT_EQ(scratch_.files(), std::vector<std::string>{"m.exr"});

    Imf::MultiPartInputFile file(path("m.exr").c_str());
    ASSERT_EQ(file.parts(), 2);
    const std::vector<View> views = withCommonDisplay(bundles_);
    for (std::size_t b = 0; b < 2; ++b) {
        Imf::InputPart part(file, static_cast<int>(b));
        const Imf::Header& header = part.header();
        EXPECT_EQ(header.name(), bundles_[b].name);
        std::vector<std::string> channels;
        for (auto i = header.channels().begin(); i != header.channels().end(); ++i)
            channels.push_back(i.name());
        EXPECT_EQ(channels, (std::vector<std::string>{"count", "first", "path.m0", "path.m1",
                                                      "thickness", "transmission"}));
        EXPECT_EQ(header.channels()["count"].type, Imf::UINT);
        EXPECT_EQ(header.channels()["first"].type, Imf::FLOAT);
        EXPECT_EQ(header.findTypedAttribute<Imf::StringAttribute>("peeler:cameraJson")->value(),
                  cameraJson(views[b]));
        EXPECT_EQ(header.find("peeler:layers"), header.end());

        const auto bits = [&](const char* name) { return channelBits(part, name); };
        const auto count = bits("count"), first = bits("first"), outer = bits("path.m0"),
                   inner = bits("path.m1"), all = bits("thickness"), passes = bits("transmission");
        const Window& crop = bundles_[b].view.crop;
        ASSERT_EQ(count.size(), crop.pixels());
        const glm::dvec3 along = bundles_[b].direction();
        double volume = 0;
        for (std::size_t i = 0; i < count.size(); ++i) {
            const auto width = static_cast<std::size_t>(crop.width());
            const glm::dvec3 start = worldPosition(bundles_[b].view, double(i % width) + 0.5,
                                                   double(i / width) + 0.5, 0);
            double length[2];
            for (std::size_t s = 0; s < 2; ++s) {
                const glm::dvec3 beside = glm::cross(start - spheres_[s].center, along);
                length[s] = 2 * std::sqrt(std::max(0.0, spheres_[s].radius * spheres_[s].radius -
                                                            glm::dot(beside, beside)));
            }
            const auto value = [&](const auto& from) { return std::bit_cast<float>(from[i]); };
            ASSERT_EQ(count[i], (length[0] > 0 ? 2U : 0U) + (length[1] > 0 ? 2U : 0U));
            ASSERT_NEAR(value(all), length[0], 3e-6);
            ASSERT_NEAR(value(outer), length[0] - length[1], 3e-6);
            ASSERT_NEAR(value(inner), length[1], 3e-6);
            ASSERT_NEAR(value(passes), std::exp(-2 * length[1]), 1e-5);
            if (length[0] > 0) {
                ASSERT_NEAR(value(first), glm::dot(-start, along) - length[0] / 2, 3e-6);
            } else {
                ASSERT_EQ(value(first), std::numeric_limits<float>::infinity());
            }
            volume += length[0];
        }
        const glm::dvec2 size = bundles_[b].size();
        const RayMapResult told = output->results().maps.at(b);
        EXPECT_EQ(told.bundle, bundles_[b].name);
        EXPECT_EQ(told.path, path("m.exr"));
        EXPECT_EQ(told.channels.at(0).name, "thickness");
        const double told_volume = told.channels.at(0).volume.value();
        EXPECT_NEAR(told_volume, volume * size.x * size.y / double(crop.pixels()), 1e-4);
        EXPECT_NEAR(told_volume, 4 * std::numbers::pi / 3, 0.02);
        EXPECT_FALSE(told.channels.at(1).volume);
    }
    const Outcome verified = runPeeler({"verify", path("m.exr")});
    EXPECT_EQ(verified.exit_code, 0) << verified.err;
    EXPECT_EQ(verified.err.find("not written by peeler"), std::string::npos) << verified.err;
}

TEST_F(RayOutputs, PicturesGoFromBlackToTheGreatestValue) {
    const auto byte = [](const FlatImage& image, std::size_t pixel, std::size_t c) {
        return std::lround(255 * encodeSrgb(image.image.rgba[pixel][c]));
    };
    RayMapOptions options;
    options.settings.maps = {RayMap::kThickness};
    trace(*maps("t.##.png", options), bundles_);
    EXPECT_EQ(scratch_.files(), (std::vector<std::string>{"t.00.png", "t.01.png"}));
    const FlatImage image = readFlatImage(path("t.00.png"));
    const Window& crop = bundles_[0].view.crop;
    ASSERT_EQ(image.image.window.pixels(), crop.pixels());
    const std::size_t middle =
        std::size_t(crop.height() / 2) * std::size_t(crop.width()) + std::size_t(crop.width() / 2);
    EXPECT_GT(byte(image, middle, 1), 245);  // the colour map ends with (252, 255, 164)
    EXPECT_GT(byte(image, middle, 2), 140);
    EXPECT_EQ(byte(image, 0, 0), 0);
    EXPECT_EQ(byte(image, 0, 2), 4);

    // The range is twice the largest value, so only the first half of the ramp appears.
    options.range = {0, 4};
    trace(*maps("half.png", options), std::span(bundles_).first(1));
    EXPECT_NEAR(double(byte(readFlatImage(path("half.png")), middle, 0)), 188, 2);

    options = {};
    options.settings.maps = {RayMap::kLast};
    trace(*maps("last.png", options), std::span(bundles_).first(1));
    const FlatImage last = readFlatImage(path("last.png"));
    EXPECT_EQ(last.image.rgba[0][3], 0);
    EXPECT_EQ(last.image.rgba[middle][3], 1);

    // With attenuation, a picture of path lengths is a radiograph.
    options.settings.maps = {RayMap::kPathLength};
    options.settings.attenuation = {0.1, 1};
    trace(*maps("x.png", options), std::span(bundles_).first(1));
    const FlatImage film = readFlatImage(path("x.png"));
    EXPECT_EQ(film.image.rgba[0][0], 0);
    EXPECT_NEAR(double(byte(film, middle, 0)), 255 * (1 - std::exp(-0.1 - 1.0)), 2);
}

/// The legend must not change any pixel of the map. It labels the colours with their values.
TEST_F(RayOutputs, PicturesHaveALegendBelow) {
    const std::span<const Bundle> one = std::span(bundles_).first(1);
    const Window& crop = bundles_[0].view.crop;
    const auto width = std::size_t(crop.width()), height = std::size_t(crop.height());
    for (const RayMap map : {RayMap::kThickness, RayMap::kTransmission, RayMap::kLast}) {
        RayMapOptions options;
        options.settings.maps = {map};
        options.settings.attenuation = {0.1, 1};
        trace(*maps("plain.png", options), one);
        options.legend = true;
        trace(*maps("legend.png", options), one);
        const CompositeImage plain = readFlatImage(path("plain.png")).image,
                             with = readFlatImage(path("legend.png")).image;
        const auto wide = std::size_t(with.window.width());
        ASSERT_GE(wide, width);
        ASSERT_GT(std::size_t(with.window.height()), height);
        for (std::size_t y = 0; y < height; ++y)
            for (std::size_t x = 0; x < width; ++x)
                ASSERT_EQ(with.rgba[y * wide + x], plain.rgba[y * width + x]) << x << ", " << y;
        // The bar's middle row goes from the colour of the minimum to that of the maximum.
        const LegendSize size = colorBarSize("", crop.width());
        const auto at = [&](std::size_t x) {
            return with.rgba[(height + std::size_t(size.height) / 2) * wide + x];
        };
        const std::size_t left = 4 * std::size_t(size.scale), right = wide - left - 1;
        const bool film = map == RayMap::kTransmission;
        EXPECT_EQ(at(left)[0] > 0.99F, film) << at(left)[0];
        EXPECT_EQ(at(right)[0] < 0.01F, film) << at(right)[0];
    }
}

TEST_F(RayOutputs, MapsThatCannotBe) {
    const auto message = [&](const std::string& name, const RayMapOptions& options) {
        try {
            const auto output = maps(name, options);
            output->begin(bundles_, {});
        } catch (const Error& e) {
            EXPECT_EQ(e.kind(), ErrorKind::kUsage);
            return std::string(e.what());
        }
        return std::string();
    };
    RayMapOptions options;
    options.settings.maps = {RayMap::kTransmission};
    EXPECT_NE(message("a.exr", options).find("attenuation"), std::string::npos);
    options.settings.maps = {RayMap::kOverlap};
    EXPECT_NE(message("a.exr", options).find("two parts"), std::string::npos);
    options.settings.parts = {std::vector<char>{1, 1}, std::vector<char>{0, 1}};
    EXPECT_NE(message("a.exr", options).find("both parts"), std::string::npos);
    options.settings.maps = {RayMap::kPathLength};
    EXPECT_NE(message("a.png", options).find("one value per material"), std::string::npos);
    options.settings.maps = {RayMap::kFirst, RayMap::kLast};
    EXPECT_NE(message("a.png", options).find("one map"), std::string::npos);
    options.settings.maps = {RayMap::kFirst};
    EXPECT_NE(message("a.png", options).find("same name"), std::string::npos);
    EXPECT_NE(message("a.gif", options), "");
    options.range = {0, 1};
    EXPECT_NE(message("a.exr", options).find("unscaled numbers"), std::string::npos);
    options.range.reset();
    EXPECT_EQ(message("a.exr", options), "");
    EXPECT_TRUE(scratch_.files().empty());  // no file was completed
}

constexpr const char* kCompareVoxels = R"(
import sys, numpy, pyopenvdb
a = numpy.load(sys.argv[1], allow_pickle=False)
inside, votes, corner, spacing = a['occupancy'], a['votes'], a['corner'], a['spacing']
assert inside.dtype == numpy.uint8 and inside.shape == votes.shape, inside.shape
assert ((votes >= 2) == inside).all() and inside.max() == 1
centre = [corner[i] + (numpy.arange(n) + 0.5) * spacing for i, n in enumerate(inside.shape)]
x, y, z = numpy.meshgrid(*centre, indexing='ij')
ball = lambda cx, r: (x - cx)**2 + y**2 + z**2 < r**2
expected = ball(0, 1) | ball(0.1, 0.5)
assert (expected != inside).sum() <= 2, (expected != inside).sum()
grid = pyopenvdb.read(sys.argv[2], 'density')
dense = numpy.full(inside.shape, -1, numpy.float32)
grid.copyToArray(dense)
assert (dense == inside).all()
assert grid.activeVoxelCount() == inside.sum() and grid.background == 0
assert grid.gridClass == 'fog volume'
assert numpy.allclose(grid.transform.indexToWorld((0, 0, 0)), [c[0] for c in centre])
assert numpy.allclose(grid.transform.indexToWorld((1, 2, 3)), [centre[i][i + 1] for i in range(3)])
print(inside.sum())
)";

TEST_F(RayOutputs, VoxelsForNumpyAndOpenVdb) {
    const AxisBundles axes = axisBundles(box_, box_, {70});
    VoxelResult result;
    for (const char* name : {"v.npz", "v.vdb", "again.VDB"}) {
        const auto output = makeVoxelOutput(path(name), solids_, axes, "peeler test");
        trace(*output, axes.bundles);
        result = output->results().voxels.value();
        EXPECT_EQ(result.path, path(name));
    }
    EXPECT_EQ(bytesOf(path("v.vdb")), bytesOf(path("again.VDB")));
    EXPECT_EQ(result.disputed, 0U);
    EXPECT_NEAR(result.volume, 4 * std::numbers::pi / 3, 0.05);

    const Outcome print = runCommand({"vdb_print", "-l", path("v.vdb")});
    if (print.exit_code == 127 || print.err.find("No such file") != std::string::npos) {
        GTEST_SKIP() << "no vdb_print (examples/install_dependencies.sh test)";
    }
    EXPECT_EQ(print.exit_code, 0) << print.err;
    for (const char* line :
         {"Name: density", "class: fog volume", "creator: peeler test", "Max value: 1"}) {
        EXPECT_NE(print.out.find(line), std::string::npos) << line << " not in\n" << print.out;
    }
    PEELER_REQUIRE_PYTHON("numpy");
    PEELER_REQUIRE_PYTHON("pyopenvdb");
    const Outcome compare = runPython(kCompareVoxels, {path("v.npz"), path("v.vdb")});
    EXPECT_EQ(compare.exit_code, 0) << compare.err;
    EXPECT_EQ(compare.out, std::to_string(result.occupied) + "\n");
}

TEST_F(RayOutputs, VoxelsAreArraysOrAGrid) {
    EXPECT_THROW(makeVoxelOutput(path("v.obj"), solids_, axisBundles(box_, box_, {70}), ""), Error);
    EXPECT_TRUE(scratch_.files().empty());
}

}  // namespace
}  // namespace peeler
