// SPDX-License-Identifier: Apache-2.0
// Tests strings from files and command lines that are invalid UTF-8, contain terminal escapes or
// are very long. No verb may report an internal error, print such strings verbatim, or wait for a
// pipe.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "core/base/printable.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

const std::string kOdd = "*[\xe8g]la\x1b[31mss\u202e*";

/// Whether the text is short, valid UTF-8 without control sequences.
testing::AssertionResult isTame(const std::string& text) {
    std::string plain = text;
    for (std::size_t at = 0; (at = plain.find('\n', at)) != std::string::npos;)
        plain.erase(at, 1);
    if (printable(plain, plain.size()) != plain)
        return testing::AssertionFailure() << printable(text, 10'000);
    if (text.size() > 50'000) return testing::AssertionFailure() << text.size() << " bytes";
    return testing::AssertionSuccess();
}

class OddStrings : public testing::Test {
  protected:
    std::string at(const std::string& name) const { return (scratch_ / name).string(); }

    /// Runs peeler, which must end without an internal error and print only messages that pass
    /// isTame().
    Outcome run(const std::vector<std::string>& arguments) const {
        const Outcome result = runPeeler(arguments);
        EXPECT_NE(result.exit_code, 1) << arguments[0] << ": " << result.err;
        EXPECT_FALSE(contains(result.err, "bug in peeler")) << result.err;
        EXPECT_TRUE(isTame(result.err)) << arguments[0];
        // JSON is for programs, so it keeps all characters except control characters.
        if (std::ranges::find(arguments, "--json") == arguments.end()) {
            EXPECT_TRUE(isTame(result.out)) << arguments[0];
        }
        return result;
    }

    const ScratchDir scratch_;
};

TEST_F(OddStrings, OfTheCommandLine) {
    const std::string scene = writeScene(scratch_.path()).string();
    for (const std::string option : {"--include", "--exclude", "--camera", "--variant", "--method",
                                     "--environment", "--animation", "--size"}) {
        run({"render", scene, "-o", at("a.exr"), option, kOdd, "--size", "16x16"});
        run({"render", scene, "-o", at("a.exr"), option, std::string(100'000, 'x')});
    }
    run({"render", scene, "-o", at(kOdd + ".exr"), "--size", "16x16", "--json"});
    run({"rays", scene, "-o", at("a.npz"), "--direction", "0,0,1", "--include", kOdd});
    run({"info", at(kOdd)});
    run({kOdd});
    run({"render", scene, "--" + kOdd});
}

/// Line feeds in names are escaped, because a stderr line with "error" implies an exit code other
/// than 0.
TEST_F(OddStrings, NamesWithLineFeedsStayInTheirLine) {
    const std::string name = "a\npeeler: error: boom";
    const fs::path folder = scratch_ / name;
    fs::create_directory(folder);
    const std::string scene = at("scene.gltf"), layers = at(name + ".exr");
    writeScene(scratch_.path());
    const auto in = [&](const char* file) { return (folder / file).string(); };
    const std::vector<std::vector<std::string>> commands = {
        {"render", scene, "-o", layers, "--size", "16x16", "--verbose"},
        {"render", scene, "-o", layers, "--size", "16x16", "--skip-existing"},
        {"render", scene, "-o", in("@.png"), "--size", "16x16", "--views", "2"},
        {"render", scene, "-o", in("####.png"), "--size", "16x16"},
        {"extract", layers, "-o", in("#.exr"), "--points", in("a.ply"), "--npz", in("a.npz")},
        {"flatten", layers, "-o", in("a.png")},
        {"convert", layers, "-o", in("a.exr"), "--as", "deep"},
        {"view", layers, "-o", in("b.png")},
        {"sheet", layers, "-o", in("c.png")},
        {"bake", scene, "-o", in("b.glb"), "--directions", "4", "--resolution", "8"},
        {"rays", scene, "-o", in("d.npz"), "--direction", "0,0,1", "--resolution", "8"},
        {"masks", scene, "-o", in("masks"), "--size", "16x16"},
        {"merge", layers, "-o", in("e.exr"), "--allow-gaps"},
        {"verify", layers},
        {"info", layers},
        {"compare", layers, layers},
    };
    for (const std::vector<std::string>& line : commands) {
        const Outcome result = run(line);
        EXPECT_EQ(result.exit_code, 0) << line[0] << ": " << result.err;
        EXPECT_FALSE(contains(result.err, "\npeeler: error")) << result.err;
        EXPECT_FALSE(result.err.starts_with("peeler: error")) << result.err;
        EXPECT_FALSE(contains(result.out, "\npeeler: error")) << result.out;
    }
}

TEST_F(OddStrings, OfAScene) {
    Json scene = triangleScene();
    const std::string long_name(1'000'000, 'n');
    scene["nodes"][0]["name"] = "a\n\x1b]0;title\x07\u009b31m";
    scene["meshes"][0]["name"] = long_name;
    scene["materials"][0]["name"] = long_name;
    scene["scenes"][0]["name"] = long_name;
    scene["asset"]["generator"] = "\x1b[2J" + long_name;
    scene["extensionsUsed"] = {"EXT_\x1b[31m\n" + long_name};
    scene["cameras"] = {{{"name", long_name},
                         {"type", "orthographic"},
                         {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0}, {"zfar", 9}}}}};
    scene["images"] = {{{"uri", "\x1b[31m\n" + long_name}}};
    scene["textures"] = {{{"source", 0}}};
    scene["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    const std::string path = writeScene(scratch_.path(), scene).string();
    EXPECT_EQ(run({"info", path}).exit_code, 0);
    const std::string layers = at("a.exr");
    EXPECT_EQ(run({"render", path, "-o", layers, "--size", "16x16", "--channels", "id"}).exit_code,
              0);
    run({"info", layers});
    run({"render", path, "-o", layers, "--camera", "none"});
    run({"render", path, "-o", layers, "--include", "none"});
    run({"check", path});
    run({"bake", path, "-o", at("b.glb"), "--directions", "4", "--resolution", "8"});
}

/// Replaces texts in the headers of rendered files by odd ones of the same length.
TEST_F(OddStrings, OfAttributes) {
    const std::string scene = writeScene(scratch_.path()).string();
    const std::string layers = at("a.exr");
    ASSERT_EQ(run({"render", scene, "-o", layers, "--size", "16x16", "--channels", "id",
                   "--include", "[f][i][r][s][t]*"})
                  .exit_code,
              0);
    const std::string bytes = [&] {
        std::ifstream file(layers, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(file), {});
    }();
    const std::vector<std::pair<std::string, std::string>> changes = {
        {"[f][i][r][s][t]*", "\xe8\x1b[31m\xff\xfe\x80-it*\xc0\xaf"},  // in peeler:settings
        {"scene.gltf", "\xff\x1b[2J\xe8.glt"},                         // in peeler:scene
        {"{\"channels\"", "[[[[[[[[[[["},                              // in peeler:settings
        {"\"include\":[", "\"include\":{["},
        {"\"name\":",
         "\"na\xff"
         "e\":"},  // in peeler:cameraJson
        {"layer_000", "layer\x1b\xff\x80"},
        {"id.object", "id.o\x1b[\xff\xe8"},
        {"camera z", "\x1b[31m\xffz\n"},  // in peeler:depth
    };
    for (const auto& [from, to] : changes) {
        std::string changed = bytes;
        std::string wanted = to;
        wanted.resize(from.size(), ' ');
        ASSERT_TRUE(contains(changed, from)) << from;
        for (std::size_t at = 0; (at = changed.find(from, at)) != std::string::npos; ++at)
            changed.replace(at, from.size(), wanted);
        SCOPED_TRACE(from);
        const std::string odd = at("odd.exr"), out = at("out.exr");
        writeText(odd, changed);
        run({"info", odd});
        run({"info", odd, "--json"});
        run({"verify", odd, layers});
        run({"verify", odd, "--json"});
        run({"flatten", odd, "-o", at("out.png"), "--json"});
        run({"convert", odd, "-o", out, "--as", "deep"});
        run({"extract", odd, "--points", at("out.ply"), "--npz", at("out.npz")});
        run({"compare", odd, layers});
        run({"compare", odd, layers, "--json"});
        run({"merge", odd, layers, "-o", out});
        run({"flatten", odd, "-o", at("out.png"), "--exclude", kOdd});
        run({"view", odd, "-o", at("out.html")});
        run({"render", scene, "-o", odd, "--size", "16x16", "--skip-existing"});
    }
}

TEST_F(OddStrings, NothingWaitsForAPipe) {
    const std::string scene = writeScene(scratch_.path()).string(), pipe = at("pipe");
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    const std::vector<std::vector<std::string>> commands = {
        {"info", pipe},
        {"verify", pipe},
        {"flatten", pipe, "-o", at("a.png")},
        {"convert", pipe, "-o", at("a.exr")},
        {"extract", pipe, "--npz", at("a.npz")},
        {"compare", pipe, pipe},
        {"merge", pipe, pipe, "-o", at("a.exr")},
        {"sheet", pipe, "-o", at("a.png")},
        {"view", pipe, "-o", at("a.html")},
        {"batch", pipe},
        {"render", pipe, "-o", at("a.png")},
        {"rays", pipe, "-o", at("a.npz"), "--direction", "0,0,1"},
        {"bake", pipe, "-o", at("a.glb")},
        {"check", pipe},
        {"masks", pipe, "-o", at("masks")},
        {"render", scene, "-o", at("a.png"), "--environment", pipe},
        {"render", scene, "-o", at("a.@@@@.png"), "--cameras", pipe},
        {"rays", scene, "-o", at("a.npz"), "--direction", "0,0,1", "--points", pipe},
        {"rays", scene, "-o", at("a.npz"), "--directions-file", pipe},
    };
    for (const auto& command : commands) {
        const Outcome result = run(command);
        EXPECT_EQ(result.exit_code, 3) << command[0] << ": " << result.err;
        EXPECT_TRUE(contains(result.err + result.out, "not a regular file"))
            << command[0] << ": " << result.err;
    }
    // --skip-existing inspects existing outputs first.
    for (const std::string name : {"p.exr", "p.png", "p.html", "p.npz", "p.jpg"}) {
        ASSERT_EQ(mkfifo(at(name).c_str(), 0600), 0);
        const Outcome result =
            run({"render", scene, "-o", at(name), "--size", "16x16", "--skip-existing"});
        EXPECT_NE(result.exit_code, 0) << name;
    }
}

}  // namespace
}  // namespace peeler::test
