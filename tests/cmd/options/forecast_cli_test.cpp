// SPDX-License-Identifier: Apache-2.0
// Tests that file sizes equal the forecast or stay below it, as stated, and that --dry-run prints
// the same forecast.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class Forecasts : public testing::Test {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }

    Json run(std::vector<std::string> line) const {
        line.insert(line.end(), {"--json", "--quiet"});
        const Outcome result = runPeeler(line);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return result.exit_code == 0 ? Json::parse(result.out) : Json();
    }
    /// Runs a command line first with --dry-run, then for real, and compares the sizes. `certainty`
    /// is the text that --dry-run prints.
    void expectForecast(std::vector<std::string> line, const std::string& certainty) const {
        const std::vector<std::string> before = scratch_.files();
        std::vector<std::string> dry = line;
        dry.insert(dry.end(), {"--dry-run", "--quiet"});
        const Outcome told = runPeeler(dry);
        ASSERT_EQ(told.exit_code, 0) << told.err;
        EXPECT_EQ(scratch_.files(), before);
        std::uint64_t forecast = 0;
        const Json plan = Json::parse(told.out);
        for (const Json& output : plan.at("outputs")) {
            EXPECT_EQ(output.at("forecast"), certainty) << told.out;
            EXPECT_GT(output.at("freeBytes").get<std::uint64_t>(), 0U);
            forecast += output.at("forecastBytes").get<std::uint64_t>();
        }
        expectSize(run(std::move(line)), forecast, certainty);
    }
    static void expectSize(const Json& result, std::uint64_t forecast,
                           const std::string& certainty) {
        const std::string where =
            result.at("output").dump() + result.value("outputs", Json()).dump();
        const auto bytes = result.at("bytes").get<std::uint64_t>();
        EXPECT_EQ(result.at("forecastBytes"), forecast) << where;
        if (certainty == "exact") {
            EXPECT_EQ(bytes, forecast) << where;
        } else if (certainty == "at most") {
            EXPECT_LE(bytes, forecast) << where;
        } else {
            EXPECT_NEAR(static_cast<double>(bytes) / static_cast<double>(forecast), 1, 0.15)
                << where;
        }
    }

    ScratchDir scratch_;
    fs::path scenes_ = sourceDir() / "examples" / "scenes";
    std::string glasses_ = scenes_ / "glasses.glb";
};

TEST_F(Forecasts, Rays) {
    const std::vector<std::string> rays = {"rays", glasses_};
    const auto expect = [&](const std::string& name, const std::string& certainty,
                            const std::vector<std::string>& more) {
        std::vector<std::string> line = rays;
        line.insert(line.end(), {"-o", path(name)});
        line.insert(line.end(), more.begin(), more.end());
        expectForecast(line, certainty);
    };
    const std::vector<std::string> bundles{"--directions", "3", "--resolution", "48"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), bundles.begin(), bundles.end());
        return more;
    };
    expect("a.npz", "exact", bundles);
    expect("a.ply", "exact", bundles);
    expect("double.ply", "exact", with({"--double"}));
    expect("few.npz", "exact", with({"--columns", "normals,t_hit"}));
    expect("few.ply", "exact", with({"--columns", "primitive_uvs", "--double"}));
    expect("a.exr", "at most", bundles);
    expect("camera.npz", "exact", {"--camera", "main", "--size", "64x36"});
    expect("map.exr", "at most", with({"--map", "first,count,thickness"}));
    expect("map.##.png", "at most", with({"--map", "thickness"}));
    expect("map.##.tif", "at most", with({"--map", "first"}));
    expect("voxels.npz", "exact", {"--voxels", "40"});
    expect("voxels.vdb", "at most", {"--voxels", "40"});
    expect("next.npz", "exact", with({"--points", path("a.ply")}));
    // This scene has a single triangle, so there is at most one hit per ray.
    std::vector<std::string> tiny{"rays", writeScene(scratch_ / "."), "-o", path("tiny.exr")};
    tiny.insert(tiny.end(), {"--axes", "--resolution", "2"});
    expectForecast(tiny, "at most");
}

TEST_F(Forecasts, RaysWithoutAFile) {
    const Outcome told = runPeeler(
        {"rays", glasses_, "--axes", "--resolution", "8", "--parity", "report", "--dry-run", "-q"});
    ASSERT_EQ(told.exit_code, 0) << told.err;
    EXPECT_EQ(Json::parse(told.out).at("outputs"), Json::array());
    // A dry run must end with the same exit code as the real run.
    EXPECT_EQ(runPeeler({"rays", glasses_, "--axes", "--resolution", "8", "--map", "first", "-o",
                         path("one.png"), "--dry-run", "-q"})
                  .exit_code,
              2);
}

TEST_F(Forecasts, Extract) {
    for (const char* channels : {"none", "all", "normal,id"}) {
        std::vector<std::string> render{"render",       glasses_, "-o",
                                        path("in.exr"), "--size", "96x54"};
        if (std::string(channels) != "none") render.insert(render.end(), {"--channels", channels});
        run(render);
        const std::vector<std::string> extract{"extract", path("in.exr")};
        const auto expect = [&](const std::string& certainty, std::vector<std::string> more) {
            more.insert(more.begin(), extract.begin(), extract.end());
            expectForecast(more, certainty);
        };
        expect("exact", {"--npz", path("a.npz")});
        expect("exact", {"--npz", path("a.npz"), "--points", path("a.ply"), "--double"});
        expect("exact", {"--npz", path("a.npz"), "--points", path("a.ply"), "--layer", "1-3"});
        expect("at most", {"--points", path("a.ply")});
        expect("at most", {"--points", path("a.ply"), "--layers", "2"});
        expect("at most", {"-o", path("layer.##.exr"), "--depth-complexity", path("n.exr")});
        expect("at most", {"-o", path("layer.##.png"), "--depth-complexity", path("n.png")});
    }
}

TEST_F(Forecasts, Bake) {
    const auto expect = [&](const std::string& name, const std::string& certainty,
                            std::vector<std::string> more) {
        more.insert(more.begin(), {"bake", scenes_ / "plant.glb", "-o", path(name), "--directions",
                                   "2", "--resolution", "16"});
        expectForecast(more, certainty);
    };
    expect("a.glb", "about", {});
    expect("a.glb", "about", {"--quantity", "bent-normal"});
    expect("a.exr", "at most", {"--size", "64", "--quantity", "bent-normal"});
    expect("a.##.png", "at most", {"--size", "64"});
}

TEST_F(Forecasts, Render) {
    struct Row {
        const char* name;
        std::vector<std::string> more;
    };
    const Row rows[] = {
        {"a.exr", {}},
        {"a.exr", {"--channels", "all", "--precision", "float"}},
        {"a.exr", {"--layout", "single-part", "--no-composite"}},
        {"a.exr", {"--layout", "nuke", "--compression", "none", "--channels", "all"}},
        {"a.exr", {"--layout", "per-file", "--cryptomatte", "--compression", "rle"}},
        {"a.exr", {"--as", "deep", "--channels", "all", "--compression", "none"}},
        {"a.exr", {"--as", "composite", "--cryptomatte"}},
        {"a.exr", {"--as", "midpoint-depth"}},
        {"a.png", {}},
        {"a.jpg", {}},
        {"a.tif", {}},
        {"a.html", {}},
    };
    for (const char* size : {"64x36", "3x2", "400x3"}) {
        for (const Row& row : rows) {
            std::vector<std::string> line{"render", glasses_, "-o", path(row.name), "--size", size};
            line.insert(line.end(), row.more.begin(), row.more.end());
            const Json result = run(line);
            expectSize(result, result.at("forecastBytes"), "at most");
        }
    }
    // Without compression, the file is nearly as large as forecast.
    const Json plain = run({"render", glasses_, "-o", path("a.exr"), "--size", "400x225", "--as",
                            "deep", "--compression", "none", "--channels", "all"});
    EXPECT_GT(plain.at("bytes").get<double>(), 0.85 * plain.at("forecastBytes").get<double>());
}

}  // namespace
}  // namespace peeler::test
