// SPDX-License-Identifier: Apache-2.0
// Output hashes: their inputs, and where each kind of file stores them.
#include "formats/output_hash.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include <peeler/error.h>
#include "core/image/merge.h"
#include "formats/arrays/array_writer.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/exr_header.h"
#include "formats/exr/exr_integrity.h"
#include "formats/exr/exr_layout.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"
#include "formats/file/regular_file.h"
#include "formats/image/flat_image.h"

namespace peeler {
namespace {

std::string ofExr(const std::string& path) {
    const ExrFiles files(path);
    for (std::size_t part = 0; part < files.parts().size(); ++part)
        files.checkChunks(part);
    requireUnchanged(path);
    return files.parts().front().attribute("peeler:outputHash");
}

std::string ofPage(const std::string& path) {
    const std::string text = readRegularText(path);
    if (!text.ends_with("</html>\n")) return "";
    return outputHashIn(std::string_view(text).substr(0, text.find("</head>")));
}

/// Whether a JPEG ends with the marker EOI (ITU-T T.81 §B.1.1.3). libjpeg would fill a truncated
/// file with grey rows.
bool endsLikeJpeg(const std::string& path) {
    const RegularFile file(path);
    char last[2] = {};
    return file.isOpen() && file.size() >= 2 && file.read(file.size() - 2, last) &&
           last[0] == '\xff' && last[1] == '\xd9';
}

std::string ofImage(const std::string& path) {
    const bool jpeg = fileKind(path) == FileKind::kJpeg;
    if (jpeg && !endsLikeJpeg(path)) return "";
    readFlatImage(path);
    return outputHashIn(imageDescription(path));
}

std::string ofArrays(const std::string& path) {
    const std::string hash = arrayText(path, "output_hash");
    return hash.empty() ? arrayText(path, "peeler:outputHash") : hash;
}

struct HashedKind {
    std::string_view extension;
    std::string (*hash)(const std::string& path);
};
constexpr HashedKind kKinds[] = {
    {".exr", ofExr},    {".html", ofPage},          {".htm", ofPage},
    {".npz", ofArrays}, {".safetensors", ofArrays}, {"", ofImage}};  // "": every other extension

}  // namespace

std::string denseText(const DenseSettings& dense) {
    // JSON has no infinities and no NaN.
    const std::string fill = dense.repeat_last           ? "last"
                             : std::isfinite(dense.fill) ? dumpJson(nlohmann::json(dense.fill))
                             : std::isnan(dense.fill)    ? "nan"
                             : dense.fill > 0            ? "inf"
                                                         : "-inf";
    const char* const type = dense.type == PixelType::kHalf ? "half" : "float";
    return std::to_string(dense.layers) + ' ' + type + ' ' + fill;
}

std::string outputHash(const View& view, const std::string& path, const OutputOptions& output) {
    const Provenance& provenance = output.provenance;
    const std::string merge = deepMergeText(output.deep_merge);
    nlohmann::json all = {
        {"scene", provenance.scene_hash},
        {"settings", provenance.settings_hash},
        {"frame", provenance.frame},
        {"time", provenance.time},
        {"camera", cameraJson(view)},
        {"extension", lowerExtension(path)},
        {"kind", findOutputFormat(path, output.as).kind},
        {"composite", !output.no_composite},
        {"cryptomatte", output.cryptomatte},
        {"layout", findExrLayout(output.layout).name},
        {"compression", output.compression},
        {"merge", merge.empty() ? provenance.deep_merge : merge},
        {"background", output.background},
        {"exposure",
         output.automatic_exposure ? nlohmann::json("automatic") : nlohmann::json(output.exposure)},
        {"toneMap", output.tone_map},
    };
    if (provenance.view) all["view"] = *provenance.view;
    if (output.compress) all["compress"] = true;
    if (findOutputFormat(path, output.as).holds(OutputContent::kPlanes))
        all["planes"] = denseText(output.dense);
    return hashText(dumpJson(all));
}

std::string outputHashFrom(const ExrInfo& input, const View& view, const std::string& path,
                           const OutputOptions& output) {
    if (!input.attributes().contains("peeler:outputHash")) return "";
    if (output.composited) return "";
    // With several samples per pixel, a render composites the original samples. A composite of
    // stored fragments differs, because these are merged and rounded. So such a file gets no hash.
    if (input.plan.samples > 1 && !findOutputFormat(path, output.as).holdsFragments()) return "";
    return outputHash(view, path, output);
}

std::string outputHashOf(const std::string& path) {
    if (!RegularFile(path).isOpen()) return "";
    const std::string extension = lowerExtension(path);
    const HashedKind* kind = kKinds;
    while (!kind->extension.empty() && kind->extension != extension)
        ++kind;
    try {
        return kind->hash(path);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kInput) throw;
        return "";
    }
}

}  // namespace peeler
