// SPDX-License-Identifier: Apache-2.0
// Tests compressed arrays: NumPy reads the same values from smaller files.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/output_hash.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr const char* kCompareArrays = R"(
import sys, zipfile, numpy as np
plain, packed = (np.load(path, allow_pickle=False) for path in sys.argv[1:3])
assert plain.files == packed.files, (plain.files, packed.files)
for name in plain.files:
    if name == 'output_hash': continue  # the option is part of it
    a, b = plain[name], packed[name]
    assert (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes()), name
with zipfile.ZipFile(sys.argv[2]) as archive:
    assert archive.testzip() is None
    kinds = {member.compress_type for member in archive.infolist()}
assert kinds == {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}, kinds
)";

class Compressed : public testing::Test {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }
    Json render(const std::string& output, const Words& more) const {
        Words line{"render", scene_, "-o", path(output), "--size", "64x36", "--json", "--quiet"};
        line.insert(line.end(), more.begin(), more.end());
        const Outcome result = runPeeler(line);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return result.exit_code == 0 ? Json::parse(result.out) : Json();
    }

    ScratchDir scratch_;
    std::string scene_ = sourceDir() / "examples/scenes/engine.glb";
};

TEST_F(Compressed, ArraysAreTheSame) {
    PEELER_REQUIRE_PYTHON("numpy");
    const std::vector<Words> cases{{"--dense", "4", "--channels", "normal,id"},
                                   {"--as", "arrays", "--channels", "id"},
                                   {"--as", "xray"},
                                   {"--as", "composite"}};
    for (Words kind : cases) {
        const Json plain = render("plain.npz", kind);
        kind.emplace_back("--compress");
        const Json packed = render("packed.npz", kind);
        EXPECT_LT(packed.at("bytes"), plain.at("bytes")) << kind[1];
        EXPECT_GE(packed.at("forecastBytes"), packed.at("bytes")) << kind[1];
        EXPECT_GT(packed.at("forecastMemory"), plain.at("bytes")) << kind[1];
        const Outcome same = runPython(kCompareArrays, {path("plain.npz"), path("packed.npz")});
        EXPECT_EQ(same.exit_code, 0) << kind[1] << same.err;
        EXPECT_EQ(outputHashOf(path("packed.npz")).size(), 16U);
        EXPECT_NE(outputHashOf(path("packed.npz")), outputHashOf(path("plain.npz")));
    }
}

TEST_F(Compressed, BytesAreTheSameWithAnyThreads) {
    render("one.npz", {"--dense", "4", "--compress", "--threads", "1"});
    render("two.npz", {"--dense", "4", "--compress"});
    EXPECT_TRUE(bytesOf(path("one.npz")) == bytesOf(path("two.npz")));
}

TEST_F(Compressed, SamplesAreTheSame) {
    PEELER_REQUIRE_PYTHON("numpy");
    render("plain.png", {"--as", "lari"});
    render("packed.png", {"--as", "lari", "--compress"});
    EXPECT_LT(4 * fs::file_size(path("packed_ldi.npz")), fs::file_size(path("plain_ldi.npz")));
    const Outcome same = runPython(kCompareArrays, {path("plain_ldi.npz"), path("packed_ldi.npz")});
    EXPECT_EQ(same.exit_code, 0) << same.err;
}

TEST_F(Compressed, OtherFilesAreRefused) {
    for (const char* const name : {"a.safetensors", "a.exr", "a.png"}) {
        const Outcome result = runPeeler({"render", scene_, "-o", path(name), "--compress"});
        EXPECT_EQ(result.exit_code, 2) << name;
        EXPECT_TRUE(contains(result.err, "--compress")) << result.err;
    }
}

}  // namespace
}  // namespace peeler::test
