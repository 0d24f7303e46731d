// SPDX-License-Identifier: Apache-2.0
// Tests methods, limits, samples and clip volumes on the command line.
#include <ImfHeader.h>
#include <ImfIntAttribute.h>
#include <ImfMultiPartInputFile.h>
#include <ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "core/capture/method.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class Methods : public testing::Test {
  protected:
    Outcome render(const fs::path& image, const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{"render", scene_.string(), "-o", image.string(),
                                           "--size", "96x64",         "-q"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runPeeler(arguments);
    }
    Json json(const fs::path& image, std::vector<std::string> more) const {
        more.emplace_back("--json");
        const Outcome result = render(image, more);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return Json::parse(result.out);
    }
    void expectUsageError(const std::vector<std::string>& more, const std::string& said) const {
        const fs::path image = scratch_ / "refused.exr";
        const Outcome result = render(image, more);
        EXPECT_EQ(result.exit_code, 2) << said;
        EXPECT_NE(result.err.find(said), std::string::npos) << result.err;
        EXPECT_NE(result.err.find("hint:"), std::string::npos) << result.err;
        EXPECT_FALSE(fs::exists(image));
    }

    ScratchDir scratch_;
    fs::path scene_ = writeScene(scratch_.path(), stackScene(5));
    fs::path layers_ = scratch_ / "layers.exr", flat_ = scratch_ / "flat.exr",
             image_ = scratch_ / "image.exr";
};

TEST_F(Methods, TheCompositeOfEveryExactMethodIsThatOfTheLayers) {
    ASSERT_EQ(render(layers_, {}).exit_code, 0);
    ASSERT_EQ(runPeeler({"flatten", layers_.string(), "-o", flat_.string(), "-q"}).exit_code, 0);
    for (const MethodInfo& method : peelMethods()) {
        const Json result =
            json(image_, {"--as", "composite", "--method", std::string(method.name)});
        EXPECT_EQ(result.at("method"), method.name);
        EXPECT_EQ(result.at("fragmentsCounted"), 5 * 96 * 64);
        EXPECT_EQ(result.at("complete"), true);
        // Values up to 1 may differ by the last bit of a half.
        const Outcome compared =
            runPeeler({"compare", flat_.string(), image_.string(), "--max-color", "0.000489"});
        if (method.exact()) {
            EXPECT_EQ(compared.exit_code, 0) << method.name << compared.out << compared.err;
        }
    }
}

/// Front-to-back methods perform the same operations as the compositing of layers.
TEST_F(Methods, FrontToBackIsTheSameToTheBit) {
    const std::string scene = (sourceDir() / "examples/scenes/panes.glb").string();
    const std::vector<std::string> size = {"--size", "320x180", "-q"};
    const auto run = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.end(), size.begin(), size.end());
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 0) << result.err;
    };
    for (const std::string precision : {"half", "float"}) {
        run({"render", scene, "-o", layers_, "--precision", precision});
        ASSERT_EQ(runPeeler({"flatten", layers_, "-o", flat_, "-q"}).exit_code, 0);
        for (const std::string method : {"a-buffer", "front-to-back", "two-pass"}) {
            run({"render", scene, "-o", image_, "--as", "composite", "--method", method,
                 "--precision", precision});
            const Outcome compared = runPeeler({"compare", flat_, image_, "--json"});
            EXPECT_EQ(Json::parse(compared.out).at("identical"), true)
                << method << ", " << precision << ": " << compared.out;
        }
    }
}

TEST_F(Methods, TakeAsManyGeometryPassesAsPublished) {
    const std::vector<std::pair<std::string, int>> published = {
        {"a-buffer", 1},      {"front-to-back", 5}, {"two-pass", 10},
        {"back-to-front", 5}, {"dual", 4},          {"weighted-average", 1},
        {"weighted-sum", 1},  {"unsorted", 1},      {"weighted-blended", 1},
        {"moment-based", 2}};
    for (const auto& [method, passes] : published) {
        EXPECT_EQ(json(scratch_ / "image.png", {"--method", method, "--samples", "1"}).at("passes"),
                  passes)
            << method;
    }
}

TEST_F(Methods, ApproximationsFindNoLayers) {
    for (const MethodInfo& method : peelMethods()) {
        if (method.exact()) continue;
        expectUsageError({"--method", std::string(method.name)}, "produces no layers");
        expectUsageError(
            {"--method", std::string(method.name), "--as", "composite", "--layers", "2"},
            "takes all layers at once");
    }
}

TEST_F(Methods, WhatALimitLeavesOutIsCounted) {
    const Json dropped = json(image_, {"--as", "composite", "--layers", "2"});
    EXPECT_EQ(dropped.at("layers"), 2);
    EXPECT_EQ(dropped.at("fragmentsStored"), 2 * 96 * 64);
    EXPECT_EQ(dropped.at("fragmentsLeftOut"), 3 * 96 * 64);
    EXPECT_EQ(dropped.at("complete"), false);
    const Json blended = json(image_, {"--as", "composite", "--layers", "2", "--tail", "blend"});
    EXPECT_EQ(blended.at("fragmentsBlended"), 3 * 96 * 64);
    EXPECT_EQ(blended.at("fragmentsLeftOut"), 0);
    EXPECT_EQ(blended.at("complete"), false);
    const Imf::MultiPartInputFile file(image_.c_str());
    const auto& header = file.header(0);
    EXPECT_EQ(header.typedAttribute<Imf::StringAttribute>("peeler:fragmentsBlended").value(),
              std::to_string(3 * 96 * 64));
    EXPECT_EQ(header.typedAttribute<Imf::IntAttribute>("peeler:complete").value(), 0);
    EXPECT_EQ(json(image_, {"--layers", "0"}).at("layers"), 5);
    expectUsageError({"--layers", "2", "--tail", "blend"}, "never blended");
}

TEST_F(Methods, StrictRefusesALimitThatLeavesFragmentsOut) {
    for (const char* tail : {"drop", "blend"}) {
        const Outcome result =
            render(image_, {"--as", "composite", "--layers", "2", "--tail", tail, "--strict"});
        EXPECT_EQ(result.exit_code, 6);
        EXPECT_NE(result.err.find("18,432 fragments of 30,720"), std::string::npos) << result.err;
        EXPECT_FALSE(fs::exists(image_));
    }
    EXPECT_EQ(render(image_, {"--occlusion-ratio", "0.5", "--strict"}).exit_code, 0);
}

TEST_F(Methods, SamplesAreSaidAndFlattenToTheComposite) {
    for (const char* precision : {"half", "float"}) {
        const std::vector<std::string> options = {"--samples", "4", "--precision", precision};
        EXPECT_EQ(json(layers_, options).at("samples"), 4);
        ASSERT_EQ(runPeeler({"flatten", layers_.string(), "-o", flat_.string(), "-q"}).exit_code,
                  0);
        std::vector<std::string> composite = options;
        composite.insert(composite.end(), {"--as", "composite"});
        ASSERT_EQ(render(image_, composite).exit_code, 0);
        const Outcome compared =
            runPeeler({"compare", flat_.string(), image_.string(), "--max-color", "0.003921"});
        EXPECT_EQ(compared.exit_code, 0) << compared.out << compared.err;
    }
    const Imf::MultiPartInputFile file(layers_.c_str());
    for (int part = 0; part < file.parts(); ++part) {
        EXPECT_EQ(file.header(part).typedAttribute<Imf::IntAttribute>("peeler:samples").value(), 4);
    }
}

TEST_F(Methods, ClipVolumesKeepOneSide) {
    // The triangles are at z = 0, −0.1, … −0.4.
    EXPECT_EQ(json(image_, {"--clip-plane", "0,0,1,0.25"}).at("layers"), 3);
    EXPECT_EQ(json(image_, {"--clip-plane", "0,0,1,0.25", "--clip", "outside"}).at("layers"), 2);
    EXPECT_EQ(
        json(image_, {"--clip-plane", "0,0,1,0.25", "--clip-plane", "0,0,-2,-0.1"}).at("layers"),
        2);
    EXPECT_EQ(json(image_, {"--clip-box", "-50,-50,-0.35,50,50,-0.15"}).at("layers"), 2);
}

TEST_F(Methods, WrongClipVolumesAreUsageErrors) {
    expectUsageError({"--clip", "inside"}, "there is no clip volume");
    expectUsageError({"--clip", "beside", "--clip-plane", "0,0,1,0"}, "unknown side 'beside'");
    expectUsageError({"--clip-plane", "0,0,0,1"}, "the plane's normal is zero");
    const Outcome few = render(image_, {"--clip-box", "1,2,3"});
    EXPECT_EQ(few.exit_code, 2);
    EXPECT_NE(few.err.find("expected 6 numbers x,y,z,x,y,z: --clip-box 1,2,3"), std::string::npos)
        << few.err;
    expectUsageError({"--clip-mesh", "ball"}, "unknown node: --clip-mesh ball");
    // This node has only the camera.
    expectUsageError({"--clip-mesh", "5"}, "no triangles to clip with");
}

}  // namespace
}  // namespace peeler::test
