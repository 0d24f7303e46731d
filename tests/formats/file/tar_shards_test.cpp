// SPDX-License-Identifier: Apache-2.0
// Tests tar shards: compares their bytes with IEEE Std 1003.1-2017 (pax, "ustar Interchange
// Format"), reads them with Python's tarfile, and tests full, kept and damaged shards.
#include "formats/file/tar_shards.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>

#include <peeler/error.h>
#include "formats/file/temporary_files.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;

/// A Python program that prints the members of tar files, in order: [file, name, contents].
constexpr const char* kMembers = R"(
import json, sys, tarfile
found = []
for path in sys.argv[1:]:
    with tarfile.open(path) as tar:
        for member in tar:
            assert member.isreg() and member.mode == 0o644 and member.uid == member.gid == 0
            found.append([path, member.name, tar.extractfile(member).read().decode("latin1")])
print(json.dumps(found))
)";

class Shards : public testing::Test {
  protected:
    std::string write(const std::string& name, const std::string& text) const {
        std::ofstream(scratch_ / name, std::ios::binary) << text;
        return (scratch_ / name).string();
    }
    /// Adds a sample of two files; `hash` identifies its contents.
    TarShards::Stored add(TarShards& shards, const std::string& key, const std::string& hash = "h",
                          std::size_t bytes = 600) const {
        const std::string text = key + hash + std::string(bytes, 'x');
        const SampleFile files[] = {{"png", write("in.png", text)},
                                    {"ldi.npz", write("in.npz", "npz of " + key)}};
        return shards.add(key, {{"outputHash", hash}, {"scene", key}}, files);
    }
    /// Makes these samples in one run: keeps each sample that an earlier run stored with the same
    /// hash, and adds the others. Returns the keys of the added samples.
    std::vector<std::string> run(const std::vector<std::pair<std::string, std::string>>& samples,
                                 const ShardSettings& settings, bool all = true) const {
        TarShards shards(pattern_, settings);
        bad_ = shards.findExisting();
        std::vector<std::string> added;
        for (const auto& [key, hash] : samples) {
            if (shards.contains(key, hash)) {
                shards.keep(key);
                continue;
            }
            add(shards, key, hash);
            added.push_back(key);
        }
        shards.finish(all);
        surplus_ = shards.surplus();
        return added;
    }
    static std::vector<std::pair<std::string, std::string>> samples(
        std::initializer_list<const char*> keys) {
        std::vector<std::pair<std::string, std::string>> all;
        for (const char* key : keys)
            all.emplace_back(key, "h");
        return all;
    }
    fs::path shard(int number) const {
        return scratch_ / ("s-00" + std::to_string(number) + ".tar");
    }
    ino_t inode(int number) const {
        struct stat found {};
        return stat(shard(number).c_str(), &found) == 0 ? found.st_ino : 0;
    }
    std::vector<std::string> bytes() const {
        std::vector<std::string> all;
        for (int i = 0; fs::exists(shard(i)); ++i)
            all.push_back(test::bytesOf(shard(i)));
        return all;
    }

    test::ScratchDir scratch_;
    std::string pattern_ = (scratch_ / "s-%03d.tar").string();
    mutable std::vector<std::string> bad_;
    mutable std::string surplus_;
};

TEST_F(Shards, HaveTheBytesOfTheStandard) {
    const SampleFile file{"txt", write("in", "hello")};
    TarShards shards(pattern_);
    const auto stored = shards.add("k", {{"outputHash", "0f"}}, {&file, 1});
    EXPECT_EQ(stored.shard, shard(0).string());
    EXPECT_EQ(stored.bytes, 5U);
    EXPECT_FALSE(fs::exists(shard(0))) << "it is not whole yet";
    shards.finish();

    const auto header = [](const std::string& name, const std::string& size) {
        std::string block(512, '\0');
        const auto put = [&](std::size_t at, const std::string& text) {
            block.replace(at, text.size(), text);
        };
        put(0, name);
        put(100, "0000644");
        put(108, "0000000");
        put(116, "0000000");
        put(124, size);
        put(136, "00000000000");
        put(148, "        ");
        put(156, "0");
        put(257, "ustar");
        put(263, "00");
        put(329, "0000000");
        put(337, "0000000");
        const unsigned sum = std::accumulate(
            block.begin(), block.end(), 0U,
            [](unsigned all, char c) { return all + static_cast<unsigned char>(c); });
        char text[8];
        std::snprintf(text, sizeof text, "%06o", sum);
        put(148, std::string(text) + '\0' + ' ');
        return block;
    };
    const auto padded = [](std::string text) {
        text.resize((text.size() + 511) / 512 * 512);
        return text;
    };
    const std::string about = "{\"outputHash\":\"0f\"}\n";
    EXPECT_EQ(test::bytesOf(shard(0)), header("k.txt", "00000000005") + padded("hello") +
                                           header("k.json", "00000000024") + padded(about) +
                                           std::string(1024, '\0'));
    EXPECT_EQ(about.size(), 024U);
}

TEST_F(Shards, AreThoseOfPythonAndReadByIt) {
    setenv("SOURCE_DATE_EPOCH", "86400", 1);
    const std::string big(3'000'000, 'b');
    const SampleFile files[] = {{"bin", write("big", big)}, {"none", write("none", "")}};
    {
        TarShards shards(pattern_);
        shards.add("key_0001", {{"outputHash", "0f"}, {"view", 1}}, files);
        shards.finish();
    }
    unsetenv("SOURCE_DATE_EPOCH");
    const auto read = test::runPython(kMembers, {shard(0).string()});
    ASSERT_EQ(read.exit_code, 0) << read.err;
    const auto members = nlohmann::json::parse(read.out);
    ASSERT_EQ(members.size(), 3U);
    EXPECT_EQ(members[0][1], "key_0001.bin");
    EXPECT_TRUE(members[0][2] == big);
    EXPECT_EQ(members[1][1], "key_0001.none");
    EXPECT_EQ(members[1][2], "");
    EXPECT_EQ(members[2][2], "{\"outputHash\":\"0f\",\"view\":1}\n");
    // Python must write the same file, except for the device numbers (empty in Python's files), the
    // header checksums (which include the device numbers), and the zeros that fill the last record.
    const auto made = test::runPython(R"(
import io, sys, tarfile
source, made = open(sys.argv[1], "rb").read(), io.BytesIO()
with tarfile.open(fileobj=made, mode="w", format=tarfile.USTAR_FORMAT) as out, \
     tarfile.open(sys.argv[1]) as tar:
    headers = [member.offset for member in tar]
    for member in tar:
        info = tarfile.TarInfo(member.name)
        info.size, info.mode, info.mtime = member.size, 0o644, 86400
        out.addfile(info, tar.extractfile(member))
def compared(data):
    data = bytearray(data)
    for header in headers:
        for field, size in ((148, 8), (329, 8), (337, 8)):
            data[header + field : header + field + size] = bytes(size)
    return data.rstrip(b"\0")
assert compared(made.getvalue()) == compared(source)
)",
                                      {shard(0).string()});
    EXPECT_EQ(made.exit_code, 0) << made.err;
}

TEST_F(Shards, AreFullByNumberOrBySize) {
    EXPECT_EQ(run(samples({"a", "b", "c", "d", "e"}), {.samples = 2}).size(), 5U);
    EXPECT_EQ(bytes().size(), 3U);
    // A sample has three headers and 1024 + 512 + 512 bytes of data. A file has another 1024 bytes
    // at its end.
    const std::uint64_t sample = 3 * 512 + 1024 + 512 + 512;
    for (const auto& [most, shards] : {std::pair{2 * sample + 1024, std::size_t{3}},
                                       std::pair{2 * sample + 1023, std::size_t{5}},
                                       std::pair{std::uint64_t{1}, std::size_t{5}}}) {
        for (int i = 0; fs::exists(shard(i)); ++i)
            fs::remove(shard(i));
        run(samples({"a", "b", "c", "d", "e"}), {.bytes = most});
        EXPECT_EQ(bytes().size(), shards) << most;
        if (most > 1) {
            for (const std::string& shard : bytes())
                EXPECT_LE(shard.size(), most);
        }
    }
}

TEST_F(Shards, OfWhichAllIsKeptAreNotTouched) {
    const ShardSettings settings{.samples = 2};
    const auto all = samples({"a", "b", "c", "d", "e"});
    run(all, settings);
    const auto before = bytes();
    const ino_t inodes[] = {inode(0), inode(1), inode(2)};
    EXPECT_TRUE(run(all, settings).empty());
    EXPECT_EQ(bytes(), before);
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(inode(i), inodes[i]);
    fs::remove(shard(1));
    EXPECT_EQ(run(all, settings), (std::vector<std::string>{"c", "d"}));
    EXPECT_EQ(bytes(), before);
    EXPECT_EQ(inode(0), inodes[0]);
    EXPECT_EQ(inode(2), inodes[2]);
}

TEST_F(Shards, AreMadeOfWhatIsKeptAndWhatIsNew) {
    const ShardSettings settings{.bytes = 9000};
    auto all = samples({"a", "b", "c", "d", "e"});
    all[3].second = "new";
    run(all, settings);
    const auto wanted = bytes();
    for (int i = 0; fs::exists(shard(i)); ++i)
        fs::remove(shard(i));
    run(samples({"a", "b", "c", "d", "e"}), settings);
    EXPECT_NE(bytes(), wanted);
    EXPECT_EQ(run(all, settings), std::vector<std::string>{"d"});
    EXPECT_EQ(bytes(), wanted) << "as if made at once";
    // With other limits, another order or fewer samples, no shard is written again, and surplus
    // shards are reported.
    EXPECT_TRUE(run(all, {.samples = 3}).empty());
    EXPECT_EQ(surplus_, shard(2).string());
    fs::remove(shard(2));
    std::ranges::reverse(all);
    EXPECT_TRUE(run(all, {.samples = 4}).empty());
    EXPECT_TRUE(run(samples({"b", "c"}), {}).empty());
    const auto read = test::runPython(kMembers, {shard(0).string()});
    EXPECT_EQ(nlohmann::json::parse(read.out).size(), 6U);
    EXPECT_EQ(nlohmann::json::parse(read.out)[0][1], "b.png");
}

TEST_F(Shards, ThatAreDamagedCountForNothing) {
    const auto all = samples({"a", "b"});
    run(all, {});
    const std::string whole = test::bytesOf(shard(0));
    const auto made = [&](std::string damaged) {
        write("s-000.tar", damaged);
        const std::size_t added = run(all, {}).size();
        EXPECT_EQ(test::bytesOf(shard(0)), whole);
        EXPECT_EQ(bad_.size(), added > 0 ? 1U : 0U);
        return added;
    };
    EXPECT_EQ(made(whole), 0U);
    for (const std::size_t size : {0U, 511U, 512U, 1024U, 3000U})
        EXPECT_EQ(made(whole.substr(0, size)), 2U) << size;
    EXPECT_EQ(made(whole.substr(0, whole.size() - 1)), 2U);
    EXPECT_EQ(made(whole.substr(0, whole.size() - 512)), 2U);
    EXPECT_EQ(made(whole + std::string(512, '\0')), 2U);
    // The reader must not trust damaged sizes and names in headers, so both samples are added
    // again.
    for (const auto& [at, text] : {std::pair<std::size_t, std::string>{124, "77777777777"},
                                   {124, "00000000000"},
                                   {0, "/"},
                                   {0, "b.png"},
                                   {156, "5"},
                                   {257, "USTAR"},
                                   {345, "p"},
                                   {148, "000000"}}) {
        std::string damaged = whole;
        damaged.replace(at, text.size(), text);
        EXPECT_EQ(made(damaged), 2U) << at << ' ' << text;
    }
    // The reader must not trust a size that exceeds the file, even with a correct checksum.
    std::string damaged = whole;
    damaged.replace(124, 11, "77777777777");
    unsigned sum = 8 * ' ';
    for (std::size_t i = 0; i < 512; ++i)
        if (i < 148 || i >= 156) sum += static_cast<unsigned char>(damaged[i]);
    char text[8];
    std::snprintf(text, sizeof text, "%06o", sum);
    damaged.replace(148, 6, text);
    EXPECT_EQ(made(damaged), 2U);
    // The recorded properties of a sample must also be valid JSON.
    const std::size_t about = whole.find("{\"outputHash\"");
    damaged = whole;
    damaged[about] = '[';
    EXPECT_EQ(made(damaged), 2U);
}

TEST_F(Shards, OfARunThatIsGivenUpLoseNothing) {
    run(samples({"a", "b", "c"}), {});
    const auto before = bytes();
    run({{"a", "other"}}, {}, false);
    EXPECT_EQ(bytes(), before);
    run(samples({"x", "y", "z", "w"}), {}, false);
    EXPECT_NE(bytes(), before);
}

TEST_F(Shards, RefuseWhatTheyCannotHold) {
    const auto refused = [&](const std::string& pattern, const std::string& key,
                             const ShardSettings& settings) {
        TarShards shards(pattern, settings);
        add(shards, "first");
        try {
            add(shards, key);
        } catch (const Error& error) {
            EXPECT_FALSE(error.hint().empty());
            shards.finish();
            EXPECT_TRUE(fs::exists(shards.nameOf(0)));
            return error.kind();
        }
        return ErrorKind::kInternal;
    };
    EXPECT_EQ(refused(pattern_, std::string(96, 'k'), {}), ErrorKind::kOutput);
    EXPECT_EQ(refused((scratch_ / "one.tar").string(), "second", {.samples = 1}),
              ErrorKind::kUsage);
    TarShards shards(pattern_, {.replaces = false});
    EXPECT_THROW(add(shards, "a"), Error);
    setenv("SOURCE_DATE_EPOCH", "-1", 1);
    EXPECT_THROW(TarShards{pattern_}, Error);
    unsetenv("SOURCE_DATE_EPOCH");
}

TEST_F(Shards, FilesInAScratchFolderGoWithIt) {
    fs::path folder;
    {
        const ScratchFolder scratch(scratch_ / "new");
        folder = scratch.path();
        EXPECT_TRUE(isScratchFile(folder / "a.png"));
        EXPECT_FALSE(isScratchFile("a.png"));
        AtomicFile file(folder / "a.png");
        file.commit();
        EXPECT_TRUE(fs::exists(folder / "a.png"));
        const ScratchFolder other(scratch_ / "new");
        EXPECT_TRUE(fs::exists(folder)) << "it is locked";
    }
    EXPECT_TRUE(fs::is_empty(scratch_ / "new"));
    // A folder of a killed process on this machine. The folder is not locked, so it is removed.
    const fs::path left = scratch_ / "other" / folder.filename();
    fs::create_directories(left);
    std::ofstream(left / "a.png") << "half";
    const AtomicFile file(scratch_ / "other/b.png");
    EXPECT_FALSE(fs::exists(left));
}

}  // namespace
}  // namespace peeler
