// SPDX-License-Identifier: Apache-2.0
// Tests OpenEXR files of other programs with every verb that accepts them.
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "formats/exr/deep_file.h"
#include "formats/exr/flat_file.h"
#include "formats/exr/read_all.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/image/flat_image.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kNames{"A", "R", "G", "B", "Z"};

class ForeignExr : public testing::Test {
  protected:
    std::string at(const std::string& name) const { return (scratch_ / name); }

    /// Runs a command that must succeed; returns its messages.
    static std::string run(const std::vector<std::string>& arguments) {
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 0) << arguments.front() << ": " << result.err;
        return result.err;
    }

    /// Writes a deep file of 8 × 6 pixels. Its data window has 4 × 3 pixels, starting at (2, 1).
    std::string inside() const {
        writeDeepFile(at("inside.exr"),
                      {deepPart({{2, 1}, {5, 3}}, kNames, {{0.5, 0.25, 0.25, 0.25, 2}})},
                      {.display = {{0, 0}, {7, 5}}});
        return at("inside.exr");
    }

    /// Writes two deep parts with equal headers but different samples.
    std::string twoParts() const {
        DeepPart a = deepPart({{0, 0}, {3, 2}}, kNames, {{1, 0.5, 0.5, 0.5, 2}});
        DeepPart b = deepPart({{0, 0}, {3, 2}}, kNames, {{1, 0.25, 0.25, 0.25, 2}});
        a.name = "beauty";
        b.name = "fx";
        writeDeepFile(at("two.exr"), {a, b});
        return at("two.exr");
    }

    ScratchDir scratch_;
};

TEST_F(ForeignExr, PicturesHaveTheSizeOfTheDisplayWindow) {
    const std::string input = inside();
    run({"flatten", input, "-o", at("a.png")});
    const FlatImage picture = readFlatImage(at("a.png"));
    EXPECT_EQ(picture.width, 8);
    EXPECT_EQ(picture.height, 6);
    EXPECT_NEAR(picture.image.rgba[1 * 8 + 2][3], 0.5F, 0.01F);
    EXPECT_EQ(picture.image.rgba[0][3], 0);
    run({"extract", input, "-o", at("layer.##.png")});
    EXPECT_EQ(readFlatImage(at("layer.00.png")).width, 8);
    run({"extract", input, "--depth-complexity", at("n.png")});
    EXPECT_EQ(readFlatImage(at("n.png")).height, 6);
    run({"sheet", input, "-o", at("sheet.png")});

    run({"flatten", input, "-o", at("flat.exr")});
    run({"convert", input, "-o", at("ldi.exr"), "--as", "ldi"});
    run({"convert", at("ldi.exr"), "-o", at("deep.exr"), "--as", "deep"});
    for (const char* name : {"ldi.exr", "deep.exr"}) {
        run({"flatten", at(name), "-o", at("b.png")});
        EXPECT_EQ(bytesOf(at("b.png")), bytesOf(at("a.png"))) << name;
    }
    run({"verify", at("ldi.exr"), at("deep.exr"), at("flat.exr")});
    run({"merge", "--elements", input, at("deep.exr"), "-o", at("merged.exr")});
    EXPECT_EQ(readAll(at("merged.exr")).fragments(), 24U);
}

TEST_F(ForeignExr, PicturesOfOneDisplayWindowAreCompared) {
    const FlatPart whole{.window = {{0, 0}, {7, 5}}, .values = {{"Y", {0.5}}}};
    const FlatPart part{.window = {{2, 1}, {5, 3}}, .values = {{"Y", {0.5}}}};
    writeFlatFile(at("whole.exr"), {whole});
    writeFlatFile(at("part.exr"), {part});
    const Outcome result = runPeeler({"compare", at("whole.exr"), at("part.exr"), "--json"});
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_EQ(Json::parse(result.out)["width"], 8) << result.out;
    run({"compare", at("part.exr"), at("part.exr")});
    run({"flatten", at("part.exr"), "-o", at("part.png"), "--tone-map", "none"});
    run({"compare", at("part.exr"), at("part.png"), "--max-color", "0.01"});
}

TEST_F(ForeignExr, RequiredFieldsOfTheHeaderAreKept) {
    const auto header = [](std::size_t, Imf::Header& h) {
        h.pixelAspectRatio() = 2;
        h.screenWindowWidth() = 3;
        Imf::addOwner(h, "somebody");
    };
    writeFlatFile(at("a.exr"), {{.values = {{"Y", {0.5}}}}}, {.header = header});
    for (const std::vector<std::string>& command :
         std::vector<std::vector<std::string>>{{"flatten", at("a.exr")},
                                               {"convert", at("a.exr")},
                                               {"merge", "--elements", at("a.exr"), at("a.exr")}}) {
        std::vector<std::string> arguments = command;
        arguments.insert(arguments.end(), {"--strict", "-o", at("b.exr")});
        run(arguments);
        const Imf::MultiPartInputFile file(at("b.exr").c_str());
        for (int i = 0; i < file.parts(); ++i) {
            EXPECT_EQ(file.header(i).pixelAspectRatio(), 2) << command.front();
            EXPECT_EQ(file.header(i).screenWindowWidth(), 3) << command.front();
            EXPECT_EQ(Imf::owner(file.header(i)), "somebody") << command.front();
        }
    }
    EXPECT_NE(run({"flatten", at("a.exr"), "-o", at("a.png")})
                  .find("warning: The pixels of the picture are not"),
              std::string::npos);
    EXPECT_EQ(runPeeler({"flatten", at("a.exr"), "-o", at("b.png"), "--strict"}).exit_code, 3);
    EXPECT_FALSE(fs::exists(at("b.png")));
}

TEST_F(ForeignExr, WhatConvertMakesIsConsistent) {
    writeDeepFile(at("ar.exr"), {deepPart({{0, 0}, {1, 0}}, {"AR", "AG", "AB", "R", "G", "B", "Z"},
                                          {{0.8, 0.4, 0, 0.2, 0.1, 0, 1}, {1, 1, 1, 0, 1, 0, 2}})});
    run({"convert", at("ar.exr"), "-o", at("x.exr"), "--as", "ldi"});
    run({"verify", at("x.exr")});
}

TEST_F(ForeignExr, PartsAreWarnedOfAndChosen) {
    const std::string input = twoParts();
    const auto red = [&](const std::vector<std::string>& more) {
        std::vector<std::string> arguments{"flatten", input, "-o", at("a.exr")};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const std::string messages = run(arguments);
        EXPECT_EQ(messages.find("warning: The part \"fx\" is not read; --part selects a part") ==
                      std::string::npos,
                  !more.empty())
            << messages;
        return readFlatImage(at("a.exr")).image.rgba[0][0];
    };
    EXPECT_EQ(red({}), 0.5F);
    EXPECT_EQ(red({"--part", "fx"}), 0.25F);
    EXPECT_EQ(red({"--part", "beauty"}), 0.5F);
    for (const std::vector<std::string>& verb : std::vector<std::vector<std::string>>{
             {"flatten", input, "-o", at("b.exr")},
             {"convert", input, "-o", at("b.exr")},
             {"extract", input, "--npz", at("b.npz")},
             {"sheet", input, "-o", at("b.png")},
             {"merge", "--elements", input, input, "-o", at("b.exr")},
             {"compare", input, input},
             {"info", input}}) {
        EXPECT_NE(runPeeler(verb).err.find("\"fx\" is not read"), std::string::npos)
            << verb.front();
        std::vector<std::string> chosen = verb, strict = verb, wrong = verb;
        chosen.insert(chosen.end(), {"--part", "fx", "--strict"});
        strict.emplace_back("--strict");
        wrong.insert(wrong.end(), {"--part", "fy"});
        EXPECT_EQ(runPeeler(chosen).exit_code, 0) << verb.front();
        EXPECT_EQ(runPeeler(strict).exit_code, 3) << verb.front();
        const Outcome refused = runPeeler(wrong);
        EXPECT_EQ(refused.exit_code, 2) << verb.front();
        EXPECT_NE(refused.err.find("fx"), std::string::npos) << refused.err;
    }
    run({"verify", input});
    // verify reads the second part, too.
    std::string bytes = bytesOf(input);
    bytes.resize(bytes.size() - 3);
    writeFile(at("cut.exr"), bytes);
    EXPECT_EQ(runPeeler({"verify", at("cut.exr")}).exit_code, 3);
}

TEST_F(ForeignExr, DwaIsReadAndGood) {
    FlatPart part{.window = {{0, 0}, {7, 5}}};
    for (const char* name : {"R", "G", "B", "A"})
        part.values[name] = {0.5};
    for (const Imf::Compression dwa : {Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION}) {
        for (const int tile : {0, 4}) {
            writeFlatFile(at("a.exr"), {part}, {.compression = dwa, .tile = tile});
            run({"flatten", at("a.exr"), "-o", at("a.png"), "--strict"});
            run({"verify", at("a.exr")});
            std::string bytes = bytesOf(at("a.exr"));
            bytes.resize(bytes.size() - 9);
            writeFile(at("cut.exr"), bytes);
            EXPECT_EQ(runPeeler({"verify", at("cut.exr")}).exit_code, 3);
            EXPECT_EQ(runPeeler({"flatten", at("cut.exr"), "-o", at("b.png")}).exit_code, 3);
        }
    }
}

/// Checks files from bug reports, if they are in a folder next to the project.
TEST_F(ForeignExr, FilesFromTheField) {
    const char* const variable = std::getenv("PEELER_FIELD");
    const fs::path field = variable ? fs::path(variable) : sourceDir() / "../shared/field";
    if (!fs::exists(field)) GTEST_SKIP() << "there is no folder " << field;
    const auto in = [&](const char* name) { return (field / name).string(); };
    run({"flatten", in("02-dwa-exr/dwaa.exr"), "-o", at("a.png"), "--strict"});
    run({"verify", in("02-dwa-exr/dwaa.exr")});
    run({"flatten", in("03-deep-window-to-png/inside.exr"), "-o", at("a.png")});
    EXPECT_EQ(readFlatImage(at("a.png")).width, 8);
    EXPECT_EQ(runPeeler({"compare", in("03-deep-window-to-png/w1.exr"),
                         in("03-deep-window-to-png/w2.exr")})
                  .exit_code,
              1);
    run({"flatten", in("04-pixel-aspect-lost/aspect.exr"), "-o", at("a.exr")});
    EXPECT_EQ(Imf::MultiPartInputFile(at("a.exr").c_str()).header(0).pixelAspectRatio(), 2);
    run({"convert", in("05-deep-alpha-names/ar.exr"), "-o", at("x.exr")});
    run({"verify", at("x.exr")});
    run({"flatten", in("05-deep-alpha-names/beauty.exr"), "-o", at("x.exr")});
    EXPECT_GT(readFlatImage(at("x.exr")).image.rgba[0][0], 0);
    EXPECT_NE(run({"flatten", in("23-deep-parts-dropped/two.exr"), "-o", at("x.exr")})
                  .find("The part \"fx\" is not read"),
              std::string::npos);
}

}  // namespace
}  // namespace peeler::test
