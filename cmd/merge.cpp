// SPDX-License-Identifier: Apache-2.0
// peeler merge: tiles of one picture, rendered apart, put together band by band.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/report.h"
#include "cmd/machine/resources.h"
#include "cmd/merge/picture_tiles.h"
#include "cmd/options/layered_bands.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/session/progress_report.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "core/base/stage_times.h"
#include "core/image/layers.h"
#include "formats/exr/exr_integrity.h"
#include "formats/exr/exr_layout.h"
#include "formats/file/file_name.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct MergeOptions {
    std::vector<fs::path> inputs;
    LayeredReadOptions reading;
    bool elements = false;
    bool allow_gaps = false;
    int threads = 0;
    OutputRequest output;
    ReportOptions report;
};

/// One run. run() lists its stages.
class Merge {
  public:
    Merge(const MergeOptions& options, Reporter& reporter)
        : options_(options), reporter_(reporter), output_(options.output) {}

    void run() {
        {
            const StageTimer timer(result_.milliseconds, "total");
            checkOptions();
            open();
            chooseKind();
            checkCover();
            plan();
            write();
        }
        report();
    }

  private:
    void checkOptions();
    void open();
    void chooseKind();
    void checkCover() const;
    void plan();
    void countLayers();
    void write();
    void report();

    /// Joins the tiles band by band and hands each band to `take`.
    template <class Take>
    void forEachBand(const Stage& stage, Take&& take);
    bool composites() const { return tiles_->kind() == PictureTiles::Kind::kComposite; }

    const MergeOptions& options_;
    Reporter& reporter_;
    OutputRequest output_;
    std::optional<PictureTiles> tiles_;
    Plan plan_;
    OutputOptions written_;
    PictureResult result_;
};

void Merge::checkOptions() {
    options_.report.applyTo(reporter_);
    checkOutput(output_, options_.inputs);
    if (findOutputFormat(output_.path.string(), output_.options.as)
            .holds(OutputContent::kShadowMap)) {
        throw Error(ErrorKind::kUsage, "layers do not tell which surfaces cast shadows",
                    "--as midpoint-depth", "render it as a whole");
    }
    std::vector<fs::path> others = options_.inputs;
    others.push_back(output_.path);
    checkReport(options_.report, others);
    setThreads(options_.threads);
}

void Merge::open() {
    const StageTimer timer(result_.milliseconds, "load");
    const bool composites_wanted =
        !output_.options.as.empty() && findOutputFormat(output_.path.string(), output_.options.as)
                                           .holds(OutputContent::kComposite);
    tiles_.emplace(options_.inputs,
                   options_.elements ? PictureTiles::Parts::kElements : PictureTiles::Parts::kTiles,
                   readingFor(options_.reading, {{output_.path}}), composites_wanted, reporter_);
    for (const fs::path& input : options_.inputs)
        if (fileKind(input.string()) == FileKind::kExr) requireUnchanged(input.string());
}

/// Chooses the kind of the output: that of the tiles, unless another is asked for. Composites are
/// merged as they are.
void Merge::chooseKind() {
    const std::string path = output_.path.string();
    if (tiles_->kind() == PictureTiles::Kind::kDeep && output_.options.as.empty() &&
        findOutputFormat(path, "").holds(OutputContent::kLayers))
        output_.options.as = "deep";
    if (composites() && output_.options.as.empty()) output_.options.as = "composite";
    checkFormat(output_);  // what suits layered files may not suit the chosen kind
    if (!composites()) return;
    if (output_.isGiven("--background")) {
        throw Error(ErrorKind::kUsage, "composites are merged as they are, background and all",
                    "--background", "render the tiles with it");
    }
    if (!findOutputFormat(path, output_.options.as).holds(OutputContent::kComposite)) {
        throw Error(ErrorKind::kUsage, "composites have no layers", "--as " + output_.options.as,
                    "render the tiles as layers");
    }
}

void Merge::checkCover() const {
    if (options_.allow_gaps || options_.elements) return;
    const auto refuse = [&](const std::string& what) {
        throw Error(ErrorKind::kInput, what, output_.path.string(),
                    "add the tile, or --allow-gaps to do without");
    };
    if (const std::string strip = tiles_->missingStrip(); !strip.empty())
        refuse("tile " + strip + " is missing");
    if (const auto gap = tiles_->gap()) {
        refuse("no tile has the " + std::to_string(gap->width()) + " x " +
               std::to_string(gap->height()) + " pixels at (" + std::to_string(gap->x0) + ", " +
               std::to_string(gap->y0) + ")");
    }
}

void Merge::plan() {
    plan_ = tiles_->info().plan;
    plan_.layers.clear();
    plan_.view.crop = tiles_->window();
    plan_.tinted = tiles_->tinted();
    plan_.fragments_counted = plan_.fragments_stored = plan_.fragments_blended = 0;
    bool complete = true;
    for (const PictureTile& tile : tiles_->all()) {
        const Plan& part = tile.info().plan;
        complete = complete && part.complete();
        // Files of other programs do not say how many there were.
        plan_.fragments_counted += std::max(part.fragments_counted, part.fragments_stored);
        plan_.fragments_stored += part.fragments_stored;
        plan_.fragments_blended += part.fragments_blended;
        if (plan_.layers.size() < part.layers.size()) plan_.layers.resize(part.layers.size());
        for (std::size_t k = 0; k < part.layers.size(); ++k) {
            Window& window = plan_.layers[k].data_window;
            window = unite(window, part.layers[k].data_window);
        }
    }
    if (options_.elements) {
        countLayers();
        return;
    }
    if (composites()) {
        if (!tiles_->overlap()) return;
        throw Error(ErrorKind::kInput,
                    "tiles overlap: nobody knows how many fragments the composite has",
                    output_.path.string(), "render tiles that do not overlap, or layers");
    }
    const bool pixels_matter =
        output_.options.layout == kPerFileLayout ||
        findOutputFormat(output_.path.string(), output_.options.as).holds(OutputContent::kXray);
    if (!tiles_->overlap()) {
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

/// Counts layers and fragments of the joined tiles, which the tiles' headers do not tell where
/// tiles overlap.
void Merge::countLayers() {
    DepthComplexity complexity(plan_.view.crop);
    forEachBand({"count", kCountEnd}, [&](const LayeredImage& band) { complexity.addBand(band); });
    plan_.layers = complexity.layers();
    plan_.fragments_stored = complexity.counted();
}

template <class Take>
void Merge::forEachBand(const Stage& stage, Take&& take) {
    ProgressReport progress(reporter_, stage);
    const Window& crop = plan_.view.crop;
    const int rows = tiles_->rowsFor(kBandBytes);
    LayeredImage band;
    for (int y = crop.y0; y < crop.y1; y += rows) {
        const Window window{crop.x0, y, crop.x1, std::min(y + rows, crop.y1)};
        {
            const StageTimer timer(result_.milliseconds, "load");
            if (const auto pixel = tiles_->read(window, band)) {
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

void Merge::write() {
    Provenance provenance = tiles_->provenance();
    provenance.tile.clear();
    provenance.version = PEELER_VERSION;
    OutputOptions output = output_.from(provenance);
    output.automatic_exposure = output_.leavesExposureOpen();
    const ExrInfo& first = tiles_->info();
    output.cryptomatte = keepsCryptomatte(first, output_);
    output.composited = composites();
    if (!options_.elements && !tiles_->gap()) {
        output.provenance.output_hash =
            outputHashFrom(first, plan_.view, output_.path.string(), output);
    }
    auto writer = makeSink(output_.path.string(), output);
    writer->begin(plan_);
    std::uint64_t fragments = 0;
    forEachBand("merge", [&](LayeredImage& band) {
        fragments += band.fragments();
        writer->write(std::move(band));
    });
    if (!composites() && fragments != plan_.fragments_stored) {
        throw Error(ErrorKind::kInput,
                    "the tiles say they have " + groupedText(plan_.fragments_stored) +
                        " fragments, and have " + groupedText(fragments),
                    output_.path.string(), "peeler verify tells which one is damaged");
    }
    writer->finish();
    add(result_.milliseconds, writer->times());
    written_ = output;
}

void Merge::report() {
    result_.inputs = options_.inputs;
    result_.output = output_.path;
    describePicture(plan_, tiles_->provenance(), result_);
    describeFiles(output_, result_, reporter_);
    describeDisplay(written_, written_.automatic_exposure, result_);
    noteDisplay(result_, reporter_);
    reportResult(options_.report, result_, reporter_);
}

}  // namespace

VerbAction declareMerge(VerbOptions& verb) {
    const auto options = std::make_shared<MergeOptions>();
    verb.addFiles("TILES", options->inputs,
                  "layered, deep or composite images (.exr, .safetensors) of one scene, view and "
                  "settings, rendered with --tile or --crop")
        .files(".exr .safetensors");
    addLayeredOptions(verb, options->reading);
    addOutputOptions(verb, options->output);
    addLayerOutputOptions(verb, options->output);
    verb.addFlag(
        "--elements", options->elements,
        "the files are not tiles but elements of one picture, such as its objects rendered "
        "apart, and layered or deep: their fragments are merged by depth");
    verb.addFlag("--allow-gaps", options->allow_gaps, "pixels that no tile has stay empty");
    addThreadsOption(verb, options->threads);
    addReportOptions(verb, options->report);
    verb.footer(
        "The result is the file that a render of the whole would have written. Tiles may overlap\n"
        "where they agree, bit for bit. Elements have camera, size, precision and channels in\n"
        "common; fragments at the very same depth stay in the order of the files. Ids of elements\n"
        "of different scenes are made different, and keep their names.");
    return [options](Session& session) {
        Merge(*options, session.reporter()).run();
        return 0;
    };
}

}  // namespace peeler::cmd
