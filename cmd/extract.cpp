// SPDX-License-Identifier: Apache-2.0
// peeler extract: layers as files of their own, a point cloud, arrays, a map of fragment counts.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "cmd/cli/progress.h"
#include "cmd/cli/report.h"
#include "cmd/extract/extract_options.h"
#include "cmd/extract/layer_files.h"
#include "cmd/machine/resources.h"
#include "cmd/options/forecast.h"
#include "cmd/options/layered_bands.h"
#include "cmd/options/output_options.h"
#include "cmd/verbs.h"
#include "core/base/error.h"
#include "core/image/layered_image.h"
#include "core/image/layers.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/exr/exr_plane_writer.h"
#include "formats/exr/layered_input.h"
#include "formats/file/file_name.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

/// Bytes of a band, fewer than kBandBytes: the writer of each layer keeps a band of it, too.
constexpr std::uint64_t kExtractBandBytes = std::uint64_t{64} << 20;

/// An output besides the layers: how the result calls it, its file, and what writes it.
struct Product {
    std::string kind;
    fs::path path;
    std::unique_ptr<Sink> sink;
    /// How large it will be, of a plan and of bands like this one.
    std::function<SizeForecast(const Plan&, const LayeredImage&)> forecast;
};

/// One run. run() lists its stages.
class Extract {
  public:
    Extract(const ExtractOptions& options, Console& console)
        : options_(options), console_(console) {}

    void run() {
        {
            const StageTimer timer(result_.milliseconds, "total");
            checkOptions();
            open();
            selectLayers();
            count();
            addProducts();
            forecast();
            if (options_.dry_run) return describe();
            tellForecast(forecast_, console_);
            result_.forecast_bytes = forecast_.size().bytes;
            extract();
        }
        report();
    }

  private:
    void checkOptions() const;
    void checkFile(const fs::path& path, const char* extension) const;
    void open();
    void selectLayers();
    void count();
    void countAll();
    void addProducts();
    void forecast();
    Forecast forecastOf(const LayeredImage& sample) const;
    void describe();
    void extract();
    void report();

    bool writesLayers() const { return !options_.output.path.empty(); }
    bool writesExrLayers() const {
        return writesLayers() && LayerFiles::needCounts(options_.output);
    }

    template <class Take>
    void forEachBand(const Stage& stage, Take&& take);

    const ExtractOptions& options_;
    Console& console_;
    std::unique_ptr<LayeredInput> reader_;
    Provenance provenance_;
    bool camera_known_ = false;
    Plan whole_, chosen_;  ///< the picture as it is, and with the chosen layers only
    LayerSelection selection_;
    std::optional<LayerFiles> layers_;
    std::vector<Product> products_;
    CountMap* counts_ = nullptr;  ///< the sink of one of products_; null = no counts
    bool counted_ = false;        ///< the plans are true of every pixel
    Forecast forecast_;
    std::uint64_t fragments_ = 0;
    RunResult result_;
};

template <class Take>
void Extract::forEachBand(const Stage& stage, Take&& take) {
    ProgressReport progress(console_, options_.report.shownProgress(), stage);
    cmd::forEachBand(*reader_, 0, result_.milliseconds, progress, take, kExtractBandBytes);
}

void Extract::checkFile(const fs::path& path, const char* extension) const {
    if (lowerExtension(path) != extension) {
        throw Error(ErrorKind::kUsage, std::string("expected a name that ends in ") + extension,
                    path.string());
    }
    OutputRequest output;
    output.path = path;
    output.no_clobber = options_.output.no_clobber;
    output.no_mkdir = options_.output.no_mkdir;
    checkTarget(output, {options_.input});
}

void Extract::checkOptions() const {
    options_.report.applyTo(console_);
    std::vector<fs::path> outputs;
    if (writesLayers()) {
        if (writesExrLayers() && options_.output.asksForDisplay()) {
            throw Error(ErrorKind::kUsage, "layers in an EXR stay as they were rendered",
                        "--background, --exposure, --tone-map",
                        "leave it out, or write .png, .jpg or .tif");
        }
        outputs.push_back(options_.output.path);
    }
    if (options_.counts) {
        OutputRequest output;
        output.path = *options_.counts;
        output.no_clobber = options_.output.no_clobber;
        output.no_mkdir = options_.output.no_mkdir;
        output.options.as = "composite";
        checkOutput(output, {options_.input});
        outputs.push_back(*options_.counts);
    }
    if (options_.points) checkFile(outputs.emplace_back(*options_.points), ".ply");
    if (options_.arrays) checkFile(outputs.emplace_back(*options_.arrays), ".npz");
    if (outputs.empty()) {
        throw Error(ErrorKind::kUsage, "nothing to extract", "",
                    "give one or more of --output, --depth-complexity, --points and --npz");
    }
    if (!options_.layers.empty() && options_.max_layers != 0) {
        throw Error(ErrorKind::kUsage, "layers are chosen by number or from the front",
                    "--layer, --layers", "leave one of them out");
    }
    if (!writesLayers() && options_.output.asksForDisplay()) {
        throw Error(ErrorKind::kUsage, "no picture of a layer is written",
                    "--background, --exposure, --tone-map", "leave it out, or add --output");
    }
    checkDenseOptions(options_.output, options_.arrays && options_.output.isGiven("--dense"));
    if (options_.double_points && !options_.points) {
        throw Error(ErrorKind::kUsage, "there are no points to be stored in 64 bits", "--double",
                    "add --points FILE.ply");
    }
    std::vector<fs::path> others = outputs;
    others.push_back(options_.input);
    checkReport(options_.report, others);
    setThreads(options_.threads);
}

void Extract::open() {
    const StageTimer timer(result_.milliseconds, "load");
    reader_ = openChosen(options_.input.string(), options_.objects);
    whole_ = reader_->info().plan;
    provenance_ = reader_->info().provenance;
    provenance_.version = PEELER_VERSION;
    camera_known_ = reader_->info().attributes().contains("peeler:cameraJson");
    if (options_.points && !camera_known_) {
        throw Error(ErrorKind::kInput, "nothing in it says where its camera was",
                    options_.input.string(),
                    "points in the world need peeler:cameraJson, which peeler render writes");
    }
}

void Extract::selectLayers() {
    const std::size_t count = whole_.layers.size();
    selection_.nearest = options_.max_layers;
    for (const int layer : options_.layers) {
        if (static_cast<std::size_t>(layer) >= count) {
            throw Error(ErrorKind::kUsage, "there is no layer " + std::to_string(layer),
                        options_.input.string(),
                        count == 0 ? "the picture is empty"
                                   : "it has " + countText(count, "layer") + ", 0 to " +
                                         std::to_string(count - 1));
        }
        selection_.listed.resize(count);
        selection_.listed[static_cast<std::size_t>(layer)] = true;
    }
    chosen_ = whole_;
    chosen_.layers.clear();
    std::vector<std::size_t> layers;
    for (std::size_t layer = 0; layer < count; ++layer) {
        if (!selection_.holds(layer)) continue;
        chosen_.layers.push_back(whole_.layers[layer]);
        layers.push_back(layer);
    }
    std::set<fs::path> names;
    if (writesLayers()) {
        if (layers.empty()) console_.warning("there is no layer to write");
        layers_.emplace(options_.output, provenance_, layers, options_.input);
        for (const std::size_t layer : layers)
            names.insert(layers_->path(layer).lexically_normal());
    }
    for (const auto& other : {options_.counts, options_.points, options_.arrays}) {
        if (!other || names.insert(other->lexically_normal()).second) continue;
        throw Error(ErrorKind::kUsage, "two outputs have the same name", other->string());
    }
}

/// Counts first, where an output has a header: it says how many fragments follow, and comes before
/// them.
void Extract::count() {
    const bool partial_counts = options_.counts && !selection_.all();
    if (options_.arrays || writesExrLayers() || partial_counts) countAll();
}

void Extract::countAll() {
    counted_ = true;
    DepthComplexity complexity(whole_.view.crop);
    forEachBand({"count", kCountEnd}, [&](const LayeredImage& band) { complexity.addBand(band); });
    // In files of other programs a window may be larger than its layer.
    const std::vector<LayerPlan> found = complexity.layers();
    chosen_.fragments_stored = 0;
    for (std::size_t layer = 0; layer < found.size(); ++layer) {
        if (layer < whole_.layers.size()) whole_.layers[layer] = found[layer];
        if (selection_.holds(layer)) chosen_.fragments_stored += found[layer].pixels;
    }
    whole_.fragments_counted = std::max(whole_.fragments_counted, complexity.counted());
}

void Extract::addProducts() {
    const std::string scene =
        provenance_.scene.empty() ? "the scene" : printable(provenance_.scene);
    // The last name of materials is that of glTF's default one, which hits do not count as any.
    const auto default_material = static_cast<std::uint32_t>(provenance_.ids.materials.size());
    if (options_.counts) {
        auto map = std::make_unique<CountMap>(options_.counts->string(),
                                              OutputOptions{.provenance = provenance_});
        counts_ = map.get();
        products_.push_back(
            {"depthComplexity", *options_.counts, std::move(map),
             [this](const Plan& plan, const LayeredImage&) { return counts_->forecast(plan); }});
    }
    if (options_.points) {
        const FragmentPointOptions points{
            options_.double_points,
            "world space of " + scene + ", +Y up, by peeler " PEELER_VERSION, default_material};
        products_.push_back({"points", *options_.points,
                             makeFragmentPoints(options_.points->string(), points),
                             [points](const Plan& plan, const LayeredImage& band) {
                                 return forecastFragmentPoints(plan, band, points);
                             }});
    }
    if (options_.arrays) {
        FragmentArrayOptions arrays{camera_known_, default_material};
        if (options_.output.isGiven("--dense")) arrays.dense = options_.output.options.dense;
        arrays.layers_listed = !options_.layers.empty();
        products_.push_back({"arrays", *options_.arrays,
                             makeFragmentArrays(options_.arrays->string(), arrays),
                             [arrays](const Plan& plan, const LayeredImage& band) {
                                 return forecastFragmentArrays(plan, band, arrays);
                             }});
    }
}

/// The sizes of all files by the headers alone, or, if what is written may not find room then, by
/// counting.
void Extract::forecast() {
    const Window& crop = whole_.view.crop;
    LayeredImage sample;  // says which channels there are
    reader_->read({crop.x0, crop.y0, crop.x1, crop.y0 + 1}, sample);
    forecast_ = forecastOf(sample);
    if (counted_ || !mayExceedDisk(forecast_)) return;
    countAll();
    forecast_ = forecastOf(sample);
}

Forecast Extract::forecastOf(const LayeredImage& sample) const {
    Forecast forecast;
    Plan whole = whole_;  // headers do not tell what a fragment takes
    whole.color_type = sample.color.type;
    whole.tinted = sample.tinted();
    for (const FragmentArray& array : sample.extra)
        whole.channel_bytes += array.stride();
    if (layers_) {
        for (const std::size_t layer : layers_->layers())
            forecast.files.push_back({.path = layers_->path(layer),
                                      .size = layers_->forecast(whole, layer),
                                      .kind = "layer"});
    }
    LayeredImage band = sample;
    if (!findChannel(band, "layer")) addLayerIndices(band);
    Plan plan = chosen_;
    if (!counted_) {
        // The header's number is of all layers, and other programs may have changed the picture.
        std::uint64_t most = 0;
        for (const LayerPlan& layer : chosen_.layers)
            most += layer.data_window.pixels();
        const bool told = selection_.all() && chosen_.fragments_stored != 0;
        plan.fragments_stored = told ? std::min(most, chosen_.fragments_stored) : most;
    }
    for (const Product& product : products_) {
        SizeForecast size = product.forecast(plan, band);
        if (!counted_) size.certainty = Certainty::kAtMost;
        const bool is_map = product.sink.get() == counts_;
        forecast.files.push_back({product.path, size,
                                  is_map ? "" : countText(plan.fragments_stored, "fragment"),
                                  product.kind});
    }
    return forecast;
}

/// What would be done, for --dry-run.
void Extract::describe() {
    Json json;
    json["input"] = options_.input.string();
    json["layers"] = chosen_.layers.size();
    json["fragments"] = counted_ ? Json(chosen_.fragments_stored) : Json();
    json["outputs"] = forecastJson(forecast_);
    console_.result(jsonText(json));
    tellForecast(forecast_, console_, true);
}

void Extract::extract() {
    for (Product& product : products_)
        product.sink->begin(chosen_);
    LayeredImage copy;
    // The first reading serves every output; later ones only layers that were too many for it.
    for (bool first = true; first || (layers_ && layers_->left()); first = false) {
        if (layers_) layers_->begin(whole_);
        forEachBand("extract", [&](LayeredImage& band) {
            if (layers_) layers_->write(band);
            if (!first || products_.empty()) return;
            if (!findChannel(band, "layer")) addLayerIndices(band);
            keepLayers(band, selection_);
            fragments_ += band.fragments();
            for (Product& product : std::span(products_).first(products_.size() - 1)) {
                copy = band;
                product.sink->write(std::move(copy));
            }
            products_.back().sink->write(std::move(band));
        });
        if (layers_) layers_->finish(result_.milliseconds);
        if (!first) continue;
        for (Product& product : products_) {
            product.sink->finish();
            add(result_.milliseconds, product.sink->times());
        }
    }
}

void Extract::report() {
    result_.inputs = {options_.input};
    result_.settings_hash = provenance_.settings_hash;
    result_.renderer = provenance_.renderer;
    result_.peak_memory = peakMemory();
    result_.files.emplace();
    std::string lines;
    const auto add_file = [&](const std::string& kind, const fs::path& path,
                              const std::string& what) {
        const WrittenFile& file = result_.addFile(path, kind);
        lines += (lines.empty() ? "" : "\n") + path.string() + ": " + what + bytesText(file.bytes);
    };
    if (layers_) {
        for (const std::size_t layer : layers_->layers())
            add_file("layer", layers_->path(layer), "");
    }
    for (const Product& product : products_) {
        add_file(product.kind, product.path,
                 product.sink.get() == counts_
                     ? "0 to " + countText(counts_->largest(), "fragment") + " a pixel, "
                     : countText(fragments_, "fragment") + ", ");
    }
    if (layers_ && !layers_->layers().empty() && products_.empty())
        result_.output = options_.output.path;
    if (!layers_ && products_.size() == 1) result_.output = products_.front().path;

    Json found;
    found["width"] = whole_.view.width;
    found["height"] = whole_.view.height;
    found["layers"] = chosen_.layers.size();
    found["fragments"] = products_.empty() ? Json() : Json(fragments_);
    found["mostFragments"] = counts_ ? Json(counts_->largest()) : Json();
    reportResult(options_.report, toJson(result_, found), lines, console_);
}

}  // namespace

VerbAction declareExtract(VerbOptions& verb) {
    const auto options = std::make_shared<ExtractOptions>();
    addExtractOptions(verb, *options);
    return [options](Console& console) {
        Extract(*options, console).run();
        return 0;
    };
}

}  // namespace peeler::cmd
