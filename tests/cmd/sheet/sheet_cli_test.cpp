// SPDX-License-Identifier: Apache-2.0
// Tests peeler sheet: the cells, their positions and their content.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "core/base/color.h"
#include "core/capture/method.h"
#include "formats/image/flat_image.h"
#include "formats/splats/splat_files.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Sheets of five half-transparent red triangles. Each fills the picture of 96 x 64 pixels.
class SheetCommand : public testing::Test {
  protected:
    void SetUp() override {
        scene_ = writeScene(scratch_.path(), stackScene(5)).string();
        layers_ = (scratch_ / "layers.exr").string();
        sheet_ = (scratch_ / "sheet.png").string();
        const Outcome result = runPeeler({"render", scene_, "-o", layers_, "--size", "96x64",
                                          "--precision", "float", "--shading", "unlit"});
        ASSERT_EQ(result.exit_code, 0) << result.err;
    }

    Outcome sheet(const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{"sheet", layers_, "-o", sheet_};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runPeeler(arguments);
    }
    Json cells(std::vector<std::string> more) const {
        more.emplace_back("--json");
        const Outcome result = sheet(more);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return Json::parse(result.out);
    }
    static std::vector<std::string> labels(const Json& json) {
        std::vector<std::string> all;
        for (const Json& cell : json.at("cells"))
            all.push_back(cell.at("label"));
        return all;
    }

    ScratchDir scratch_;
    std::string scene_, layers_, sheet_;
};

TEST_F(SheetCommand, HasTheCompositeAndEveryLayer) {
    const Json json = cells({});
    EXPECT_EQ(labels(json), (std::vector<std::string>{"composite", "layer 0", "layer 1", "layer 2",
                                                      "layer 3", "layer 4"}));
    EXPECT_EQ(json.at("cells").at(0).at("detail"), "30,720 fragments");
    EXPECT_EQ(json.at("cells").at(3).at("detail"), "6,144 fragments");
    EXPECT_EQ(json.at("cellsOmitted"), 0);
    const CompositeImage page = readFlatImage(sheet_).image;
    EXPECT_EQ(page.window.width(), json.at("width"));
    EXPECT_EQ(page.window.height(), json.at("height"));
    // The sheet has three columns of 96 pixels and four gaps of 4.
    EXPECT_EQ(page.window.width(), 3 * 96 + 4 * 4);
}

TEST_F(SheetCommand, CellsShowTheirPixels) {
    // The base colour is (1, 0, 0, 0.5), unlit, over black: red is 0.5 in one layer and 1 - 2^-5 in
    // all five.
    ASSERT_EQ(sheet({"--background", "#000000", "--tone-map", "none"}).exit_code, 0);
    const CompositeImage page = readFlatImage(sheet_).image;
    const auto at = [&](int column, int from_bottom) {
        const int x = 4 + column * 100 + 48, y = page.window.height() - from_bottom;
        return page.rgba[static_cast<std::size_t>(y * page.window.width() + x)];
    };
    // Distances from the lower edge of the page, inside the two rows of cells.
    const int lower = 20, upper = lower + 64 + 2 * 4 + 21;
    EXPECT_NEAR(at(0, upper)[0], 1 - 1 / 32.0, 0.01);  // composite
    EXPECT_NEAR(at(1, upper)[0], 0.5, 0.01);           // layer 0
    EXPECT_NEAR(at(2, lower)[0], 0.5, 0.01);           // layer 4
    EXPECT_NEAR(at(0, upper)[1], 0, 0.01);
}

TEST_F(SheetCommand, OfASceneEqualsThatOfItsFile) {
    ASSERT_EQ(sheet({}).exit_code, 0);
    const std::string of_file = bytesOf(sheet_);
    const Outcome result =
        runPeeler({"sheet", scene_, "-o", sheet_, "--size", "96x64", "--precision", "float",
                   "--shading", "unlit", "--memory", "2G", "--methods", "none"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(bytesOf(sheet_), of_file);
}

TEST_F(SheetCommand, ProgressionComesNearer) {
    const Json json = cells({"--progression"});
    EXPECT_EQ(labels(json), (std::vector<std::string>{"1 layer", "2 layers", "3 layers", "4 layers",
                                                      "all 5 layers"}));
    // Red and alpha are 1 - 2^-5 in the composite and 1 - 2^-k with k layers; green and blue are 0.
    for (int k = 1; k <= 5; ++k) {
        const Json& cell = json.at("cells").at(static_cast<std::size_t>(k - 1));
        const double apart = std::exp2(-k) - std::exp2(-5);
        EXPECT_NEAR(cell.at("max"), apart, 1e-6) << k;
        EXPECT_NEAR(cell.at("rmse"), apart / std::sqrt(2), 1e-6) << k;
    }
    EXPECT_EQ(json.at("cells").at(0).at("detail"), "RMSE 0.33, 9.6 dB");
}

TEST_F(SheetCommand, TooManyCellsAreLeftOutAndSaidSo) {
    const Outcome result = sheet({"--cells", "3"});
    EXPECT_NE(result.err.find("3 cells of 6 left out; --cells 6 shows all"), std::string::npos)
        << result.err;
    EXPECT_EQ(labels(cells({"--cells", "3"})),
              (std::vector<std::string>{"composite", "layer 0", "layer 1"}));
    EXPECT_EQ(labels(cells({"--cells", "3", "--progression"})),
              (std::vector<std::string>{"1 layer", "2 layers", "all 5 layers"}));
    EXPECT_EQ(labels(cells({"--cells", "1", "--progression"})),
              (std::vector<std::string>{"all 5 layers"}));
}

TEST_F(SheetCommand, TheNearestLayersOnly) {
    const Json json = cells({"--layers", "2"});
    EXPECT_EQ(labels(json), (std::vector<std::string>{"composite", "layer 0", "layer 1"}));
    EXPECT_EQ(json.at("cells").at(0).at("detail"), "12,288 fragments");
    EXPECT_EQ(json.at("complete"), false);
}

TEST_F(SheetCommand, DepthIsWhiteNearAndDarkFar) {
    const Json json = cells({"--show", "depth", "--columns", "5"});
    ASSERT_EQ(json.at("cells").size(), 5U);
    EXPECT_EQ(json.at("cells").at(0).at("label"), "layer 0");
    EXPECT_EQ(json.at("cells").at(0).at("detail"), "Z 3-3.4, near white");
    const CompositeImage page = readFlatImage(sheet_).image;
    for (int layer = 0; layer < 5; ++layer) {
        const int x = 4 + layer * 100 + 48, y = page.window.height() - 30;
        const float value = page.rgba[static_cast<std::size_t>(y * page.window.width() + x)][0];
        EXPECT_NEAR(srgbFromLinear(value), 1 - 0.94 * layer / 4, 0.01) << layer;
    }
}

TEST_F(SheetCommand, ColumnsAndCellWidth) {
    const Json json = cells({"--columns", "6", "--cell-width", "48"});
    EXPECT_EQ(json.at("width"), 6 * 48 + 7 * 4);
    EXPECT_EQ(json.at("height"), 4 + 21 + 32 + 4);
}

TEST_F(SheetCommand, PlotsTheTransmittanceOfAThinnedFile) {
    const std::string thin = (scratch_ / "thin.exr").string();
    ASSERT_EQ(runPeeler({"convert", layers_, "-o", thin, "--as", "deep", "--deep-error", "1/8"})
                  .exit_code,
              0);
    const Outcome result =
        runPeeler({"sheet", thin, "-o", sheet_, "--against", layers_, "--columns", "3", "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json json = Json::parse(result.out);
    EXPECT_EQ(labels(json),
              (std::vector<std::string>{"original", "thinned", "transmittance over depth"}));
    EXPECT_EQ(json.at("cells").at(0).at("detail"), "30,720 samples");
    // The thinned curve, in orange, crosses the plot in every column within the margins.
    const CompositeImage page = readFlatImage(sheet_).image;
    int crossed = 0;
    for (int x = 2 * 100 + 4 + 6; x < 2 * 100 + 4 + 96 - 6; ++x) {
        bool orange = false;
        for (int y = 0; y < page.window.height(); ++y) {
            const auto& color = page.rgba[static_cast<std::size_t>(y * page.window.width() + x)];
            orange = orange || (color[0] > 0.5F && color[2] < 0.1F);
        }
        crossed += orange ? 1 : 0;
    }
    EXPECT_EQ(crossed, 96 - 12);
    EXPECT_EQ(sheet({"--against", layers_, "--layers", "1"}).exit_code, 2);
    EXPECT_EQ(runPeeler({"sheet", scene_, "-o", sheet_, "--against", layers_}).exit_code, 2);
}

TEST_F(SheetCommand, SaysWhatDoesNotGoTogether) {
    struct Row {
        std::vector<std::string> options;
        std::string part;
    };
    const Row rows[] = {{{"--fov", "30"}, "--fov"},
                        {{"--size", "10x10"}, "--size"},
                        {{"--method", "dual"}, "--method"},
                        {{"--clip-plane", "1,0,0,0"}, "--clip-plane"},
                        {{"--progression", "--show", "depth"}, "--progression"},
                        {{"--methods", "all"}, "--methods"},
                        {{"--tail", "blend"}, "--tail"},
                        {{"--show", "colour"}, "did you mean 'color'?"},
                        {{"--cells", "0"}, "--cells 0"},
                        {{"-o", (scratch_ / "sheet.exr").string()}, ".png"}};
    for (const Row& row : rows) {
        const Outcome result = sheet(row.options);
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_NE(result.err.find(row.part), std::string::npos) << result.err;
    }
    EXPECT_FALSE(fs::exists(sheet_));
    EXPECT_EQ(sheet({"--layers", "3", "--threads", "1"}).exit_code, 0);
    EXPECT_EQ(runPeeler({"sheet", sheet_, "-o", (scratch_ / "other.png").string()}).exit_code, 3);
}

/// Returns two half-transparent triangles that fill the picture. The nearer one is red and drawn
/// first.
nlohmann::json redBeforeGreen() {
    nlohmann::json scene = stackScene(2);
    scene["meshes"].push_back(scene["meshes"][0]);
    scene["meshes"][1]["primitives"][0]["material"] = 1;
    scene["materials"].push_back(scene["materials"][0]);
    scene["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"] = {0, 1, 0, 0.5};
    scene["nodes"][1]["mesh"] = 1;
    return scene;
}

class SheetOfAScene : public testing::Test {
  protected:
    Json cells(std::vector<std::string> more) const {
        std::vector<std::string> arguments{"sheet", scene_,      "-o",    sheet_,  "--size",
                                           "96x64", "--shading", "unlit", "--json"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return Json::parse(result.out).at("cells");
    }

    ScratchDir scratch_;
    std::string scene_ = writeScene(scratch_.path(), redBeforeGreen()).string();
    std::string sheet_ = (scratch_ / "sheet.png").string();
};

// Sorted, red is 1/2 and green 1/4. In draw order, green covers red: red is 1/4 and green 1/2.
// Two of the four channels have an error of 1/4.
constexpr double kUnsortedRmse = 0.25 / 1.41421356;

TEST_F(SheetOfAScene, ShowsUnsortedBlendingBesideTheComposite) {
    const Json all = cells({});
    ASSERT_EQ(all.size(), 4U);
    EXPECT_EQ(all.at(0).at("label"), "composite");
    EXPECT_EQ(all.at(1).at("label"), "plain blending");
    EXPECT_EQ(all.at(2).at("label"), "layer 0");
    EXPECT_NEAR(all.at(1).at("max"), 0.25, 1e-3);
    EXPECT_NEAR(all.at(1).at("rmse"), kUnsortedRmse, 1e-3);
    cells({"--background", "#000000"});
    const CompositeImage page = readFlatImage(sheet_).image;
    for (const int column : {0, 1}) {
        const int x = 4 + 100 * column + 48, y = 4 + 21 + 40;  // a point inside the two upper cells
        const auto& pixel = page.rgba[static_cast<std::size_t>(y * page.window.width() + x)];
        EXPECT_NEAR(pixel[0], column == 0 ? 0.5 : 0.25, 0.01);
        EXPECT_NEAR(pixel[1], column == 0 ? 0.25 : 0.5, 0.01);
    }
    EXPECT_EQ(cells({"--methods", "none"}).size(), 3U);
    EXPECT_EQ(cells({"--layers", "1"}).size(), 2U);
    // Any limit hides plain blending, even if it omits no fragments.
    EXPECT_EQ(cells({"--occlusion-ratio", "0.1"}).size(), 3U);
    EXPECT_EQ(cells({"--cells", "2"}).at(1).at("label"), "plain blending");
    EXPECT_EQ(cells({"--cells", "1"}).at(0).at("label"), "composite");
}

TEST_F(SheetOfAScene, ShowsWhatTheClipVolumeLeaves) {
    // The nearer triangle is at z = 0, the other at -0.1.
    const std::vector<std::string> behind{"--clip-plane", "0,0,-1,-0.05"};
    EXPECT_EQ(cells(behind).size(), 3U);  // the composite, plain blending and one layer
    auto of_methods = behind;
    of_methods.insert(of_methods.end(), {"--methods", "all"});
    for (const Json& cell : cells(of_methods))
        // All methods are exact for a single layer.
        EXPECT_LT(cell.value("max", 0.0), 1e-6) << cell;
    const auto refused = [&](const std::vector<std::string>& more) {
        std::vector<std::string> arguments{"sheet", scene_, "-o", sheet_};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_NE(result.err.find(more.front()), std::string::npos) << result.err;
    };
    refused({"--clip", "outside"});
    refused({"--clip-mesh", "nothing"});
}

TEST_F(SheetOfAScene, ComparesEveryMethod) {
    const Json all = cells({"--methods", "all"});
    const auto methods = peelMethods();
    ASSERT_EQ(all.size(), methods.size());
    for (std::size_t i = 0; i < methods.size(); ++i) {
        const Json& cell = all.at(i);
        EXPECT_TRUE(cell.at("label").get<std::string>().starts_with(methods[i].name));
        EXPECT_GE(cell.at("passes"), 1);
        if (i == 0) continue;  // cell 0 is the reference for the errors
        if (methods[i].exact()) {
            EXPECT_LT(cell.at("max"), 1e-6) << methods[i].name;
        } else if (methods[i].name == "moment-based") {
            EXPECT_LT(cell.at("max"), 0.01);  // four moments are nearly exact for two layers
        } else {
            EXPECT_GT(cell.at("max"), 0.1) << methods[i].name;
        }
        if (methods[i].name == "unsorted") {
            EXPECT_NEAR(cell.at("rmse"), kUnsortedRmse, 1e-6);
        }
    }
    EXPECT_EQ(cells({"--methods", "all", "--cells", "2"}).size(), 2U);
}

TEST_F(SheetOfAScene, OfSplatsHasOnlyMethodsThatShowThem) {
    writeFile(scratch_ / "one.ply", splatPly({knownSplat()}, 0));
    scene_ = (scratch_ / "one.ply").string();
    const Json layers = cells({});
    ASSERT_EQ(layers.size(), 2U);
    EXPECT_EQ(layers.at(1).at("label"), "layer 0");
    const Json methods = cells({"--methods", "all"});
    EXPECT_EQ(methods.size(),
              static_cast<std::size_t>(std::ranges::count_if(peelMethods(), &MethodInfo::exact)));
    for (const Json& cell : methods)
        EXPECT_LT(cell.value("max", 0.0), 1e-6) << cell;
}

TEST_F(SheetOfAScene, MethodsHaveNothingToDoWithLayersOrDepth) {
    for (const std::vector<std::string>& more : {std::vector<std::string>{"--progression"},
                                                 {"--show", "depth"},
                                                 {"--layers", "1"},
                                                 {"--occlusion-ratio", "0.1"}}) {
        std::vector<std::string> arguments{"sheet", scene_, "-o", sheet_, "--methods", "all"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_NE(result.err.find("--methods all"), std::string::npos) << result.err;
    }
}

TEST_F(SheetCommand, OfNothingIsOneEmptyCell) {
    const std::string scene =
        writeScene(scratch_.path(), Json::parse(R"({"asset": {"version": "2.0"}})")).string();
    for (const char* more : {"--progression", "--json"}) {
        const Outcome result = runPeeler({"sheet", scene, "-o", sheet_, more});
        EXPECT_EQ(result.exit_code, 0) << result.err;
    }
}

}  // namespace
}  // namespace peeler::test
