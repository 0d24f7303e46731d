// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/layer_file_options.h"

#include <limits>
#include <string_view>
#include <system_error>

#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/options/output_options.h"
#include "core/base/error.h"
#include "formats/exr/exr_compression.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/exr_layout.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr Choice<DeepMerge> kDeepMerges[] = {
    {"off", DeepMerge::kOff, "every fragment is a sample"},
    {"exact", DeepMerge::kExact, "those at the very same depth"},
    {"by-id", DeepMerge::kById, "those of one object and material within the tolerances"},
    {"by-z", DeepMerge::kByZ, "those within --deep-z-tolerance"},
};

bool isSet(const LayerFileFlags& flags) {
    return flags.layout && findExrLayout(*flags.layout).one_file_a_layer;
}

/// A name of a table with `name` and `summary` in each row, and the table as help.
template <class Row>
Option addNamed(VerbOptions& verb, const char* option, std::optional<std::string>& target,
                std::span<const Row> rows, const std::string& kind, std::string help,
                bool first_is_default) {
    std::vector<std::string_view> names;
    for (const Row& row : rows) {
        help += '\n' + std::string(row.name) +
                (names.empty() && first_is_default ? " (default): " : ": ") +
                std::string(row.summary);
        names.push_back(row.name);
    }
    return addValue(
        verb, option, "NAME", target,
        [names, kind](const std::string& text) {
            for (const std::string_view name : names) {
                if (name == text) return text;
            }
            refuseName(kind, text, names);
        },
        help);
}

double parseTolerance(const std::string& text) {
    const double value = parseNumber(text);
    if (value < 0) throw Error(ErrorKind::kUsage, "expected a number from 0");
    return value;
}

void checkDeepMerge(const LayerFileFlags& flags) {
    const bool by_id = flags.deep_merge == DeepMerge::kById;
    const bool near = by_id || flags.deep_merge == DeepMerge::kByZ;
    if (near && !flags.z_tolerance) {
        refuse("nothing says how near samples must be", "--deep-merge",
               "add --deep-z-tolerance, in scene units");
    }
    if (flags.z_tolerance && !near)
        refuse("no samples are merged by it", "--deep-z-tolerance",
               "add --deep-merge by-id or by-z");
    if (flags.alpha_tolerance && !by_id)
        refuse("no samples are merged by it", "--deep-alpha-tolerance", "add --deep-merge by-id");
}

}  // namespace

void addLayerFileOptions(VerbOptions& verb, LayerFileFlags& flags) {
    constexpr const char* kGroup = "Layer files";
    addNamed(verb, "--layout", flags.layout, exrLayouts(), "layout",
             "where the layers of --as ldi go", true)
        .group(kGroup);
    addNamed(verb, "--compression", flags.compression, exrCompressions(), "compression",
             "lossless compression of layers; deep images take no zip", false)
        .group(kGroup);
    addChoice<DeepMerge>(verb, "--deep-merge", flags.deep_merge, kDeepMerges, "merge",
                         "neighbouring samples of --as deep that become one, with the same "
                         "composite and the nearest's depth:")
        .group(kGroup);
    addValue(verb, "--deep-z-tolerance", "X", flags.z_tolerance, parseTolerance,
             "how far samples that are merged may lie behind the nearest, scene units")
        .group(kGroup);
    addValue(verb, "--deep-alpha-tolerance", "X", flags.alpha_tolerance, parseTolerance,
             "how far their alpha may be from the nearest's, by-id (default: 1, any)")
        .group(kGroup);
}

void checkLayerFileOptions(const LayerFileFlags& flags, const OutputFormat& format) {
    const bool layered = format.holds(OutputContent::kLayers);
    const bool deep = format.holds(OutputContent::kSamples);
    if (flags.layout && !layered)
        refuse("only layered files have a layout", "--layout", "add --as ldi, or leave it out");
    if (flags.compression && !format.holdsFragments())
        refuse("only layers are compressed as asked for", "--compression",
               "add --as ldi or --as deep, or leave it out");
    if (flags.compression) findExrCompression(*flags.compression, deep);
    const bool merging = flags.deep_merge != DeepMerge::kOff;
    if ((merging || flags.z_tolerance || flags.alpha_tolerance) && !deep) {
        refuse("only the samples of deep images are merged",
               merging             ? "--deep-merge"
               : flags.z_tolerance ? "--deep-z-tolerance"
                                   : "--deep-alpha-tolerance",
               "add --as deep, or leave it out");
    }
    checkDeepMerge(flags);
}

void checkLayerFiles(const LayerFileFlags& flags, const fs::path& output,
                     const std::vector<fs::path>& inputs, bool no_clobber) {
    if (!isSet(flags)) return;
    for (const fs::path& input : inputs) {
        for (const std::string& file : exrFilesOf(input.string())) {
            if (isExrLayerFile(file, output.string())) {
                refuse("a layer's file could replace the input " + file, "--layout per-file",
                       "choose another name for the output");
            }
        }
    }
    if (!no_clobber) return;
    std::error_code failure;
    const fs::path folder = output.has_parent_path() ? output.parent_path() : fs::path(".");
    for (const auto& entry : fs::directory_iterator(folder, failure)) {
        if (isExrLayerFile(entry.path().string(), output.string())) checkNotThere(entry.path());
    }
}

void applyLayerFileOptions(const LayerFileFlags& flags, OutputOptions& options) {
    options.layout = flags.layout.value_or("");
    options.compression = flags.compression.value_or("");
    options.deep_merge.mode = flags.deep_merge;
    options.deep_merge.z_tolerance = static_cast<float>(flags.z_tolerance.value_or(0));
    options.deep_merge.alpha_tolerance = static_cast<float>(flags.alpha_tolerance.value_or(1));
}

void describeFiles(const LayerFileFlags& flags, const fs::path& output, PictureResult& result,
                   Console& console) {
    result.bytes = fileBytes(output);
    if (isSet(flags)) {
        for (std::size_t layer = 0; layer < result.layers; ++layer)
            result.bytes += fileBytes(exrLayerFile(output.string(), layer));
        std::error_code failure;
        const std::string next = exrLayerFile(output.string(), result.layers);
        if (fs::exists(next, failure)) {
            console.warning(
                "Files of layers that the picture does not have are there from earlier: " + next +
                " and what may follow.");
        }
    }
    if (flags.deep_merge == DeepMerge::kOff) return;
    const Plan plan = openLayered(output.string())->info().plan;
    result.layers = plan.layers.size();
    result.fragments_stored = plan.fragments_stored;
}

}  // namespace peeler::cmd
