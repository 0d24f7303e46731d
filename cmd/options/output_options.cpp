// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/output_options.h"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/options/dense_options.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/exr_layout.h"
#include "formats/file/atomic_file.h"
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"
#include "formats/image/image_writer.h"
#include "formats/layered/opened_picture.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

float parseExposure(const std::string& text) {
    const double stops = parseNumber(text);
    if (std::abs(stops) > 100) throw Error(ErrorKind::kUsage, "expected stops from -100 to 100");
    return static_cast<float>(stops);
}

/// Parses a background colour and premultiplies it, as OutputOptions requires.
std::array<float, 4> parseBackground(const std::string& text) {
    std::array<float, 4> color = parseColor(text);
    for (std::size_t i = 0; i < 3; ++i)
        color[i] *= color[3];
    return color;
}

constexpr Choice<DeepMerge> kDeepMerges[] = {
    {"off", DeepMerge::kOff, "keep every fragment as a sample"},
    {"exact", DeepMerge::kExact, "merge samples at exactly the same depth"},
    {"by-id", DeepMerge::kById, "merge samples of one object and material within the tolerances"},
    {"by-z", DeepMerge::kByZ, "merge samples within --deep-z-tolerance"},
};

/// Adds an option that applies only to some formats. Records whether the option is given. Otherwise
/// like addValue().
template <class T, class Parse>
Option addGiven(VerbOptions& verb, OutputRequest& output, const char* name, const char* value_name,
                T& target, Parse parse, const std::string& help) {
    return verb.addText(
        name, value_name,
        [&output, &target, name, parse](const std::string& text) {
            target = parse(text);
            output.given.insert(name);
        },
        help);
}

/// Adds an option whose value is the `name` of a row in `rows`. The help lists all rows. Otherwise
/// like addGiven().
template <class Row>
Option addNamed(VerbOptions& verb, OutputRequest& output, const char* option, std::string& target,
                std::span<const Row> rows, const std::string& kind, const std::string& help,
                bool first_is_default) {
    std::vector<std::string_view> names;
    for (const Row& row : rows)
        names.push_back(row.name);
    return addGiven(
               verb, output, option, "NAME", target,
               [names, kind](const std::string& text) {
                   if (std::ranges::find(names, text) == names.end()) refuseName(kind, text, names);
                   return text;
               },
               help)
        .oneOf(describeChoices(rows, first_is_default));
}

float parseTolerance(const std::string& text) {
    const double value = parseNumber(text);
    if (value < 0) throw Error(ErrorKind::kUsage, "expected a number of 0 or more");
    return static_cast<float>(value);
}

/// Parses an error such as 0.001 or 1/1024.
double parseDeepError(const std::string& text) {
    const std::size_t slash = text.find('/');
    const double error = slash == std::string::npos ? parseNumber(text)
                                                    : parseNumber(text.substr(0, slash)) /
                                                          parseNumber(text.substr(slash + 1));
    if (!(error > 0 && error < 1))
        throw Error(ErrorKind::kUsage, "expected a number between 0 and 1, such as 1/1024");
    return error;
}

bool parseDeepKeep(const std::string& text) {
    if (text == "id") return true;
    throw Error(ErrorKind::kUsage, "expected id");
}

/// Declares --layout, --compression, --deep-merge, --deep-z-tolerance, --deep-alpha-tolerance,
/// --deep-error and --deep-keep.
void addLayerFileOptions(VerbOptions& verb, OutputRequest& output) {
    constexpr const char* kGroup = "Layer files";
    OutputOptions& options = output.options;
    addNamed(verb, output, "--layout", options.layout, exrLayouts(), "layout",
             "arrangement of the layers of --as ldi:", true)
        .group(kGroup);
    addNamed(verb, output, "--compression", options.compression, exrCompressions(), "compression",
             "lossless compression of layers; zip is not available for deep images:", false)
        .group(kGroup);
    addChoice<DeepMerge>(verb, "--deep-merge", options.deep_merge.mode, kDeepMerges,
                         "kind of merge",
                         "merge neighbouring samples of --as deep into one with the same composite "
                         "and the nearest depth:")
        .group(kGroup);
    addGiven(verb, output, "--deep-z-tolerance", "X", options.deep_merge.z_tolerance,
             parseTolerance,
             "maximum distance of merged samples behind the nearest one, in scene units")
        .group(kGroup);
    addGiven(verb, output, "--deep-alpha-tolerance", "X", options.deep_merge.alpha_tolerance,
             parseTolerance,
             "maximum alpha difference of merged samples from the nearest one, for by-id (default: "
             "1, any)")
        .group(kGroup);
    addGiven(verb, output, "--deep-error", "E", options.deep_merge.error, parseDeepError,
             "thin the samples of --as deep: at every depth, accumulated colour (relative to the "
             "pixel's largest above 1) and transmittance change by at most E, such as 1/1024")
        .group(kGroup);
    addGiven(verb, output, "--deep-keep", "id", options.deep_merge.keep_ids, parseDeepKeep,
             "keep objects and materials in separate samples with --deep-error; needs the channel "
             "id")
        .group(kGroup);
}

void checkDeepMerge(const OutputRequest& output) {
    const DeepMerge mode = output.options.deep_merge.mode;
    if (output.isGiven("--deep-error") && mode != DeepMerge::kOff)
        refuse("--deep-error merges samples, too", "--deep-merge", "leave out one of the two");
    if (output.isGiven("--deep-keep") && !output.isGiven("--deep-error"))
        refuse("no samples are thinned", "--deep-keep", "add --deep-error");
    const bool by_id = mode == DeepMerge::kById;
    const bool near = by_id || mode == DeepMerge::kByZ;
    if (near && !output.isGiven("--deep-z-tolerance")) {
        refuse("merging samples needs a depth tolerance", "--deep-merge",
               "add --deep-z-tolerance, in scene units");
    }
    if (output.isGiven("--deep-z-tolerance") && !near)
        refuse("the tolerance has no effect", "--deep-z-tolerance",
               "add --deep-merge by-id or by-z");
    if (output.isGiven("--deep-alpha-tolerance") && !by_id)
        refuse("the tolerance has no effect", "--deep-alpha-tolerance", "add --deep-merge by-id");
}

void checkLayerFileOptions(const OutputRequest& output, const OutputFormat& format) {
    const bool deep = format.holds(OutputContent::kSamples);
    if (output.isGiven("--layout") && !format.holds(OutputContent::kLayers))
        refuse("only layered files have a layout", "--layout", "add --as ldi, or leave it out");
    if (output.isGiven("--compression")) {
        if (!format.isCompressed())
            refuse("only layered and deep files have a choice of compression", "--compression",
                   "add --as ldi or --as deep, or leave it out");
        findExrCompression(output.options.compression, deep);
    }
    const auto refuse_if = [&](bool given, const char* option) {
        if (given && !deep)
            refuse("only deep images have samples to merge", option,
                   "add --as deep, or leave it out");
    };
    refuse_if(output.options.deep_merge.mode != DeepMerge::kOff, "--deep-merge");
    for (const char* const option :
         {"--deep-z-tolerance", "--deep-alpha-tolerance", "--deep-error", "--deep-keep"})
        refuse_if(output.isGiven(option), option);
    checkDeepMerge(output);
}

}  // namespace

void addOutputFile(VerbOptions& verb, OutputRequest& output, bool layers_only) {
    std::string listed, endings;
    std::set<std::string_view> known;
    for (const OutputFormat& format : outputFormats()) {
        if (!output.options.as.empty() && format.kind != output.options.as) continue;
        if (layers_only && !format.holdsFragments()) continue;
        for (const std::string_view extension : format.extensions) {
            if (!known.insert(extension).second) continue;
            listed += (listed.empty() ? "" : ", ") + std::string(extension);
            endings += std::string(extension) + ' ';
        }
    }
    const auto toPath = [](const std::string& text) {
        return fs::path(text == "-" ? "-.png" : text);
    };
    addValue(
        verb, "-o,--output", "FILE", output.path, toPath,
        "the file to write: " + listed +
            std::string(layers_only ? "; -.EXT writes this format to standard output"
                                    : "; - writes a PNG to standard output, -.EXT another format"))
        .files(endings)
        .group("Output")
        .required();
    verb.addFlag("--no-clobber", output.no_clobber, "fail if the file exists").group("Output");
    verb.addFlag("--no-mkdir", output.no_mkdir,
                 "fail if the file's folder is missing (default: create it)")
        .group("Output");
}

void addOutputOptions(VerbOptions& verb, OutputRequest& output) {
    addOutputFile(verb, output);
    addDisplayOptions(verb, output);
}

void addDisplayOptions(VerbOptions& verb, OutputRequest& output) {
    OutputOptions& options = output.options;
    addGiven(verb, output, "--background", "COLOR", options.background, parseBackground,
             "background of composites: transparent, a basic colour of CSS such as white, "
             "#rrggbb[aa] or #rgb[a] in sRGB, or r,g,b[,a] in linear light (default: transparent)")
        .group("Output");
    addGiven(
        verb, output, "--exposure", "STOPS", options.exposure, parseExposure,
        "exposure of outputs other than EXR; does not change the background (default: metered for "
        "scenes with lights and for files that are too bright or too dark to show, else 0)")
        .group("Output");
    addNamed(verb, output, "--tone-map", options.tone_map, toneMaps(), "tone map",
             "tone map of outputs other than EXR:", true)
        .group("Output");
}

void addFxaaOption(VerbOptions& verb, bool& fxaa, const std::string& remark) {
    verb.addFlag("--fxaa", fxaa, "antialias a composite's edges with FXAA: " + remark)
        .group("Output");
}

void addLayerOutputOptions(VerbOptions& verb, OutputRequest& output, bool layers_only) {
    std::vector<ChoiceDescription> kinds;
    std::set<std::string_view> known;
    std::vector<std::string_view> names;
    for (const OutputFormat& format : outputFormats()) {
        if (layers_only && !format.holdsFragments()) continue;
        if (!known.insert(format.kind).second) continue;
        names.push_back(format.kind);
        kinds.push_back({std::string(format.kind), std::string(format.summary)});
    }
    addValue(
        verb, "--as", "KIND", output.options.as,
        [names](const std::string& text) {
            if (std::find(names.begin(), names.end(), text) == names.end()) {
                refuseName("kind", text, names);
            }
            return text;
        },
        "kind of output (default: ldi in an .exr, else chosen by the extension):")
        .oneOf(std::move(kinds))
        .group("Output");
    verb.addFlag("--no-composite", output.options.no_composite,
                 "write only the layers, without the composite part")
        .group("Output");
    addLayerFileOptions(verb, output);
    if (layers_only) return;
    addDenseOptions(verb, output);
    verb.addFlag("--compress", output.options.compress,
                 "deflate the arrays of a .npz, also of --as lari, xray and world-tracing; the "
                 "arrays are kept in memory until they are complete")
        .group("Planes");
}

bool OutputRequest::hasFilePerLayer() const {
    return findExrLayout(options.layout).one_file_a_layer;
}

bool OutputRequest::asksForDisplay() const {
    return isGiven("--background") || isGiven("--exposure") || isGiven("--tone-map");
}

bool OutputRequest::leavesExposureOpen() const {
    return !isGiven("--exposure") && findOutputFormat(path.string(), options.as).for_display;
}

OutputOptions OutputRequest::from(const Provenance& provenance) const {
    OutputOptions asked = options;
    asked.provenance = provenance;
    if (!findOutputFormat(path.string(), options.as).for_display) return asked;
    if (!isGiven("--tone-map")) asked.tone_map = toneMaps().front().name;
    asked.outcome = std::make_shared<DisplayOutcome>();
    return asked;
}

void describeDisplay(const OutputOptions& written, bool automatic_exposure, PictureResult& result) {
    if (!written.outcome) return;
    result.display = {written.tone_map, written.outcome->exposure, automatic_exposure,
                      written.outcome->raised_pixels};
}

void noteDisplay(const PictureResult& result, Reporter& reporter) {
    if (!result.display) return;
    const DisplayedAs& display = *result.display;
    const std::string file = result.output.string() + ": ";
    if (display.automatic_exposure && display.exposure != 0) {
        reporter.note(file + "exposed by " + stopsText(display.exposure) +
                      " stops, found by metering; set --exposure to change it");
    }
    // Isolated pixels are not worth a note.
    const auto pixels =
        static_cast<std::uint64_t>(result.width) * static_cast<std::uint64_t>(result.height);
    if (display.alpha_raised_pixels > pixels / 100) {
        reporter.note(file + "alpha was raised in " +
                      countText(display.alpha_raised_pixels, "pixel") +
                      " with more light than coverage (reflections on clear glass); use "
                      "--background or an EXR to keep them exact");
    }
}

void checkFormat(const OutputRequest& output) {
    const OutputFormat& format = findOutputFormat(output.path.string(), output.options.as);
    checkLayerFileOptions(output, format);
    checkDenseOptions(output, format.holds(OutputContent::kPlanes));
    if (output.options.compress && !format.isOverBlack() && lowerExtension(output.path) != ".npz")
        refuse("only the arrays of a .npz can be compressed", "--compress",
               "write a .npz, or leave it out");
    const auto refuse_if_given = [&](const char* what, const char* option, const char* hint) {
        if (output.isGiven(option)) refuse(what, option, hint);
    };
    if (!format.takesBackground()) {
        constexpr const char* kCompositeHint = "add --as composite, or choose another extension";
        refuse_if_given(format.isOverBlack() ? "this sample has a black background"
                                             : "layers have no background",
                        "--background", kCompositeHint);
        if (!format.for_display) {
            refuse_if_given("layers are stored as rendered", "--exposure", kCompositeHint);
            refuse_if_given("layers are stored as rendered", "--tone-map", kCompositeHint);
        }
    }
    if (output.options.no_composite) {
        if (format.holds(OutputContent::kComposite))
            refuse("this output is only the composite", "--no-composite", "leave it out");
        if (!format.hasComposite())
            refuse("this output has no composite", "--no-composite", "leave it out");
        if (output.hasFilePerLayer())
            refuse("the composite's file is needed, because it names the layer files",
                   "--no-composite", "leave it out, or choose another --layout");
    }
    if (format.for_display) return;
    constexpr const char* kLinear = "an EXR holds linear light as rendered";
    constexpr const char* kDisplayHint = "write a .png, .jpg or .tif";
    refuse_if_given(kLinear, "--exposure", kDisplayHint);
    refuse_if_given(kLinear, "--tone-map", kDisplayHint);
}

bool keepsCryptomatte(const ExrInfo& input, const OutputRequest& output) {
    const OutputFormat& format = findOutputFormat(output.path.string(), output.options.as);
    return input.has_cryptomatte && !input.provenance.ids.empty() && format.channels &&
           format.hasComposite() && !output.options.no_composite;
}

void describeFiles(const OutputRequest& output, PictureResult& result, Reporter& reporter) {
    const std::string file = output.path.string();
    result.bytes = fileBytes(file);
    for (const std::string& beside : filesBeside(file, output.options))
        result.bytes += fileBytes(beside);
    if (output.hasFilePerLayer()) {
        for (std::size_t layer = 0; layer < result.layers; ++layer)
            result.bytes += fileBytes(exrLayerFile(file, layer));
        const std::string next = exrLayerFile(file, result.layers);
        if (isSeen(next)) {
            reporter.warning("Layer files from an earlier run remain: " + next +
                             " and possibly more.");
        }
    }
    if (!output.options.deep_merge.merges()) return;
    const Plan plan = openLayered(file)->info().plan;
    result.layers = plan.layers.size();
    result.fragments_stored = plan.fragments_stored;
}

void addThreadsOption(VerbOptions& verb, int& threads) {
    addValue(
        verb, "--threads", "N", threads,
        [](const std::string& text) { return static_cast<int>(parseInteger(text, 0, 1024)); },
        "number of threads (default: 0, as many as CPU affinity, the cgroup's quota, "
        "SLURM_CPUS_PER_TASK and CUE_THREADS allow)")
        .group("Machine");
}

}  // namespace peeler::cmd
