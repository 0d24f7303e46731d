// SPDX-License-Identifier: Apache-2.0
// Tests output hashes: every complete file records the hash of its sources.
#include "formats/output_hash.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "core/image/channels.h"
#include "formats/exr/synthetic_image.h"
#include "support/test_support.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHash = "0123456789abcdef";

class EachFormat : public testing::TestWithParam<OutputFormat> {
  protected:
    /// Writes a file of the format with the output hash kHash. Returns the path.
    std::string write(OutputOptions options = {}) const {
        const OutputFormat& format = GetParam();
        const std::string path = scratch_ / ("out" + std::string(format.extensions.front()));
        options.as = format.kind;
        options.provenance.version = "1";
        options.provenance.output_hash = kHash;
        test::SyntheticPicture picture = test::makePicture({.width = 64, .height = 48});
        for (const Channel channel : format.needs ? format.needs() : std::span<const Channel>()) {
            FragmentArray& array =
                picture.image.extra.emplace_back(emptyArray(channel, picture.plan.color_type));
            array.data.resize(picture.image.fragments() * array.stride());
        }
        test::writePicture(*makeSink(path, options), picture);
        return path;
    }
    test::ScratchDir scratch_;
};

TEST_P(EachFormat, TellsItsHash) {
    EXPECT_EQ(outputHashOf(write()), kHash);
}

TEST_P(EachFormat, TellsNothingOfAFileThatIsCutOff) {
    const std::string path = write();
    const auto size = fs::file_size(path);
    for (const auto left : {size - 1, size - size / 10, size / 2, size / 20, std::uintmax_t{0}}) {
        const std::string cut =
            scratch_ / (std::to_string(left) + fs::path(path).extension().string());
        fs::copy_file(path, cut);
        fs::resize_file(cut, left);
        EXPECT_EQ(outputHashOf(cut), "") << left << " of " << size << " bytes";
    }
}

TEST_P(EachFormat, TellsNothingOfAnotherFile) {
    const std::string path = scratch_ / ("other" + std::string(GetParam().extensions.front()));
    EXPECT_EQ(outputHashOf(path), "");
    std::ofstream(path) << "peeler:outputHash 0123456789abcdef";
    EXPECT_EQ(outputHashOf(path), "");
}

INSTANTIATE_TEST_SUITE_P(All, EachFormat,
                         testing::ValuesIn(outputFormats().begin(), outputFormats().end()),
                         [](const auto& each) {
                             std::string name(each.param.kind);
                             name += each.param.extensions.front();
                             std::erase_if(name, [](char c) { return !std::isalnum(c); });
                             return name;
                         });

TEST(OutputHash, OfASetNeedsAllFiles) {
    const test::ScratchDir scratch;
    const std::string path = scratch / "set.exr";
    OutputOptions options;
    options.layout = "per-file";
    options.provenance.version = "1";
    options.provenance.output_hash = kHash;
    test::writePicture(*makeSink(path, options), test::makePicture({.width = 64, .height = 48}));
    EXPECT_EQ(outputHashOf(path), kHash);
    fs::remove(scratch / "set.layer_001.exr");
    EXPECT_EQ(outputHashOf(path), "");
}

TEST(OutputHash, IsOfAllThatDecidesWhatIsInTheFile) {
    std::set<std::string> hashes;
    View view;
    OutputOptions options;
    options.provenance.settings_hash = "a";
    const auto isNew = [&](const std::string& path = "a.exr") {
        return hashes.insert(outputHash(view, path, options)).second;
    };
    EXPECT_TRUE(isNew());
    EXPECT_FALSE(isNew("b.exr"));  // the file's name does not matter
    options.provenance.version = "2";
    options.provenance.renderer = "other";
    options.provenance.method = "dual";
    EXPECT_FALSE(isNew());
    options.as = "ldi";  // the default kind, given by name, makes no difference
    EXPECT_FALSE(isNew());
    options.as = "deep";
    EXPECT_TRUE(isNew());
    options.deep_merge.mode = DeepMerge::kExact;
    EXPECT_TRUE(isNew());
    options.as = "composite";
    EXPECT_TRUE(isNew());
    options.background = {1, 0, 0, 1};
    EXPECT_TRUE(isNew());
    EXPECT_TRUE(isNew("a.png"));
    options.exposure = 1;
    EXPECT_TRUE(isNew("a.png"));
    options.tone_map = "aces";
    EXPECT_TRUE(isNew("a.png"));
    view.crop = {0, 0, 5, 5};
    EXPECT_TRUE(isNew());
    view.camera_to_world[3][0] = 1e-9;
    EXPECT_TRUE(isNew());
    options.provenance.time = 0.5;
    EXPECT_TRUE(isNew());
    options.provenance.scene_hash = "b";
    EXPECT_TRUE(isNew());
    options.provenance.settings_hash = "c";
    EXPECT_TRUE(isNew());
    options.as = "ldi";
    EXPECT_TRUE(isNew());
    options.compression = "zips";
    EXPECT_TRUE(isNew());
    options.layout = "single-part";
    EXPECT_TRUE(isNew());
    options.no_composite = true;
    EXPECT_TRUE(isNew());
}

}  // namespace
}  // namespace peeler
