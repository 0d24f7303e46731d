// SPDX-License-Identifier: Apache-2.0
// Output paths, formats and reports: options, checks before any work, results after it.
#include "cmd/options/output_options.h"

#include <algorithm>
#include <set>
#include <system_error>
#include <vector>

#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "core/base/error.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/exr_layout.h"
#include "formats/file/atomic_file.h"
#include "formats/file/file_name.h"
#include "formats/image/image_writer.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

/// Whether both name one file, however they are spelt; a file that is not there yet has only its
/// spelling.
bool sameFile(const fs::path& a, const fs::path& b) {
    std::error_code failure;
    if (fs::equivalent(a, b, failure)) return true;
    return a.lexically_normal() == b.lexically_normal();
}

std::vector<std::string_view> toneMapNames() {
    std::vector<std::string_view> names;
    for (const ToneMap& row : toneMaps())
        names.push_back(row.name);
    return names;
}

std::string toneMapNamed(const std::string& text) {
    const auto names = toneMapNames();
    if (std::find(names.begin(), names.end(), text) == names.end())
        refuseName("tone map", text, names);
    return text;
}

double parseExposure(const std::string& text) {
    const double stops = parseNumber(text);
    if (std::abs(stops) > 100) throw Error(ErrorKind::kUsage, "expected stops from -100 to 100");
    return stops;
}

}  // namespace

void addOutputFile(VerbOptions& verb, OutputFlags& flags, bool layers_only) {
    std::string extensions;
    std::set<std::string_view> known;
    for (const OutputFormat& format : outputFormats()) {
        if (!flags.as.empty() && format.kind != flags.as) continue;
        if (layers_only && !format.holdsFragments()) continue;
        for (const std::string_view extension : format.extensions) {
            if (!known.insert(extension).second) continue;
            extensions += (extensions.empty() ? "" : ", ") + std::string(extension);
        }
    }
    addValue(
        verb, "-o,--output", "FILE", flags.path,
        [](const std::string& text) { return fs::path(text); }, "the file to write: " + extensions)
        .group("Output")
        .required();
    verb.addFlag("--no-clobber", flags.no_clobber, "fail if the file is there already")
        .group("Output");
}

void addOutputOptions(VerbOptions& verb, OutputFlags& flags) {
    const auto add = [&](const char* name, const char* value, auto& target, auto parse,
                         const std::string& help) {
        return addValue(verb, name, value, target, parse, help).group("Output");
    };
    addOutputFile(verb, flags);
    add(
        "--background", "COLOR", flags.background,
        [](const std::string& text) { return parseColor(text); },
        "behind a composite: transparent (default), r,g,b[,a] in linear light, or #rrggbb[aa] in "
        "sRGB");
    add("--exposure", "STOPS", flags.exposure, parseExposure,
        "brightens (or darkens) what is not an EXR (default: 0)");
    std::string maps;
    for (const ToneMap& row : toneMaps()) {
        maps += '\n' + std::string(row.name) + (maps.empty() ? " (default): " : ": ") +
                std::string(row.summary);
    }
    add("--tone-map", "NAME", flags.tone_map, toneMapNamed,
        "how what is not an EXR shows bright light" + maps);
}

void addFxaaOption(VerbOptions& verb, bool& fxaa, const std::string& remark) {
    verb.addFlag("--fxaa", fxaa, "smooths the stairs along a composite's edges: " + remark)
        .group("Output");
}

void addLayerOutputOptions(VerbOptions& verb, OutputFlags& flags, bool layers_only) {
    std::string kinds;
    std::set<std::string_view> known;
    std::vector<std::string_view> names;
    for (const OutputFormat& format : outputFormats()) {
        if (layers_only && !format.holdsFragments()) continue;
        if (!known.insert(format.kind).second) continue;
        names.push_back(format.kind);
        kinds += (kinds.empty() ? "" : " or ") + std::string(format.kind);
    }
    addValue(
        verb, "--as", "KIND", flags.as,
        [names](const std::string& text) {
            if (std::find(names.begin(), names.end(), text) == names.end()) {
                refuseName("kind", text, names);
            }
            return text;
        },
        kinds + " (default: by the extension; .exr holds layers)")
        .group("Output");
    verb.addFlag("--no-composite", flags.no_composite,
                 "layers only, without the part that shows them composited")
        .group("Output");
    addLayerFileOptions(verb, flags.layers);
}

void checkFolder(const fs::path& file) {
    const AtomicFile probe(file.string());
}

void checkFormat(const OutputFlags& flags) {
    const OutputFormat& format = findOutputFormat(flags.path.string(), flags.as);
    checkLayerFileOptions(flags.layers, format);
    const bool composite = format.holds(OutputContent::kComposite);
    if (!format.takesBackground()) {
        constexpr const char* kCompositeHint = "add --as composite, or choose another extension";
        if (flags.background) refuse("layers have no background", "--background", kCompositeHint);
        if (flags.exposure) refuse("layers are stored as rendered", "--exposure", kCompositeHint);
        if (flags.tone_map) refuse("layers are stored as rendered", "--tone-map", kCompositeHint);
    }
    if (flags.no_composite && composite) {
        refuse("this output is nothing but the composite", "--no-composite", "leave it out");
    }
    if (flags.no_composite && !format.holds(OutputContent::kLayers))
        refuse("this output has no composite", "--no-composite", "leave it out");
    if (flags.no_composite && flags.layers.layout == kPerFileLayout)
        refuse("the composite's file is the one that names the others", "--no-composite",
               "leave it out, or choose another --layout");
    if (format.for_display) return;
    constexpr const char* kLinear = "an EXR holds linear light as rendered";
    constexpr const char* kDisplayHint = "write a .png, .jpg or .tif";
    if (flags.exposure) refuse(kLinear, "--exposure", kDisplayHint);
    if (flags.tone_map) refuse(kLinear, "--tone-map", kDisplayHint);
}

void checkNotThere(const fs::path& file) {
    std::error_code failure;
    if (!fs::exists(fs::symlink_status(file, failure))) return;
    throw Error(ErrorKind::kOutput, "the file is there already", file.string(),
                "remove it, choose another name, or leave --no-clobber out");
}

void checkTarget(const OutputFlags& flags, const std::vector<fs::path>& inputs) {
    for (const fs::path& input : inputs) {
        for (const std::string& file : exrFilesOf(input.string())) {
            if (!sameFile(flags.path, file)) continue;
            throw Error(ErrorKind::kUsage,
                        file == input.string() ? "the output is the input"
                                               : "the output is a file of the input",
                        flags.path.string(), "choose another name for the output");
        }
    }
    if (flags.no_clobber) checkNotThere(flags.path);
    checkLayerFiles(flags.layers, flags.path, inputs, flags.no_clobber);
}

std::vector<fs::path> checkSeries(const OutputFlags& flags, std::span<const int> numbers,
                                  const std::vector<fs::path>& inputs) {
    if (!hasFrameToken(flags.path.string())) {
        checkTarget(flags, inputs);
        return {flags.path};
    }
    std::vector<fs::path> files;
    OutputFlags file = flags;
    for (const int number : numbers) {
        file.path = framePath(flags.path.string(), number);
        checkTarget(file, inputs);
        files.push_back(file.path);
    }
    return files;
}

void checkOutput(const OutputFlags& flags, const std::vector<fs::path>& inputs) {
    checkFormat(flags);
    checkTarget(flags, inputs);
    checkFolder(flags.path);
}

OutputOptions outputOptions(const OutputFlags& flags, const Provenance& provenance) {
    OutputOptions options;
    options.as = flags.as;
    options.composite_part = !flags.no_composite;
    if (flags.background) {
        options.background = *flags.background;
        for (std::size_t i = 0; i < 3; ++i)
            options.background[i] *= options.background[3];
    }
    if (flags.exposure) options.exposure = static_cast<float>(*flags.exposure);
    if (flags.tone_map) options.tone_map = *flags.tone_map;
    options.provenance = provenance;
    applyLayerFileOptions(flags.layers, options);
    return options;
}

bool keepsCryptomatte(const ExrInfo& input, const OutputFlags& output) {
    const OutputFormat& format = findOutputFormat(output.path.string(), output.as);
    return input.has_cryptomatte && !input.provenance.ids.empty() && format.channels &&
           format.hasComposite() && !output.no_composite;
}

void checkExtraFile(const fs::path& file, const std::vector<fs::path>& others,
                    const std::string& what, const std::string& option) {
    for (const fs::path& other : others) {
        if (!sameFile(file, other) && !isExrLayerFile(file.string(), other.string())) continue;
        throw Error(ErrorKind::kUsage, what + " would replace the input or the output",
                    option + " " + file.string(), "choose another name for it");
    }
    checkFolder(file);
}

void checkReport(const ReportOptions& options, const std::vector<fs::path>& others) {
    if (options.file) checkExtraFile(*options.file, others, "the report", "--report");
}

void checkSceneFiles(const Scene& scene, const std::vector<fs::path>& outputs) {
    const std::set<fs::path> files(scene.files.begin(), scene.files.end());
    for (const fs::path& output : outputs) {
        std::error_code failure;
        if (!files.contains(fs::weakly_canonical(fs::absolute(output, failure), failure))) continue;
        throw Error(ErrorKind::kUsage, "this would replace a file that the scene is made of",
                    output.string(), "choose another name");
    }
}

void addThreadsOption(VerbOptions& verb, int& threads) {
    addValue(
        verb, "--threads", "N", threads,
        [](const std::string& text) { return static_cast<int>(parseInteger(text, 0, 1024)); },
        "processors to use (default: 0, as many as CPU affinity, the cgroup's quota, "
        "SLURM_CPUS_PER_TASK and CUE_THREADS allow)")
        .group("Machine");
}

}  // namespace peeler::cmd
