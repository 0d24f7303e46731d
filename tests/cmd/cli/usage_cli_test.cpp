// SPDX-License-Identifier: Apache-2.0
// Tests the command line itself: help, versions, and errors reported before any work.
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "cmd/cli/arguments.h"
#include "cmd/tiny_gltf.h"
#include "cmd/verbs.h"
#include "formats/writers.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

TEST(Help, ListsEveryVerbWithItsSummary) {
    const Outcome result = runPeeler({"--help"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    for (const cmd::Verb& verb : cmd::verbs()) {
        EXPECT_TRUE(contains(result.out, std::string(verb.name))) << verb.name;
        EXPECT_TRUE(contains(result.out, std::string(verb.summary))) << verb.name;
    }
}

TEST(Help, OfEveryVerbFitsATerminal) {
    for (const cmd::Verb& verb : cmd::verbs()) {
        const Outcome result = runPeeler({std::string(verb.name), "--help", "all"});
        EXPECT_EQ(result.exit_code, 0) << verb.name;
        EXPECT_EQ(result.err, "") << verb.name;
        EXPECT_TRUE(contains(result.out, std::string(verb.summary))) << result.out;
        // batch and worker always print their results as JSON lines.
        const bool lines = verb.name == "batch" || verb.name == "worker";
        const char* const form = lines ? "JSON line" : "--json";
        EXPECT_TRUE(contains(result.out, form)) << result.out;
        for (std::size_t at = 0, end; at < result.out.size(); at = end + 1) {
            end = result.out.find('\n', at);
            ASSERT_NE(end, std::string::npos) << "the last line does not end";
            EXPECT_LE(end - at, 100U) << result.out.substr(at, end - at);
        }
    }
}

TEST(Help, ListsTheChoicesOfTheTables) {
    const std::string help = runPeeler({"render", "--help", "all"}).out;
    for (const char* part :
         {"a-buffer (default)", "front-to-back", "visible", "transparent", "unlit", "osmesa",
          "Camera:", "Picture:", "Layers:", "Output:", "Machine:", "Messages:"}) {
        EXPECT_TRUE(contains(help, part)) << part;
    }
}

TEST(Help, IsAVerbToo) {
    EXPECT_EQ(runPeeler({"help"}).out, runPeeler({"--help"}).out);
    EXPECT_EQ(runPeeler({"help", "render"}).out, runPeeler({"render", "--help"}).out);
    EXPECT_EQ(runPeeler({"help", "render", "all"}).out, runPeeler({"render", "-h", "all"}).out);
    EXPECT_EQ(runPeeler({"help", "rendre"}).exit_code, 2);
}

TEST(Help, BeginsWithThreeExamples) {
    for (const cmd::Verb& verb : cmd::verbs()) {
        const std::string help = runPeeler({std::string(verb.name), "--help", "all"}).out;
        EXPECT_EQ(std::ranges::count(verb.examples, '\n'), 2) << verb.name;
        const std::size_t first = help.find("Examples:\n  " + std::string(verb.examples, 0, 10));
        EXPECT_LT(first, help.find("Usage:")) << help;
        EXPECT_TRUE(contains(std::string(verb.examples), "peeler " + std::string(verb.name)));
    }
}

TEST(Help, IsShortUnlessAllIsAskedFor) {
    for (const cmd::Verb& verb : cmd::verbs()) {
        const std::string name(verb.name);
        const std::string some = runPeeler({name, "--help"}).out;
        const std::string all = runPeeler({name, "--help", "all"}).out;
        EXPECT_EQ(runPeeler({"help", name}).out, some);
        if (verb.common.empty()) {
            EXPECT_EQ(some, all);
            continue;
        }
        std::istringstream words{std::string(verb.common)};
        std::size_t count = 0;
        for (std::string word; words >> word; ++count)
            EXPECT_TRUE(contains(some, "--" + word + ' ') || contains(some, "--" + word + '\n'))
                << some;
        EXPECT_LE(count, 13U) << name;
        EXPECT_EQ(std::ranges::count(some, '\n') < std::ranges::count(all, '\n'), true) << name;
        EXPECT_FALSE(contains(some, "--verbose")) << some;
        EXPECT_TRUE(contains(some, "`peeler " + name + " --help all` shows all ")) << some;
        const std::string last = std::string(verb.examples.substr(verb.examples.rfind('\n') + 1));
        EXPECT_FALSE(contains(some, last)) << some;
        EXPECT_TRUE(contains(all, last)) << all;
    }
}

TEST(Help, SaysWhatKindsOfOutputAre) {
    const std::string help = runPeeler({"render", "--help"}).out;
    for (const OutputFormat& format : outputFormats())
        EXPECT_TRUE(contains(help, std::string(format.kind) + ": ")) << format.kind;
}

TEST(Version, IsOneLineOnStdout) {
    EXPECT_EQ(runPeeler({"-V"}).out, runPeeler({"--version"}).out);
    const Outcome result = runPeeler({"--version"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_TRUE(
        std::regex_match(result.out, std::regex(R"(peeler \d+\.\d+\.\d+( \([0-9a-f]{10,}\))?\n)")))
        << result.out;
    EXPECT_EQ(result.out.find('\n'), result.out.size() - 1);
    EXPECT_EQ(result.err, "");
}

TEST(Usage, NoVerbShowsTheHelpOnStderr) {
    const Outcome result = runPeeler({});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.out, "");
    EXPECT_TRUE(contains(result.err, "render"));
    EXPECT_TRUE(contains(result.err, "peeler: error: no verb given"));
}

/// A rejected command line, and texts that its message must contain.
struct Refused {
    std::vector<std::string> arguments;  ///< SCENE and OUT are replaced by paths
    std::vector<std::string> parts;
};

class Refusals : public testing::TestWithParam<Refused> {};

TEST_P(Refusals, SayWhatWhereAndWhatToTry) {
    const ScratchDir scratch;
    const fs::path out = scratch / "out";
    fs::create_directory(out);
    const fs::path scene = writeScene(scratch.path(), stackScene(2));
    std::vector<std::string> arguments = GetParam().arguments;
    for (std::string& argument : arguments) {
        if (argument == "SCENE") argument = scene.string();
        if (argument.starts_with("OUT/")) argument = out.string() + argument.substr(3);
    }
    const Outcome result = runPeeler(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_TRUE(result.err.starts_with("peeler: error: ")) << result.err;
    for (const std::string& part : GetParam().parts) {
        EXPECT_TRUE(contains(result.err, part)) << "no \"" << part << "\" in\n" << result.err;
    }
    EXPECT_TRUE(fs::is_empty(out));
}

/// Returns the command line `peeler render SCENE -o OUT/a.exr` with these options.
Refused refusedRender(std::vector<std::string> options, std::vector<std::string> parts) {
    std::vector<std::string> arguments{"render", "SCENE", "-o", "OUT/a.exr"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return {arguments, std::move(parts)};
}

INSTANTIATE_TEST_SUITE_P(
    Names, Refusals,
    testing::Values(
        Refused{{"rendre"}, {"unknown verb: rendre", "did you mean 'render'?"}},
        Refused{{"model.glb"},
                {"no verb given: model.glb", "peeler render model.glb -o model.png"}},
        Refused{{"-o", "OUT/a.png", "in/part.STL"}, {"peeler render in/part.STL -o part.png"}},
        Refused{{"layers.exr"}, {"peeler flatten layers.exr -o layers.png"}},
        refusedRender({"--metod", "x"}, {"unknown option: --metod", "did you mean '--method'?"}),
        refusedRender({"--size"}, {"the option needs a value: --size", "see peeler render --help"}),
        refusedRender({"--shadows=maybe"}, {"the option takes no value: --shadows=maybe"}),
        refusedRender({"--tail", "bled"},
                      {"unknown choice of tail 'bled'", "the choices of tail are: drop, blend"}),
        refusedRender({"extra.gltf"}, {"would have the same file name", "put {stem}"}),
        Refused{{"flatten", "a.exr", "b.exr", "-o", "OUT/a.png"},
                {"unexpected argument: b.exr", "see peeler flatten --help"}},
        Refused{{"bake", "SCENE", "-o", "OUT/a.glb", "--quantity", "lihgt"},
                {"unknown quantity 'lihgt'", "the quantities are: ao"}},
        refusedRender({"--method", "a-bufer"},
                      {"unknown method 'a-bufer'", "--method a-bufer", "did you mean 'a-buffer'?",
                       "a-buffer, front-to-back"}),
        refusedRender({"--camera", "fornt"},
                      {"unknown camera: --camera fornt", "did you mean 'front'?"}),
        refusedRender({"--camera", "7"}, {"unknown camera: --camera 7", "an index from 0 to 0"}),
        refusedRender({"--scene", "other"}, {"unknown scene: --scene other"}),
        refusedRender({"--camera", "light:kye"},
                      {"unknown light: --camera light:kye", "did you mean 'light:key'?",
                       "from light:0 to light:0"}),
        refusedRender({"--surfaces", "visble"}, {"did you mean 'visible'?"}),
        refusedRender({"--faces", "sides"}, {"gltf, front, back, both"}),
        refusedRender({"--backend", "eglo"}, {"did you mean 'egl'?", "auto, egl, osmesa"}),
        refusedRender({"--as", "png"}, {"--as png", "ldi, deep, composite"})));

INSTANTIATE_TEST_SUITE_P(
    Values, Refusals,
    testing::Values(
        refusedRender({"--size", "0x100"},
                      {"--size 0x100", "from 1 to 65536", "see peeler render --help"}),
        Refused{{"rays", "SCENE", "-o", "OUT/a.npz", "--resolution", "many"},
                {"--resolution many", "see peeler rays --help"}},
        refusedRender({"--as", "ldi", "--no-composite", "--cryptomatte"},
                      {"leave --no-composite out"}),
        refusedRender({"--size", "-5x100"}, {"--size -5x100"}),
        refusedRender({"--size", "99999999999x2"}, {"--size 99999999999x2"}),
        refusedRender({"--size", "65536x65536"}, {"more than 1073741824 pixels"}),
        refusedRender({"--size", "big"}, {"--size big"}),
        refusedRender({"--size", "100,100"}, {"--size 100,100", "such as 1280x720"}),
        refusedRender({"--channels", "normal,depth"}, {"A and Z (depth) already: 'depth'"}),
        refusedRender({"-o", "OUT/b.png"}, {"one output: --output ", "a.exr, --output "}),
        refusedRender({"--fov", "nan"}, {"--fov nan"}),
        refusedRender({"--fov", "180"}, {"less than 180 degrees"}),
        refusedRender({"--eye", "1,2"}, {"x,y,z"}),
        refusedRender({"--intrinsics", "1,2,3"}, {"fx,fy,cx,cy"}),
        refusedRender({"--intrinsics", "1,0,3,4"}, {"greater than 0"}),
        refusedRender({"--pose", "1,2,3"}, {"3 x 4 or 4 x 4"}),
        refusedRender({"--pose", "2,0,0,0,0,2,0,0,0,0,2,0"}, {"a rotation"}),
        refusedRender({"--pose", "1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1"}, {"last row"}),
        refusedRender({"--unit", "0"}, {"greater than 0"}),
        refusedRender({"--layers", "1.5"}, {"--layers 1.5"}),
        refusedRender({"--memory", "1M"}, {"too little memory", "64M"}),
        refusedRender({"--memory", "lots"}, {"8G"}),
        refusedRender({"--threads", "-1"}, {"--threads -1"}),
        refusedRender({"--crop", "0,0,1281,10"}, {"outside the picture", "1280 x 720"}),
        refusedRender({"--size"}, {"--size", "see peeler render --help"})));

INSTANTIATE_TEST_SUITE_P(
    Contradictions, Refusals,
    testing::Values(
        refusedRender({"--camera", "0", "--fov", "30"}, {"--camera"}),
        refusedRender({"--fov", "30", "--ortho-height", "2"}, {"--fov, --ortho-height"}),
        refusedRender({"--eye", "0,5,0", "--target", "0,0,0", "--up", "0,1,0"},
                      {"parallel", "--up"}),
        refusedRender({"--eye", "-1,-1,-1", "--target", "-1,-1,-1"}, {"--eye, --target"}),
        refusedRender({"--intrinsics", "80,80,40,30", "--fov", "30", "--size", "80x60"},
                      {"--intrinsics, --fov"}),
        refusedRender({"--intrinsics", "80,80,40,30", "--size", "80"}, {"--size WxH"}),
        refusedRender({"--pose", "1,0,0,0,0,1,0,0,0,0,1,0", "--eye", "1,2,3"}, {"--pose, --eye"}),
        refusedRender({"--camera", "0", "--pose", "1,0,0,0,0,1,0,0,0,0,1,0"}, {"--camera 0"}),
        refusedRender({"--views", "2", "--intrinsics", "80,80,40,30"}, {"--intrinsics, --views"}),
        Refused{{"flatten", "SCENE", "-o", "OUT/a.exr", "--tail", "blend"}, {"add --layers N"}},
        Refused{{"convert", "SCENE", "-o", "OUT/a.exr", "--no-composite", "--cryptomatte"},
                {"Cryptomatte", "leave it out"}},
        refusedRender({"--near", "5", "--far", "1"}, {"--near, --far"}),
        refusedRender({"--background", "1,1,1"}, {"layers have no background", "--as composite"}),
        refusedRender({"--exposure", "1"}, {"--exposure", "--as composite"}),
        refusedRender({"--as", "composite", "--no-composite"}, {"--no-composite"}),
        refusedRender({"--as", "midpoint-depth", "--no-composite"}, {"--no-composite"}),
        refusedRender({"--as", "midpoint-depth", "--layers", "2"},
                      {"--as midpoint-depth", "--layers"}),
        refusedRender({"--shadow-size", "64"}, {"--shadow-size 64", "add --shadows"}),
        refusedRender({"--as", "composite", "--tone-map", "aces"}, {"linear light", ".png"}),
        Refused{{"render", "SCENE", "-o", "SCENE"}, {"scene.gltf"}},
        Refused{{"render", "SCENE", "-o", "OUT/a.xyz"}, {"a.xyz", ".png"}},
        Refused{{"render", "SCENE", "-o", "OUT/a.png", "--as", "ldi"}, {"ldi"}},
        Refused{{"render", "SCENE"},
                {"--output", "for example: peeler render scene.glb -o scene.png",
                 "see peeler render --help"}},
        Refused{{"render", "-o", "OUT/a.exr"}, {"SCENE"}},
        refusedRender({"--report", "OUT/a.exr"}, {"--report", "replace"}),
        Refused{{"flatten", "SCENE", "-o", "OUT/a.exr", "--layers", "none"}, {"--layers none"}}));

/// An empty value is an error, because it often comes from "$NAME" in a script without NAME.
TEST(Usage, NothingMeansAnEmptyValue) {
    const auto refused = [](const std::vector<std::string>& arguments, const std::string& where) {
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 2) << arguments[0] << ' ' << where;
        EXPECT_TRUE(contains(result.err, " is empty: " + where + "\n"))
            << arguments[0] << ": " << result.err;
    };
    std::size_t options = 0;
    for (const cmd::CommandDescription& verb : cmd::describeCommandLine().verbs) {
        for (const cmd::OptionDescription& option : verb.options) {
            if (option.value_name.empty() || option.names.empty()) continue;
            refused({verb.name, option.names.back(), ""}, option.names.back());
            ++options;
        }
        const auto argument = std::ranges::find_if(
            verb.options, [](const auto& option) { return option.names.empty(); });
        if (argument != verb.options.end()) refused({verb.name, ""}, argument->value_name);
    }
    EXPECT_GT(options, 300U);
    refused({"render", "--report=", "scene.glb"}, "--report");
    EXPECT_TRUE(contains(runPeeler({"masks", "a.glb", "-o", ""}).err, "the name is empty"));
}

TEST(Usage, NamesThatBeginWithADashGetAHint) {
    const ScratchDir scratch;
    const fs::path here = fs::current_path();
    fs::current_path(scratch.path());
    fs::rename(writeScene(scratch.path()), "-scene.gltf");
    writeText("-o.gltf", bytesOf("-scene.gltf"));
    const std::vector<std::string> more{"-o", "a.png", "--size", "8x8"};
    for (const std::string name : {"-scene.gltf", "-o.gltf"}) {
        std::vector<std::string> line{"render", name};
        line.insert(line.end(), more.begin(), more.end());
        const Outcome refused = runPeeler(line);
        EXPECT_EQ(refused.exit_code, 2);
        EXPECT_TRUE(contains(refused.err, "write ./" + name + "\n")) << refused.err;
        line[1] = "./" + name;
        EXPECT_EQ(runPeeler(line).exit_code, 0);
    }
    EXPECT_FALSE(contains(runPeeler({"render", "-none.gltf"}).err, "write ./"));
    fs::current_path(here);
}

TEST(Usage, FilesOfTheSceneAreKept) {
    const ScratchDir folder;
    nlohmann::json scene = triangleScene();
    scene["images"] = {{{"uri", "wood_0001.png"}}};
    const std::string path = writeScene(folder.path(), scene).string();
    writeText(folder / "wood_0001.png", "mine");
    fs::create_symlink(folder.path(), folder / "link");
    const auto refused = [&](std::vector<std::string> options, const char* verb = "render") {
        options.insert(options.begin(), {verb, path, "--size", "8x8"});
        const Outcome result = runPeeler(options);
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_NE(result.err.find("a file of the scene"), std::string::npos) << result.err;
    };
    refused({"-o", folder / "wood_0001.png"});
    refused({"-o", folder / "link/wood_0001.png"});
    refused({"-o", folder / "wood_####.png", "--frames", "0-2"});
    refused({"-o", folder / "out.exr", "--report", folder / "triangle.bin"});
    refused({"-o", folder / "wood_0001.png"}, "sheet");
    EXPECT_EQ(bytesOf(folder / "wood_0001.png"), "mine");
    EXPECT_EQ(bytesOf(folder / "triangle.bin"), triangleBuffer());
    EXPECT_FALSE(fs::exists(folder / "wood_0000.png"));
    EXPECT_FALSE(fs::exists(folder / "out.exr"));
}

TEST(Usage, OutputThatIsTheInputIsRefused) {
    const ScratchDir scratch;
    writeScene(scratch.path());
    fs::create_symlink(scratch / "scene.gltf", scratch / "same.exr");
    const Outcome result = runPeeler(
        {"render", (scratch / "scene.gltf").string(), "-o", (scratch / "same.exr").string()});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(contains(result.err, "the output is the input")) << result.err;
    EXPECT_GT(fs::file_size(scratch / "scene.gltf"), 100U);
}

}  // namespace
}  // namespace peeler::test
