// SPDX-License-Identifier: Apache-2.0
// peeler merge: tiles of one picture, rendered apart, put together band by band.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "cmd/layered_bands.h"
#include "cmd/options.h"
#include "cmd/output_options.h"
#include "cmd/progress.h"
#include "cmd/report.h"
#include "cmd/resources.h"
#include "cmd/share.h"
#include "cmd/verbs.h"
#include "core/error.h"
#include "core/layer_windows.h"
#include "core/tiles.h"
#include "formats/exr_layout.h"
#include "formats/layered_input.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct MergeOptions {
    std::vector<fs::path> inputs;
    bool allow_gaps = false;
    int threads = 0;
    OutputFlags output;
    ReportFlags report;
};

/// A tile, and the names and types of its fragments' arrays.
struct Tile {
    std::string path;
    std::unique_ptr<LayeredInput> input;
    LayeredImage arrays;

    const ExrInfo& info() const { return input->info(); }
    const Window& window() const { return info().plan.view.crop; }
    bool hasLayers() const { return !info().plan.layers.empty(); }
};

std::string channelsText(const LayeredImage& image) {
    std::string text;
    for (const FragmentArray& array : image.extra) {
        for (const std::string& channel : array.channels) {
            constexpr const char* kNames[] = {"half", "float", "uint"};
            text += channel + ' ' + kNames[static_cast<std::size_t>(array.type)] + ", ";
        }
    }
    return text.empty() ? "none" : text.substr(0, text.size() - 2);
}

/// Whatever the crop.
std::string wholeCamera(const ExrInfo& info) {
    const auto text = info.attributes().find("peeler:cameraJson");
    if (text == info.attributes().end()) return "";
    nlohmann::json json = nlohmann::json::parse(text->second);  // describe() has read it already
    json.erase("crop");
    return json.dump();
}

/// What the tiles of one picture have in common.
struct CommonAttribute {
    const char* name;
    std::string (*text)(const ExrInfo& info);
    bool must;  ///< else the first tile's is kept, with a warning
};

constexpr CommonAttribute kCommon[] = {
    {"peeler:sceneHash", [](const ExrInfo& i) { return i.provenance.scene_hash; }, true},
    {"peeler:frame", [](const ExrInfo& i) { return std::to_string(i.provenance.frame); }, true},
    {"peeler:time", [](const ExrInfo& i) { return std::to_string(i.provenance.time); }, true},
    {"peeler:cameraJson", wholeCamera, true},
    {"peeler:surfaces", [](const ExrInfo& i) { return i.provenance.surfaces; }, true},
    {"peeler:samples", [](const ExrInfo& i) { return std::to_string(i.plan.samples); }, true},
    {"precision",
     [](const ExrInfo& i) {
         return std::string(i.plan.color_type == PixelType::kHalf ? "half" : "float");
     },
     true},
    {"peeler:settingsHash", [](const ExrInfo& i) { return i.provenance.settings_hash; }, true},
    {"peeler:deepMerge", [](const ExrInfo& i) { return i.provenance.deep_merge; }, true},
    {"peeler:method", [](const ExrInfo& i) { return i.provenance.method; }, false},
    {"peeler:renderer", [](const ExrInfo& i) { return i.provenance.renderer; }, false},
    {"peeler:version", [](const ExrInfo& i) { return i.provenance.version; }, false},
};

/// One run. run() lists its stages.
class Merge {
  public:
    Merge(const MergeOptions& options, Console& console)
        : options_(options), console_(console), output_(options.output) {}

    void run() {
        {
            const StageTimer timer(result_.milliseconds, "total");
            checkOptions();
            open();
            checkCommon();
            checkCover();
            plan();
            write();
        }
        tell();
    }

  private:
    void checkOptions();
    bool areComposites(const std::vector<OpenedExr>& opened) const;
    void expectComposite();
    void open();
    void checkCommon();
    void checkStrips() const;
    void checkCover();
    void plan();
    void countLayers();
    bool isWhatRenderMakes() const;
    void write();
    void tell();

    /// Joins the tiles band by band and hands each band to `take`.
    template <class Take>
    void forEachBand(const Stage& stage, Take&& take);
    int rowsAtOnce() const;

    const MergeOptions& options_;
    Console& console_;
    OutputFlags output_;
    bool has_gaps_ = false;    ///< pixels that no tile has
    bool composites_ = false;  ///< the tiles are, and so is the result
    std::vector<Tile> tiles_;
    std::vector<Window> windows_;
    LayeredImage arrays_;  ///< of tiles with layers
    Plan plan_;
    PictureResult result_;
};

void Merge::checkOptions() {
    options_.report.applyTo(console_);
    checkOutput(output_, options_.inputs);
    if (findOutputFormat(output_.path.string(), output_.as).casters) {
        throw Error(ErrorKind::kUsage, "layers do not tell which surfaces cast shadows",
                    "--as midpoint-depth", "render it as a whole");
    }
    std::vector<fs::path> others = options_.inputs;
    others.push_back(output_.path);
    checkReport(options_.report, others);
    setThreads(options_.threads);
}

/// Whether the tiles are composites, one of which may be empty like any other tile.
bool Merge::areComposites(const std::vector<OpenedExr>& opened) const {
    const auto flat = [](const OpenedExr& tile) {
        return tile.info.composite >= 0 && tile.info.layers.empty() && tile.info.deep.empty();
    };
    const auto empty = [](const OpenedExr& tile) { return isLayered(tile.info); };
    if (!std::ranges::all_of(opened, flat)) return false;
    return output_.as == "composite" || !std::ranges::all_of(opened, empty);
}

/// Composites are merged as they are.
void Merge::expectComposite() {
    if (output_.as.empty()) output_.as = "composite";
    const OutputFormat& format = findOutputFormat(output_.path.string(), output_.as);
    if (format.kind == "composite" && !output_.background) return;
    throw Error(ErrorKind::kUsage,
                output_.background ? "composites are merged as they are, background and all"
                                   : "composites have no layers",
                output_.background ? "--background" : "--as " + output_.as,
                "render the tiles with it, or as layers");
}

void Merge::open() {
    const StageTimer timer(result_.milliseconds, "load");
    std::vector<OpenedExr> opened;
    for (const fs::path& path : options_.inputs)
        opened.emplace_back(path.string());
    composites_ = areComposites(opened);
    if (composites_) expectComposite();
    const bool deep =
        std::ranges::all_of(opened, [](const OpenedExr& tile) { return !tile.info.deep.empty(); });
    if (deep && output_.as.empty() && findOutputFormat(output_.path.string(), "").kind == "ldi")
        output_.as = "deep";
    for (std::size_t i = 0; i < opened.size(); ++i) {
        Tile tile;
        tile.path = options_.inputs[i].string();
        tile.input =
            composites_ ? openComposite(std::move(opened[i])) : openLayered(std::move(opened[i]));
        if (!tile.info().is_peeler) {
            throw Error(ErrorKind::kInput, "nothing in it says which picture it is a tile of",
                        tile.path, "tiles are files of peeler render --tile or --crop");
        }
        const Window& window = tile.window();
        if (composites_ || tile.hasLayers()) {
            tile.input->read({window.x0, window.y0, window.x1, window.y0 + 1}, tile.arrays);
        }
        windows_.push_back(window);
        tiles_.push_back(std::move(tile));
    }
}

void Merge::checkCommon() {
    const auto differ = [&](const Tile& a, const Tile& b, const std::string& attribute,
                            const std::string& in_a, const std::string& in_b) {
        throw Error(ErrorKind::kInput,
                    "the tiles are not of one picture: they differ in " + attribute,
                    a.path + " and " + b.path, "the first has " + in_a + "\nthe other has " + in_b);
    };
    const Tile& first = tiles_.front();
    for (const CommonAttribute& attribute : kCommon) {
        for (const Tile& tile : tiles_) {
            const std::string a = attribute.text(first.info()), b = attribute.text(tile.info());
            if (a == b) continue;
            if (attribute.must) differ(first, tile, attribute.name, a, b);
            std::string text = first.path + " and " + tile.path;
            text.append(" differ in ").append(attribute.name).append(": ").append(a);
            text.append(" and ").append(b).append("; the file will say the first");
            console_.warning(text);
            break;
        }
    }
    const Tile* with_layers = nullptr;
    for (const Tile& tile : tiles_) {
        if (!composites_ && !tile.hasLayers()) continue;
        if (!with_layers) with_layers = &tile;
        const std::string a = channelsText(with_layers->arrays), b = channelsText(tile.arrays);
        if (a != b) differ(*with_layers, tile, "channels", a, b);
    }
    arrays_ = with_layers ? with_layers->arrays : LayeredImage();
    arrays_.color.channels = {"R", "G", "B", "A"};
    arrays_.color.type = first.info().plan.color_type;
}

/// Strips of one number, of which one at the top or the bottom would not be missed otherwise.
void Merge::checkStrips() const {
    std::set<int> there;
    int count = 0;
    for (const Tile& tile : tiles_) {
        const std::string& text = tile.info().provenance.tile;
        if (text.empty()) return;
        const Share share = parseShare(text);
        if (count != 0 && share.count != count) return;
        count = share.count;
        there.insert(share.index);
    }
    for (int i = 1; i <= count; ++i) {
        if (there.contains(i)) continue;
        throw Error(ErrorKind::kInput, "tile " + Share{i, count}.text() + " is missing",
                    output_.path.string(), "add the tile, or --allow-gaps to leave its pixels out");
    }
}

void Merge::checkCover() {
    if (!options_.allow_gaps) checkStrips();
    plan_ = tiles_.front().info().plan;
    plan_.layers.clear();
    plan_.view.crop = {};
    for (const Window& window : windows_)
        plan_.view.crop = unite(plan_.view.crop, window);
    const auto gap = findGap(windows_, plan_.view.crop);
    has_gaps_ = gap.has_value();
    if (!gap || options_.allow_gaps) return;
    throw Error(ErrorKind::kInput,
                "no tile has the " + std::to_string(gap->width()) + " x " +
                    std::to_string(gap->height()) + " pixels at (" + std::to_string(gap->x0) +
                    ", " + std::to_string(gap->y0) + ")",
                output_.path.string(), "add the tile, or --allow-gaps to leave them empty");
}

void Merge::plan() {
    plan_.fragments_counted = plan_.fragments_stored = plan_.fragments_blended = 0;
    bool complete = true;
    for (const Tile& tile : tiles_) {
        const Plan& part = tile.info().plan;
        complete = complete && part.complete();
        plan_.fragments_counted += part.fragments_counted;
        plan_.fragments_stored += part.fragments_stored;
        plan_.fragments_blended += part.fragments_blended;
        if (plan_.layers.size() < part.layers.size()) plan_.layers.resize(part.layers.size());
        for (std::size_t k = 0; k < part.layers.size(); ++k) {
            Window& window = plan_.layers[k].data_window;
            window = unite(window, part.layers[k].data_window);
        }
    }
    if (composites_) {
        if (!overlap(windows_)) return;
        throw Error(ErrorKind::kInput,
                    "tiles overlap: nobody knows how many fragments the composite has",
                    output_.path.string(), "render tiles that do not overlap, or layers");
    }
    const bool pixels_matter = output_.layers.layout == kPerFileLayout;
    if (!overlap(windows_)) {
        if (pixels_matter) countLayers();
        return;
    }
    if (!complete) {
        throw Error(ErrorKind::kInput,
                    "tiles overlap and lack fragments: nobody knows how many the picture has",
                    output_.path.string(), "render tiles that do not overlap, or all their layers");
    }
    countLayers();
    plan_.fragments_counted = plan_.fragments_stored;
}

/// Where tiles overlap, only their union tells.
void Merge::countLayers() {
    LayerWindows windows;
    forEachBand({"count", kCountEnd}, [&](const LayeredImage& band) { windows.add(band); });
    plan_.layers = windows.layers();
    plan_.fragments_stored = windows.fragments();
}

/// What is read at once stays within kBandBytes, whether the tiles lie side by side or not.
int Merge::rowsAtOnce() const {
    std::uint64_t across = 1;
    for (const Window& window : windows_) {
        const auto beside = std::ranges::count_if(windows_, [&](const Window& other) {
            return other.y0 < window.y1 && window.y0 < other.y1;
        });
        across = std::max(across, static_cast<std::uint64_t>(beside));
    }
    int rows = plan_.view.crop.height();
    for (const Tile& tile : tiles_) {
        // A low tile that fits says its height, which is no limit for its neighbours.
        constexpr int kUsualRows = 128;
        const int fitting = tile.input->rowsFor(kBandBytes / across);
        const bool all_of_it = fitting >= tile.window().height();
        rows = std::min(rows, all_of_it ? std::max(fitting, kUsualRows) : fitting);
    }
    return rows;
}

template <class Take>
void Merge::forEachBand(const Stage& stage, Take&& take) {
    ProgressReport progress(console_, options_.report.shownProgress(), stage);
    const Window& crop = plan_.view.crop;
    const int rows = rowsAtOnce();
    std::vector<LayeredImage> images;
    LayeredImage band;
    for (int y = crop.y0; y < crop.y1; y += rows) {
        const Window window{crop.x0, y, crop.x1, std::min(y + rows, crop.y1)};
        {
            const StageTimer timer(result_.milliseconds, "load");
            images.clear();
            for (const Tile& tile : tiles_) {
                const Window part = intersect(window, tile.window());
                if (!part.empty()) tile.input->read(part, images.emplace_back());
            }
            if (const auto pixel = joinTiles(images, window, arrays_, band)) {
                throw Error(ErrorKind::kInput,
                            "tiles that overlap do not agree on pixel (" +
                                std::to_string(pixel->x0) + ", " + std::to_string(pixel->y0) + ")",
                            output_.path.string(),
                            "render them with the same renderer, or without an overlap");
            }
        }
        take(band);
        progress.update(static_cast<double>(window.y1 - crop.y0) / crop.height());
    }
}

/// Whether one command would have made the same file, so that the file may say so.
bool Merge::isWhatRenderMakes() const {
    const ExrInfo& first = tiles_.front().info();
    if (!first.attributes().contains("peeler:outputHash")) return false;
    // What they do not tell: the background of composites, by what deep samples were merged.
    if (has_gaps_ || composites_ || !first.provenance.deep_merge.empty()) return false;
    // Colours of several samples were rounded before they are composited.
    const std::string_view kind = findOutputFormat(output_.path.string(), output_.as).kind;
    return plan_.samples == 1 || kind == (first.deep.empty() ? "ldi" : "deep");
}

void Merge::write() {
    Provenance provenance = tiles_.front().info().provenance;
    provenance.tile.clear();
    provenance.version = PEELER_VERSION;
    OutputOptions output = outputOptions(output_, provenance);
    const ExrInfo& first = tiles_.front().info();
    output.cryptomatte = keepsCryptomatte(first, output_);
    output.composited = composites_;
    if (isWhatRenderMakes())
        output.provenance.output_hash = outputHash(plan_.view, output_.path.string(), output);
    auto writer = makeSink(output_.path.string(), output);
    writer->begin(plan_);
    std::uint64_t fragments = 0;
    forEachBand("merge", [&](const LayeredImage& band) {
        fragments += band.fragments();
        writer->write(band);
    });
    if (!composites_ && fragments != plan_.fragments_stored) {
        throw Error(ErrorKind::kInput,
                    "the tiles say they have " + groupedText(plan_.fragments_stored) +
                        " fragments, and have " + groupedText(fragments),
                    output_.path.string(), "peeler verify tells which one is damaged");
    }
    writer->finish();
    add(result_.milliseconds, writer->times());
}

void Merge::tell() {
    result_.output = output_.path;
    describePicture(plan_, tiles_.front().info().provenance, result_);
    result_.fragments_blended = plan_.fragments_blended;
    result_.samples = plan_.samples;
    describeFiles(output_.layers, output_.path, result_, console_);
    tellResult(options_.report, result_, console_);
}

}  // namespace

VerbAction declareMerge(CLI::App& app) {
    const auto options = std::make_shared<MergeOptions>();
    addFiles(app, "TILES", options->inputs,
             "layered, deep or composite images (.exr) of one scene, view and settings, rendered "
             "with --tile or --crop");
    addOutputOptions(app, options->output);
    addLayerOutputOptions(app, options->output);
    app.add_flag("--allow-gaps", options->allow_gaps, "pixels that no tile has stay empty");
    addThreadsOption(app, options->threads);
    addReportOptions(app, options->report);
    app.footer(
        "The result is the file that a render of the whole would have written. Tiles may overlap\n"
        "where they agree, bit for bit.");
    return [options](Console& console) {
        Merge(*options, console).run();
        return 0;
    };
}

}  // namespace peeler::cmd
