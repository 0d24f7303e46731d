// SPDX-License-Identifier: Apache-2.0
// peeler extract: layers as separate files, a point cloud, arrays, a fragment-count map.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include <peeler/error.h>
#include <peeler/layered_image.h>
#include "cmd/cli/report.h"
#include "cmd/extract/band_memory.h"
#include "cmd/extract/extract_options.h"
#include "cmd/extract/layer_files.h"
#include "cmd/machine/resources.h"
#include "cmd/options/forecast.h"
#include "cmd/options/layered_bands.h"
#include "cmd/session/progress_report.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "core/base/printable.h"
#include "core/base/process_memory.h"
#include "core/base/stage_times.h"
#include "core/image/layers.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/exr/exr_plane_writer.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

/// The maximum size of a band, in bytes. Smaller than kBandBytes, because the writer of each layer
/// also holds a band.
constexpr std::uint64_t kExtractBandBytes = std::uint64_t{64} << 20;

/// An output other than the layers: its kind in the result, its file and its sink.
struct Product {
    std::string kind;
    fs::path path;
    std::unique_ptr<Sink> sink;
    /// Returns the forecast file size. All bands have the same arrays as the given band.
    std::function<SizeForecast(const Plan&, const LayeredImage&)> forecast;
    /// Returns the bytes per fragment that the sink needs in addition to the band. All bands have
    /// the same arrays as the given band.
    std::function<std::uint64_t(const LayeredImage&)> fragment_bytes;
};

class Extract {
  public:
    Extract(const ExtractOptions& options, Reporter& reporter)
        : options_(options), reporter_(reporter) {}

    void run() {
        {
            const StageTimer timer(result_.milliseconds, "total");
            options_.report.applyTo(reporter_);
            checkExtractOptions(options_);
            setThreads(options_.threads);
            open();
            selectLayers();
            addProducts();
            chooseBands();
            count();
            forecast();
            forecastMemory();
            if (options_.dry_run) return describe();
            reportForecast(forecast_, reporter_);
            result_.forecast_bytes = forecast_.size().bytes;
            extract();
        }
        report();
    }

  private:
    void open();
    void selectLayers();
    void addProducts();
    BandUse useOf(int rows) const;
    void chooseBands();
    void count();
    void countAll();
    void forecast();
    Forecast forecastOf() const;
    Plan wholePlan() const;
    LayeredImage bandLike() const;
    void forecastMemory();
    bool isOneBand() const;
    bool knowsBands() const;
    std::uint64_t takes() const;
    void describe();
    void extract();
    void report();

    template <class Take>
    void forEachBand(const Stage& stage, Take&& take);

    const ExtractOptions& options_;
    Reporter& reporter_;
    std::unique_ptr<LayeredInput> reader_;
    Provenance provenance_;
    bool camera_known_ = false;
    Plan whole_, chosen_;  ///< for the whole picture, and for only the chosen layers
    LayerSelection selection_;
    std::optional<LayerFiles> layers_;
    std::vector<Product> products_;
    /// A sink in products_, or null without --counts.
    CountMap* counts_ = nullptr;
    LayeredImage sample_;  ///< first row of the picture, for the types of all channels
    std::uint64_t band_bytes_ = 0;
    bool counted_ = false;  ///< whether the plans contain exact counts
    Forecast forecast_;
    std::optional<DepthComplexity> complexity_;
    /// Resident bytes and their peak before the extraction.
    std::uint64_t resident_ = 0, peak_ = 0;
    std::uint64_t fragments_ = 0;
    RunResult result_;
};

template <class Take>
void Extract::forEachBand(const Stage& stage, Take&& take) {
    ProgressReport progress(reporter_, stage);
    cmd::forEachBand(*reader_, 0, result_.milliseconds, progress, take, band_bytes_);
}

void Extract::open() {
    const StageTimer timer(result_.milliseconds, "load");
    const fs::path none;
    const fs::path outputs[] = {options_.output.path, options_.counts.value_or(none),
                                options_.points.value_or(none), options_.arrays.value_or(none)};
    const LayeredReadOptions reading = readingFor(options_.reading, outputs);
    reader_ = openChosen(options_.input.string(), reading, options_.objects, reporter_);
    whole_ = reader_->info().plan;
    provenance_ = reader_->info().provenance;
    provenance_.version = PEELER_VERSION;
    camera_known_ = reader_->info().attributes().contains("peeler:cameraJson");
    if (options_.points && !camera_known_) {
        throw Error(ErrorKind::kInput, "the file has no camera", options_.input.string(),
                    "give a file of peeler render; points in world space need its attribute "
                    "peeler:cameraJson");
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
    if (options_.writesLayers()) {
        if (layers.empty()) reporter_.warning("There is no layer to write.");
        layers_.emplace(options_.output, provenance_, layers, options_.input);
        for (const std::size_t layer : layers)
            names.insert(layers_->path(layer).lexically_normal());
    }
    for (const auto& other : {options_.counts, options_.points, options_.arrays}) {
        if (!other || names.insert(other->lexically_normal()).second) continue;
        throw Error(ErrorKind::kUsage, "two outputs have the same name", other->string(),
                    "choose another name");
    }
}

void Extract::addProducts() {
    const std::string scene =
        provenance_.scene.empty() ? "the scene" : printable(provenance_.scene);
    // The last name belongs to glTF's default material, which hits report as no material.
    const auto default_material = static_cast<std::uint32_t>(provenance_.ids.materials.size());
    if (options_.counts) {
        auto map = std::make_unique<CountMap>(options_.counts->string(),
                                              OutputOptions{.provenance = provenance_});
        counts_ = map.get();
        products_.push_back(
            {"depthComplexity", *options_.counts, std::move(map),
             [this](const Plan& plan, const LayeredImage&) { return counts_->forecast(plan); },
             [](const LayeredImage&) { return 0; }});
    }
    if (options_.points) {
        const FragmentPointOptions points{
            options_.double_points,
            "world space of " + scene + ", +Y up, by peeler " PEELER_VERSION, default_material};
        products_.push_back(
            {"points", *options_.points, makeFragmentPoints(options_.points->string(), points),
             [points](const Plan& plan, const LayeredImage& band) {
                 return forecastFragmentPoints(plan, band, points);
             },
             [points](const LayeredImage& band) { return fragmentPointBytes(band, points); }});
    }
    if (options_.arrays) {
        FragmentArrayOptions arrays{camera_known_, default_material};
        if (options_.output.isGiven("--dense")) arrays.dense = options_.output.options.dense;
        arrays.layers_listed = !options_.layers.empty();
        products_.push_back(
            {"arrays", *options_.arrays, makeFragmentArrays(options_.arrays->string(), arrays),
             [arrays, path = options_.arrays->string()](const Plan& plan,
                                                        const LayeredImage& band) {
                 return forecastFragmentArrays(path, plan, band, arrays);
             },
             [arrays](const LayeredImage& band) { return fragmentArrayBytes(band, arrays); }});
    }
}

/// Returns sample_ with the channels that the products receive.
LayeredImage Extract::bandLike() const {
    LayeredImage band = sample_;
    if (!products_.empty() && !findChannel(band, "layer")) addLayerIndices(band);
    return band;
}

/// Returns the whole picture's plan. The bytes per fragment are from sample_, because headers lack
/// them.
Plan Extract::wholePlan() const {
    Plan whole = whole_;
    whole.color_type = sample_.color.type;
    whole.tinted = sample_.tinted();
    for (const FragmentArray& array : sample_.extra)
        whole.channel_bytes += array.stride();
    return whole;
}

BandUse Extract::useOf(int rows) const {
    const LayeredImage band = bandLike();
    BandUse use = noUseOf(band);
    use.layers = chosen_.layers.size();
    const auto add_memory = [&](const SinkMemory& memory) {
        use.made.fixed += memory.bytes;
        use.made.pixel += memory.pixel_bytes;
    };
    if (layers_) add_memory(layers_->memory(wholePlan(), rows, use.list_bytes));
    for (const Product& product : products_) {
        add_memory(product.sink->memory(chosen_));
        use.made.fragment += product.fragment_bytes(band);
    }
    // Arrays do not grow if there is a single band. If no output stores fragments, the memory
    // counted above covers the growth.
    const bool alone = rows >= whole_.view.crop.height();
    if (products_.empty() && (alone || !options_.writesFragments())) use.array_bytes = 0;
    if (products_.size() > 1) {  // one sink gets the band, the others share a copy
        use.made.fragment += use.list_bytes;
        use.made.pixel += sizeof(std::uint32_t);
    }
    return use;
}

void Extract::chooseBands() {
    const Window& crop = whole_.view.crop;
    reader_->read({crop.x0, crop.y0, crop.x1, crop.y0 + 1}, sample_);
    band_bytes_ = bandBytesWithin(options_.memory, *reader_, kExtractBandBytes,
                                  [this](int rows) { return useOf(rows); });
}

/// Counts the fragments if an output's header contains the count.
void Extract::count() {
    const bool partial_counts = options_.counts && !selection_.all();
    if (options_.arrays || options_.writesFragments() || partial_counts) countAll();
}

void Extract::countAll() {
    counted_ = true;
    DepthComplexity& complexity = complexity_.emplace(whole_.view.crop);
    forEachBand({"count", kCountEnd}, [&](const LayeredImage& band) { complexity.addBand(band); });
    // The windows in files from other programs may be larger than the layers.
    const std::vector<LayerPlan> found = complexity.layers();
    chosen_.fragments_stored = 0;
    for (std::size_t layer = 0; layer < found.size(); ++layer) {
        if (layer < whole_.layers.size()) whole_.layers[layer] = found[layer];
        if (selection_.holds(layer)) chosen_.fragments_stored += found[layer].pixels;
    }
    whole_.fragments_counted = std::max(whole_.fragments_counted, complexity.counted());
}

/// Forecasts all file sizes from the headers. If the output may not fit on the disk, counts the
/// fragments and forecasts again.
void Extract::forecast() {
    forecast_ = forecastOf();
    if (counted_ || !mayExceedDisk(forecast_)) return;
    countAll();
    forecast_ = forecastOf();
}

/// Prepares the memory forecast, which depends on the maximum number of fragments per band. A dry
/// run counts the fragments first; other runs count them while extracting. The forecast assumes
/// that the system reuses the memory freed after counting.
void Extract::forecastMemory() {
    if (options_.dry_run && !knowsBands()) countAll();
    returnFreeMemory();
    resident_ = residentBytes();
    peak_ = peakMemory();
    if (knowsBands()) reporter_.detail("uses at most " + bytesText(takes()) + " of memory");
}

bool Extract::isOneBand() const {
    return reader_->rowsFor(band_bytes_) >= whole_.view.crop.height();
}

/// Whether takes() uses exact fragment counts rather than the upper limits in the headers.
bool Extract::knowsBands() const {
    return complexity_ || isOneBand() || reader_->mostOf(1).counted;
}

/// Returns the maximum resident bytes during the run.
std::uint64_t Extract::takes() const {
    const auto use = [this](int rows) { return useOf(rows); };
    return std::max(repeatedPeak(peak_),
                    resident_ + bandMemory(*reader_, reader_->rowsFor(band_bytes_), use,
                                           complexity_ ? &*complexity_ : nullptr));
}

Forecast Extract::forecastOf() const {
    Forecast forecast;
    if (layers_) {
        const Plan whole = wholePlan();
        for (const std::size_t layer : layers_->layers())
            forecast.files.push_back({.path = layers_->path(layer),
                                      .size = layers_->forecast(whole, layer),
                                      .kind = "layer"});
    }
    const LayeredImage band = bandLike();
    Plan plan = chosen_;
    if (!counted_) {
        // The header's count is only an upper limit: it may include layers that are not chosen, and
        // another program may have changed the picture.
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

/// Reports the plan, for --dry-run.
void Extract::describe() {
    Json json;
    json["input"] = options_.input.string();
    json["layers"] = chosen_.layers.size();
    json["fragments"] = counted_ ? Json(chosen_.fragments_stored) : Json();
    json["forecastMemory"] = takes();
    json["outputs"] = forecastJson(forecast_);
    reporter_.result(json);
    reportMemory(takes(), reporter_);
    reportForecast(forecast_, reporter_, true);
}

void Extract::extract() {
    for (Product& product : products_)
        product.sink->begin(chosen_);
    LayeredImage copy;
    const bool counts = !knowsBands();
    if (counts) complexity_.emplace(whole_.view.crop);
    // The first pass writes all outputs. Later passes write the layers that could not be open at
    // the same time.
    for (bool first = true; first || (layers_ && layers_->left()); first = false) {
        if (layers_) layers_->begin(whole_);
        forEachBand("extract", [&](LayeredImage& band) {
            if (counts && first) complexity_->addBand(band);
            if (isOneBand()) returnFreeMemory();  // for writing
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
    result_.forecast_memory = takes();
    result_.peak_memory = peakMemory();
    result_.files.emplace();
    std::vector<std::string> lines;
    const auto add_file = [&](const std::string& kind, const fs::path& path,
                              const std::string& what) {
        const WrittenFile& file = result_.addFile(path, kind);
        lines.push_back(path.string() + ": " + what + bytesText(file.bytes));
    };
    if (layers_) {
        for (const std::size_t layer : layers_->layers())
            add_file("layer", layers_->path(layer), "");
    }
    for (const Product& product : products_) {
        add_file(product.kind, product.path,
                 product.sink.get() == counts_
                     ? "0 to " + countText(counts_->largest(), "fragment") + " per pixel, "
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
    reportResult(options_.report, toJson(result_, found), lines, reporter_);
}

}  // namespace

VerbAction declareExtract(VerbOptions& verb) {
    const auto options = std::make_shared<ExtractOptions>();
    addExtractOptions(verb, *options);
    return [options](Session& session) {
        Extract(*options, session.reporter()).run();
        return 0;
    };
}

}  // namespace peeler::cmd
