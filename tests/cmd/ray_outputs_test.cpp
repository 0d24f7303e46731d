// SPDX-License-Identifier: Apache-2.0
// Maps, voxels and parity reports of known hits, as other programs read them.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <bit>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "cmd/rays/ray_map_output.h"
#include "cmd/rays/ray_parity.h"
#include "cmd/rays/voxel_output.h"
#include "core/base/error.h"
#include "core/rays/bundle.h"
#include "formats/exr/exr_header.h"
#include "formats/image/flat_image.h"
#include "formats/image/image_writer.h"
#include "support/python.h"
#include "support/ray_hits.h"
#include "support/test_support.h"

namespace peeler::cmd {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using test::bodies;
using test::bytesOf;
using test::Hit;
using test::Outcome;
using test::rayHits;
using test::runCommand;
using test::runPeeler;
using test::runPython;
using test::ScratchDir;
using test::Sphere;
using test::sphereHits;

/// What a spheres' scene is traced with.
class RayOutputs : public testing::Test {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }

    void trace(RayOutput& output, std::span<const Bundle> bundles) const {
        output.begin(bundles, {});
        for (std::size_t i = 0; i < bundles.size(); ++i)
            output.take(i, sphereHits(bundles[i], spheres_));
        output.finish();
    }
    std::unique_ptr<RayOutput> maps(const std::string& name, RayMapOptions options) const {
        return makeRayMapOutput(path(name), shown_, &solids_, std::move(options));
    }
    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : fs::directory_iterator(scratch_.path()))
            names.push_back(entry.path().filename());
        std::ranges::sort(names);
        return names;
    }

    ScratchDir scratch_;
    Scene scene_ = bodies(2);
    PosedScene shown_{scene_};
    Solids solids_{shown_};
    std::vector<Sphere> spheres_ = {{{0, 0, 0}, 1}, {{0.1, 0, 0}, 0.5}};
    Bounds box_{{-1.2, -1.1, -1}, {1.2, 1.1, 1}};
    std::vector<Bundle> bundles_ = {parallelBundle("side", box_, box_, {1, 0, 0}, {50}),
                                    parallelBundle("askew", box_, box_, {1, 2, -3}, {41})};
};

/// The numbers of a channel, as bits.
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
    EXPECT_EQ(files(), std::vector<std::string>{"m.exr"});

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
        Json result;
        output->tell(result);
        const Json& told = result.at("maps").at(b);
        EXPECT_EQ(told.at("bundle"), bundles_[b].name);
        EXPECT_EQ(told.at("channels").at(0).at("name"), "thickness");
        EXPECT_NEAR(told.at("channels").at(0).at("volume").get<double>(),
                    volume * size.x * size.y / double(crop.pixels()), 1e-4);
        EXPECT_NEAR(told.at("channels").at(0).at("volume").get<double>(), 4 * std::numbers::pi / 3,
                    0.02);
        EXPECT_FALSE(told.at("channels").at(1).contains("volume"));
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
    EXPECT_EQ(files(), (std::vector<std::string>{"t.00.png", "t.01.png"}));
    const FlatImage image = readFlatImage(path("t.00.png"));
    const Window& crop = bundles_[0].view.crop;
    ASSERT_EQ(image.image.window.pixels(), crop.pixels());
    const std::size_t middle =
        std::size_t(crop.height() / 2) * std::size_t(crop.width()) + std::size_t(crop.width() / 2);
    EXPECT_GT(byte(image, middle, 1), 245);  // the last anchor is (252, 255, 164)
    EXPECT_GT(byte(image, middle, 2), 140);
    EXPECT_EQ(byte(image, 0, 0), 0);
    EXPECT_EQ(byte(image, 0, 2), 4);

    // Twice the range: half of the ramp.
    options.range = {0, 4};
    trace(*maps("half.png", options), std::span(bundles_).first(1));
    EXPECT_NEAR(double(byte(readFlatImage(path("half.png")), middle, 0)), 188, 2);

    options = {};
    options.settings.maps = {RayMap::kLast};
    trace(*maps("last.png", options), std::span(bundles_).first(1));
    const FlatImage last = readFlatImage(path("last.png"));
    EXPECT_EQ(last.image.rgba[0][3], 0);
    EXPECT_EQ(last.image.rgba[middle][3], 1);

    // With attenuation a picture of path lengths is an X-ray.
    options.settings.maps = {RayMap::kPathLength};
    options.settings.attenuation = {0.1, 1};
    trace(*maps("x.png", options), std::span(bundles_).first(1));
    const FlatImage film = readFlatImage(path("x.png"));
    EXPECT_EQ(film.image.rgba[0][0], 0);
    EXPECT_NEAR(double(byte(film, middle, 0)), 255 * (1 - std::exp(-0.1 - 1.0)), 2);
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
    EXPECT_NE(message("a.exr", options).find("attenuate"), std::string::npos);
    options.settings.maps = {RayMap::kOverlap};
    EXPECT_NE(message("a.exr", options).find("two parts"), std::string::npos);
    options.settings.parts = {std::vector<char>{1, 1}, std::vector<char>{0, 1}};
    EXPECT_NE(message("a.exr", options).find("both parts"), std::string::npos);
    options.settings.maps = {RayMap::kPathLength};
    EXPECT_NE(message("a.png", options).find("a number a material"), std::string::npos);
    options.settings.maps = {RayMap::kFirst, RayMap::kLast};
    EXPECT_NE(message("a.png", options).find("one map"), std::string::npos);
    options.settings.maps = {RayMap::kFirst};
    EXPECT_NE(message("a.png", options).find("same name"), std::string::npos);
    EXPECT_NE(message("a.gif", options), "");
    options.range = {0, 1};
    EXPECT_NE(message("a.exr", options).find("as they are"), std::string::npos);
    options.range.reset();
    EXPECT_EQ(message("a.exr", options), "");
    EXPECT_TRUE(files().empty());  // nothing was finished
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
    Json result;
    for (const char* name : {"v.npz", "v.vdb", "again.VDB"}) {
        VoxelOutput output(path(name), solids_, axes, 0, "peeler test");
        trace(output, axes.bundles);
        result = {};
        output.tell(result);
    }
    EXPECT_EQ(bytesOf(path("v.vdb")), bytesOf(path("again.VDB")));
    EXPECT_EQ(result.at("voxels").at("disputed"), 0);
    EXPECT_NEAR(result.at("voxels").at("volume").get<double>(), 4 * std::numbers::pi / 3, 0.05);

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
    EXPECT_EQ(compare.out, result.at("voxels").at("occupied").dump() + "\n");
}

TEST_F(RayOutputs, VoxelsOverTheBudget) {
    const AxisBundles axes = axisBundles(box_, box_, {70});
    const std::uint64_t cells = VoxelVotes::cellsOf(axes);
    EXPECT_NO_THROW(VoxelOutput(path("v.npz"), solids_, axes, cells, ""));
    try {
        VoxelOutput(path("v.npz"), solids_, axes, cells - 1, "");
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kMemory);
        EXPECT_NE(e.hint().find("fewer"), std::string::npos);
    }
    EXPECT_THROW(VoxelOutput(path("v.obj"), solids_, axes, 0, ""), Error);
    EXPECT_TRUE(files().empty());
}

TEST_F(RayOutputs, ParityIsReported) {
    std::ostringstream out, err;
    Console console(out, err, false);
    {
        RayParity parity(scene_, solids_, console);
        trace(parity, bundles_);
        Json result;
        parity.tell(result);
        EXPECT_EQ(result.at("parity").at("holds"), true);
        EXPECT_EQ(result.at("parity").at("solids").size(), 2U);
        EXPECT_EQ(err.str(), "");
    }
    // A lid is missing: the first body has a hole, and one ray finds it.
    scene_.meshes[0].primitives[0].positions.resize(9);
    const PosedScene shown(scene_, 0);
    const Solids open(shown);
    const auto hits = rayHits(bundles_[1], [n = 0](const auto&, const auto&) mutable {
        std::vector<Hit> found = {{1, 1}, {2, 1}, {3, 4}, {4, 4}};
        if (++n == 10) found.erase(found.begin());
        return found;
    });
    RayParity parity(scene_, open, console);
    parity.begin(bundles_, {});
    parity.take(1, hits);
    parity.finish();
    EXPECT_FALSE(parity.holds());
    try {
        parity.fail();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kInput);
        EXPECT_STREQ(e.what(),
                     "1 ray hits a solid an odd number of times: not every mesh is closed");
        EXPECT_EQ(e.where(), "body 0");
        EXPECT_NE(e.hint(), "");
    }
    EXPECT_NE(err.str().find("warning: body 0: 1 of "), std::string::npos) << err.str();
    EXPECT_NE(err.str().find("3 edges are open; the first one: askew, pixel (9, 0), along (0.26"),
              std::string::npos)
        << err.str();
    Json result;
    parity.tell(result);
    const Json& first = result.at("parity").at("solids").at(0);
    EXPECT_EQ(first.at("node"), "body 0");
    EXPECT_EQ(first.at("oddRays"), 1);
    EXPECT_EQ(first.at("openEdges"), 3);
    EXPECT_EQ(first.at("firstOddRays").at(0).at("x"), 9);
    EXPECT_EQ(result.at("parity").at("solids").at(1).at("oddRays"), 0);
}

}  // namespace
}  // namespace peeler::cmd
