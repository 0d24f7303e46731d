// SPDX-License-Identifier: Apache-2.0
// peeler rays: all hits of bundles of rays, and what follows from them.
// Longer than others because a run, its outputs and its views are one class.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/progress.h"
#include "cmd/cli/report.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/forecast.h"
#include "cmd/options/output_options.h"
#include "cmd/rays/ray_findings.h"
#include "cmd/rays/rays_options.h"
#include "cmd/verbs.h"
#include "core/base/error.h"
#include "formats/arrays/point_reader.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"
#include "formats/output_hash.h"
#include "formats/rays/ray_output.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

/// Hands the bands of a bundle on to the outputs.
class BundleSink final : public Sink {
  public:
    BundleSink(std::span<const std::unique_ptr<RayOutput>> outputs, std::size_t bundle)
        : outputs_(outputs), bundle_(bundle) {}

    void begin(const Plan&) override {}
    void write(LayeredImage&& band) override {
        for (const auto& output : outputs_)
            output->take(bundle_, band);
    }
    void finish() override {}
    /// What the outputs take besides the band, which they go through some rows at a time.
    SinkMemory memory() const override { return {0, std::uint64_t{48} << 20}; }

  private:
    std::span<const std::unique_ptr<RayOutput>> outputs_;
    std::size_t bundle_;
};

/// The bundles that go into one output, and what becomes of them.
struct RayTrace {
    OutputRequest output;
    std::optional<std::size_t> view{};  ///< of one output a view
    std::vector<Bundle> bundles{};
    std::vector<std::unique_ptr<RayOutput>> outputs{};
    const RayParity* parity = nullptr;  ///< one of outputs; null without --parity
    std::vector<fs::path> files{};      ///< the files that are written
    std::vector<std::uint64_t> hits{};  ///< of each bundle; empty if no output needs them first
    Forecast forecast{};
    std::uint64_t hits_found = 0;
    double largest_correction = 0;
    bool failed = false;  ///< --parity fail found an odd ray: no file is written
};

/// One run. run() and make() list its stages.
class Rays {
  public:
    Rays(const RaysOptions& options, Console& console)
        : options_(options),
          console_(console),
          job_(options, console),
          views_(options.bundles.views, options.bundles.camera),
          results_(eachAlone() ? "view" : "", console) {}

    /// Returns the exit code.
    int run() {
        checkOptions();
        openScene();
        checkSceneOutputs();
        if (!eachAlone()) {
            RayTrace trace{.output = options_.output, .bundles = chooseBundles()};
            make(trace);
            if (options_.dry_run) return 0;
            reportResult(options_.report, results_.json(), "", console_);
            if (trace.failed) trace.parity->fail();
            return 0;
        }
        return makeViews();
    }

  private:
    /// Whether every view has an output of its own.
    bool eachAlone() const { return views_.asked() && hasViewToken(options_.output.path.string()); }
    void checkOptions();
    void checkFiles() const;
    void checkSceneOutputs() const;
    std::vector<fs::path> inputs() const;
    fs::path outputOf(std::size_t view) const;
    void openScene();
    std::vector<Bundle> chooseBundles();
    Bundle viewBundle(std::size_t view) const;
    int makeViews();
    void makeView(std::size_t view);
    void make(RayTrace& trace);
    void nameFiles(RayTrace& trace) const;
    void openOutputs(RayTrace& trace);
    std::unique_ptr<RayOutput> makeOutput(const RayTrace& trace);
    std::string hashOf(const RayTrace& trace) const;
    void openHits();
    void count(RayTrace& trace);
    void describe(const RayTrace& trace);
    void trace(RayTrace& trace);
    void report(RayTrace& trace);

    const Solids& solids() {
        if (!solids_) solids_ = std::make_unique<Solids>(*posed_);
        return *solids_;
    }

    const RaysOptions& options_;
    Console& console_;
    CaptureJob job_;
    ViewList views_;
    std::size_t first_ = 0, end_ = 1;  ///< of the views, which are this run's
    CaptureSettings capture_;
    const OpenedScene* scene_ = nullptr;  ///< owned by job_
    std::optional<PosedScene> posed_;
    std::optional<AxisBundles> lattice_;  ///< of --voxels
    std::unique_ptr<Solids> solids_;      ///< if something needs them
    HitSource* source_ = nullptr;         ///< owned by job_; null before the first output
    SequenceResults results_;
};

void Rays::checkOptions() {
    job_.checkOptions();
    checkRaysOptions(options_);
    const std::optional<Shard>& chunk = options_.sequence.chunk;
    if (chunk && !views_.asked())
        refuse("there are no views to take a part of", "--chunk " + chunk->text(),
               "add --cameras or --views");
    std::tie(first_, end_) = chunk.value_or(Shard()).of(views_.size());
    if ((options_.sequence.skip_existing || options_.sequence.keep_going) && !eachAlone())
        refuse("one file has all views", "--skip-existing, --keep-going",
               "put @@@@ into the output's name, for a file a view");
    checkFiles();
    capture_ = options_.capture;
    capture_.faces = options_.chosenFaces();
    // Outputs of --points find t from the triangle anyway.
    const bool refine = options_.refine && !options_.points;
    capture_.hit_mode = refine ? HitMode::kRefined : HitMode::kRaw;
    capture_.color_type = PixelType::kFloat;  // normals, too
    // A camera sees from its near to its far plane; other rays have no ends.
    capture_.depth_clamp = !options_.bundles.usesCamera();
}

std::vector<fs::path> Rays::inputs() const {
    std::vector<fs::path> inputs{options_.scene.file};
    for (const auto& file : {options_.bundles.file, options_.points, options_.bundles.views.file})
        if (file) inputs.push_back(*file);
    return inputs;
}

fs::path Rays::outputOf(std::size_t view) const {
    const fs::path& path = options_.output.path;
    return eachAlone() ? fs::path(viewPath(path.string(), static_cast<int>(view))) : path;
}

void Rays::checkFiles() const {
    std::vector<fs::path> others = inputs();
    const std::size_t outputs = eachAlone() ? end_ - first_ : options_.writesFile() ? 1U : 0U;
    for (std::size_t i = 0; i < outputs; ++i) {
        OutputRequest output = options_.output;
        output.path = outputOf(first_ + i);
        if (options_.sequence.skip_existing || options_.sequence.keep_going)
            output.no_clobber = false;
        if (options_.writesPictures()) {
            output.options.as = "composite";
            output.path = framePath(output.path.string(), 0);
            checkOutput(output, inputs());
        } else {
            if (i == 0) checkExtraFile(output.path, others, "the output", "--output");
            checkTarget(output, inputs());
        }
        others.push_back(output.path);
    }
    checkReport(options_.report, others);
}

/// Only now is known which files the scene is made of.
void Rays::checkSceneOutputs() const {
    std::vector<fs::path> files;
    for (std::size_t view = first_; eachAlone() && view < end_; ++view)
        files.push_back(outputOf(view));
    job_.checkOutputs(files);
}

/// Names and checks the outputs of the bundles: only now is known how many pictures there are.
void Rays::nameFiles(RayTrace& trace) const {
    if (options_.writesPictures()) {
        std::vector<int> numbers(trace.bundles.size());
        std::iota(numbers.begin(), numbers.end(), 0);
        OutputRequest output = trace.output;
        if (trace.view) output.no_clobber = false;  // makeView() has looked
        trace.files = checkSeries(output, numbers, inputs());
        checkReport(options_.report, trace.files);
    } else if (options_.writesFile()) {
        trace.files = {trace.output.path};
    }
    job_.checkOutputs(trace.files);
}

void Rays::openScene() {
    scene_ = &job_.openScene();
    posed_ = job_.pose();
    if (views_.asked()) views_.place(*scene_);
}

Bundle Rays::viewBundle(std::size_t view) const {
    const std::string name = views_.asked() ? views_.name(view) : "camera";
    return {name, views_.view(*scene_, *posed_, view)};
}

std::vector<Bundle> Rays::chooseBundles() {
    const std::optional<Bounds> all = posed_->bounds();
    if (!all)
        throw Error(ErrorKind::kInput, "the scene shows nothing that a ray could hit",
                    options_.scene.file.string(), "peeler info tells what is in it");
    if (views_.asked()) {
        std::vector<Bundle> bundles;
        for (std::size_t view = first_; view < end_; ++view)
            bundles.push_back(viewBundle(view));
        return bundles;
    }
    if (options_.bundles.usesCamera()) {
        CameraOptions camera = options_.bundles.camera;
        if (camera.size == Size{0, 0}) camera.size = CameraOptions{}.size;
        return {{"camera", scene_->view(*posed_, camera)}};
    }
    if (options_.voxels) {
        RayGrid grid;
        grid.resolution = *options_.voxels;
        lattice_ = axisBundles(options_.bundles.bounds.value_or(*all), *all, grid);
        return lattice_->bundles;
    }
    return parallelBundles(options_.bundles, *all);
}

int Rays::makeViews() {
    int code = 0;
    job_.chooseEngine();  // hashes tell which
    try {
        for (std::size_t view = first_; view < end_; ++view) {
            try {
                makeView(view);
            } catch (...) {
                const Error error = currentError();
                if (!options_.sequence.keep_going || error.kind() == ErrorKind::kUsage) throw error;
                results_.addFailure(outputOf(view), {.view = static_cast<int>(view)}, error);
                job_.closeHits();  // the failure may have left it in any state
                source_ = nullptr;
                job_.takeTimes();
            }
        }
    } catch (...) {
        code = reportError(console_, currentError());
    }
    if (!options_.dry_run) reportResult(options_.report, results_.json(), "", console_);
    results_.tellFailures();
    return std::max(code, results_.worst());
}

void Rays::makeView(std::size_t view) {
    if (view != first_) job_.restartClock();
    RayTrace trace{.output = options_.output, .view = view, .bundles = {viewBundle(view)}};
    trace.output.path = outputOf(view);
    if (options_.sequence.skip_existing &&
        outputHashOf(trace.output.path.string()) == hashOf(trace)) {
        RunResult there;
        there.setFile(trace.output.path);
        job_.finish(there);
        Json found = {{"view", view}, {"camera", views_.name(view)}, {"skipped", true}};
        results_.add(toJson(there, found), trace.output.path.string() + ": is there already");
        return;
    }
    if (trace.output.no_clobber) checkTarget(trace.output, {});
    make(trace);
}

void Rays::make(RayTrace& trace) {
    nameFiles(trace);
    openOutputs(trace);
    openHits();
    count(trace);
    if (options_.dry_run) return describe(trace);
    tellForecast(trace.forecast, console_);
    this->trace(trace);
    report(trace);
}

void Rays::openOutputs(RayTrace& trace) {
    if (options_.parity) {
        auto parity = std::make_unique<RayParity>(scene_->scene(), solids(), console_);
        trace.parity = parity.get();
        trace.outputs.push_back(std::move(parity));
    }
    if (options_.writesFile()) trace.outputs.push_back(makeOutput(trace));
    std::vector<Channel>& channels = capture_.channels;
    for (const auto& output : trace.outputs) {
        const std::vector<Channel> more = output->channels();
        channels.insert(channels.end(), more.begin(), more.end());
    }
    std::ranges::sort(channels);
    channels.erase(std::unique(channels.begin(), channels.end()), channels.end());
}

/// Of all that decides what is in the file of a view.
std::string Rays::hashOf(const RayTrace& trace) const {
    CaptureSettings settings = capture_;
    settings.channels.clear();  // they follow from what is asked for
    const Json all = {
        {"scene", hexText(scene_->scene().content_hash)},
        {"settings", job_.settingsHash(settings, raySettings(options_, trace.bundles))},
        {"time", options_.animation.time.value_or(0)},
        {"name", trace.bundles.front().name},
        {"extension", lowerExtension(trace.output.path)},
    };
    return hashText(dumpJson(all));
}

std::unique_ptr<RayOutput> Rays::makeOutput(const RayTrace& trace) {
    const std::string path = trace.output.path.string();
    Provenance provenance;
    provenance.version = PEELER_VERSION;
    provenance.method = "rays";
    provenance.scene = options_.scene.file.filename().string();
    provenance.scene_hash = hexText(scene_->scene().content_hash);
    provenance.time = options_.animation.time.value_or(0);
    if (trace.view) {
        provenance.view = static_cast<int>(*trace.view);
        provenance.output_hash = hashOf(trace);
    }
    if (lattice_) {
        checkVoxelMemory(*lattice_, capture_.memory);
        return makeVoxelOutput(path, solids(), *lattice_, "peeler " PEELER_VERSION);
    }
    if (options_.writesPictures()) {
        RayMapOptions maps = rayMapOptions(options_.maps, scene_->scene());
        maps.provenance = provenance;
        const Solids* inside = needsSolids(maps.settings.maps) ? &solids() : nullptr;
        return makeRayMapOutput(path, *posed_, inside, maps);
    }
    if (options_.points) return makeNextHitOutput(path, *posed_, readPoints(*options_.points));
    HitOptions hits{.posed = *posed_,
                    .provenance = provenance,
                    .comment = "hits in world space of " + printable(provenance.scene) +
                               ", +Y up, by peeler " PEELER_VERSION,
                    .double_positions = options_.double_points,
                    .columns = options_.columns};
    if (options_.output.isGiven("--dense")) hits.dense = options_.output.options.dense;
    return makeHitOutput(path, hits);
}

void Rays::openHits() {
    if (!source_) source_ = &job_.openHits(*posed_);
}

/// Counts first where an output needs it: its header or arrays say how many hits follow, and come
/// before them. Then the sizes of the files are known.
void Rays::count(RayTrace& trace) {
    if (std::ranges::any_of(trace.outputs,
                            [](const auto& output) { return output->needsHits(); })) {
        ProgressReport progress(console_, options_.report.shownProgress(), {"count", kCountEnd});
        for (const Bundle& bundle : trace.bundles) {
            trace.hits.push_back(source_->plan(bundle.view, capture_).fragments_counted);
            progress.update(static_cast<double>(trace.hits.size()) /
                            static_cast<double>(trace.bundles.size()));
        }
    }
    if (!options_.writesFile()) return;
    const std::uint64_t hits =
        std::accumulate(trace.hits.begin(), trace.hits.end(), std::uint64_t{0});
    std::string contents =
        trace.hits.empty() ? countText(raysOf(trace.bundles), "ray") : countText(hits, "hit");
    contents += " of " + countText(trace.bundles.size(), "bundle");
    trace.forecast.files = {{trace.output.path,
                             trace.outputs.back()->forecast(trace.bundles, trace.hits),
                             std::move(contents)}};
}

/// What would be done, for --dry-run.
void Rays::describe(const RayTrace& trace) {
    Json json;
    json["scene"] = options_.scene.file.string();
    json["bundles"] = trace.bundles.size();
    json["rays"] = raysOf(trace.bundles);
    json["hits"] =
        trace.hits.empty()
            ? Json()
            : Json(std::accumulate(trace.hits.begin(), trace.hits.end(), std::uint64_t{0}));
    json["settingsHash"] = job_.settingsHash(capture_, raySettings(options_, trace.bundles));
    json["outputs"] = forecastJson(trace.forecast);
    console_.result(jsonText(json));
    tellForecast(trace.forecast, console_, true);
}

void Rays::trace(RayTrace& trace) {
    for (const auto& output : trace.outputs)
        output->begin(trace.bundles, trace.hits);
    ProgressReport progress(console_, options_.report.shownProgress(), "trace");
    const auto all = static_cast<double>(trace.bundles.size());
    for (std::size_t i = 0; i < trace.bundles.size(); ++i) {
        // The source still has the plan of a lone bundle from count().
        if (trace.hits.size() != 1) {
            const Plan plan = source_->plan(trace.bundles[i].view, capture_);
            trace.hits_found += plan.fragments_counted;
        }
        BundleSink sink(trace.outputs, i);
        const CaptureReport report = source_->capture(
            sink, [&](double share) { progress.update((static_cast<double>(i) + share) / all); });
        trace.largest_correction = std::max(trace.largest_correction, report.largest_correction);
    }
    if (trace.hits.size() == 1) trace.hits_found = trace.hits.front();
    trace.failed = options_.parity == ParityUse::kFail && !trace.parity->holds();
    for (const auto& output : trace.outputs)
        if (!trace.failed || output.get() == trace.parity) output->finish();
}

void Rays::report(RayTrace& trace) {
    RunResult result;
    job_.finish(result);
    // The hash stands in the result alone: files of rays have never had it, and keep their bytes.
    result.settings_hash = job_.settingsHash(capture_, raySettings(options_, trace.bundles));
    const std::uint64_t rays = raysOf(trace.bundles);
    if (options_.writesFile()) result.forecast_bytes = trace.forecast.size().bytes;
    std::string line = countText(trace.bundles.size(), "bundle") + ", " + countText(rays, "ray") +
                       ", " + countText(trace.hits_found, "hit");
    if (options_.writesFile() && !trace.failed) {
        const fs::path& path = trace.output.path;
        line = path.string() + ": " + line;
        if (fs::exists(path)) {
            result.setFile(path);
            line += ", " + bytesText(result.bytes);
        } else {
            result.setFiles(path, trace.files);
        }
    }
    Json found;
    if (trace.view) {
        found["view"] = *trace.view;
        found["camera"] = views_.name(*trace.view);
    }
    found["bundles"] = trace.bundles.size();
    found["rays"] = rays;
    found["hits"] = trace.hits_found;
    found["largestCorrection"] =
        capture_.hit_mode == HitMode::kRaw ? Json() : Json(trace.largest_correction);
    if (trace.parity) trace.parity->addTo(found);
    for (const auto& output : trace.outputs)
        addRayResults(output->results(), found);
    results_.add(toJson(result, found), line + ", " + totalText(result.milliseconds));
}

}  // namespace

VerbAction declareRays(VerbOptions& verb) {
    const auto options = std::make_shared<RaysOptions>();
    addRaysOptions(verb, *options);
    return [options, verb](Console& console) {
        options->bundles.views.size_given = verb.given("--size");
        return Rays(*options, console).run();
    };
}

}  // namespace peeler::cmd
