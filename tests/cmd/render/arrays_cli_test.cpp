// SPDX-License-Identifier: Apache-2.0
// Tests arrays for other programs: lossless round trips of layers through .safetensors, equal
// numbers in .npz and .safetensors from every verb, and scenes from arrays.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cmd/tiny_gltf.h"
#include "formats/arrays/array_writer.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Compares the arrays of two files, one .npz and one .safetensors.
constexpr const char* kSameArrays = R"(
import json, sys, numpy as np
def tensors(path):
    data = open(path, 'rb').read()
    length = int.from_bytes(data[:8], 'little')
    header = json.loads(data[8:8 + length])
    texts = header.pop('__metadata__', {})
    types = {'U8': 'u1', 'I32': '<i4', 'U32': '<u4', 'I64': '<i8', 'F16': '<f2', 'F32': '<f4', 'F64': '<f8'}
    arrays = {}
    for name, entry in header.items():
        first, last = (8 + length + offset for offset in entry['data_offsets'])
        arrays[name] = np.frombuffer(data[first:last], types[entry['dtype']]).reshape(entry['shape'])
    return arrays, texts
stored = np.load(sys.argv[1], allow_pickle=False)
arrays, texts = tensors(sys.argv[2])
texts = {name: np.frombuffer(text.encode(), np.uint8) for name, text in texts.items()}
assert set(stored.files) == set(arrays) | set(texts), set(stored.files) ^ (set(arrays) | set(texts))
for name, array in arrays.items():
    assert array.dtype == stored[name].dtype and array.shape == stored[name].shape, name
    assert array.tobytes() == stored[name].tobytes(), name
print(len(arrays))
)";

class ArraysBetweenPrograms : public testing::Test {
  protected:
    std::string at(const std::string& name) const { return (scratch_ / name).string(); }

    static Json run(std::vector<std::string> arguments) {
        arguments.emplace_back("--json");
        if (arguments.front() != "info") arguments.emplace_back("--quiet");
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 0) << arguments.front() << ": " << result.err;
        return result.out.empty() ? Json() : Json::parse(result.out);
    }

    static std::string glasses() { return (sourceDir() / "examples/scenes/glasses.glb").string(); }

    Json render(const std::string& name, std::vector<std::string> more) const {
        more.insert(more.begin(), {"render", glasses(), "-o", at(name), "--size", "80x45"});
        return run(more);
    }

    /// Runs a verb once per file format. The files must have equal arrays and the reported sizes.
    void expectSameArrays(std::vector<std::string> arguments) {
        arguments.insert(arguments.end(), {"-o", ""});
        for (const std::string_view extension : arrayExtensions()) {
            arguments.back() = at("same" + std::string(extension));
            std::vector<std::string> planned = arguments;
            planned.emplace_back("--dry-run");
            const Json plan = run(planned);
            run(arguments);
            const std::uint64_t bytes = fs::file_size(arguments.back());
            EXPECT_NE(plan.dump().find(std::to_string(bytes)), std::string::npos)
                << arguments.back() << ' ' << bytes << ' ' << plan.dump();
        }
        const auto same = runPython(kSameArrays, {at("same.npz"), at("same.safetensors")});
        EXPECT_EQ(same.exit_code, 0) << arguments.front() << same.err;
    }

    ScratchDir scratch_;
};

TEST_F(ArraysBetweenPrograms, LayersGoThroughThemByteForByte) {
    const std::vector<std::string> ways[] = {
        {},
        {"--channels", "all", "--crop", "11,9,50,31"},
        {"--transmission", "color", "--channels", "id", "--precision", "float"},
        {"--samples", "4", "--layers", "3"},
        {"--tile", "2/3"},
    };
    for (const auto& way : ways) {
        const Json written = render("a.safetensors", way);
        EXPECT_EQ(written["bytes"], fs::file_size(at("a.safetensors")));
        for (const char* kind : {"ldi", "deep"}) {
            std::vector<std::string> as = way;
            as.insert(as.end(), {"--as", kind});
            const Json rendered = render("rendered.exr", as);
            EXPECT_EQ(rendered["fragmentsStored"], written["fragmentsStored"]);
            run({"convert", at("a.safetensors"), "-o", at("converted.exr"), "--as", kind});
            EXPECT_TRUE(bytesOf(at("converted.exr")) == bytesOf(at("rendered.exr")))
                << kind << ' ' << (way.empty() ? "" : way.front());
        }
        run({"convert", at("rendered.exr"), "-o", at("back.safetensors")});
        run({"convert", at("back.safetensors"), "-o", at("again.exr"), "--as", "deep"});
        EXPECT_TRUE(bytesOf(at("again.exr")) == bytesOf(at("rendered.exr")));
    }
}

TEST_F(ArraysBetweenPrograms, EveryVerbReadsThem) {
    render("a.exr", {"--channels", "id"});
    render("a.safetensors", {"--channels", "id"});
    const std::string arrays = at("a.safetensors"), layers = at("a.exr");
    const auto expectSame = [&](std::vector<std::string> arguments, const std::string& name) {
        for (const std::string& input : {layers, arrays}) {
            arguments[1] = input;
            arguments.back() = at((input == layers ? "1" : "2") + name);
            run(arguments);
        }
        EXPECT_TRUE(bytesOf(at("1" + name)) == bytesOf(at("2" + name))) << arguments.front();
    };
    expectSame({"flatten", "", "--layers", "3", "-o", ""}, "flat.exr");
    expectSame({"flatten", "", "-o", ""}, "flat.png");
    expectSame({"flatten", "", "-o", ""}, "flat.safetensors");
    expectSame({"sheet", "", "-o", ""}, "sheet.png");
    expectSame({"view", "", "-o", ""}, "view.png");
    expectSame({"extract", "", "--npz", ""}, "arrays.npz");
    expectSame({"extract", "", "--layer", "1", "-o", ""}, "layer.safetensors");
    EXPECT_EQ(runPeeler({"compare", layers, arrays}).exit_code, 0);
    const Json info = run({"info", arrays});
    const Json of_exr = run({"info", layers});
    for (const char* key : {"fragmentsFound", "layers", "depthComplexity", "points", "camera",
                            "complete", "provenance"})
        EXPECT_EQ(info[key], of_exr[key]) << key;
    EXPECT_NE(runPeeler({"info", arrays}).out.find("picture in arrays"), std::string::npos);
    const Json verified = run({"verify", arrays});
    EXPECT_EQ(verified["files"][0]["kind"], "layered");
    EXPECT_EQ(verified["files"][0]["fragments"], info["fragmentsFound"]);
    // A second render recognises the file and keeps it.
    const Json again = render("a.safetensors", {"--channels", "id", "--skip-existing"});
    EXPECT_EQ(again["skipped"], true) << again.dump();
}

TEST_F(ArraysBetweenPrograms, TilesOfThemAreMerged) {
    std::vector<std::string> merge{"merge"};
    for (const char* tile : {"1/2", "2/2"}) {
        merge.push_back(at(std::string("tile") + tile[0] + ".safetensors"));
        render(fs::path(merge.back()).filename().string(), {"--tile", tile});
    }
    render("whole.exr", {});
    merge.insert(merge.end(), {"-o", at("merged.exr")});
    run(merge);
    EXPECT_TRUE(bytesOf(at("merged.exr")) == bytesOf(at("whole.exr")));
}

TEST_F(ArraysBetweenPrograms, BothContainersHoldTheSame) {
    PEELER_REQUIRE_PYTHON("numpy");
    const std::string scene = glasses();
    expectSameArrays({"render", scene, "--size", "40x30", "--as", "arrays", "--channels", "all"});
    expectSameArrays({"render", scene, "--size", "40x30", "--dense", "3"});
    expectSameArrays({"render", scene, "--size", "40x30", "--as", "xray"});
    expectSameArrays({"rays", scene, "--directions", "2", "--resolution", "24"});
    expectSameArrays({"rays", scene, "--axes", "--resolution", "24", "--map", "first,count"});
    expectSameArrays({"bake", scene, "--directions", "4"});
    expectSameArrays({"bake", scene, "--directions", "4", "--quantity", "bent-normal"});
    const std::string voxels[] = {"rays", scene, "--voxels", "8"};
    expectSameArrays({std::begin(voxels), std::end(voxels)});
}

TEST_F(ArraysBetweenPrograms, CompositesAreArraysToo) {
    PEELER_REQUIRE_PYTHON("numpy");
    render("a.exr", {"--as", "composite"});
    render("a.safetensors", {"--as", "composite"});
    render("a.npz", {"--as", "composite"});
    EXPECT_EQ(
        runPeeler({"compare", at("a.exr"), at("a.safetensors"), "--max-color", "0.001"}).exit_code,
        0);
    EXPECT_EQ(run({"verify", at("a.safetensors")})["files"][0]["kind"], "flat");
    const auto read = runPython(
        "import sys, numpy\n"
        "a = numpy.load(sys.argv[1])\n"
        "assert a['rgba'].shape == (45, 80, 4) and a['z'].shape == (45, 80)\n"
        "assert (numpy.isinf(a['z']) == (a['rgba'][..., 3] == 0)).all()\n",
        {at("a.npz")});
    EXPECT_EQ(read.exit_code, 0) << read.err;
}

TEST_F(ArraysBetweenPrograms, ScenesComeAsArrays) {
    const std::string path = at("scene.safetensors");
    const float vertices[] = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
    ArrayWriter writer(path, {{"vertices", NumberType::kFloat, {3, 3}}},
                       {{"base_color", "[1, 0, 0, 0.5]"}, {"alpha_mode", "BLEND"}});
    writer.append(0, asBytes(vertices));
    writer.finish();
    const Json info = run({"info", path});
    EXPECT_EQ(info["kind"], "scene") << info.dump();
    const Json picture = run({"render", path, "-o", at("a.safetensors"), "--size", "16x16"});
    EXPECT_GT(picture["fragmentsStored"].get<int>(), 30);
    EXPECT_EQ(runPeeler({"convert", path, "-o", at("b.exr")}).exit_code, 3);
    EXPECT_EQ(runPeeler({"render", at("a.safetensors"), "-o", at("b.exr")}).exit_code, 3);
    // Files of arrays in a folder are not scenes.
    const Outcome folder = runPeeler({"render", scratch_.path().string(), "-o", at("{stem}.exr")});
    EXPECT_EQ(folder.exit_code, 3) << folder.err;
}

TEST_F(ArraysBetweenPrograms, WhatDoesNotFitIsRefused) {
    const std::string scene = glasses();
    for (const std::vector<std::string>& more : {std::vector<std::string>{"--layout", "nuke"},
                                                 {"--compression", "rle"},
                                                 {"--no-composite"},
                                                 {"--cryptomatte"},
                                                 {"--background", "1,1,1"},
                                                 {"--as", "ldi"},
                                                 {"--as", "deep"}}) {
        std::vector<std::string> arguments{"render", scene, "-o", at("a.safetensors")};
        arguments.insert(arguments.end(), more.begin(), more.end());
        EXPECT_EQ(runPeeler(arguments).exit_code, 2) << more.front();
    }
    EXPECT_EQ(runPeeler({"render", scene, "-o", at("a.npz"), "--as", "layers"}).exit_code, 2);
}

TEST_F(ArraysBetweenPrograms, CompositesAreMergedAsComposites) {
    const Json rendered = render("whole.safetensors", {"--as", "composite"});
    const Json merged = run({"merge", at("whole.safetensors"), "-o", at("merged.exr")});
    EXPECT_EQ(merged.at("layers"), rendered.at("layers"));
    render("whole.exr", {"--as", "composite", "--precision", "float"});
    // The layers were stored as half floats before compositing, hence the tolerance.
    const Json same = run({"compare", at("merged.exr"), at("whole.exr"), "--max-color", "0.001"});
    EXPECT_EQ(same.at("a").at("layered"), false);
}

}  // namespace
}  // namespace peeler::test
