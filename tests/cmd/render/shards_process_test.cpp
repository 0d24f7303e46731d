// SPDX-License-Identifier: Apache-2.0
// Tests runs that are killed at random moments while they write shards. Files with final names must
// be complete.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr int kViews = 24, kOfAShard = 4;

/// A Python program that prints the members of shards with their hashes. Fails if tarfile cannot
/// read a shard to its end, or if a sample is incomplete.
constexpr const char* kRead = R"(
import hashlib, json, sys, tarfile
found = {}
for path in sys.argv[1:]:
    keys = {}
    with tarfile.open(path) as tar:
        for member in tar:
            key, extension = member.name.split(".", 1)
            content = tar.extractfile(member).read()
            assert len(content) == member.size > 0
            keys.setdefault(key, set()).add(extension)
            assert member.name not in found
            found[member.name] = hashlib.sha256(content).hexdigest()
    assert keys and all(files == {"png", "ldi.npz", "npy", "json"} for files in keys.values()), keys
print(json.dumps(found))
)";

class KilledShards : public testing::Test {
  protected:
    static std::vector<std::string> line(const fs::path& out) {
        const fs::path scene = sourceDir() / "examples/scenes/coincident.glb";
        return {"render",
                scene.string(),
                "-o",
                (out / "s-%03d.tar").string(),
                "-q",
                "--preset",
                "lari",
                "--size",
                "64x64",
                "--views",
                std::to_string(kViews),
                "--shard-count",
                std::to_string(kOfAShard),
                "--skip-existing"};
    }
    /// Returns the shards in a folder, and the number of other files in it.
    static std::vector<std::string> shardsIn(const fs::path& folder,
                                             std::size_t* others = nullptr) {
        std::vector<std::string> shards;
        if (others) *others = 0;
        for (const auto& entry : fs::directory_iterator(folder)) {
            const std::string name = entry.path().filename().string();
            if (!name.starts_with('.') && name.ends_with(".tar"))
                shards.push_back(entry.path().string());
            else if (others)
                ++*others;
        }
        std::ranges::sort(shards);
        return shards;
    }
    static Json membersOf(const fs::path& folder) {
        const auto read = runPython(kRead, shardsIn(folder));
        EXPECT_EQ(read.exit_code, 0) << read.err;
        return read.exit_code == 0 ? Json::parse(read.out) : Json();
    }

    ScratchDir scratch_;
};

TEST_F(KilledShards, AreWholeOrNotThere) {
    const char* given = std::getenv("PEELER_TEST_SEED");
    const unsigned seed =
        given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : std::random_device{}();
    std::mt19937 random{seed};
    const fs::path whole = scratch_ / "whole", out = scratch_ / "out";
    fs::create_directories(out);
    const auto start = std::chrono::steady_clock::now();
    ASSERT_EQ(runPeelerProcess(line(whole)).exit_code, 0);
    std::chrono::duration<double> takes = std::chrono::steady_clock::now() - start;
    const Json members = membersOf(whole);
    ASSERT_EQ(members.size(), std::size_t{4 * kViews});
    ASSERT_EQ(shardsIn(whole).size(), std::size_t{kViews / kOfAShard});

    const int kills = exhaustive() ? 40 : 10;
    int killed = 0, runs = 0;
    std::size_t left = 0;
    for (; killed < kills && runs < 3 * kills; ++runs) {
        // A random half of the shards already exists.
        for (const std::string& shard : shardsIn(out))
            if (random() % 2 == 0) fs::remove(shard);
        const std::size_t before = shardsIn(out).size();
        const std::size_t wanted = random() % 3;  // new shards to wait for before the kill
        std::uniform_real_distribution<double> part(0, wanted == 0 ? 0.5 : 0.2);
        StartedCommand run(peelerCommand(line(out)));
        while (wanted > 0 && run.running() && shardsIn(out).size() < before + wanted)
            std::this_thread::sleep_for(200us);
        std::this_thread::sleep_for(part(random) * takes);
        kill(run.pid(), SIGKILL);
        const CommandResult result = run.wait();
        ASSERT_TRUE(result.exit_code == 137 || result.exit_code == 0) << result.err;
        killed += result.exit_code == 137;
        // If the run ended before it was killed, kill the next runs earlier.
        if (result.exit_code == 0) takes *= 0.8;
        std::size_t others = 0;
        shardsIn(out, &others);
        left += others;
        const Json there = membersOf(out);
        for (const auto& [name, hash] : there.items())
            ASSERT_EQ(hash, members.value(name, "")) << name << ", seed " << seed;
    }
    ASSERT_EQ(runPeelerProcess(line(out)).exit_code, 0);
    EXPECT_EQ(membersOf(out), members);
    std::size_t others = 0;
    const std::vector<std::string> shards = shardsIn(out, &others);
    EXPECT_EQ(others, 0U) << "what killed runs left is still there";
    for (const std::string& shard : shards)
        EXPECT_EQ(bytesOf(shard), bytesOf(whole / fs::path(shard).filename())) << shard;
    std::printf(
        "seed %u: %d runs, %d of them killed (the others had ended), %zu hidden files and folders "
        "left behind and removed\n",
        seed, runs, killed, left);
    EXPECT_EQ(killed, kills);
}

TEST_F(KilledShards, TerminationLeavesNothing) {
    const fs::path out = scratch_ / "out";
    StartedCommand run(peelerCommand(line(out)));
    while (run.running() && (!fs::exists(out) || shardsIn(out).empty()))
        std::this_thread::sleep_for(200us);
    kill(run.pid(), SIGTERM);
    EXPECT_EQ(run.wait().exit_code, 143);
    std::size_t others = 0;
    EXPECT_FALSE(shardsIn(out, &others).empty());
    EXPECT_EQ(others, 0U);
}

}  // namespace
}  // namespace peeler::test
