// SPDX-License-Identifier: Apache-2.0
// Tests which options of layer files can be combined with which outputs.
#include "cmd/options/output_options.h"
#include "cmd/options/output_checks.h"

#include <gtest/gtest.h>

#include <peeler/error.h>
#include "formats/exr/exr_layout.h"

namespace peeler::cmd {
namespace {

/// Returns the rejected option; "" if there is none.
std::string refusal(OutputRequest output, const std::string& as) {
    output.path = "out.exr";
    output.options.as = as;
    try {
        checkFormat(output);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_NE(error.hint(), "");
        return error.where();
    }
    return "";
}

TEST(OutputOptionsTest, NothingIsRefusedByDefault) {
    for (const OutputFormat& format : outputFormats()) {
        OutputRequest output;
        output.path = "out" + std::string(format.extensions.front());
        output.options.as = format.kind;
        EXPECT_NO_THROW(checkFormat(output)) << format.kind;
    }
}

TEST(OutputOptionsTest, LayoutsAreForLayeredFiles) {
    for (const ExrLayout& layout : exrLayouts()) {
        OutputRequest output;
        output.options.layout = layout.name;
        output.given = {"--layout"};
        EXPECT_EQ(refusal(output, "ldi"), "");
        EXPECT_EQ(refusal(output, "deep"), "--layout");
        EXPECT_EQ(refusal(output, "composite"), "--layout");
    }
}

TEST(OutputOptionsTest, DeepImagesTakeWhatTheFormatAllows) {
    for (const ExrCompression& compression : exrCompressions()) {
        OutputRequest output;
        output.options.compression = compression.name;
        output.given = {"--compression"};
        EXPECT_EQ(refusal(output, "ldi"), "");
        EXPECT_EQ(refusal(output, "deep"), compression.deep ? "" : "`compression`");
        EXPECT_EQ(refusal(output, "composite"), "--compression");
    }
}

TEST(OutputOptionsTest, MergingIsForDeepFilesAndNeedsItsTolerances) {
    struct Case {
        DeepMerge merge;
        std::optional<float> z, alpha;
        const char* refused;  ///< the option refused for a deep file
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
        OutputRequest output;
        output.options.deep_merge = {one.merge, one.z.value_or(0), one.alpha.value_or(1)};
        if (one.z) output.given.insert("--deep-z-tolerance");
        if (one.alpha) output.given.insert("--deep-alpha-tolerance");
        EXPECT_EQ(refusal(output, "deep"), one.refused);
        EXPECT_NE(refusal(output, "ldi"), "");
        EXPECT_NE(refusal(output, "composite"), "");
    }
}

TEST(OutputOptionsTest, ThinningIsForDeepFilesAndNotForMergedOnes) {
    OutputRequest output;
    output.options.deep_merge.error = 1.0 / 256;
    output.given = {"--deep-error", "--deep-keep"};
    EXPECT_EQ(refusal(output, "deep"), "");
    EXPECT_EQ(refusal(output, "ldi"), "--deep-error");
    output.options.deep_merge.mode = DeepMerge::kExact;
    EXPECT_EQ(refusal(output, "deep"), "--deep-merge");
    output.options.deep_merge.mode = DeepMerge::kOff;
    output.given = {"--deep-keep"};
    EXPECT_EQ(refusal(output, "deep"), "--deep-keep");
}

TEST(OutputOptionsTest, TheCompositeOfASetNamesItAndDeepImagesHaveNone) {
    OutputRequest output;
    output.path = "out.exr";
    output.options.no_composite = true;
    output.options.layout = kPerFileLayout;
    EXPECT_THROW(checkOutput(output, {}), Error);
    output.options.layout.clear();
    output.options.as = "deep";
    EXPECT_THROW(checkOutput(output, {}), Error);
}

}  // namespace
}  // namespace peeler::cmd
