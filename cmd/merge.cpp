// SPDX-License-Identifier: Apache-2.0
// peeler merge: joins the tiles, or merges the elements, of a picture, band by band.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/report.h"
#include "cmd/merge/picture_tiles.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/layered_run.h"
#include "cmd/options/output_options.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "core/image/layers.h"
#include "formats/exr/exr_integrity.h"
#include "formats/exr/exr_layout.h"
#include "formats/file/file_name.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct MergeOptions : LayeredRunOptions {
    std::vector<fs::path> inputs;
    bool elements = false;
    bool allow_gaps = false;
};

class Merge {
  public:
    Merge(const MergeOptions& options, Reporter& reporter)
        : options_(options), run_(options, options.inputs, reporter), reporter_(reporter) {}

    void run() {
        checkOptions();
        open();
        chooseKind();
        checkCover();
        plan();
        write();
    }

  private:
    void checkOptions();
    void open();
    void chooseKind();
    void checkCover() const;
    void plan();
    void countLayers();
    void write();

    template <class Take>
    void forEachBand(const Stage& stage, Take&& take);
    bool composites() const { return tiles_->kind() == PictureTiles::Kind::kComposite; }
    std::string path() const { return run_.output.path.string(); }

    const MergeOptions& options_;
    LayeredRun run_;
    Reporter& reporter_;
    std::optional<PictureTiles> tiles_;
};

void Merge::checkOptions() {
    run_.checkFiles();
    if (findOutputFormat(path(), run_.output.options.as).holds(OutputContent::kShadowMap)) {
        throw Error(ErrorKind::kUsage, "layers do not record which surfaces cast shadows",
                    "--as midpoint-depth", "render the whole picture at once");
    }
}

void Merge::open() {
    const std::string& as = run_.output.options.as;
    const bool composites_wanted =
        !as.empty() && findOutputFormat(path(), as).holds(OutputContent::kComposite);
    run_.open([&](const LayeredReadOptions& reading) {
        tiles_.emplace(
            options_.inputs,
            options_.elements ? PictureTiles::Parts::kElements : PictureTiles::Parts::kTiles,
            reading, composites_wanted, reporter_);
        for (const fs::path& input : options_.inputs)
            if (fileKind(input.string()) == FileKind::kExr) requireUnchanged(input.string());
    });
}

/// Chooses the output's kind: --as or, by default, the kind of the tiles. Composites are joined
/// unchanged.
void Merge::chooseKind() {
    OutputRequest& output = run_.output;
    std::string& as = output.options.as;
    if (tiles_->kind() == PictureTiles::Kind::kDeep && as.empty() &&
        findOutputFormat(path(), "").holds(OutputContent::kLayers))
        as = "deep";
    if (composites() && as.empty()) as = "composite";
    checkFormat(output);  // again, because the kind may have changed
    if (!composites()) return;
    if (output.isGiven("--background")) {
        throw Error(ErrorKind::kUsage, "composites are merged with the backgrounds they have",
                    "--background", "render the tiles with this background");
    }
    if (!findOutputFormat(path(), as).holds(OutputContent::kComposite)) {
        throw Error(ErrorKind::kUsage, "composites have no layers", "--as " + as,
                    "render the tiles as layers");
    }
}

void Merge::checkCover() const {
    if (options_.allow_gaps || options_.elements) return;
    const auto refuse = [&](const std::string& what) {
        throw Error(ErrorKind::kInput, what, path(), "add the tile, or use --allow-gaps");
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
    Plan& plan = run_.plan;
    plan = tiles_->info().plan;
    plan.layers.clear();
    plan.view.crop = tiles_->window();
    plan.tinted = tiles_->tinted();
    plan.fragments_counted = plan.fragments_stored = plan.fragments_blended = 0;
    bool complete = true;
    for (const PictureTile& tile : tiles_->all()) {
        const Plan& part = tile.info().plan;
        complete = complete && part.complete();
        // Files from other programs lack the number of counted fragments.
        plan.fragments_counted += std::max(part.fragments_counted, part.fragments_stored);
        plan.fragments_stored += part.fragments_stored;
        plan.fragments_blended += part.fragments_blended;
        if (plan.layers.size() < part.layers.size()) plan.layers.resize(part.layers.size());
        for (std::size_t k = 0; k < part.layers.size(); ++k) {
            Window& window = plan.layers[k].data_window;
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
                    "tiles overlap, so the composite's fragment count is unknown", path(),
                    "render tiles that do not overlap, or layers");
    }
    const OutputOptions& output = run_.output.options;
    const bool pixels_matter = output.layout == kPerFileLayout ||
                               findOutputFormat(path(), output.as).holds(OutputContent::kXray);
    if (!tiles_->overlap()) {
        if (pixels_matter) countLayers();
        return;
    }
    if (!complete) {
        throw Error(
            ErrorKind::kInput,
            "tiles overlap and do not have all layers, so the picture's fragment count is unknown",
            path(), "render the tiles without overlap or with all layers");
    }
    countLayers();
    plan.fragments_counted = plan.fragments_stored;
}

/// Counts the layers and fragments of the joined tiles. If tiles overlap, the headers cannot give
/// these numbers.
void Merge::countLayers() {
    DepthComplexity complexity(run_.plan.view.crop);
    forEachBand({"count", kCountEnd}, [&](const LayeredImage& band) { complexity.addBand(band); });
    run_.plan.layers = complexity.layers();
    run_.plan.fragments_stored = complexity.counted();
}

template <class Take>
void Merge::forEachBand(const Stage& stage, Take&& take) {
    const auto read = [&](const Window& window, LayeredImage& band) {
        if (const auto pixel = tiles_->read(window, band)) {
            throw Error(ErrorKind::kInput,
                        "overlapping tiles differ at pixel (" + std::to_string(pixel->x0) + ", " +
                            std::to_string(pixel->y0) + ")",
                        path(), "render them with the same renderer, or without overlap");
        }
    };
    run_.forEachBand(stage, tiles_->rowsFor(kBandBytes), read, take);
}

void Merge::write() {
    Provenance provenance = tiles_->provenance();
    provenance.tile.clear();
    const ExrInfo& first = tiles_->info();
    OutputOptions output = run_.outputOptions(provenance);
    output.cryptomatte = keepsCryptomatte(first, run_.output);
    output.composited = composites();
    if (!options_.elements && !tiles_->gap())
        output.provenance.output_hash = outputHashFrom(first, run_.plan.view, path(), output);
    const auto sink = makeSink(path(), output);
    run_.write(*sink, [&] {
        std::uint64_t fragments = 0;
        forEachBand("merge", [&](LayeredImage& band) {
            fragments += band.fragments();
            sink->write(std::move(band));
        });
        if (composites() || fragments == run_.plan.fragments_stored) return;
        throw Error(ErrorKind::kInput,
                    "the tiles' headers give " + groupedText(run_.plan.fragments_stored) +
                        " fragments, but the tiles have " + groupedText(fragments),
                    path(), "find the damaged tile with peeler verify");
    });
    run_.report(output, tiles_->provenance());
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
    verb.addFlag("--elements", options->elements,
                 "merge elements of one picture, such as objects rendered separately, instead of "
                 "tiles; the fragments of layered or deep files are merged by depth");
    verb.addFlag("--allow-gaps", options->allow_gaps,
                 "allow pixels that no tile covers, and leave them empty");
    addThreadsOption(verb, options->threads);
    addReportOptions(verb, options->report);
    verb.footer(
        "Merged tiles are identical to a render of the whole picture. Tiles may overlap where\n"
        "they are identical bit for bit.\n"
        "Elements must have the same camera, size, precision and channels. Layered or deep\n"
        "elements with all layers, one sample per pixel and no shadows give the same fragments as\n"
        "a render of the whole scene; only fragments at exactly the same depth are in the order\n"
        "of the files. With more samples, pixels that elements share are approximate at edges.\n"
        "Ids of different scenes are renumbered so that they differ, and keep their names.");
    return [options](Session& session) {
        Merge(*options, session.reporter()).run();
        return 0;
    };
}

}  // namespace peeler::cmd
