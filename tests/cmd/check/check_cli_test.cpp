// SPDX-License-Identifier: Apache-2.0
// Tests the verdict of peeler check for good parts, and for parts with one fault each.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "cmd/check/check_parts.h"
#include "cmd/check/part_report.h"
#include "cmd/check/places_scene.h"
#include "cmd/options/camera_options.h"
#include "cmd/tiny_gltf.h"
#include "core/scene/view.h"
#include "formats/image/flat_image.h"
#include "formats/image/legend.h"
#include "formats/meshes/scene_reader.h"
#include "formats/meshes/threemf_package.h"
#include "support/closed_meshes.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

using Json = nlohmann::json;

class CheckVerb : public testing::Test {
  protected:
    /// Writes a scene with these meshes in nodes "part 0", "part 1", … Returns the path.
    std::string write(const std::vector<Primitive>& meshes) {
        Json scene = {{"asset", {{"version", "2.0"}}}, {"scene", 0}};
        std::string buffer;
        const auto view = [&](const void* data, std::size_t bytes) {
            scene["bufferViews"].push_back(
                {{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", bytes}});
            buffer.append(static_cast<const char*>(data), bytes);
            return scene["bufferViews"].size() - 1;
        };
        for (std::size_t i = 0; i < meshes.size(); ++i) {
            const Primitive& mesh = meshes[i];
            glm::vec3 least = mesh.positions[0], most = least;
            for (const glm::vec3& p : mesh.positions) {
                least = glm::min(least, p);
                most = glm::max(most, p);
            }
            const auto positions =
                view(mesh.positions.data(), mesh.positions.size() * sizeof(glm::vec3));
            const auto indices = view(mesh.indices.data(), mesh.indices.size() * 4);
            scene["accessors"].push_back({{"bufferView", positions},
                                          {"componentType", 5126},
                                          {"count", mesh.positions.size()},
                                          {"type", "VEC3"},
                                          {"min", {least.x, least.y, least.z}},
                                          {"max", {most.x, most.y, most.z}}});
            scene["accessors"].push_back({{"bufferView", indices},
                                          {"componentType", 5125},
                                          {"count", mesh.indices.size()},
                                          {"type", "SCALAR"}});
            scene["meshes"].push_back(
                {{"primitives",
                  {{{"attributes", {{"POSITION", 2 * i}}}, {"indices", 2 * i + 1}}}}});
            scene["nodes"].push_back({{"mesh", i}, {"name", "part " + std::to_string(i)}});
            scene["scenes"][0]["nodes"].push_back(i);
        }
        scene["buffers"].push_back({{"byteLength", buffer.size()}});
        writeText(dir_ / "part.glb", glb(scene, buffer));
        return (dir_ / "part.glb").string();
    }

    static Outcome check(const std::string& scene, const std::vector<std::string>& more = {}) {
        std::vector<std::string> arguments{"check", scene};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runPeeler(arguments);
    }

    /// Returns the JSON result of a check, and expects this exit code.
    static Json json(const std::string& scene, int code, std::vector<std::string> more = {}) {
        more.push_back("--json");
        const Outcome run = check(scene, more);
        EXPECT_EQ(run.exit_code, code) << run.err;
        return Json::parse(run.out);
    }

    static std::string onlyProblem(const Json& result, std::size_t part = 0) {
        const Json& problems = result.at("parts").at(part).at("problems");
        return problems.size() == 1 ? problems[0].at("kind").get<std::string>() : problems.dump();
    }

    ScratchDir dir_;
};

Primitive inwards(Primitive mesh) {
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        std::swap(mesh.indices[i], mesh.indices[i + 1]);
    return mesh;
}

Primitive together(Primitive a, const Primitive& b) {
    const auto before = static_cast<std::uint32_t>(a.positions.size());
    a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
    for (const std::uint32_t index : b.indices)
        a.indices.push_back(before + index);
    return a;
}

TEST_F(CheckVerb, ProgressGrowsToTheEnd) {
    const std::string scene = write({torus(0.3, 300, 100)});
    const Outcome run = check(scene, {"--progress", "json"});
    std::vector<double> shares;
    std::istringstream text(run.err);
    for (std::string line; std::getline(text, line);)
        if (line.starts_with('{')) shares.push_back(Json::parse(line).at("progress"));
    ASSERT_GT(shares.size(), 3U) << run.err;
    EXPECT_TRUE(std::ranges::is_sorted(shares)) << run.err;
    EXPECT_EQ(shares.back(), 1.0);
}

TEST_F(CheckVerb, ACubeIsGoodToPrint) {
    const std::string scene = write({cube()});
    const Outcome text = check(scene);
    EXPECT_EQ(text.exit_code, 0);
    EXPECT_TRUE(contains(text.out, "part.glb: good to print\n")) << text.out;
    EXPECT_TRUE(contains(text.out, "closed, manifold, facing outwards, no crossings"));
    EXPECT_TRUE(contains(text.out, "thinnest wall  2000 mm, from ")) << text.out;
    EXPECT_FALSE(contains(text.err, "error")) << text.err;
    const Json result = json(scene, 0);
    EXPECT_EQ(result.at("verdict"), "good");
    EXPECT_DOUBLE_EQ(result.at("volume"), 8);
    EXPECT_DOUBLE_EQ(result.at("unionVolume"), 8);
    const Json& part = result.at("parts").at(0);
    EXPECT_EQ(part.at("node"), "part 0");
    EXPECT_EQ(part.at("shells"), 1);
    EXPECT_DOUBLE_EQ(part.at("area"), 24);
    EXPECT_EQ(part.at("bounds").at("max"), (Json{1.0, 1.0, 1.0}));
    EXPECT_DOUBLE_EQ(part.at("thinnestWall").at("thickness"), 2);
}

TEST_F(CheckVerb, EveryDefectIsNamed) {
    Primitive open = cube(), flipped = cube();
    open.indices.resize(33);
    std::swap(flipped.indices[3], flipped.indices[4]);
    const Json hole = json(write({open}), 3);
    EXPECT_EQ(onlyProblem(hole), "openEdges");
    EXPECT_EQ(hole.at("parts")[0].at("openEdges"), 3);
    EXPECT_EQ(hole.at("parts")[0].at("holes"), 1);
    EXPECT_TRUE(hole.at("volume").is_null());
    EXPECT_EQ(onlyProblem(json(write({flipped}), 3)), "flippedTriangles");
    EXPECT_EQ(onlyProblem(json(write({inwards(cube())}), 3)), "insideOutShells");
    const Json overlap = json(write({together(cube(), placed(cube(), 1, {1, 1, 1}))}), 3);
    EXPECT_EQ(onlyProblem(overlap), "overlaps");
    EXPECT_NEAR(overlap.at("volume").get<double>(), 16, 1e-9);
    EXPECT_NEAR(overlap.at("unionVolume").get<double>(), 15, 1e-9);
    EXPECT_EQ(onlyProblem(json(write({together(cube(), placed(cube(), 1, {2, 2, 0}))}), 3)),
              "nonManifoldEdges");
    const Json cavity = json(write({together(cube(), inwards(placed(cube(), 0.5F, {})))}), 0);
    EXPECT_EQ(cavity.at("parts")[0].at("cavities"), 1);
    EXPECT_DOUBLE_EQ(cavity.at("volume"), 7);
    const Outcome text = check(write({open}));
    EXPECT_TRUE(contains(text.out, "3 edges are open, around 1 hole, one at (")) << text.out;
    EXPECT_TRUE(contains(text.err, "peeler: error: not printable as it is")) << text.err;
}

TEST_F(CheckVerb, AThinWallIsAProblemIfItIsAskedFor) {
    const std::string scene = (sourceDir() / "examples" / "scenes" / "bracket.glb").string();
    const Json wall = json(scene, 0, {"--min-wall", "1.19"}).at("thinnestWall");
    EXPECT_NEAR(wall.at("thickness").get<double>(), 0.0012, 1e-9);
    // The thinnest wall, above the bracket's window, is between z = -18.8 and -20 mm.
    EXPECT_NEAR(wall.at("from")[2].get<double>() + wall.at("to")[2].get<double>(), -0.0388, 1e-8);
    EXPECT_EQ(onlyProblem(json(scene, 3, {"--min-wall", "1.21"})), "thinWalls");
    // With --unit mm, the thickness of 0.0012 units is 0.0012 mm.
    EXPECT_EQ(json(scene, 3, {"--min-wall", "0.0013", "--unit", "mm"}).at("metresPerUnit"), 0.001);
    EXPECT_EQ(check(scene, {"--min-wall", "0.0011", "--unit", "mm"}).exit_code, 0);
}

TEST_F(CheckVerb, AWallOfExactlyTheLeastIsGood) {
    // A cube of 10 mm, whose thickness is slightly less because of rounding.
    const std::string ten = write({placed(cube(), 0.005F, {0.3F, 0.1F, 0.7F})});
    EXPECT_EQ(json(ten, 0, {"--min-wall", "10"}).at("verdict"), "good");
    EXPECT_EQ(onlyProblem(json(ten, 3, {"--min-wall", "10.002"})), "thinWalls");
    const std::string bracket = (sourceDir() / "examples" / "scenes" / "bracket.glb").string();
    EXPECT_EQ(check(bracket, {"--min-wall", "1.2"}).exit_code, 0);
    EXPECT_EQ(check(bracket, {"--min-wall", "1.2002"}).exit_code, 3);
}

TEST_F(CheckVerb, ABodyWithoutVolumeIsNotGood) {
    Primitive sheet;
    sheet.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    sheet.indices = {0, 1, 2, 0, 2, 1};
    const Json alone = json(write({sheet}), 3);
    EXPECT_EQ(onlyProblem(alone), "flatShells");
    EXPECT_EQ(alone.at("parts")[0].at("flatShells"), 1);
    const Outcome beside = check(write({together(cube(), placed(sheet, 1, {3, 0, 0}))}));
    EXPECT_EQ(beside.exit_code, 3);
    EXPECT_TRUE(contains(beside.out, "1 shell has no volume, at (")) << beside.out;
}

TEST_F(CheckVerb, AWallThatACrossingCutsIsNotTheThinnestWall) {
    // A flat cavity, from 0.62 to 1.02 high, breaks through the top of a plate, from -1 to 1 high.
    // At the edge of the hole, the wall between cavity and top gets arbitrarily thin.
    Primitive plate = cube();
    for (glm::vec3& p : plate.positions)
        p *= glm::vec3(5, 1, 5);
    Primitive cavity = inwards(icosphere(3));
    for (glm::vec3& p : cavity.positions)
        p = p * glm::vec3(2, 0.2F, 2) + glm::vec3(0.1F, 0.82F, 0.2F);
    const std::string scene = write({together(plate, cavity)});
    const Json result = json(scene, 3);
    const Json& part = result.at("parts")[0];
    EXPECT_NEAR(part.at("thinnestWall").at("thickness").get<double>(), 1.62, 0.02) << part;
    EXPECT_EQ(part.at("thinnestWall").at("crossed"), false);
    EXPECT_LT(part.at("crossedWall").at("thickness").get<double>(), 1e-3);
    EXPECT_EQ(part.at("crossedWall").at("crossed"), true);
    EXPECT_EQ(result.at("thinnestWall").at("thickness"), part.at("thinnestWall").at("thickness"));
    const std::string text = check(scene).out;
    EXPECT_TRUE(contains(text, "\n  thinnest wall  16")) << text;
    EXPECT_TRUE(contains(text, "\n  crossed wall   ")) << text;
    EXPECT_TRUE(json(write({cube()}), 0).at("parts")[0].at("crossedWall").is_null());
    EXPECT_FALSE(contains(check(write({cube()})).out, "crossed wall"));
}

TEST_F(CheckVerb, TextsHaveOneUnit) {
    const std::string bracket = (sourceDir() / "examples" / "scenes" / "bracket.glb").string();
    const std::string mm = check(bracket).out;
    EXPECT_TRUE(contains(mm, "  size           60 x 6 x 40 mm\n")) << mm;
    EXPECT_TRUE(contains(mm, "  thinnest wall  1.2 mm, from (4.66667, 2, -18.8) to ")) << mm;
    EXPECT_FALSE(contains(mm, " m)")) << mm;
    const std::string metres = check(bracket, {"--unit", "m"}).out;
    EXPECT_TRUE(contains(metres, "  size           0.06 x 0.006 x 0.04 m\n")) << metres;
    EXPECT_TRUE(contains(metres, " 0.0012 m, from (0.00466667, 0.002, -0.0188) to ")) << metres;
    EXPECT_FALSE(contains(metres, "mm")) << metres;
    EXPECT_TRUE(contains(check(bracket, {"--unit", "0.002"}).out, " 0.12 x 0.012 x 0.08 mm\n"));
    EXPECT_TRUE(contains(check(write({cube()}), {"--unit", "cm"}).out, "volume         8 cm3\n"));
}

/// Returns the text of an STL with the cube's triangles, from 0 to 10. Odd triangles are moved by
/// `offset`.
std::string noisyStl(double offset) {
    const Primitive mesh = cube();
    std::string text = "solid box\n";
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
        if (i % 3 == 0) text += "facet normal 0 0 0\nouter loop\n";
        text += "vertex";
        for (int axis = 0; axis < 3; ++axis)
            text += ' ' + std::to_string(5 * (1 + double(mesh.positions[mesh.indices[i]][axis])) +
                                         (i / 3 % 2 == 1 ? offset : 0));
        text += i % 3 == 2 ? "\nendloop\nendfacet\n" : "\n";
    }
    return text + "endsolid box\n";
}

TEST_F(CheckVerb, TheUnitOfA3mfIsItsOwn) {
    const std::string box = (dir_ / "box.3mf").string();
    writeText(box, threeMfOf(threeMfModel(threeMfObject(threeMfBox(1, 2, 30)),
                                          "<item objectid=\"1\"/>", "inch")));
    EXPECT_TRUE(contains(check(box).out, "  size           25.4 x 762 x 50.8 mm\n"));
    EXPECT_EQ(check(box).err, "");
    EXPECT_TRUE(contains(check(box, {"--unit", "inch"}).out, "  size           1 x 30 x 2 inch\n"));
    EXPECT_EQ(json(box, 0, {"--unit", "mm"}).at("metresPerUnit"), 1);
    EXPECT_EQ(check(box, {"--unit", "mm", "--min-wall", "25"}).exit_code, 0);
    EXPECT_EQ(check(box, {"--unit", "mm", "--min-wall", "26"}).exit_code, 3);
    // A mirrored part faces outwards.
    const std::string mirrored = "<item objectid=\"1\" transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\"/>";
    writeText(box, threeMfOf(threeMfModel(threeMfObject(threeMfBox(1, 2, 3)), mirrored)));
    EXPECT_EQ(json(box, 0).at("parts")[0].at("oriented"), true);
    EXPECT_NEAR(json(box, 0).at("volume").get<double>(), 6e-9, 1e-15);
    // 20 metres: too large for a printer, but the unit is certain.
    writeText(box, threeMfOf(threeMfModel(threeMfObject(threeMfBox(20, 20, 20)),
                                          "<item objectid=\"1\"/>", "meter")));
    EXPECT_FALSE(contains(check(box).err, "give --unit mm"));
}

TEST_F(CheckVerb, AnStlWithNoiseIsWelded) {
    const std::string stl = (dir_ / "box.stl").string();
    const std::vector<std::string> mm{"--unit", "mm"};
    writeText(stl, noisyStl(1e-6));
    const Json box = json(stl, 0, mm).at("parts")[0];
    EXPECT_EQ(box.at("closed"), true);
    EXPECT_NEAR(box.at("volume").get<double>(), 1000, 0.01);
    EXPECT_NEAR(box.at("weldTolerance").get<double>(), 1e-6 * std::sqrt(300), 1e-9);
    EXPECT_GT(box.at("weldedPoints").get<int>(), 0);
    EXPECT_TRUE(contains(check(stl, mm).out, "\n  welded         ")) << check(stl, mm).out;
    EXPECT_EQ(json(stl, 3, {"--unit", "mm", "--weld", "0"}).at("parts")[0].at("closed"), false);
    EXPECT_EQ(json(stl, 0, mm).at("metresPerUnit"), 0.001);
    // The box is 10 metres large.
    const std::string assumed = "if the file is in millimetres, give --unit mm";
    EXPECT_TRUE(contains(check(stl).err, assumed)) << check(stl).err;
    EXPECT_FALSE(contains(check(stl, mm).err, assumed));
    // --weld is in millimetres, whatever the unit of the scene.
    writeText(stl, noisyStl(0.01));
    EXPECT_EQ(json(stl, 3, mm).at("parts")[0].at("weldedPoints"), 0);
    EXPECT_EQ(json(stl, 0, {"--unit", "mm", "--weld", "0.02"}).at("parts")[0].at("closed"), true);
    EXPECT_EQ(json(stl, 3, {"--unit", "m", "--weld", "0.02"}).at("parts")[0].at("closed"), false);
    EXPECT_EQ(json(stl, 0, {"--unit", "m", "--weld", "20"}).at("parts")[0].at("closed"), true);
    EXPECT_EQ(check(stl, {"--weld", "-1"}).exit_code, 2);
    // Closed parts are not welded.
    const std::string closed = write({cube()});
    EXPECT_EQ(json(closed, 0, {"--weld", "5000"}).at("parts")[0].at("weldedPoints"), 0);
    EXPECT_FALSE(contains(check(closed).out, "welded"));
}

/// Returns tetrahedra with random corners inside a cube.
Primitive soup(unsigned tetrahedra) {
    std::mt19937 random(7);
    const auto coordinate = [&] { return float(random() % 65536) / 65536; };
    Primitive soup;
    for (std::uint32_t i = 0; i < 4 * tetrahedra; i += 4) {
        std::array<glm::vec3, 4> p{};
        for (glm::vec3& corner : p)
            corner = {coordinate(), coordinate(), coordinate()};
        soup.positions.insert(soup.positions.end(), p.begin(), p.end());
        const bool inwards = glm::dot(glm::cross(p[1] - p[0], p[2] - p[0]), p[3] - p[0]) < 0;
        for (auto [a, b, c] : {std::array{0U, 2U, 1U}, {0U, 1U, 3U}, {1U, 2U, 3U}, {0U, 3U, 2U}}) {
            if (inwards) std::swap(b, c);
            soup.indices.insert(soup.indices.end(), {i + a, i + b, i + c});
        }
    }
    return soup;
}

TEST_F(CheckVerb, WhatCrossesEverywhereEndsAndSaysWhatIsNotDetermined) {
    // The first part has too many crossing pairs to count.
    const std::string report = (dir_ / "report.json").string();
    const Outcome text =
        check(write({soup(1000), cube()}), {"--min-wall", "1", "--report", report});
    EXPECT_EQ(text.exit_code, 3);
    EXPECT_TRUE(contains(text.out, "facing outwards, at least ")) << text.out;
    EXPECT_TRUE(contains(text.out, "the union not determined: at least ")) << text.out;
    EXPECT_TRUE(contains(text.out, "shells overlap in at least "));
    EXPECT_TRUE(contains(text.out, "volume         not determined: too many crossings\n"));
    const Json result = Json::parse(bytesOf(report));
    EXPECT_TRUE(result.at("volume").is_null());
    const Json& part = result.at("parts")[0];
    EXPECT_EQ(part.at("moreCrossings"), true);
    EXPECT_TRUE(part.at("volume").is_number());
    EXPECT_TRUE(part.at("unionVolume").is_null());
    EXPECT_TRUE(part.at("thinnestWall").is_null());
    EXPECT_EQ(part.at("thinnestWallCertain"), false);
    EXPECT_EQ(part.at("problems").back().at("kind"), "uncertainWall");
    EXPECT_EQ(result.at("parts")[1].at("verdict"), "good");
    // All pairs are counted, but unionVolume() reaches its step limit.
    const Json less = json(write({soup(300)}), 3).at("parts")[0];
    EXPECT_EQ(less.at("moreCrossings"), false);
    EXPECT_TRUE(less.at("unionVolume").is_null());
}

TEST_F(CheckVerb, ASpikeBesideWhichEverythingTouchesIsNotGood) {
    // The tolerance, a millionth of the spike's length, is larger than the rest of the part.
    Primitive spike = icosphere(5);
    for (int level = 0; level < 3; ++level)
        spike = together(spike, placed(spike, 1, {2.5F, 0, 0}));
    spike.positions[0] = {0, 1e9F, 0};
    const Outcome text = check(write({spike}));
    EXPECT_EQ(text.exit_code, 3);
    EXPECT_TRUE(contains(text.err, "too many triangles touch or cross to compare all")) << text.err;
    EXPECT_TRUE(contains(text.out, "not determined: ")) << text.out;
}

TEST_F(CheckVerb, PartsAreCheckedOneByOneOrTogether) {
    const std::string scene = write({cube(), placed(cube(), 1, {1, 0, 0})});
    const Json apart = json(scene, 0);
    EXPECT_EQ(apart.at("parts").size(), 2U);
    ASSERT_EQ(apart.at("partOverlaps").size(), 1U);
    EXPECT_EQ(apart.at("partOverlaps")[0].at("parts"), (Json{0, 1}));
    EXPECT_NEAR(apart.at("volume").get<double>(), 16, 1e-9);
    EXPECT_NEAR(apart.at("unionVolume").get<double>(), 12, 1e-9);
    EXPECT_NE(onlyProblem(json(scene, 3, {"--together"})), "");
    Primitive lower = cube(), upper = cube();
    lower.indices.resize(18);
    upper.indices.erase(upper.indices.begin(), upper.indices.begin() + 18);
    const std::string halves = write({lower, upper});
    EXPECT_EQ(json(halves, 3).at("parts")[1].at("closed"), false);
    EXPECT_EQ(json(halves, 0, {"--together"}).at("parts").size(), 1U);
    EXPECT_EQ(json(halves, 3, {"--include", "part 1"}).at("parts").size(), 1U);
}

TEST_F(CheckVerb, ThePictureMarksThePlaces) {
    Primitive open = cube();
    open.indices.resize(33);
    const std::string bad = write({open}), picture = (dir_ / "places.png").string();
    const Outcome run = check(bad, {"-o", picture, "--size", "160x90", "--json"});
    EXPECT_EQ(run.exit_code, 3) << run.err;
    EXPECT_EQ(Json::parse(run.out).at("output"), picture);
    const CompositeImage image = readFlatImage(picture).image;
    EXPECT_GE(image.window.width(), 160);
    EXPECT_GT(image.window.height(), 90);
    std::size_t red = 0, blue = 0;
    for (std::size_t i = 0; i < 90 * std::size_t(image.window.width()); ++i) {
        const auto [r, g, b, a] = image.rgba[i];
        red += r > 0.4F && g < 0.3F * r && b < 0.3F * r ? 1 : 0;
        blue += b > 0.4F && g < 0.7F * b && r < 0.5F * b ? 1 : 0;
    }
    EXPECT_GT(red, 60U) << "open edges, not only their middles";
    EXPECT_GT(blue, 5U) << "the thinnest wall";
}

TEST_F(CheckVerb, ThePictureShowsCrossingsAsLines) {
    // Boxes of 10 units cross along six segments of 5 units, between the common box's corners.
    const std::string scene = write({together(placed(cube(), 5, {5, 5, 5}),  //
                                              placed(cube(), 5, {10, 10, 10}))});
    const std::string picture = (dir_ / "places.png").string();
    const Outcome run = check(scene, {"-o", picture, "--size", "640x360", "--json"});
    const Json part = Json::parse(run.out).at("parts")[0];
    EXPECT_NEAR(part.at("crossingLength").get<double>(), 30, 1e-5);
    const glm::dvec3 corners[] = {{10, 5, 5},  {10, 10, 5}, {5, 10, 5},
                                  {5, 10, 10}, {5, 5, 10},  {10, 5, 10}};
    const auto offCurve = [&](const glm::dvec3& p) {
        double least = 1e9;
        for (std::size_t i = 0; i < 6; ++i) {
            const glm::dvec3 a = corners[i], b = corners[(i + 1) % 6];
            const double t = std::clamp(glm::dot(p - a, b - a) / 25, 0.0, 1.0);
            least = std::min(least, glm::distance(p, glm::mix(a, b, t)));
        }
        return least;
    };
    const Json& place = part.at("problems")[0].at("places")[0];
    EXPECT_LT(offCurve({place[0], place[1], place[2]}), 1e-5) << place;

    const Scene read = readSceneFile(scene);
    const cmd::CheckReport report = cmd::checkParts(PosedScene(read), {}, [](double) {});
    const Scene places = cmd::placesScene(report);
    const PosedScene posed(places);
    cmd::CameraOptions camera;
    camera.size = {640, 360};
    const View view = cmd::makeView(posed, SceneExtent(posed), camera);
    const glm::dmat4 to_camera = glm::inverse(view.camera_to_world);
    const CompositeImage image = readFlatImage(picture).image;
    const auto yellow = [&](const glm::dvec3& p) {
        const glm::dvec2 at = PixelRays(view).pixel(glm::dvec3(to_camera * glm::dvec4(p, 1)));
        const auto [r, g, b, a] =
            image.rgba[std::size_t(at.y) * std::size_t(image.window.width()) + std::size_t(at.x)];
        return b < 0.4F * std::min(r, g);
    };
    for (std::size_t i = 0; i < 6; ++i)
        for (const double t : {0.1, 0.3, 0.5, 0.7, 0.9})
            EXPECT_TRUE(yellow(glm::mix(corners[i], corners[(i + 1) % 6], t))) << i << ' ' << t;
    for (const glm::dvec3& p : {glm::dvec3(0, 5, 5), {2, 2, 10}, {10, 7, 7}, {15, 10, 13}})
        EXPECT_FALSE(yellow(p)) << p.x << ' ' << p.y << ' ' << p.z;
    EXPECT_EQ(cmd::placesLegend(report)[1].text, "crossings");
}

TEST_F(CheckVerb, ThePictureShowsOverlapsInOnePlaneAsTriangles) {
    const std::string scene = write({together(cube(), placed(cube(), 1, {0.5F, 0.25F, 0}))});
    const Scene read = readSceneFile(scene);
    const cmd::CheckReport report = cmd::checkParts(PosedScene(read), {}, [](double) {});
    EXPECT_EQ(cmd::placesLegend(report)[1].text, "crossing or overlapping");
    const Scene places = cmd::placesScene(report);
    EXPECT_TRUE(std::ranges::any_of(places.meshes[0].primitives, [&](const Primitive& p) {
        return p.topology == Topology::kTriangles &&
               std::ranges::count(p.positions, glm::vec3(1)) &&
               places.materials[std::size_t(p.material)].alpha_mode == AlphaMode::kOpaque;
    })) << "the triangles at a corner of the common plane";
}

TEST_F(CheckVerb, WhatIsNoPartIsRefused) {
    EXPECT_EQ(check((dir_ / "missing.glb").string()).exit_code, 3);
    const std::string scene = write({cube()});
    EXPECT_EQ(check(scene, {"--min-wall", "0"}).exit_code, 2);
    EXPECT_EQ(check(scene, {"--unit", "miles"}).exit_code, 2);
    EXPECT_EQ(check(scene, {"-o", scene}).exit_code, 2);
    EXPECT_EQ(check(scene, {"-o", (dir_ / "places.ply").string()}).exit_code, 2);
}

/// Each of these sample models is a single closed box.
TEST_F(CheckVerb, SampleModels) {
    PEELER_REQUIRE_ASSETS(assets);
    for (const char* name : {"Box", "BoxTextured"}) {
        const auto scene =
            assets / "gltf-sample-assets" / name / "glTF-Binary" / (std::string(name) + ".glb");
        const Json result = json(scene.string(), 0);
        EXPECT_NEAR(result.at("volume").get<double>(), 1, 1e-6) << name;
        EXPECT_NEAR(result.at("thinnestWall").at("thickness").get<double>(), 1, 1e-6) << name;
    }
}

}  // namespace
}  // namespace peeler::test
