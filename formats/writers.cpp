// SPDX-License-Identifier: Apache-2.0
// The table of output formats: a new format needs a source file and a row in this table.
#include "formats/writers.h"

#include <algorithm>
#include <cstring>

#include <peeler/error.h>
#include "core/image/channels.h"
#include "formats/arrays/array_writer.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/arrays/picture_arrays.h"
#include "formats/exr/exr_deep_with_cryptomatte.h"
#include "formats/exr/exr_plane_writer.h"
#include "formats/exr/exr_writers.h"
#include "formats/file/file_name.h"
#include "formats/image/image_writer.h"
#include "formats/page/html_view_writer.h"

namespace peeler {
namespace {

template <class Writer>
std::unique_ptr<Sink> make(const std::string& path, const OutputOptions& options) {
    return std::make_unique<Writer>(path, options);
}

std::unique_ptr<Sink> makeArrays(const std::string& path, const OutputOptions& options) {
    return makeFragmentArrays(path, arrayOptions(options));
}

std::unique_ptr<Sink> makeXrayMatrix(const std::string& path, const OutputOptions& options) {
    return makeXray(path, options);
}

SizeForecast arraysForecast(const std::string& path, const Plan& plan,
                            const OutputOptions& options) {
    return forecastFragmentArrays(path, plan, emptyBand(plan), arrayOptions(options));
}

template <std::vector<std::string> (*files)(const std::string&)>
std::vector<std::string> companions(const std::string& path, const OutputOptions& /*options*/) {
    return files(path);
}

SizeForecast xrayForecast(const std::string& path, const Plan& plan, const OutputOptions& options) {
    return forecastXray(path, plan, options);
}

std::vector<OutputFormat> makeTable() {
    std::vector<OutputFormat> rows = {
        {.extensions = {".exr"},
         .kind = "ldi",
         .summary = "layered depth image: one OpenEXR part per layer",
         .make = make<ExrLdiWriter>,
         .content = OutputContent::kLayers,
         .channels = true},
        {.extensions = {".exr"},
         .kind = "deep",
         .summary = "deep image: OpenEXR deep scan lines, one sample per fragment",
         .make = makeDeepImage,
         .content = OutputContent::kSamples,
         .channels = true,
         .beside = deepCompanions},
        {.extensions = {".exr"},
         .kind = "composite",
         .summary = "flat OpenEXR image: R,G,B,A and the first Z",
         .make = make<ExrCompositeWriter>,
         .content = OutputContent::kComposite,
         .channels = true},
        {.extensions = {".exr"},
         .kind = "midpoint-depth",
         .summary = "midpoint shadow map: Z halfway between the two nearest opaque surfaces",
         .make = make<ExrMidpointWriter>,
         .content = OutputContent::kShadowMap},
    };
    for (const ImageFormat& format : imageFormats())
        rows.push_back({.extensions = format.extensions,
                        .kind = "composite",
                        .summary = format.summary,
                        .make = make<ImageWriter>,
                        .content = OutputContent::kComposite,
                        .for_display = true});
    rows.push_back({.extensions = {".html", ".htm"},
                    .kind = "page",
                    .summary = "web page that shows the layers from any side, in one file",
                    .make = make<HtmlViewWriter>,
                    .content = OutputContent::kPage,
                    .for_display = true});
    const std::vector<std::string_view> arrays(arrayExtensions().begin(), arrayExtensions().end());
    rows.push_back({.extensions = {".safetensors"},
                    .kind = "layers",
                    .summary = "every fragment in arrays, as in memory; peeler reads them back",
                    .make = makeLayerArrays,
                    .content = OutputContent::kLists,
                    .channels = true,
                    .forecast = forecastLayerArrays});
    rows.push_back({.extensions = arrays,
                    .kind = "arrays",
                    .summary = "every fragment in arrays for numpy, one list per pixel",
                    .make = makeArrays,
                    .content = OutputContent::kArrays,
                    .channels = true,
                    .forecast = arraysForecast});
    rows.push_back({.extensions = arrays,
                    .kind = "dense",
                    .summary = "the nearest fragments in planes for numpy: (h, w, planes, ...)",
                    .make = makeArrays,
                    .content = OutputContent::kPlanes,
                    .channels = true,
                    .forecast = arraysForecast});
    rows.push_back({.extensions = {".png"},
                    .kind = "lari",
                    .summary = "a sample for LaRI: OUT.png, OUT_ldi.npz and OUT.npy",
                    .make = makeLariSample,
                    .content = OutputContent::kLari,
                    .for_display = true,
                    .forecast = forecastLariSample,
                    .beside = companions<lariFiles>});
    rows.push_back({.extensions = {".png"},
                    .kind = "world-tracing",
                    .summary = "a frame for World Tracing: OUT.png and OUT_xyz.npz",
                    .make = makeWorldTracingSample,
                    .content = OutputContent::kWorldTracing,
                    .for_display = true,
                    .forecast = forecastWorldTracingSample,
                    .beside = companions<worldTracingFiles>});
    rows.push_back({.extensions = arrays,
                    .kind = "xray",
                    .summary = "a sample for X-Ray: 16 layers as a sparse matrix for scipy",
                    .make = makeXrayMatrix,
                    .content = OutputContent::kXray,
                    .needs = xrayChannels,
                    .forecast = xrayForecast});
    rows.push_back({.extensions = arrays,
                    .kind = "composite",
                    .summary = "flat picture in arrays for numpy: rgba and the first z",
                    .make = makeCompositeArrays,
                    .content = OutputContent::kComposite,
                    .channels = true,
                    .forecast = forecastCompositeArrays});
    return rows;
}

const std::vector<OutputFormat>& table() {
    static const std::vector<OutputFormat> rows = makeTable();
    return rows;
}

void addOnce(std::string& list, std::string_view word) {
    if ((", " + list + ",").find(", " + std::string(word) + ",") != std::string::npos) return;
    list += (list.empty() ? "" : ", ") + std::string(word);
}

}  // namespace

std::span<const OutputFormat> outputFormats() {
    return table();
}

const OutputFormat& findOutputFormat(std::string_view path, std::string_view as) {
    const std::string extension = lowerExtension(path);
    std::string extensions, kinds, kinds_here, extensions_there;
    for (const OutputFormat& row : table()) {
        const bool fits = std::find(row.extensions.begin(), row.extensions.end(), extension) !=
                          row.extensions.end();
        if (fits && (as.empty() || as == row.kind)) return row;
        if (fits) addOnce(kinds_here, row.kind);
        addOnce(kinds, row.kind);
        for (const std::string_view name : row.extensions) {
            addOnce(extensions, name);
            if (as == row.kind) addOnce(extensions_there, name);
        }
    }
    if (kinds_here.empty()) {
        throw Error(ErrorKind::kUsage,
                    extension.empty() ? "the output has no extension, so its format is unknown"
                                      : "unknown output format \"" + extension + "\"",
                    std::string(path), "choose one of: " + extensions);
    }
    if (extensions_there.empty()) {
        throw Error(ErrorKind::kUsage, "unknown kind of output \"" + std::string(as) + "\"",
                    Parameter::kAs, "choose one of: " + kinds);
    }
    throw Error(ErrorKind::kUsage,
                extension + " cannot hold " + Parameter::kAs + " " + std::string(as),
                std::string(path),
                "write " + extensions_there + ", or use " + Parameter::kAs + " " + kinds_here);
}

std::vector<std::string> filesBeside(const std::string& path, const OutputOptions& options) {
    const std::string extension = lowerExtension(path);
    for (const OutputFormat& row : table()) {
        if (row.beside && row.kind == options.as &&
            std::ranges::find(row.extensions, extension) != row.extensions.end())
            return row.beside(path, options);
    }
    return {};
}

std::unique_ptr<Sink> makeSink(const std::string& path, const OutputOptions& options) {
    return findOutputFormat(path, options.as).make(path, options);
}

// Sends each pixel to the Sink as a list of one fragment, because compositing over nothing does not
// change it.
void writePicture(const std::string& path, const CompositeImage& picture,
                  const OutputOptions& options) {
    OutputOptions flat = options;
    flat.as = "composite";
    const auto sink = makeSink(path, flat);
    const auto width = static_cast<std::size_t>(picture.window.width());
    const int height = picture.window.height();
    Plan plan;
    plan.view.width = picture.window.width();
    plan.view.height = height;
    plan.view.crop = {0, 0, plan.view.width, height};
    plan.color_type = PixelType::kFloat;
    plan.layers = {{plan.view.crop, picture.window.pixels()}};
    plan.fragments_counted = plan.fragments_stored = picture.window.pixels();
    sink->begin(plan);
    constexpr int kRowsAtOnce = 256;
    for (int y = 0; y < height; y += kRowsAtOnce) {
        LayeredImage band;
        const std::span<float> out =
            onePerPixel({0, y, plan.view.width, std::min(y + kRowsAtOnce, height)}, band);
        std::memcpy(out.data(), picture.rgba.data() + static_cast<std::size_t>(y) * width,
                    out.size_bytes());
        std::ranges::fill(band.z, 1.0F);
        sink->write(std::move(band));
    }
    sink->finish();
}

}  // namespace peeler
