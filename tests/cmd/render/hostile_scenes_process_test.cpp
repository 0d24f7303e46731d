// SPDX-License-Identifier: Apache-2.0
// Tests scenes that declare huge data, and scenes that try to read other files. The command must
// reject or draw them, with little memory and time.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdio>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "core/base/parallel.h"
#include "core/base/process_memory.h"
#include "formats/image/png_builder.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

std::string toText(const Bytes& bytes) {
    return {bytes.begin(), bytes.end()};
}

/// Runs `info` on a scene. It loads the same data as `render`.
CommandResult info(const fs::path& scene, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"info", scene.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runPeelerProcess(arguments);
}

// ---- sizes

struct Hostile {
    const char* name;
    void (*change)(Json&);
    const char* where;
    const char* words;
};

class HostileSizes : public testing::TestWithParam<Hostile> {};

constexpr std::uint64_t kHugeCount = std::uint64_t{1} << 31U;

/// Declares that the buffer's 48 bytes contain the positions, compressed and without a fallback.
void compress(Json& scene, std::uint64_t count, std::uint64_t stride) {
    scene["buffers"].push_back({{"byteLength", 1}});
    scene["bufferViews"][0] = {{"buffer", 1},
                               {"byteLength", count * stride},
                               {"extensions",
                                {{"EXT_meshopt_compression",
                                  {{"buffer", 0},
                                   {"byteLength", 48},
                                   {"count", count},
                                   {"byteStride", stride},
                                   {"mode", "ATTRIBUTES"}}}}}};
}

/// Returns the memory limit, in bytes, for a child that allocates almost nothing. It includes this
/// process's memory, because a child begins as a copy of this process.
std::uint64_t mostMemory() {
    return residentBytes() + (std::uint64_t{200} << 20);
}

TEST_P(HostileSizes, AreRefusedBeforeAnythingIsAllocated) {
    const ScratchDir scratch;
    Json scene = triangleScene();
    GetParam().change(scene);
    // A meshopt stream begins with 0xA0.
    std::string buffer = triangleBuffer();
    buffer[0] = '\xA0';
    const CommandResult run = info(writeScene(scratch.path(), scene, buffer));
    EXPECT_EQ(run.exit_code, 3) << run.err;
    EXPECT_TRUE(contains(run.err, std::string(": ") + GetParam().where)) << run.err;
    EXPECT_TRUE(contains(run.err, GetParam().words)) << run.err;
    EXPECT_LT(run.cpu_seconds, kEndlessSeconds);
    if (!kShadowMemory) {
        EXPECT_LT(run.peak_memory, mostMemory());
    }
}

INSTANTIATE_TEST_SUITE_P(
    All, HostileSizes,
    testing::Values(
        Hostile{"Accessor", [](Json& s) { s["accessors"][0]["count"] = kHugeCount; },
                "/accessors/0", "ends at byte"},
        Hostile{"Indices", [](Json& s) { s["accessors"][1]["count"] = kHugeCount; }, "/accessors/1",
                "ends at byte"},
        Hostile{"AccessorWithoutData",
                [](Json& s) {
                    s["accessors"][0].erase("bufferView");
                    s["accessors"][0]["count"] = kHugeCount;
                },
                "/accessors/0/count", "at most"},
        Hostile{"AccessorOf2To53", [](Json& s) { s["accessors"][0]["count"] = 9007199254740991; },
                "/accessors/0", "ends at byte"},
        Hostile{"BufferView", [](Json& s) { s["bufferViews"][0]["byteLength"] = kHugeCount; },
                "/bufferViews/0", "ends at byte"},
        Hostile{"Buffer", [](Json& s) { s["buffers"][0]["byteLength"] = kHugeCount; }, "/buffers/0",
                "truncated"},
        Hostile{"Sparse",
                [](Json& s) {
                    s["accessors"][0]["sparse"] = {
                        {"count", kHugeCount - 1},
                        {"indices", {{"bufferView", 1}, {"componentType", 5125}}},
                        {"values", {{"bufferView", 0}}}};
                },
                "/accessors/0/sparse/count", "substituted"},
        Hostile{"SparseOfAHugeAccessor",
                [](Json& s) {
                    s["accessors"][0].erase("bufferView");
                    s["accessors"][0]["count"] = kHugeCount;
                    s["accessors"][0]["sparse"] = {
                        {"count", kHugeCount - 1},
                        {"indices", {{"bufferView", 1}, {"componentType", 5125}}},
                        {"values", {{"bufferView", 0}}}};
                },
                "/accessors/0/count", "at most"},
        Hostile{"Meshopt", [](Json& s) { compress(s, kHugeCount, 256); },
                "/bufferViews/0/extensions/EXT_meshopt_compression", "need at least"},
        Hostile{"MeshoptOf2To53Bytes", [](Json& s) { compress(s, std::uint64_t{1} << 45U, 256); },
                "/bufferViews/0/extensions/EXT_meshopt_compression", "need at least"},
        Hostile{"DracoAccessors",
                [](Json& s) {
                    s["accessors"][0]["count"] = kHugeCount * 4096;
                    s["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
                        {"bufferView", 0}, {"attributes", {{"POSITION", 0}}}};
                },
                "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression",
                "more than the limit"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(HostileScenes, APictureOf60000SquareIsNotDecoded) {
    const ScratchDir scratch;
    Json scene = triangleScene();
    scene["images"] = {{{"uri", "huge.png"}}};
    scene["textures"] = {{{"source", 0}}};
    scene["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    writeText(scratch / "huge.png", toText(png(60000, 60000, PngColor::kGrey, 8, {})));
    const fs::path path = writeScene(scratch.path(), scene);
    const CommandResult lenient = info(path);
    EXPECT_EQ(lenient.exit_code, 0) << lenient.err;
    EXPECT_TRUE(contains(lenient.err, "60000 x 60000")) << lenient.err;
    if (!kShadowMemory) {
        EXPECT_LT(lenient.peak_memory, mostMemory());
    }
    EXPECT_LT(lenient.cpu_seconds, kEndlessSeconds);
    const CommandResult strict =
        runPeelerProcess({"render", path, "-o", scratch / "a.exr", "--size", "16x16", "--strict"});
    EXPECT_EQ(strict.exit_code, 3) << strict.err;
    EXPECT_TRUE(contains(strict.err, ": /images/0")) << strict.err;
}

/// In a chain of nodes, recursion would overflow the stack, and multiplying matrices from the root
/// would take quadratic time.
TEST(HostileScenes, AChainOfAMillionNodesIsRefused) {
    const ScratchDir scratch;
    Json scene = triangleScene();
    // In quadratic time, either count would take too long.
    const int count = exhaustive() ? 1000000 : 100000;
    std::string nodes = "[";
    for (int i = 0; i + 1 < count; ++i)
        nodes += "{\"children\":[" + std::to_string(i + 1) + "]},";
    nodes += "{\"mesh\":0}]";
    scene["nodes"] = "NODES";
    writeScene(scratch.path(), scene);
    std::string text = scene.dump();
    text.replace(text.find("\"NODES\""), 7, nodes);
    writeText(scratch / "scene.gltf", text);
    const CommandResult run = info(scratch / "scene.gltf");
    EXPECT_EQ(run.exit_code, 3) << run.err;
    EXPECT_TRUE(contains(run.err, "nested deeper than 10000 levels: /nodes/")) << run.err;
    EXPECT_LT(run.cpu_seconds, kEndlessSeconds);
}

TEST(HostileScenes, DeepJsonIsRefused) {
    const ScratchDir scratch;
    const std::size_t depth = 5000000;
    writeText(scratch / "scene.gltf", R"({"asset":{"version":"2.0"},"extras":)" +
                                          std::string(depth, '[') + std::string(depth, ']') + "}");
    const CommandResult run = info(scratch / "scene.gltf");
    EXPECT_EQ(run.exit_code, 3) << run.err;
    EXPECT_TRUE(contains(run.err, "nested deeper")) << run.err;
    EXPECT_LT(run.cpu_seconds, kEndlessSeconds);
}

// ---- the sandbox

/// The URI of a file, and whether the file can be read with --allow-outside.
struct Place {
    const char* name;
    std::string uri;
    bool readable_if_allowed;
};

class Sandbox : public testing::Test {
  protected:
    /// Makes a scratch folder with scene/, for the scene, and outside/, for the forbidden files.
    Sandbox() {
        fs::create_directories(scene_ / "folder.bin");
        fs::create_directory(outside_);
        writeText(outside_ / "secret.bin", triangleBuffer());
        writeText(outside_ / "secret.png", toText(png(1, 1, PngColor::kGrey, 8, {7})));
        for (const char* name : {"secret.bin", "secret.png"})
            fs::create_symlink(outside_ / name, scene_ / ("link-" + std::string(name)));
        fs::create_directory_symlink(outside_, scene_ / "away");
        fs::create_symlink("/dev/zero", scene_ / "zero.bin");
        EXPECT_EQ(mkfifo((scene_ / "pipe.bin").c_str(), 0600), 0);
    }

    /// Returns URIs for a file in outside/.
    std::vector<Place> places(const std::string& file) const {
        return {{"Parent", "../outside/" + file, true},
                {"Encoded", "%2e%2e/outside/" + file, true},
                {"EncodedSlash", "..%2Foutside%2F" + file, true},
                {"Inwards", "folder.bin/../../outside/" + file, true},
                {"Absolute", (outside_ / file).string(), true},
                {"Link", "link-" + file, true},
                {"LinkedFolder", "away/" + file, true},
                {"FileUri", "file://" + (outside_ / file).string(), true},
                {"Folder", "folder.bin", false},
                {"Pipe", "pipe.bin", false},
                {"Device", "zero.bin", false},
                {"AbsoluteDevice", "/dev/zero", false},
                {"Decoy", file, false}};
    }

    fs::path sceneWithBuffer(const std::string& uri, std::size_t number = 0) const {
        Json scene = triangleScene();
        scene["buffers"][0]["uri"] = uri;
        return write(scene, number);
    }

    fs::path sceneWithImage(const std::string& uri, std::size_t number) const {
        Json scene = triangleScene();
        scene["images"] = {{{"uri", uri}}};
        scene["textures"] = {{{"source", 0}}};
        scene["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
        writeText(scene_ / "triangle.bin", triangleBuffer());
        return write(scene, number);
    }

    /// The results for a scene that refers to one Place, without and with --allow-outside. The
    /// working folder contains a decoy with the file's name.
    struct Runs {
        CommandResult plain, allowed;
    };
    std::vector<Runs> runAll(const std::vector<fs::path>& scenes) const {
        std::vector<Runs> runs(scenes.size());
        parallelFor(scenes.size(), [&](std::size_t i) {
            runs[i].plain = runPeelerProcess({"info", scenes[i]}, {}, outside_);
            runs[i].allowed =
                runPeelerProcess({"info", scenes[i], "--allow-outside"}, {}, outside_);
        });
        return runs;
    }

  private:
    fs::path write(const Json& scene, std::size_t number) const {
        const fs::path path = scene_ / ("scene" + std::to_string(number) + ".gltf");
        writeText(path, scene.dump());
        return path;
    }

  protected:
    const ScratchDir scratch_;
    const fs::path scene_ = scratch_ / "scene", outside_ = scratch_ / "outside";
};

TEST_F(Sandbox, BuffersStayInIt) {
    const std::vector<Place> all = places("secret.bin");
    std::vector<fs::path> scenes;
    for (const Place& place : all)
        scenes.push_back(sceneWithBuffer(place.uri, scenes.size()));
    const std::vector<Runs> runs = runAll(scenes);
    for (std::size_t i = 0; i < all.size(); ++i) {
        const Place& place = all[i];
        const auto& [plain, allowed] = runs[i];
        SCOPED_TRACE(place.name);
        EXPECT_EQ(plain.exit_code, 3) << plain.out << plain.err;
        EXPECT_TRUE(contains(plain.err, ": /buffers/0/uri")) << plain.err;
        EXPECT_TRUE(contains(plain.err, "peeler: hint: ")) << plain.err;
        EXPECT_EQ(contains(plain.err, "--allow-outside"),
                  place.readable_if_allowed || contains(place.uri, "zero"))
            << plain.err;
        EXPECT_EQ(allowed.exit_code, place.readable_if_allowed ? 0 : 3) << allowed.err;
        EXPECT_EQ(contains(allowed.out, "1 triangle"), place.readable_if_allowed) << allowed.out;
    }
}

TEST_F(Sandbox, ImagesStayInIt) {
    const std::vector<Place> all = places("secret.png");
    std::vector<fs::path> scenes;
    for (const Place& place : all)
        scenes.push_back(sceneWithImage(place.uri, scenes.size()));
    const std::vector<Runs> runs = runAll(scenes);
    for (std::size_t i = 0; i < all.size(); ++i) {
        const Place& place = all[i];
        const auto& [plain, allowed] = runs[i];
        SCOPED_TRACE(place.name);
        EXPECT_EQ(plain.exit_code, 0) << plain.err;
        EXPECT_TRUE(contains(plain.err, "/images/0 is left out")) << plain.err;
        EXPECT_TRUE(contains(plain.out, "textures: 0")) << plain.out;
        EXPECT_EQ(allowed.exit_code, 0) << allowed.err;
        EXPECT_EQ(contains(allowed.out, "textures: 1"), place.readable_if_allowed) << allowed.out;
    }
}

TEST_F(Sandbox, EveryVerbLiftsIt) {
    const fs::path scene = sceneWithBuffer("../outside/secret.bin");
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"render", scene, "-o", scratch_ / "a.exr", "--size", "16x16"},
          {"sheet", scene, "-o", scratch_ / "a.png", "--size", "16x16"},
          {"info", scene}}) {
        EXPECT_EQ(runPeelerProcess(arguments).exit_code, 3) << arguments[0];
        std::vector<std::string> lifted = arguments;
        lifted.push_back("--allow-outside");
        const CommandResult run = runPeelerProcess(lifted);
        EXPECT_EQ(run.exit_code, 0) << arguments[0] << run.err;
    }
    EXPECT_GT(fs::file_size(scratch_ / "a.exr"), 0U);
    EXPECT_GT(fs::file_size(scratch_ / "a.png"), 0U);
}

}  // namespace
}  // namespace peeler::test
