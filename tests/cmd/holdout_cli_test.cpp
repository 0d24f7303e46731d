// SPDX-License-Identifier: Apache-2.0
// Tests peeler holdout. Also composites its files with OpenEXR and OpenImageIO.
#include <gtest/gtest.h>

#include <ImfChannelList.h>
#include <ImfCompositeDeepScanLine.h>
#include <ImfDeepScanLineInputFile.h>
#include <ImfFrameBuffer.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/test_support.h"

namespace peeler::test {
namespace {

using Rgba = std::vector<float>;

constexpr int kWidth = 48, kHeight = 27;

class HoldoutVerb : public testing::Test {
  protected:
    std::string at(const std::string& name) const { return scratch_ / name; }
    static void ok(const std::vector<std::string>& arguments) {
        const Outcome run = runPeeler(arguments);
        ASSERT_EQ(run.exit_code, 0) << run.err;
    }
    /// Renders glass gears and their housing, as deep images of 32-bit floats.
    void render(const std::string& name, const std::vector<std::string>& options) {
        std::vector<std::string> arguments{
            "render", (sourceDir() / "examples/scenes/engine.glb").string(),
            "-o",     at(name),
            "--size", std::to_string(kWidth) + 'x' + std::to_string(kHeight),
            "--as",   "deep",
            "-q",     "--precision",
            "float"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        ok(arguments);
    }
    void holdout(const std::string& in, const std::string& out,
                 const std::vector<std::string>& options) {
        std::vector<std::string> arguments{"holdout", at(in), "-o", at(out), "-q"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        ok(arguments);
    }
    Rgba byPeeler(const std::string& name) {
        ok({"flatten", at(name), "-o", at("flat_" + name), "-q"});
        return pixelsOf(OIIO::ImageBuf(at("flat_" + name)));
    }
    Rgba byOpenImageIO(const std::string& name) const {
        const OIIO::ImageBuf deep(at(name));
        OIIO::ImageBuf flat;
        EXPECT_TRUE(OIIO::ImageBufAlgo::flatten(flat, deep)) << flat.geterror();
        return pixelsOf(flat);
    }
    Rgba byOpenExr(const std::string& name) const {
        Imf::DeepScanLineInputFile file(at(name).c_str());
        Imf::CompositeDeepScanLine composite;
        composite.addSource(&file);
        Rgba rgba(std::size_t{4} * kWidth * kHeight);
        Imf::FrameBuffer buffer;
        const char* const names[] = {"R", "G", "B", "A"};
        for (std::size_t c = 0; c < 4; ++c)
            buffer.insert(names[c], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(rgba.data() + c),
                                               4 * sizeof(float), 4 * sizeof(float) * kWidth));
        composite.setFrameBuffer(buffer);
        const auto& window = composite.dataWindow();
        composite.readPixels(window.min.y, window.max.y);
        return rgba;
    }
    /// Returns the display window's R, G, B and A; 0 outside the data window.
    static Rgba pixelsOf(const OIIO::ImageBuf& image) {
        Rgba rgba;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
                for (const char* const channel : {"R", "G", "B", "A"})
                    rgba.push_back(image.getchannel(x, y, 0, image.spec().channelindex(channel)));
        return rgba;
    }
    static void expectSum(const Rgba& a, const Rgba& b, const Rgba& whole) {
        float most = 0;
        for (std::size_t i = 0; i < whole.size(); ++i) {
            ASSERT_NEAR(a[i] + b[i], whole[i], 4e-6) << i;
            most = std::max(most, std::min(a[i], b[i]));
        }
        EXPECT_GT(most, 0.05F) << "both show in some pixel";
    }

    ScratchDir scratch_;
};

TEST_F(HoldoutVerb, ElementsHeldOutByEachOtherAddUpByAnyArithmetic) {
    render("housing.exr", {"--include", "housing*"});
    render("gears.exr", {"--exclude", "housing*"});
    ok({"merge", at("housing.exr"), at("gears.exr"), "-o", at("whole.exr"), "--elements", "-q"});
    holdout("housing.exr", "a.exr", {"--by", at("gears.exr")});
    holdout("gears.exr", "b.exr", {"--by", at("housing.exr"), "--same-depth", "in-front"});
    expectSum(byPeeler("a.exr"), byPeeler("b.exr"), byPeeler("whole.exr"));
    expectSum(byOpenImageIO("a.exr"), byOpenImageIO("b.exr"), byOpenImageIO("whole.exr"));
    expectSum(byOpenExr("a.exr"), byOpenExr("b.exr"), byOpenExr("whole.exr"));
    ok({"verify", at("a.exr"), "-q"});
}

TEST_F(HoldoutVerb, ObjectsAreHeldOutByTheOthersOfTheirFile) {
    render("whole.exr", {"--channels", "id"});
    holdout("whole.exr", "a.exr", {"--include", "housing*"});
    holdout("whole.exr", "b.exr", {"--exclude", "housing*"});
    expectSum(byPeeler("a.exr"), byPeeler("b.exr"), byPeeler("whole.exr"));
    const Outcome info = runPeeler({"info", at("a.exr"), "--json"});
    EXPECT_TRUE(contains(info.out, "heldOut")) << info.out;
}

TEST_F(HoldoutVerb, ASceneIsRenderedAsTheMatte) {
    const std::string engine = (sourceDir() / "examples/scenes/engine.glb").string();
    render("gears.exr", {"--exclude", "housing*"});
    render("engine.exr", {});
    holdout("gears.exr", "by_file.exr", {"--by", at("engine.exr")});
    holdout("gears.exr", "by_scene.exr", {"--by", engine});
    EXPECT_EQ(byPeeler("by_file.exr"), byPeeler("by_scene.exr"));
}

TEST_F(HoldoutVerb, WritesLayersAndPictures) {
    render("housing.exr", {"--include", "housing*"});
    render("gears.exr", {"--exclude", "housing*"});
    holdout("housing.exr", "layers.exr", {"--by", at("gears.exr"), "--as", "ldi"});
    holdout("housing.exr", "deep.exr", {"--by", at("gears.exr")});
    EXPECT_EQ(byPeeler("layers.exr"), byPeeler("deep.exr"));
    holdout("housing.exr", "flat.png", {"--by", at("gears.exr")});
    EXPECT_GT(bytesOf(scratch_ / "flat.png").size(), 100U);
}

TEST_F(HoldoutVerb, RefusesMattesThatDoNotFit) {
    render("a.exr", {});
    render("small.exr", {"--size", "24x13"});
    render("other.exr", {"--eye", "1,2,3"});
    const auto outcome = [&](std::vector<std::string> options) {
        std::vector<std::string> arguments{"holdout", at("a.exr"), "-o", at("o.exr")};
        arguments.insert(arguments.end(), options.begin(), options.end());
        return runPeeler(arguments);
    };
    const Outcome nothing = outcome({});
    EXPECT_EQ(nothing.exit_code, 2);
    EXPECT_TRUE(contains(nothing.err, "no matte is given: --by")) << nothing.err;
    const Outcome size = outcome({"--by", at("small.exr")});
    EXPECT_EQ(size.exit_code, 2);
    EXPECT_TRUE(contains(size.err, "the matte has another size")) << size.err;
    const Outcome camera = outcome({"--by", at("other.exr")});
    EXPECT_EQ(camera.exit_code, 0);
    EXPECT_TRUE(contains(camera.err, "it has another camera")) << camera.err;
    EXPECT_EQ(outcome({"--by", at("other.exr"), "--strict"}).exit_code, 3);
    EXPECT_EQ(outcome({"--by", at("missing.exr")}).exit_code, 3);
}

}  // namespace
}  // namespace peeler::test
