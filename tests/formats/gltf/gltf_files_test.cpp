// SPDX-License-Identifier: Apache-2.0
// Tests which files a scene may open, and the messages for files that are not scenes.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <set>

#include "formats/gltf/gltf_builder.h"
#include "formats/gltf/gltf_reader.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Returns the triangle with this URI for its buffer.
GltfBuilder withUri(const std::string& uri) {
    GltfBuilder builder = triangle();
    builder.gltf["buffers"] = {{{"byteLength", builder.bin.size()}, {"uri", uri}}};
    return builder;
}

/// A change of the working folder, which the destructor reverts.
class WorkingFolder {
  public:
    explicit WorkingFolder(const fs::path& folder) : before_(fs::current_path()) {
        fs::current_path(folder);
    }
    ~WorkingFolder() { fs::current_path(before_); }

  private:
    fs::path before_;
};

void expectBufferRefused(const ScratchDir& folder, const std::string& uri,
                         const std::string& words) {
    const Error error = errorOf(withUri(uri).write(folder));
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_EQ(error.where(), "/buffers/0/uri");
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    EXPECT_FALSE(error.hint().empty());
}

TEST(GltfFiles, ReadsNamesOfEveryKindInsideTheFolder) {
    const ScratchDir folder;
    fs::create_directory(folder / "sub");
    const struct {
        const char *uri, *name;
    } cases[] = {{"plain.bin", "plain.bin"},
                 {"./sub/deep.bin", "sub/deep.bin"},
                 {"with%20space.bin", "with space.bin"},
                 {"with space.bin", "with space.bin"},
                 {"%E2%9D%A4.bin", "\u2764.bin"},
                 {"\u2764\u267B.bin", "\u2764\u267B.bin"},
                 {"100%.bin", "100%.bin"},
                 {"a%3Ab.bin", "a:b.bin"},
                 {"sub/../plain.bin", "plain.bin"}};
    for (const auto& [uri, name] : cases) {
        const GltfBuilder builder = withUri(uri);
        writeFile(folder / name, builder.bin);
        GltfBuilder copy = builder;
        EXPECT_NO_THROW(readGltf(copy.write(folder))) << uri;
    }
}

TEST(GltfFiles, ListsWhatASceneNamesReadOrNot) {
    GltfBuilder builder = triangle();
    builder.gltf["images"] = {{{"uri", "wood%20grain.png"}},
                              {{"uri", "maps/../wood%20grain.png"}},
                              {{"uri", "/elsewhere/sky.png"}},
                              {{"uri", "data:image/png;base64,AAAA"}},
                              {{"uri", "https://example.com/a.png"}}};
    const ScratchDir folder;
    const fs::path home = fs::canonical(folder.path());
    const fs::path file = builder.write(folder);
    const auto files = [&](bool allow_outside) {
        GltfOptions options;
        options.allow_outside = allow_outside;
        const std::vector<fs::path> list = readGltf(file, options).files;
        const std::set<fs::path> set(list.begin(), list.end());
        EXPECT_EQ(set.size(), list.size());
        return set;
    };
    std::set<fs::path> expected{home / "scene.bin", home / "wood grain.png"};
    EXPECT_EQ(files(false), expected);
    expected.insert("/elsewhere/sky.png");
    EXPECT_EQ(files(true), expected);
}

TEST(GltfFiles, ReadsDataUris) {
    const GltfBuilder plain = triangle();
    std::string percent = "data:application/octet-stream,";
    const char* digits = "0123456789abcdef";
    for (const std::uint8_t byte : plain.bin)
        percent += std::string("%") + digits[byte >> 4] + digits[byte & 15];
    EXPECT_EQ(load(withUri(percent)).meshes[0].primitives[0].positions[1], glm::vec3(1, 0, 0));
    // "TWFu" is the base64 of "Man", an example from RFC 4648.
    const auto withBytes = [](const char* uri, int length) {
        GltfBuilder builder;
        builder.gltf["buffers"] = {{{"byteLength", length}, {"uri", uri}}};
        return builder;
    };
    EXPECT_NO_THROW(load(withBytes("data:;base64,TWFu", 3)));
    EXPECT_NO_THROW(load(withBytes("DATA:application/gltf-buffer;BASE64,TWE=", 2)));
    EXPECT_EQ(errorOf(withBytes("data:;base64,TWE=", 3)).where(), "/buffers/0");
    EXPECT_EQ(errorOf(withBytes("data:;base64,TW!u", 3)).where(), "/buffers/0/uri");
    EXPECT_EQ(errorOf(withBytes("data:;base64", 3)).where(), "/buffers/0/uri");
}

TEST(GltfFiles, RefusesWhatLeavesTheFolder) {
    const ScratchDir outer;
    writeFile(outer / "outside.bin", triangle().bin);
    const ScratchDir folder;
    fs::create_directory(folder / "sub");
    writeFile(folder / "inside.bin", triangle().bin);
    expectBufferRefused(folder, "../outside.bin", "..");
    expectBufferRefused(folder, "%2e%2e/outside.bin", "..");
    expectBufferRefused(folder, "sub/../../outside.bin", "..");
    expectBufferRefused(folder, outer / "outside.bin", "absolute");
    expectBufferRefused(folder, "/etc/hostname", "absolute");
    expectBufferRefused(folder, "%2Fetc/hostname", "absolute");
    expectBufferRefused(folder, "file:///etc/hostname", "absolute");
    expectBufferRefused(folder, "http://127.0.0.1/a.bin", "data: URIs");
    expectBufferRefused(folder, "C:\\a.bin", "absolute");
    expectBufferRefused(folder, "inside.bin%00.png", "not a file name");
    expectBufferRefused(folder, "", "not a file name");

    fs::create_symlink(outer / "outside.bin", folder / "link.bin");
    expectBufferRefused(folder, "link.bin", "symbolic link");
    fs::create_directory_symlink(outer.path(), folder / "away");
    expectBufferRefused(folder, "away/outside.bin", "symbolic link");
    // A folder whose name merely begins with the scene folder's name is outside.
    const std::string twin = folder.path().string() + "-twin";
    fs::create_directory(twin);
    writeFile(fs::path(twin) / "a.bin", triangle().bin);
    fs::create_symlink(fs::path(twin) / "a.bin", folder / "twin.bin");
    expectBufferRefused(folder, "twin.bin", "symbolic link");
    fs::remove_all(twin);
}

TEST(GltfFiles, FollowsLinksThatStayInTheFolder) {
    const ScratchDir folder;
    GltfBuilder builder = withUri("link.bin");
    writeFile(folder / "real.bin", builder.bin);
    fs::create_symlink("real.bin", folder / "link.bin");
    EXPECT_NO_THROW(readGltf(builder.write(folder)));
}

TEST(GltfFiles, RefusesWhatIsNoRegularFile) {
    const ScratchDir folder;
    fs::create_directory(folder / "folder.bin");
    ASSERT_EQ(mkfifo((folder / "pipe.bin").c_str(), 0600), 0);
    expectBufferRefused(folder, "folder.bin", "folder");
    expectBufferRefused(folder, "pipe.bin", "not a regular file");
    expectBufferRefused(folder, ".", "folder");
    expectBufferRefused(folder, "missing.bin", "does not exist");
    fs::create_symlink("loop.bin", folder / "loop.bin");
    EXPECT_EQ(errorOf(withUri("loop.bin").write(folder)).where(), "/buffers/0/uri");
}

TEST(GltfFiles, NeverLooksInTheCurrentFolder) {
    const ScratchDir folder, elsewhere;
    GltfBuilder builder = withUri("decoy.bin");
    writeFile(elsewhere / "decoy.bin", builder.bin);
    builder.gltf["images"] = {{{"uri", "decoy.png"}}};
    builder.gltf["textures"] = {{{"source", 0}}};
    builder.gltf["materials"] = {
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    writeFile(elsewhere / "decoy.png", std::string("not even an image"));
    const fs::path scene = builder.write(folder);
    {
        const WorkingFolder there(elsewhere.path());
        EXPECT_EQ(errorOf(scene).where(), "/buffers/0/uri");
    }
    writeFile(folder / "decoy.bin", builder.bin);
    {
        const WorkingFolder there(elsewhere.path());
        EXPECT_TRUE(warned(readGltf(scene), "does not exist"));
    }
    {
        const WorkingFolder there(folder.path());
        EXPECT_NO_THROW(readGltf("scene.gltf"));
    }
}

TEST(GltfFiles, CapsTheSizeOfEveryFile) {
    const ScratchDir folder;
    GltfBuilder builder = withUri("big.bin");
    builder.bin.resize(100000);
    writeFile(folder / "big.bin", builder.bin);
    GltfOptions options;
    options.max_file_bytes = 50000;
    EXPECT_EQ(errorOf(builder.write(folder), options).where(), "/buffers/0/uri");
    options.max_file_bytes = 10;
    const fs::path scene = builder.write(folder);
    EXPECT_EQ(errorOf(scene, options).where(), scene.string());
}

TEST(GltfFiles, SaysWhatIsWrongWithTheSceneFileItself) {
    const ScratchDir folder;
    const auto expect = [&](const fs::path& path, const std::string& words) {
        const Error error = errorOf(path);
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_EQ(error.where(), path.string());
        EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
        EXPECT_FALSE(error.hint().empty()) << error.what();
    };
    const auto expectText = [&](const std::string& text, const std::string& words) {
        writeFile(folder / "scene.gltf", text);
        expect(folder / "scene.gltf", words);
    };
    expect(folder / "missing.gltf", "does not exist");
    expect(folder / "missing/scene.gltf", "does not exist");
    expect(folder.path(), "folder");
    ASSERT_EQ(mkfifo((folder / "pipe.glb").c_str(), 0600), 0);
    expect(folder / "pipe.glb", "not a regular file");
    expectText("", "empty");
    expectText(" \n", "the file contains no JSON");
    expectText("\x89PNG\r\n\x1A\n", "neither binary glTF nor a JSON object");
    expectText("[]", "it is an array, not an object");
    expectText("{}", "no \"asset\"");
    expectText(R"({"asset": 2})", "no \"asset\"");
    expectText("{\"asset\":\n {\"version\": }", "line 2, column 14");
    expectText(R"({"asset":{"version":"2.0"}} trailing)", "not valid JSON");
    expectText("{\"asset\":{\"version\":\"\xFF\"}}", "not valid JSON");
    expectText(R"({"asset":{"version":"2.0"},"a":1e999})", "not valid JSON");
    std::string deep = R"({"asset":{"version":"2.0"},"extras":)";
    deep += std::string(1000000, '[') + std::string(1000000, ']') + "}";
    expectText(deep, "nested deeper");
}

TEST(GltfFiles, IgnoresByteOrderMarksAndBracketsInStrings) {
    const ScratchDir folder;
    writeFile(folder / "scene.gltf",
              "\xEF\xBB\xBF{\"asset\":{\"version\":\"2.0\",\"generator\":\"" +
                  std::string(1000, '[') + "\\\"\"}}");
    EXPECT_EQ(readGltf(folder / "scene.gltf").generator, std::string(1000, '[') + "\"");
}

TEST(GltfContainer, IsToldByItsContent) {
    const ScratchDir folder;
    const fs::path binary = triangle().write(folder, "scene.glb");
    fs::rename(binary, folder / "named.gltf");
    EXPECT_EQ(readGltf(folder / "named.gltf").meshes[0].primitives[0].positions.size(), 3U);
}

TEST(GltfContainer, RefusesDamage) {
    const ScratchDir folder;
    const auto expect = [&](const std::string& bytes, const std::string& words) {
        writeFile(folder / "scene.glb", bytes);
        const Error error = errorOf(folder / "scene.glb");
        EXPECT_EQ(error.where(), (folder / "scene.glb").string());
        EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    };
    const std::string good = glb(R"({"asset":{"version":"2.0"}})", {1, 2, 3, 4});
    const auto patched = [&](std::size_t offset, char byte) {
        std::string bytes = good;
        bytes[offset] = byte;
        return bytes;
    };
    // The file has 12 bytes of header, 8 + 28 of JSON and 8 + 4 of BIN.
    ASSERT_EQ(good.size(), 60U);
    expect(good.substr(0, 59), "truncated: the header says 60 bytes, but only 59 are there");
    expect(good.substr(0, 8), "truncated");
    expect(patched(4, 1), "binary glTF 1");
    expect(patched(12, 100), "truncated: the chunk header says 100 bytes, but only 40 are there");
    expect(patched(48, 5), "truncated: the chunk header says 5 bytes, but only 4 are there");
    expect(patched(15, '\x7F'), "truncated");
    expect(patched(16, 'X'), "first chunk is not JSON");
    expect(patched(8, 12).substr(0, 12), "no JSON chunk");
    expect(patched(8, 16).substr(0, 16),
           "truncated: the chunk header says 8 bytes, but only 4 are there");
    for (std::size_t size = 0; size < good.size(); ++size) {
        writeFile(folder / "scene.glb", good.substr(0, size));
        EXPECT_EQ(errorOf(folder / "scene.glb").kind(), ErrorKind::kInput) << size;
    }
}

TEST(GltfContainer, IgnoresWhatFollows) {
    const ScratchDir folder;
    writeFile(folder / "scene.glb", glb(R"({"asset":{"version":"2.0"}})", {}) + "more");
    EXPECT_TRUE(warned(readGltf(folder / "scene.glb"), "longer than its header says"));
}

TEST(GltfContainer, MayBeLongerThanTheBufferButNotShorter) {
    GltfBuilder builder = triangle();
    const ScratchDir folder;
    EXPECT_NO_THROW(readGltf(builder.write(folder, "scene.glb")));
    builder.gltf["buffers"] = {{{"byteLength", 37}}};
    EXPECT_EQ(errorOf(builder.write(folder, "scene.glb")).where(), "/buffers/0");
}

TEST(GltfHash, DependsOnEveryByteAndNothingElse) {
    const ScratchDir folder, other;
    GltfBuilder builder = triangle();
    const std::uint64_t hash = readGltf(builder.write(folder)).content_hash;
    EXPECT_EQ(readGltf(builder.write(other)).content_hash, hash);
    builder.bin[0] ^= 1;
    EXPECT_NE(readGltf(builder.write(folder)).content_hash, hash);
    builder.bin[0] ^= 1;
    builder.gltf["asset"]["generator"] = "x";
    EXPECT_NE(readGltf(builder.write(folder)).content_hash, hash);
}

}  // namespace
}  // namespace peeler::test
