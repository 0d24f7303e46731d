// SPDX-License-Identifier: Apache-2.0
// Tests the base-color map of peeler rays: against unlit pictures of GL, and through a fisheye.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cmd/tiny_gltf.h"
#include "formats/image/image_library.h"
#include "support/npz_file.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

Outcome baseColor(const std::filesystem::path& scene, const std::string& output,
                  std::vector<std::string> options) {
    options.insert(options.begin(),
                   {"rays", scene.string(), "--quiet", "--map", "base-color", "-o", output});
    return runPeeler(options);
}

TEST(BaseColorMap, IsTheUnlitPicture) {
    const ScratchDir scratch;
    const std::string scene = (sourceDir() / "examples/scenes/engine.glb").string();
    const std::vector<std::string> camera{"--eye", "0.2,0.25,0.5", "--size", "160x120"};
    for (const char* const engine : {"cpu", "gl"}) {
        std::vector<std::string> options = camera;
        options.insert(options.end(), {"--engine", engine});
        const Outcome run = baseColor(scene, scratch / "map.exr", options);
        ASSERT_EQ(run.exit_code, 0) << run.err;
        std::vector<std::string> render{"render",    scene,         "-o",    scratch / "gl.exr",
                                        "--quiet",   "--shading",   "unlit", "--as",
                                        "composite", "--precision", "float"};
        render.insert(render.end(), camera.begin(), camera.end());
        ASSERT_EQ(runPeeler(render).exit_code, 0);
        const Outcome compared =
            runPeeler({"compare", scratch / "map.exr", scratch / "gl.exr", "--json"});
        const Json color = Json::parse(compared.out)["composite"];
        // The engines differ at edges.
        EXPECT_LT(color["rmse"].get<double>(), 0.01) << engine << compared.out;
        EXPECT_LT(color["mean"].get<double>(), 1e-3) << engine;
    }
}

TEST(BaseColorMap, ThroughAFisheye) {
    const ScratchDir scratch;
    const auto scene = writeScene(scratch / ".");  // red, with an opacity of 1/2
    const std::vector<std::string> camera{"--lens", "fisheye",  "--fov",  "200",
                                          "--eye",  "0,-0.2,1", "--size", "65x65"};
    const Outcome png = baseColor(scene, scratch / "map.png", camera);
    ASSERT_EQ(png.exit_code, 0) << png.err;
    const auto decoder = imageDecoder("png", scratch / "map.png");
    ASSERT_EQ(decoder->image().width, 65);
    ASSERT_EQ(decoder->image().height, 65);
    std::vector<std::uint8_t> samples(std::size_t{65} * 65 * 4);
    decoder->read(0, 4, samples.data());
    const std::uint8_t* const middle = samples.data() + std::size_t{4} * (32 * 65 + 32);
    EXPECT_EQ((std::array<int, 4>{middle[0], middle[1], middle[2], middle[3]}),
              (std::array<int, 4>{255, 0, 0, 128}));
    EXPECT_EQ(samples[3], 0) << "no hit in the corner";

    std::vector<std::string> with_first = camera;
    with_first.insert(with_first.end(), {"--map", "first"});
    const Outcome npz = baseColor(scene, scratch / "map.npz", with_first);
    ASSERT_EQ(npz.exit_code, 0) << npz.err;
    const auto arrays = readNpz(scratch / "map.npz");
    constexpr std::size_t kMiddle = 32 * 65 + 32;
    for (const auto& [name, value] :
         {std::pair{"R.0", 0.5F}, {"G.0", 0.0F}, {"B.0", 0.0F}, {"A.0", 0.5F}, {"first.0", 1.0F}})
        EXPECT_NEAR(arrays.at(name).as<float>().at(kMiddle), value, 0.03) << name;

    EXPECT_EQ(baseColor(scene, scratch / "two.png", with_first).exit_code, 2);
    std::vector<std::string> range = camera;
    range.insert(range.end(), {"--range", "0,1"});
    const Outcome refused = baseColor(scene, scratch / "two.png", range);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find("base colours have no range"), std::string::npos) << refused.err;
}

TEST(BaseColorColumn, IsWhatTheMapComposites) {
    const ScratchDir scratch;
    const std::string scene = (sourceDir() / "examples/scenes/engine.glb").string();
    const std::vector<std::string> camera{"--lens", "fisheye",      "--fov",  "120",
                                          "--eye",  "0.2,0.25,0.5", "--size", "80x60"};
    const auto traced = [&](const char* name, std::vector<std::string> options) {
        options.insert(options.begin(), {"rays", scene, "--quiet", "-o", scratch / name});
        options.insert(options.end(), camera.begin(), camera.end());
        const Outcome run = runPeeler(options);
        EXPECT_EQ(run.exit_code, 0) << run.err;
        return scratch / name;
    };
    const auto hits = readNpz(traced("hits.npz", {"--columns", "t_hit,base_color"}));
    const auto map = readNpz(traced("map.npz", {"--map", "base-color"}));
    const auto splits = hits.at("ray_splits").as<std::int64_t>();
    const auto colors = hits.at("base_color").as<float>();
    ASSERT_EQ(hits.at("base_color").shape, "(" + std::to_string(splits.back()) + ", 4)");
    ASSERT_GT(splits.back(), 1000);
    constexpr std::array kMapChannels{"R.0", "G.0", "B.0", "A.0"};
    for (std::size_t channel = 0; channel < 4; ++channel) {
        const auto expected = map.at(kMapChannels[channel]).as<float>();
        for (std::size_t ray = 0; ray + 1 < splits.size(); ++ray) {
            float sum = 0, passing = 1;
            for (auto i = static_cast<std::size_t>(splits[ray]);
                 i < static_cast<std::size_t>(splits[ray + 1]) && passing > 0; ++i) {
                const float alpha = colors[4 * i + 3];
                sum += passing * alpha * (channel == 3 ? 1 : colors[4 * i + channel]);
                passing *= 1 - alpha;
            }
            ASSERT_NEAR(sum, expected[ray], 1e-5) << ray << kMapChannels[channel];
        }
    }
    EXPECT_FALSE(readNpz(traced("all.npz", {"--columns", "all"})).contains("base_color"));
    EXPECT_EQ(readNpz(traced("dense.npz", {"--columns", "base_color", "--dense", "2"}))
                  .at("base_color")
                  .shape,
              "(60, 80, 2, 4)");
    const std::string ply = bytesOf(traced("points.ply", {"--columns", "base_color"}));
    EXPECT_TRUE(contains(ply, "property float base_r\n")) << ply.substr(0, 400);
}

}  // namespace
}  // namespace peeler::test
