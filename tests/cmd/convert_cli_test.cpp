// SPDX-License-Identifier: Apache-2.0
// Tests peeler convert: lossless round trips between deep files and all layouts, merging of
// samples, and errors.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cmd/tiny_gltf.h"
#include "formats/layered/opened_picture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class ConvertVerb : public testing::Test {
  protected:
    std::string at(const std::string& name) const { return (scratch_ / name).string(); }

    /// Runs a command that must succeed; returns its JSON result.
    static Json run(std::vector<std::string> arguments) {
        arguments.insert(arguments.end(), {"--json", "--quiet"});
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 0) << arguments.front() << ": " << result.err;
        return result.out.empty() ? Json() : Json::parse(result.out);
    }

    Json renderGlasses(const std::string& name, std::vector<std::string> more) const {
        const fs::path scene = sourceDir() / "examples/scenes/glasses.glb";
        more.insert(more.begin(), {"render", scene.string(), "-o", at(name), "--size", "160x90"});
        return run(more);
    }

    ScratchDir scratch_;
};

TEST_F(ConvertVerb, LayeredAndDeepFilesTurnIntoEachOtherByteForByte) {
    const std::string crop = "31,20,77,51";
    renderGlasses("ldi.exr", {"--crop", crop});
    renderGlasses("deep.exr", {"--crop", crop, "--as", "deep"});
    run({"convert", at("ldi.exr"), "-o", at("to-deep.exr"), "--as", "deep"});
    run({"convert", at("deep.exr"), "-o", at("to-ldi.exr"), "--as", "ldi"});
    EXPECT_TRUE(bytesOf(at("to-deep.exr")) == bytesOf(at("deep.exr")));
    EXPECT_TRUE(bytesOf(at("to-ldi.exr")) == bytesOf(at("ldi.exr")));
    for (const char* layout : {"single-part", "per-file"}) {
        run({"convert", at("deep.exr"), "-o", at("layout.exr"), "--layout", layout});
        run({"convert", at("layout.exr"), "-o", at("back.exr"), "--as", "deep"});
        EXPECT_TRUE(bytesOf(at("back.exr")) == bytesOf(at("deep.exr"))) << layout;
    }
    // Other verbs must read the same picture from both files.
    run({"flatten", at("ldi.exr"), "-o", at("a.exr")});
    run({"flatten", at("deep.exr"), "-o", at("b.exr")});
    EXPECT_TRUE(bytesOf(at("a.exr")) == bytesOf(at("b.exr")));
    EXPECT_EQ(runPeeler({"compare", at("ldi.exr"), at("deep.exr")}).exit_code, 0);
    EXPECT_EQ(runPeeler({"sheet", at("deep.exr"), "-o", at("sheet.png")}).exit_code, 0);
}

TEST_F(ConvertVerb, OpenImageIoFlattensToOurCompositeWithinHalfPrecision) {
    renderGlasses("deep.exr", {"--as", "deep"});
    OIIO::ImageBuf deep(at("deep.exr")), flat;
    ASSERT_TRUE(OIIO::ImageBufAlgo::flatten(flat, deep)) << flat.geterror();
    const auto reader = openLayered(at("deep.exr"));
    LayeredImage image;
    reader->read(reader->info().plan.view.crop, image);
    ASSERT_GT(reader->info().plan.layers.size(), 5U);
    CompositeImage composite;
    compositeOver(image, {}, composite);
    for (int y = 0; y < 90; ++y) {
        for (int x = 0; x < 160; ++x) {
            for (int c = 0; c < 4; ++c) {
                const auto p = static_cast<std::size_t>(y * 160 + x);
                const float ours = composite.rgba[p][static_cast<std::size_t>(c)];
                const float theirs = flat.getchannel(x, y, 0, c);
                // A half has 11 significant bits. OpenImageIO rounds to half once; our result is
                // float.
                ASSERT_NEAR(ours, theirs, std::max(1.0F, std::abs(ours)) / 1024)
                    << x << ',' << y << ' ' << c;
            }
        }
    }
}

TEST_F(ConvertVerb, OtherProgramsFlattenColourAloneHoweverManyChannelsThereAre) {
    const auto flattened = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.end(), {"--as", "deep"});
        renderGlasses(name, more);
        const Outcome result =
            runCommand({"oiiotool", at(name), "--flatten", "-o", at("flat." + name)});
        EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
        return OIIO::ImageBuf(at("flat." + name));
    };
    const OIIO::ImageBuf plain = flattened("plain.exr", {});
    const OIIO::ImageBuf rich = flattened("rich.exr", {"--channels", "all"});
    EXPECT_EQ(rich.spec().channelnames, (std::vector<std::string>{"R", "G", "B", "A", "Z"}));
    const OIIO::ImageBufAlgo::CompareResults result =
        OIIO::ImageBufAlgo::compare(rich, plain, 0.0F, 0.0F);
    EXPECT_FALSE(result.error) << result.maxerror;
    // All channels are read back, regardless of the order in which they were requested.
    run({"convert", at("rich.exr"), "-o", at("layers.exr"), "--as", "ldi"});
    renderGlasses("rendered.exr", {"--channels", "all"});
    EXPECT_TRUE(bytesOf(at("layers.exr")) == bytesOf(at("rendered.exr")));
}

TEST_F(ConvertVerb, MergedSamplesAreFewerAndLookAlike) {
    const std::string scene = writeScene(scratch_.path(), stackScene(6)).string();
    const std::vector<std::string> render{"render", scene,  "-o",     at("a.exr"),
                                          "--as",   "deep", "--size", "64x48"};
    const Json all = run(render);
    std::vector<std::string> merged = render;
    merged[3] = at("b.exr");
    merged.insert(merged.end(), {"--deep-merge", "by-z", "--deep-z-tolerance", "1000"});
    const Json fewer = run(merged);
    EXPECT_EQ(fewer["fragmentsStored"].get<unsigned>() * 6, all["fragmentsStored"].get<unsigned>());
    EXPECT_EQ(fewer["layers"], 1);
    EXPECT_EQ(fewer["complete"], false);
    const auto reader = openLayered(at("b.exr"));
    EXPECT_EQ(reader->info().plan.layers.size(), 1U);
    EXPECT_EQ(reader->info().plan.fragments_stored * 6, all["fragmentsStored"].get<unsigned>());
    const Outcome result =
        runPeeler({"compare", at("a.exr"), at("b.exr"), "--composites", "--max-color", "0.002"});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
}

TEST_F(ConvertVerb, WhatDoesNotFitIsRefused) {
    const std::string scene = writeScene(scratch_.path(), stackScene(2)).string();
    const Outcome result =
        runPeeler({"render", scene, "-o", at("out.exr"), "--deep-merge", "exact"});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_NE(result.err.find("--deep-merge"), std::string::npos) << result.err;
    run({"render", scene, "-o", at("a.exr"), "--size", "32x24"});
    EXPECT_EQ(runPeeler({"convert", at("a.exr"), "-o", at("a.exr")}).exit_code, 2);
    EXPECT_EQ(runPeeler({"convert", at("a.exr"), "-o", at("b.png")}).exit_code, 2);
    EXPECT_EQ(runPeeler({"convert", at("a.exr"), "-o", at("b.exr"), "--as", "composite"}).exit_code,
              2);
    EXPECT_EQ(runPeeler({"convert", scene, "-o", at("b.exr")}).exit_code, 3);
    const Outcome nameless =
        runPeeler({"convert", at("a.exr"), "-o", at("b.exr"), "--cryptomatte"});
    EXPECT_EQ(nameless.exit_code, 2);
    EXPECT_NE(nameless.err.find("--channels id"), std::string::npos) << nameless.err;
}

TEST_F(ConvertVerb, CryptomatteIsMadeOfIds) {
    renderGlasses("ids.exr", {"--channels", "id"});
    renderGlasses("matte.exr", {"--channels", "id", "--cryptomatte"});
    run({"convert", at("ids.exr"), "-o", at("made.exr"), "--cryptomatte"});
    EXPECT_TRUE(bytesOf(at("made.exr")) == bytesOf(at("matte.exr")));
}

TEST_F(ConvertVerb, ASetDoesNotReplaceItsInputNorWhatMustStay) {
    const std::string scene = writeScene(scratch_.path(), stackScene(2)).string();
    run({"render", scene, "-o", at("a.exr"), "--size", "32x24", "--layout", "per-file"});
    EXPECT_TRUE(fs::exists(at("a.layer_001.exr")));
    EXPECT_EQ(
        runPeeler({"convert", at("a.layer_001.exr"), "-o", at("a.exr"), "--layout", "per-file"})
            .exit_code,
        2);
    fs::remove(at("a.exr"));
    EXPECT_EQ(
        runPeeler({"render", scene, "-o", at("a.exr"), "--layout", "per-file", "--no-clobber"})
            .exit_code,
        4);
    // A layer's file on its own is a picture of one layer.
    const Json json = run({"convert", at("a.layer_001.exr"), "-o", at("b.exr")});
    EXPECT_EQ(json["layers"], 1);
}

}  // namespace
}  // namespace peeler::test
