// SPDX-License-Identifier: Apache-2.0
// One row a format: a new one is a new file and a row here.
#include "formats/writers.h"

#include <algorithm>
#include <filesystem>

#include "core/error.h"
#include "formats/exr_composite_writer.h"
#include "formats/exr_ldi_writer.h"
#include "formats/exr_midpoint_writer.h"
#include "formats/html_view_writer.h"
#include "formats/image_writer.h"

namespace peeler {
namespace {

std::unique_ptr<Sink> makeLdi(const std::string& path, const OutputOptions& options) {
    return std::make_unique<ExrLdiWriter>(path, options.provenance,
                                          ExrLdiOptions{.composite = options.composite_part});
}

std::unique_ptr<Sink> makeExrComposite(const std::string& path, const OutputOptions& options) {
    return std::make_unique<ExrCompositeWriter>(path, options.provenance, options.background);
}

std::unique_ptr<Sink> makeExrMidpoint(const std::string& path, const OutputOptions& options) {
    return std::make_unique<ExrMidpointWriter>(path, options.provenance);
}

template <const char* format>
std::unique_ptr<Sink> makeImage(const std::string& path, const OutputOptions& options) {
    return std::make_unique<ImageWriter>(
        path, format,
        ImageOptions{.background = options.background,
                     .exposure = options.exposure,
                     .tone_map = options.tone_map,
                     .software = "peeler " + options.provenance.version});
}

std::unique_ptr<Sink> makePage(const std::string& path, const OutputOptions& options) {
    return std::make_unique<HtmlViewWriter>(
        path, options.provenance,
        HtmlViewOptions{.image = {.background = options.background,
                                  .exposure = options.exposure,
                                  .tone_map = options.tone_map,
                                  .software = {}},
                        .max_fragments = options.max_fragments});
}

constexpr char kPng[] = "png", kJpeg[] = "jpeg", kTiff[] = "tiff";  // OpenImageIO's names

const std::array<OutputFormat, 7>& table() {
    static const std::array<OutputFormat, 7> rows = {{
        {{".exr"}, "ldi", "layered depth image: one OpenEXR part a layer", makeLdi},
        {{".exr"}, "composite", "flat OpenEXR image: R,G,B,A and the first Z", makeExrComposite},
        {{".exr"},
         "midpoint-depth",
         "midpoint shadow map: Z halfway between the two nearest opaque surfaces",
         makeExrMidpoint,
         true},
        {{".png"}, "composite", "8-bit sRGB with straight alpha", makeImage<kPng>, false, true},
        {{".jpg", ".jpeg"}, "composite", "8-bit sRGB without alpha", makeImage<kJpeg>, false, true},
        {{".tif", ".tiff"},
         "composite",
         "16-bit sRGB with straight alpha",
         makeImage<kTiff>,
         false,
         true},
        {{".html", ".htm"},
         "page",
         "web page that shows the layers from any side, in one file",
         makePage,
         false,
         true},
    }};
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

const OutputFormat& findOutputFormat(const std::string& path, const std::string& as) {
    std::string extension = std::filesystem::path(path).extension().string();
    for (char& c : extension) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
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
                                      : "there is no output format \"" + extension + "\"",
                    path, "choose one of: " + extensions);
    }
    if (extensions_there.empty()) {
        throw Error(ErrorKind::kUsage, "there is no kind of output \"" + as + "\"", "--as",
                    "choose one of: " + kinds);
    }
    throw Error(ErrorKind::kUsage, extension + " cannot hold --as " + as, path,
                "write " + extensions_there + ", or use --as " + kinds_here);
}

std::unique_ptr<Sink> makeSink(const std::string& path, const OutputOptions& options) {
    return findOutputFormat(path, options.as).make(path, options);
}

}  // namespace peeler
