// SPDX-License-Identifier: Apache-2.0
// Which options of layer files go with which output.
#include "cmd/options/layer_file_options.h"

#include <gtest/gtest.h>

#include "cmd/options/output_options.h"
#include "core/base/error.h"
#include "formats/exr/exr_compression.h"
#include "formats/exr/exr_layout.h"

namespace peeler::cmd {
namespace {

/// Where the refusal points; "" if there is none.
std::string refusal(const LayerFileFlags& flags, const std::string& as) {
    try {
        checkLayerFileOptions(flags, findOutputFormat("out.exr", as));
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_NE(error.hint(), "");
        return error.where();
    }
    return "";
}

TEST(LayerFileOptions, NothingIsRefusedByDefault) {
    for (const OutputFormat& format : outputFormats())
        EXPECT_NO_THROW(checkLayerFileOptions({}, format)) << format.kind;
}

TEST(LayerFileOptions, LayoutsAreForLayeredFiles) {
    for (const ExrLayout& layout : exrLayouts()) {
        LayerFileFlags flags;
        flags.layout = std::string(layout.name);
        EXPECT_EQ(refusal(flags, "ldi"), "");
        EXPECT_EQ(refusal(flags, "deep"), "--layout");
        EXPECT_EQ(refusal(flags, "composite"), "--layout");
    }
}

TEST(LayerFileOptions, DeepImagesTakeWhatTheFormatAllows) {
    for (const ExrCompression& compression : exrCompressions()) {
        LayerFileFlags flags;
        flags.compression = std::string(compression.name);
        EXPECT_EQ(refusal(flags, "ldi"), "");
        EXPECT_EQ(refusal(flags, "deep"), compression.deep ? "" : "--compression");
        EXPECT_EQ(refusal(flags, "composite"), "--compression");
    }
}

TEST(LayerFileOptions, MergingIsForDeepFilesAndNeedsItsTolerances) {
    struct Case {
        DeepMerge merge;
        std::optional<double> z, alpha;
        const char* refused;  ///< of a deep file
    };
    const Case cases[] = {
        {DeepMerge::kExact, {}, {}, ""},
        {DeepMerge::kByZ, 0.5, {}, ""},
        {DeepMerge::kById, 0.5, {}, ""},
        {DeepMerge::kById, 0.5, 0.1, ""},
        {DeepMerge::kOff, 1.0, {}, "--deep-z-tolerance"},
        {DeepMerge::kOff, {}, 1.0, "--deep-alpha-tolerance"},
        {DeepMerge::kExact, 1.0, {}, "--deep-z-tolerance"},
        {DeepMerge::kByZ, {}, {}, "--deep-merge"},
        {DeepMerge::kById, {}, 0.1, "--deep-merge"},
        {DeepMerge::kByZ, 1.0, 1.0, "--deep-alpha-tolerance"},
    };
    for (const Case& one : cases) {
        LayerFileFlags flags;
        flags.deep_merge = one.merge;
        flags.z_tolerance = one.z;
        flags.alpha_tolerance = one.alpha;
        EXPECT_EQ(refusal(flags, "deep"), one.refused);
        EXPECT_NE(refusal(flags, "ldi"), "");
        EXPECT_NE(refusal(flags, "composite"), "");
    }
}

TEST(LayerFileOptions, TheCompositeOfASetNamesItAndDeepImagesHaveNone) {
    OutputFlags flags;
    flags.path = "out.exr";
    flags.no_composite = true;
    flags.layers.layout = std::string(kPerFileLayout);
    EXPECT_THROW(checkOutput(flags, {}), Error);
    flags.layers.layout.reset();
    flags.as = "deep";
    EXPECT_THROW(checkOutput(flags, {}), Error);
}

}  // namespace
}  // namespace peeler::cmd
