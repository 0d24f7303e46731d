// SPDX-License-Identifier: Apache-2.0
// Tests peeler rays on a scene with Gaussian splats: lists, maps, and what lacks splats.
#include <gtest/gtest.h>

#include "formats/splats/splat_files.h"
#include "support/npz_file.h"

namespace peeler::test {
namespace {

/// Writes two splats on the axis, and a pane between them.
std::string splatsAndPane(const ScratchDir& folder) {
    Splat near;
    near.mean = {0, 0, 1};
    near.scale = glm::dvec3(0.2);
    near.rotation = {0, 0, 0, 1};
    near.opacity = 0.5;
    near.harmonics[0] = glm::dvec3(0.5 / 0.28209479177387814);  // white
    Splat far = near;
    far.mean.z = -1;
    GltfBuilder builder = splatGltf({far, near}, 0);
    const int corners = builder.addAccessor<float>({-9, -9, 0, 9, -9, 0, 0, 9, 0}, "VEC3");
    builder.gltf["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0, 0, 1}}}}}};
    builder.gltf["meshes"].push_back(
        {{"primitives", {{{"attributes", {{"POSITION", corners}}}, {"material", 0}}}}});
    builder.gltf["nodes"].push_back({{"mesh", 1}, {"name", "pane"}});
    builder.gltf["scenes"][0]["nodes"].push_back(builder.gltf["nodes"].size() - 1);
    return builder.write(folder, "both.glb").string();
}

Outcome traceSplats(const std::string& scene, const std::string& output,
                    std::vector<std::string> options) {
    options.insert(options.begin(), {"rays", scene, "--engine", "cpu", "-o", output});
    return runPeeler(options);
}

TEST(SplatRays, AreInLists) {
    const ScratchDir folder;
    const Outcome run =
        traceSplats(splatsAndPane(folder), folder / "hits.npz",
                    {"--eye", "0,0,3", "--fov", "40", "--size", "33x33", "--columns",
                     "t_hit,node_ids,primitive_ids,normals,base_color", "--strict"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.err.find("warning"), std::string::npos) << run.err;
    const auto arrays = readNpz(folder / "hits.npz");
    const auto splits = arrays.at("ray_splits").as<std::int64_t>();
    const auto middle = static_cast<std::size_t>(splits.at(16 * 33 + 16));
    ASSERT_EQ(splits.at(16 * 33 + 17) - splits.at(16 * 33 + 16), 3);
    const auto t = arrays.at("t_hit").as<float>(), color = arrays.at("base_color").as<float>(),
               normals = arrays.at("normals").as<float>();
    const auto nodes = arrays.at("node_ids").as<std::uint32_t>(),
               primitives = arrays.at("primitive_ids").as<std::uint32_t>();
    const struct {
        float t, green, alpha, normal;
        std::uint32_t node, primitive;
    } rows[] = {{2, 1, 0.5F, 0, 0, 1}, {3, 0, 1, 1, 1, 0}, {4, 1, 0.5F, 0, 0, 0}};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t hit = middle + i;
        EXPECT_NEAR(t[hit], rows[i].t, 1e-5);
        EXPECT_NEAR(color[4 * hit], 1, 1e-5);
        EXPECT_NEAR(color[4 * hit + 1], rows[i].green, 1e-5);
        EXPECT_NEAR(color[4 * hit + 3], rows[i].alpha, 1e-5);
        EXPECT_EQ(normals[3 * hit + 2], rows[i].normal);
        EXPECT_EQ(nodes[hit], rows[i].node);
        EXPECT_EQ(primitives[hit], rows[i].primitive);
    }
}

TEST(SplatRays, AreInMapsThatNeedNoSolids) {
    const ScratchDir folder;
    const std::string scene = splatsAndPane(folder);
    const Outcome run =
        traceSplats(scene, folder / "maps.npz",
                    {"--direction", "0,0,-1", "--bounds", "-0.01,-0.01,-1,0.01,0.01,1",
                     "--resolution", "1", "--map", "first,count,base-color,thickness"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_TRUE(contains(run.err, "rays through solids do not hit Gaussian splats")) << run.err;
    const auto arrays = readNpz(folder / "maps.npz");
    const auto value = [&](const char* name) { return arrays.at(name).as<float>().at(0); };
    EXPECT_EQ(arrays.at("count.0").as<std::uint32_t>().at(0), 3U);
    EXPECT_EQ(value("thickness.0"), 0);
    EXPECT_NEAR(value("R.0"), 1, 1e-5);
    EXPECT_NEAR(value("G.0"), 0.5, 1e-5);
    EXPECT_NEAR(value("A.0"), 1, 1e-5);
}

TEST(SplatRays, CoverSplatsToThreeSigma) {
    const ScratchDir folder;
    Splat splat = knownSplat();
    splat.scale = glm::dvec3(0.5);
    splat.opacity = 0.8;
    writeFile(folder / "one.ply", splatPly({splat}, 0));
    const Outcome run = traceSplats((folder / "one.ply").string(), folder / "hits.npz",
                                    {"--direction", "0,0,-1", "--resolution", "40"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const auto t = readNpz(folder / "hits.npz").at("t_hit").as<float>();
    // Of the square of three sigma, a circle is within three sigma.
    EXPECT_NEAR(static_cast<double>(t.size()), 1600 * 3.14159265 / 4, 30);
    for (const float distance : t)
        ASSERT_NEAR(distance, 1.5, 0.01);
}

TEST(SplatRays, AreMissedByOthersWithAWarning) {
    const ScratchDir folder;
    const std::string scene = splatsAndPane(folder);
    writeFile(folder / "points.ply",
              "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
              "property float y\nproperty float z\nend_header\n0 0 2\n");
    const std::string points = (folder / "points.ply").string();
    const struct {
        std::vector<std::string> options;
        std::string words;
    } rows[] = {
        {{"--eye", "0,0,3", "--lens", "fisheye", "--fov", "90", "--size", "16x16"},
         "rays of lenses and lists do not hit"},
        {{"--direction", "0,0,-1", "--resolution", "8", "--map", "thickness"},
         "rays do not hit Gaussian splats; results lack them"},
        {{"--direction", "0,0,-1", "--resolution", "8", "--points", points}, "rays do not hit"},
        {{"--voxels", "4"}, "rays do not hit"},
        {{"--direction", "0,0,-1", "--resolution", "8", "--parity", "report"},
         "rays through solids do not hit"},
    };
    for (const auto& row : rows) {
        const Outcome run = traceSplats(scene, folder / "out.npz", row.options);
        EXPECT_EQ(run.exit_code, 0) << run.err;
        EXPECT_TRUE(contains(run.err, row.words)) << row.words << '\n' << run.err;
        EXPECT_FALSE(contains(run.err, "lines and points")) << run.err;
        std::vector<std::string> strict = row.options;
        strict.insert(strict.end(), {"--strict"});
        EXPECT_EQ(traceSplats(scene, folder / "out.npz", strict).exit_code, 3) << row.words;
    }
}

}  // namespace
}  // namespace peeler::test
