// SPDX-License-Identifier: Apache-2.0
// Which options of layer files go with which output.
#include "cmd/options/output_options.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "formats/exr/exr_layout.h"

namespace peeler::cmd {
namespace {

/// Where the refusal points; "" if there is none.
std::string refusal(OutputRequest flags, const std::string& as) {
    flags.path = "out.exr";
    flags.options.as = as;
    try {
        checkFormat(flags);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_NE(error.hint(), "");
        return error.where();
    }
    return "";
}

TEST(OutputOptionsTest, NothingIsRefusedByDefault) {
    for (const OutputFormat& format : outputFormats()) {
        OutputRequest flags;
        flags.path = "out" + std::string(format.extensions.front());
        flags.options.as = format.kind;
        EXPECT_NO_THROW(checkFormat(flags)) << format.kind;
    }
}

TEST(OutputOptionsTest, LayoutsAreForLayeredFiles) {
    for (const ExrLayout& layout : exrLayouts()) {
        OutputRequest flags;
        flags.options.layout = layout.name;
        flags.given = {"--layout"};
        EXPECT_EQ(refusal(flags, "ldi"), "");
        EXPECT_EQ(refusal(flags, "deep"), "--layout");
        EXPECT_EQ(refusal(flags, "composite"), "--layout");
    }
}

TEST(OutputOptionsTest, DeepImagesTakeWhatTheFormatAllows) {
    for (const ExrCompression& compression : exrCompressions()) {
        OutputRequest flags;
        flags.options.compression = compression.name;
        flags.given = {"--compression"};
        EXPECT_EQ(refusal(flags, "ldi"), "");
        EXPECT_EQ(refusal(flags, "deep"), compression.deep ? "" : "--compression");
        EXPECT_EQ(refusal(flags, "composite"), "--compression");
    }
}

TEST(OutputOptionsTest, MergingIsForDeepFilesAndNeedsItsTolerances) {
    struct Case {
        DeepMerge merge;
        std::optional<float> z, alpha;
        const char* refused;  ///< of a deep file
    };
    const Case cases[] = {
        {DeepMerge::kExact, {}, {}, ""},
        {DeepMerge::kByZ, 0.5F, {}, ""},
        {DeepMerge::kById, 0.5F, {}, ""},
        {DeepMerge::kById, 0.5F, 0.1F, ""},
        {DeepMerge::kOff, 1.0F, {}, "--deep-z-tolerance"},
        {DeepMerge::kOff, {}, 1.0F, "--deep-alpha-tolerance"},
        {DeepMerge::kExact, 1.0F, {}, "--deep-z-tolerance"},
        {DeepMerge::kByZ, {}, {}, "--deep-merge"},
        {DeepMerge::kById, {}, 0.1F, "--deep-merge"},
        {DeepMerge::kByZ, 1.0F, 1.0F, "--deep-alpha-tolerance"},
    };
    for (const Case& one : cases) {
        OutputRequest flags;
        flags.options.deep_merge = {one.merge, one.z.value_or(0), one.alpha.value_or(1)};
        if (one.z) flags.given.insert("--deep-z-tolerance");
        if (one.alpha) flags.given.insert("--deep-alpha-tolerance");
        EXPECT_EQ(refusal(flags, "deep"), one.refused);
        EXPECT_NE(refusal(flags, "ldi"), "");
        EXPECT_NE(refusal(flags, "composite"), "");
    }
}

TEST(OutputOptionsTest, TheCompositeOfASetNamesItAndDeepImagesHaveNone) {
    OutputRequest flags;
    flags.path = "out.exr";
    flags.options.no_composite = true;
    flags.options.layout = kPerFileLayout;
    EXPECT_THROW(checkOutput(flags, {}), Error);
    flags.options.layout.clear();
    flags.options.as = "deep";
    EXPECT_THROW(checkOutput(flags, {}), Error);
}

}  // namespace
}  // namespace peeler::cmd
