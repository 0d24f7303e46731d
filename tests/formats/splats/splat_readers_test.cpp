// SPDX-License-Identifier: Apache-2.0
// Tests that every format of Gaussian splats gives the splats that it holds.
#include "formats/splats/splat_files.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <iostream>
#include <numbers>

#include "formats/meshes/scene_reader.h"

namespace peeler::test {
namespace {

class SplatReaders : public testing::Test {
  protected:
    Scene read(const std::string& name, const std::string& bytes,
               const SceneReadOptions& options = {}) {
        writeFile(folder_ / name, bytes);
        return readSceneFile(folder_ / name, options);
    }
    std::string refusal(const std::string& name, const std::string& bytes) {
        try {
            read(name, bytes);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_TRUE(contains(error.where(), name)) << error.what();
            return error.what();
        }
        ADD_FAILURE() << name << " was read";
        return "";
    }

    ScratchDir folder_;
};

const Splats& splatsOf(const Scene& scene) {
    return *scene.meshes.at(0).primitives.at(0).splats;
}

/// A format, and the rounding of its numbers.
struct SplatFormat {
    std::string name;
    std::function<std::string(const std::vector<Splat>&, int degree)> write;
    Rounding rounding;
    int most_degree = 3;
    double dilation = 0.3;
    bool by_distance = false;
};

std::vector<SplatFormat> formats(const ScratchDir& folder) {
    constexpr double kHalf = 0.5, kY0 = 0.2821;
    const double tenth = std::numbers::sqrt2 / 1023 * kHalf;
    return {
        {"a.ply", [](const auto& splats, int degree) { return splatPly(splats, degree); }, {}},
        {"b.ply",
         [](const auto& splats, int degree) { return compressedPly(splats, degree); },
         {8 / 1023.0 * kHalf, 4 / 1023.0 * kHalf * 1.01, 3 * tenth, 0, 3 / 255.0 / kY0 * kHalf,
          8 / 256.0 * kHalf}},
        {"c.glb",
         [&](const auto& splats, int degree) {
             return bytesOf(splatGltf(splats, degree).write(folder, "c.glb"));
         },
         {},
         3,
         0,
         true},
        {"d.spz",
         [](const auto& splats, int degree) { return gzip(unpackedSpzOf(splats, degree, 2)); },
         {0, 0, 3 / 127.5 * kHalf, 0, 1 / 255.0 / 0.15 * kHalf, 0}},
        {"e.spz",
         [](const auto& splats, int degree) { return gzip(unpackedSpzOf(splats, degree, 3)); },
         {0, 0, 3 * tenth, 0, 1 / 255.0 / 0.15 * kHalf, 0}},
        {"f.splat",
         [](const auto& splats, int) { return dotSplat(splats); },
         {0, 0, 2 / 128.0 * kHalf, 0, 1 / 255.0 / kY0 * kHalf, 0},
         0},
    };
}

TEST_F(SplatReaders, EveryFormatGivesItsSplats) {
    for (const SplatFormat& format : formats(folder_)) {
        for (int degree = 0; degree <= format.most_degree; ++degree) {
            SCOPED_TRACE(format.name + ", degree " + std::to_string(degree));
            const Scene scene =
                read(format.name, format.write({knownSplat(), knownSplat(2)}, degree));
            EXPECT_TRUE(scene.warnings.empty());
            ASSERT_EQ(scene.meshes.at(0).primitives.at(0).topology, Topology::kPoints);
            expectSplat(scene, 0, knownSplat(), degree, format.rounding);
            expectSplat(scene, 1, knownSplat(2), degree, format.rounding);
            EXPECT_EQ(splatsOf(scene).dilation, format.dilation);
            EXPECT_EQ(splatsOf(scene).by_distance, format.by_distance);
            EXPECT_FALSE(splatsOf(scene).compensated);
            EXPECT_FALSE(splatsOf(scene).linear);
            checkScene(scene);
        }
    }
}

TEST_F(SplatReaders, ACompressedPlyWithoutLimitsOfColoursHasThemFromZeroToOne) {
    expectSplat(read("a.ply", compressedPly({knownSplat()}, 0, false)), 0, knownSplat(), 0,
                {0.004, 0.002, 0.003, 0, 0.5 / 255 / 0.2821, 0});
}

TEST_F(SplatReaders, EveryComponentMayBeTheLargest) {
    for (const SplatFormat& format : formats(folder_)) {
        for (int largest = 0; largest < 4; ++largest) {
            Splat splat = knownSplat();
            splat.rotation = {0.2, -0.3, 0.1, -0.25};
            splat.rotation[largest] = largest % 2 ? -1 : 1;
            splat.rotation = glm::normalize(splat.rotation);
            Rounding rounding = format.rounding;
            // A small w follows from the others, whose errors it magnifies.
            rounding.rotation *= format.name == "d.spz" ? 4 : 1;
            SCOPED_TRACE(format.name + ", component " + std::to_string(largest));
            expectSplat(read(format.name, format.write({splat}, 0)), 0, splat, 0, rounding);
        }
    }
}

TEST_F(SplatReaders, AntialiasedTrainingIsKnownFromCommentsAndFlags) {
    const auto compensated = [&](const std::string& name, const std::string& bytes) {
        return splatsOf(read(name, bytes)).compensated;
    };
    const std::vector<Splat> splats = {knownSplat()};
    EXPECT_TRUE(compensated("a.ply", splatPly(splats, 0, "comment SplatRenderMode: mip\n")));
    EXPECT_FALSE(compensated("a.ply", splatPly(splats, 0, "comment SplatRenderMode: default\n")));
    EXPECT_TRUE(compensated("a.ply", splatPly(splats, 0, "comment antialiased 1\n")));
    EXPECT_FALSE(compensated("a.ply", splatPly(splats, 0, "comment antialiased 0\n")));
    EXPECT_TRUE(
        compensated("a.ply", compressedPly(splats, 0, true, "comment SplatRenderMode: mip\n")));
    EXPECT_TRUE(compensated("a.spz", gzip(unpackedSpzOf(splats, 0, 3, 1))));
    EXPECT_TRUE(warned(read("a.ply", splatPly(splats, 0, "comment SplatRenderMode: 2dgs\n")),
                       "flat (2DGS)"));
}

TEST_F(SplatReaders, TheFilterOfMipSplattingWidensSplats) {
    Splat splat = knownSplat();
    std::string file = splatPly({splat}, 0);
    file.insert(file.find("end_header"), "property float filter_3D\n");
    PackedNumbers filter;
    filter.add(0.25F);
    const Scene scene = read("a.ply", file + filter.text);
    double share = 1;
    for (int i = 0; i < 3; ++i) {
        const double wide = std::hypot(splat.scale[i], 0.25);
        share *= splat.scale[i] / wide;
        splat.scale[i] = wide;
    }
    splat.opacity *= share;
    expectSplat(scene, 0, splat, 0, {});
    EXPECT_TRUE(splatsOf(scene).compensated);
    EXPECT_EQ(splatsOf(scene).dilation, 0.1);
}

TEST_F(SplatReaders, UnusableSplatsAreLeftOutAndCounted) {
    const double infinity = std::numeric_limits<double>::infinity();
    std::vector<Splat> splats(5, knownSplat());
    splats[1].mean.x = infinity;
    splats[2].harmonics[0].y = std::nan("");
    splats[3].scale.z = std::exp(100.0);
    const Scene scene = read("a.ply", splatPly(splats, 0));
    EXPECT_EQ(splatsOf(scene).size(), 2U);
    EXPECT_TRUE(warned(scene, "left out (3; the first is splat 1)"));
    splats[2] = knownSplat();
    splats[3].scale.z = -1;
    EXPECT_TRUE(warned(read("a.splat", dotSplat(splats)), "left out (2; the first is splat 1)"));
}

TEST_F(SplatReaders, OpacitiesAndScalesMayBeExactlyZeroOrOne) {
    std::vector<Splat> splats(2, knownSplat());
    splats[0].opacity = 1;
    splats[1].opacity = 0;
    splats[1].scale.x = 0;
    const Scene scene = read("a.ply", splatPly(splats, 0));
    EXPECT_TRUE(scene.warnings.empty());
    EXPECT_EQ(splatsOf(scene).opacities, (std::vector<float>{1, 0}));
    EXPECT_EQ(splatsOf(scene).scales[1].x, 0);
}

TEST_F(SplatReaders, ARotationOfZerosIsTheIdentity) {
    Splat splat = knownSplat();
    splat.rotation = glm::dvec4(0);
    for (const auto& [name, bytes] :
         {std::pair<std::string, std::string>("a.ply", splatPly({splat}, 0)),
          {"a.splat", dotSplat({splat})}}) {
        const Scene scene = read(name, bytes);
        EXPECT_TRUE(warned(scene, "rotation is zero"));
        EXPECT_EQ(splatsOf(scene).rotations[0], glm::vec4(0, 0, 0, 1));
    }
}

TEST_F(SplatReaders, UpAndUnitPlaceTheNode) {
    SceneReadOptions options;
    options.up = Axis::kZ;
    options.metres_per_unit = 0.5;
    for (const SplatFormat& format : formats(folder_)) {
        if (format.name == "c.glb") continue;
        const Scene scene = read(format.name, format.write({knownSplat()}, 0), options);
        EXPECT_EQ(scene.nodes.at(0).local * glm::dvec4(0, 0, 1, 1), glm::dvec4(0, 0.5, 0, 1))
            << format.name;
        EXPECT_TRUE(assumedOf(folder_ / format.name, options));
    }
}

TEST_F(SplatReaders, FilesThatAreNotReadAreNamed) {
    const std::vector<Splat> splats = {knownSplat()};
    const auto without = [&](const std::string& name) {
        std::string file = splatPly(splats, 0);
        return file.replace(file.find(name), name.size(), std::string(name.size(), 'q'));
    };
    const std::string spz = unpackedSpzOf(splats, 1, 3);
    const auto changed = [&](std::size_t place, char value) {
        std::string file = spz;
        file[place] = value;
        return gzip(file);
    };
    const struct {
        std::string name, bytes, words;
    } rows[] = {
        {"a.ply", without("scale_2"), "no scale_2"},
        {"a.ply", without("rot_3"), "no rot_3"},
        {"a.ply", without("f_dc_1"), "no f_dc_1"},
        {"a.ply", splatPly(splats, 1).replace(splatPly(splats, 1).find("f_rest_8"), 8, "f_rest_9"),
         "no f_rest_8"},
        {"a.ply", splatPly(splats, 1).replace(splatPly(splats, 1).find("f_rest_8"), 8, "qqqqqqqq"),
         "8 properties f_rest_"},
        {"a.ply", splatPly(splats, 1).substr(0, splatPly(splats, 1).size() - 1), "ends before"},
        {"b.ply", compressedPly(std::vector<Splat>(257, splats[0]), 0), "need 2 chunks"},
        {"b.ply", compressedPly(splats, 1).substr(0, compressedPly(splats, 1).size() - 1),
         "ends before"},
        {"c.spz", changed(4, 4), "SPZ version 4"},
        {"c.spz", changed(4, 1), "SPZ version 1"},
        {"c.spz", changed(12, 4), "degree 4"},
        {"c.spz", changed(13, 25), "fractional bits"},
        {"c.spz", changed(14, 2), "extensions"},
        {"c.spz", changed(0, 'M'), "not an SPZ file"},
        {"c.spz", changed(8, 2), "ends before its 2 splats"},
        {"c.spz", changed(11, 127), "ends before"},
        {"c.spz", gzip(spz).substr(0, 40), "damaged"},
        {"c.spz", std::string("\x1f\x8b"), "damaged"},
        {"c.spz", gzip(std::string(std::size_t{64} << 20U, '\0')), "200 times its size"},
        {"c.spz", "NGSP", "shorter than a header"},
        {"d.splat", dotSplat(splats) + "a", "within splat 1"},
        {"e.sog", "PK\x03\x04", "SOG splats"},
        {"e.ksplat", "a", "ksplat splats"},
    };
    for (const auto& row : rows)
        EXPECT_TRUE(contains(refusal(row.name, row.bytes), row.words))
            << row.words << ": " << refusal(row.name, row.bytes);
}

TEST_F(SplatReaders, UnpackedSpzIsRead) {
    expectSplat(read("a.spz", unpackedSpzOf({knownSplat()}, 1, 3)), 0, knownSplat(), 1,
                {0, 0, 0.0021, 0, 0.0131, 0});
}

TEST_F(SplatReaders, TheContentDecidesExceptForDotSplat) {
    const auto formatOf = [&](const std::string& name, const std::string& bytes) {
        writeFile(folder_ / name, bytes);
        const SceneFormat* const format = sceneFormatOf(folder_ / name);
        return std::string(format ? format->name : "");
    };
    std::vector<Splat> splats = {knownSplat()};
    EXPECT_EQ(formatOf("a.splat", splatPly(splats, 0)), "3DGS PLY");
    EXPECT_EQ(formatOf("a.splat", compressedPly(splats, 3)), "compressed PLY");
    EXPECT_EQ(formatOf("a.ply", gzip(unpackedSpzOf(splats, 0, 2))), "SPZ");
    EXPECT_EQ(formatOf("a.bin", dotSplat(splats)), "");
    std::string brace = dotSplat(splats);
    brace[0] = '{';
    EXPECT_EQ(formatOf("a.splat", brace), ".splat");
    const std::string plain = "ply\nformat ascii 1.0\nelement vertex 0\n";
    EXPECT_EQ(formatOf("a.ply", plain + properties("float", {"x", "y", "z", "f_dc_0", "opacity"})),
              "PLY");
}

TEST_F(SplatReaders, ARealCaptureIsRead) {
    const char* const named = std::getenv("PEELER_SPLATS");
    const std::filesystem::path path =
        (named ? std::filesystem::path(named) : sourceDir() / "../shared/splats") /
        "guitar.compressed.ply";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
    const Scene scene = readSceneFile(path);
    EXPECT_TRUE(scene.warnings.empty());
    EXPECT_EQ(splatsOf(scene).size(), 90854U);
}

}  // namespace
}  // namespace peeler::test
