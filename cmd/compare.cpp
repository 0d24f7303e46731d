// SPDX-License-Identifier: Apache-2.0
// peeler compare: differences between two pictures, per layer, computed band by band.
#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <peeler/composite.h>
#include <peeler/error.h>
#include <peeler/layered_image.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "cmd/compare/compare_result.h"
#include "cmd/machine/resources.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/session/progress_report.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "core/base/color.h"
#include "core/image/merge.h"
#include "formats/file/file_name.h"
#include "formats/file/read_warnings.h"
#include "formats/image/flat_image.h"
#include "formats/layered/opened_picture.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

/// The maximum size of a band of each file, in bytes.
constexpr std::uint64_t kComparedBandBytes = std::uint64_t{192} << 20;

struct CompareOptions {
    fs::path a, b;
    LayeredReadOptions reading;
    bool composites = false;
    Thresholds thresholds;
    std::optional<fs::path> heatmap;
    std::optional<double> heatmap_max;
    int threads = 0;
    ReportOptions report;
};

/// One of the two files: a layered or flat picture, read in bands.
class ComparedImage {
  public:
    /// Opens the file. Throws Error (kInput) if the file is not an image.
    ComparedImage(const std::string& path, const LayeredReadOptions& reading, Reporter& reporter);

    const std::string& path() const { return path_; }
    bool layered() const { return layered_; }
    std::size_t layers() const { return layered_ ? reader_->info().plan.layers.size() : 0; }
    Window picture() const;  ///< returns the display window
    /// Returns the rendered pixels: the camera's crop or, if the file has no camera, the whole
    /// picture.
    Window pixels() const;
    Window stored() const;  ///< returns the window of the stored pixels, which is inside pixels()
    /// Whether the file has a camera. Then pixels() is the camera's crop.
    bool isCrop() const { return reader_ && reader_->info().plan.view.known; }
    /// Whether the file format (OpenEXR, arrays) stores the position of the pixels in the display
    /// window.
    bool placed() const { return reader_ != nullptr; }

    /// Sets the window of pixels to compare. Pixels outside pixels() have no fragments.
    void choose(const Window& window) { window_ = window; }
    const Window& window() const { return window_; }
    /// Returns the largest number of rows for which read() needs at most about `bytes`.
    int rowsFor(std::uint64_t bytes) const;
    /// Reads `rows` rows, the first at `first` rows below the top of window(). Only if placed().
    void read(int first, int rows, LayeredImage& out);
    /// Reads rows of any image as a composite without a background.
    void read(int first, int rows, CompositeImage& out);

  private:
    std::string path_;
    std::unique_ptr<LayeredInput> reader_;  ///< set if placed()
    bool layered_ = false;
    FlatImage flat_;
    Window window_;
    LayeredImage band_, part_;
};

std::string comparedSizeText(const Window& window) {
    return std::to_string(window.width()) + " x " + std::to_string(window.height());
}

ComparedImage::ComparedImage(const std::string& path, const LayeredReadOptions& reading,
                             Reporter& reporter)
    : path_(path) {
    if (!isPictureFile(path)) {
        flat_ = readFlatImage(path);
        ReadWarnings warnings(reading.strict, path);
        const std::string image = "The image \"" + path + "\": ";
        for (const std::string& note : flat_.notes)
            warnings.warn(image + note + ".");
        for (const Text& warning : warnings.sentences())
            reporter.warning(warning);
        return;
    }
    OpenedPicture opened(path, reading);
    const bool composite = isLoneComposite(opened.info()) && !reading.choosesPicture();
    const bool layers = isLayered(opened.info()) && !reading.choosesPicture();
    reader_ = composite ? openComposite(std::move(opened)) : openInput(std::move(opened), reporter);
    layered_ = layers || !reader_->info().deep.empty();
}

Window ComparedImage::picture() const {
    if (!reader_) return flat_.image.window;
    const View& view = reader_->info().plan.view;
    return {0, 0, view.width, view.height};
}

Window ComparedImage::pixels() const {
    return reader_ ? reader_->info().plan.view.crop : flat_.image.window;
}

Window ComparedImage::stored() const {
    if (!reader_ || isCrop()) return pixels();
    const ExrInfo& info = reader_->info();
    Window all;
    for (const auto* const parts : {&info.layers, &info.deep})
        for (const std::size_t part : *parts)
            all = unite(all, info.parts[part].data_window);
    return all;
}

int ComparedImage::rowsFor(std::uint64_t bytes) const {
    return reader_ ? reader_->rowsFor(bytes) : window_.height();
}

void ComparedImage::read(int first, int rows, LayeredImage& out) {
    const Window band{window_.x0, window_.y0 + first, window_.x1, window_.y0 + first + rows};
    const Window inside = intersect(band, pixels());
    if (inside == band) return reader_->read(band, out);
    part_ = {};
    if (!inside.empty()) reader_->read(inside, part_);
    joinTiles({&part_, 1}, band, part_, out);
}

void ComparedImage::read(int first, int rows, CompositeImage& out) {
    if (reader_) {
        read(first, rows, band_);
        compositeOver(band_, {}, out);
        return;
    }
    const int y = window_.y0 + first;
    out.setRows(flat_.image, y, y + rows);
}

[[noreturn]] void refuseSizes(const ComparedImage& a, const ComparedImage& b,
                              const std::string& sizes) {
    throw Error(ErrorKind::kUsage, "the images differ in size", a.path() + ", " + b.path(),
                sizes + " pixels; compare images of the same size");
}

/// Sets the pixels to compare in two images that are placed(): the stored window if it is the same
/// in both images, else all pixels of both. Throws Error (kUsage) if the images differ in size or
/// in their cameras' crops.
void choosePlaced(ComparedImage& a, ComparedImage& b) {
    if (a.picture() != b.picture())
        refuseSizes(
            a, b,
            "they are " + comparedSizeText(a.picture()) + " and " + comparedSizeText(b.picture()));
    const bool same = a.stored() == b.stored();
    if (!same && a.pixels() != b.pixels() && (a.isCrop() || b.isCrop())) {
        throw Error(ErrorKind::kUsage, "the images differ in their crops",
                    a.path() + ", " + b.path(),
                    "they hold " + windowText(a.pixels()) + " and " + windowText(b.pixels()) +
                        "; compare images with the same crop");
    }
    const Window window = same ? a.stored() : unite(a.pixels(), b.pixels());
    a.choose(window);
    b.choose(window);
}

/// Sets the pixels to compare in both images. Throws Error (kUsage) if their sizes differ.
void chooseWindows(ComparedImage& a, ComparedImage& b) {
    if (a.placed() && b.placed()) return choosePlaced(a, b);
    const auto is_like = [](const Window& one, const Window& other) {
        return one.width() == other.width() && one.height() == other.height();
    };
    // An image without placement may have the size of the other image's display window, or of the
    // other image's stored window.
    for (const Window& of_a : {a.picture(), a.stored()}) {
        for (const Window& of_b : {b.picture(), b.stored()}) {
            if (!is_like(of_a, of_b)) continue;
            a.choose(of_a);
            b.choose(of_b);
            return;
        }
    }
    refuseSizes(
        a, b, "they hold " + comparedSizeText(a.stored()) + " and " + comparedSizeText(b.stored()));
}

class Compare {
  public:
    Compare(const CompareOptions& options, Reporter& reporter)
        : options_(options), reporter_(reporter) {}

    int run() {
        checkOptions();
        open();
        compare();
        writeHeatmap();
        return report();
    }

  private:
    void checkOptions();
    void open();
    void compare();
    void writeHeatmap();
    int report();

    const CompareOptions& options_;
    Reporter& reporter_;
    std::unique_ptr<ComparedImage> a_, b_;
    Comparison comparison_;
    std::vector<float> differences_;  ///< colour differences per pixel; empty without a heat map
    std::optional<HeatmapResult> heatmap_;
};

void Compare::checkOptions() {
    options_.report.applyTo(reporter_);
    const fs::path heatmap = options_.heatmap.value_or(fs::path());
    OutputRequest output;
    output.path = heatmap;
    output.options.as = "composite";
    if (options_.heatmap) checkOutput(output, {options_.a, options_.b});
    checkReport(options_.report, {options_.a, options_.b, heatmap});
    if (options_.heatmap_max && !options_.heatmap) {
        throw Error(ErrorKind::kUsage, "there is no heat map to scale", "--heatmap-max",
                    "add --heatmap FILE");
    }
    setThreads(options_.threads);
}

void Compare::open() {
    a_ = std::make_unique<ComparedImage>(options_.a.string(), options_.reading, reporter_);
    b_ = std::make_unique<ComparedImage>(options_.b.string(), options_.reading, reporter_);
    chooseWindows(*a_, *b_);
    comparison_.a = {a_->path(), a_->layered(), a_->layers()};
    comparison_.b = {b_->path(), b_->layered(), b_->layers()};
    comparison_.width = a_->window().width();
    comparison_.height = a_->window().height();
    comparison_.by_layer = a_->layered() && b_->layered() && !options_.composites;
    comparison_.difference.layers.resize(comparison_.by_layer ? std::max(a_->layers(), b_->layers())
                                                              : 0);
    if (options_.heatmap) differences_.resize(a_->window().pixels());
}

void Compare::compare() {
    ProgressReport progress(reporter_, "compare");
    LayeredDifference& sum = comparison_.difference;
    const auto width = static_cast<std::size_t>(comparison_.width);
    const int step = std::min(a_->rowsFor(kComparedBandBytes), b_->rowsFor(kComparedBandBytes));
    LayeredImage layers_a, layers_b;
    CompositeImage flat_a, flat_b;
    for (int y = 0; y < comparison_.height; y += step) {
        const int rows = std::min(step, comparison_.height - y);
        const auto pixels = static_cast<std::size_t>(rows) * width;
        std::span<float> differences;
        if (!differences_.empty())
            differences = {differences_.data() + static_cast<std::size_t>(y) * width, pixels};
        if (comparison_.by_layer) {
            a_->read(y, rows, layers_a);
            b_->read(y, rows, layers_b);
            addDifference(layers_a, layers_b, sum, differences);
        } else {
            a_->read(y, rows, flat_a);
            b_->read(y, rows, flat_b);
            addDifference(flat_a, flat_b, sum.composite, differences);
            sum.pixels += pixels;
        }
        progress.update(static_cast<double>(y + rows) / comparison_.height);
    }
}

void Compare::writeHeatmap() {
    if (!options_.heatmap) return;
    float largest = 0;
    for (const float value : differences_) {
        if (value < std::numeric_limits<float>::infinity()) largest = std::max(largest, value);
    }
    heatmap_ = HeatmapResult{.path = options_.heatmap->string(),
                             .color = options_.heatmap_max.value_or(largest > 0 ? largest : 1),
                             .count = comparison_.difference.largest_count};
    CompositeImage picture;
    picture.window = {0, 0, comparison_.width, comparison_.height};
    picture.rgba.reserve(differences_.size());
    for (const float value : differences_) {
        const std::array<float, 3> color =
            value < 0 ? blueToCyan(-value / static_cast<float>(heatmap_->count))
                      : inferno(static_cast<float>(value / heatmap_->color));
        picture.rgba.push_back({color[0], color[1], color[2], 1});
    }
    OutputOptions output;
    output.provenance.version = PEELER_VERSION;
    writePicture(heatmap_->path, picture, output);
}

int Compare::report() {
    const std::vector<ThresholdResult> results = judge(comparison_, options_.thresholds);
    const auto json = toJson(comparison_, results, heatmap_);
    if (options_.report.file) writeReport(*options_.report.file, json);
    if (options_.report.json) {
        reporter_.result(json);
    } else if (!reporter_.quiet()) {
        reporter_.text(toText(comparison_, heatmap_));
    }
    int code = 0;
    for (const ThresholdResult& result : results) {
        if (!result.exceeded) continue;
        reporter_.error(toText(result));
        code = 1;
    }
    return code;
}

double parseLimit(const std::string& text) {
    if (text == "inf") return std::numeric_limits<double>::infinity();
    const double value = parseNumber(text);
    if (value < 0) throw Error(ErrorKind::kUsage, "expected a number of 0 or more, or inf");
    return value;
}

void addThresholds(VerbOptions& verb, Thresholds& thresholds) {
    constexpr const char* kGroup = "Thresholds";
    addValue(
        verb, "--max-count", "N", thresholds.max_count,
        [](const std::string& text) {
            return static_cast<std::uint64_t>(
                parseInteger(text, 0, std::numeric_limits<std::int64_t>::max()));
        },
        "maximum number of pixels with different fragment counts (default: 0)")
        .group(kGroup);
    addValue(verb, "--max-depth", "X", thresholds.max_depth, parseLimit,
             "maximum depth difference in scene units (default: 0)")
        .group(kGroup);
    addValue(verb, "--max-color", "X", thresholds.max_color, parseLimit,
             "maximum difference of a colour channel (default: 0, unless --max-rmse or --min-psnr "
             "is given)")
        .group(kGroup);
    addValue(verb, "--max-rmse", "X", thresholds.max_rmse, parseLimit,
             "maximum root mean square of the colour differences")
        .group(kGroup);
    addValue(
        verb, "--min-psnr", "DB", thresholds.min_psnr, parseLimit,
        "minimum peak signal-to-noise ratio of colour, for a peak of 1; inf means no difference")
        .group(kGroup);
}

void addHeatmap(VerbOptions& verb, CompareOptions& options) {
    addFile(verb, "--heatmap", "FILE", options.heatmap,
            "picture (.png, .jpg, .tif) of every pixel's largest colour difference, from black to "
            "yellow; pixels with different fragment counts go from blue to cyan")
        .files(".png .jpg .tif")
        .group("Output");
    addValue(
        verb, "--heatmap-max", "X", options.heatmap_max,
        [](const std::string& text) { return parsePositive(text); },
        "difference shown in yellow (default: the largest)")
        .group("Output");
}

constexpr const char* kCompareFooter =
    "Two layered files are compared fragment by fragment, in depth order; thresholds apply to\n"
    "the fragments that both files have. A layered file and a flat one (PNG, JPEG, TIFF, or\n"
    "EXR without layers) are compared by their composites. Colours are compared linear and\n"
    "premultiplied: 8- and 16-bit images are decoded from sRGB first. NaN differs infinitely\n"
    "from any number, but equals NaN.\n"
    "\n"
    "Exit codes: 0 within the thresholds, 1 beyond them, 2 if the sizes or crops differ.";

}  // namespace

VerbAction declareCompare(VerbOptions& verb) {
    const auto options = std::make_shared<CompareOptions>();
    constexpr const char* kImages = ".exr .safetensors .png .jpg .tif";
    addFile(verb, "A", "", options->a, "an image").files(kImages).required();
    addFile(verb, "B", "", options->b, "another image of the same size and crop")
        .files(kImages)
        .required();
    addLayeredOptions(verb, options->reading);
    verb.addFlag("--composites", options->composites,
                 "compare the composites of layered files, not their layers");
    addThresholds(verb, options->thresholds);
    addHeatmap(verb, *options);
    addThreadsOption(verb, options->threads);
    addReportOptions(verb, options->report);
    verb.footer(kCompareFooter);
    return [options](Session& session) { return Compare(*options, session.reporter()).run(); };
}

}  // namespace peeler::cmd
