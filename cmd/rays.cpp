// SPDX-License-Identifier: Apache-2.0
// peeler rays: all hits of bundles of rays, and what follows from them.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

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

/// One run. run() lists its stages.
class Rays {
  public:
    Rays(const RaysOptions& options, Console& console)
        : options_(options), console_(console), job_(options, console) {}

    void run() {
        checkOptions();
        openScene();
        chooseBundles();
        checkOutputs();
        openOutputs();
        openHits();
        count();
        if (options_.dry_run) return describe();
        tellForecast(forecast_, console_);
        trace();
        report();
        if (failed_) parity_->fail();
    }

  private:
    void checkOptions();
    void checkFiles() const;
    void checkOutputs();
    std::vector<fs::path> inputs() const;
    void openScene();
    void chooseBundles();
    void openOutputs();
    std::unique_ptr<RayOutput> makeOutput();
    void openHits();
    void count();
    void describe();
    void trace();
    void report();

    const Solids& solids() {
        if (!solids_) solids_ = std::make_unique<Solids>(*posed_);
        return *solids_;
    }

    const RaysOptions& options_;
    Console& console_;
    CaptureJob job_;
    CaptureSettings capture_;
    const OpenedScene* scene_ = nullptr;  ///< owned by job_
    std::optional<PosedScene> posed_;
    std::vector<Bundle> bundles_;
    std::optional<AxisBundles> lattice_;  ///< of --voxels
    std::unique_ptr<Solids> solids_;      ///< if something needs them
    std::vector<std::unique_ptr<RayOutput>> outputs_;
    const RayParity* parity_ = nullptr;  ///< one of outputs_; null without --parity
    std::vector<fs::path> files_;        ///< the files that are written
    HitSource* source_ = nullptr;        ///< owned by job_
    std::vector<std::uint64_t> hits_;    ///< of each bundle; empty if no output needs them first
    Forecast forecast_;
    std::uint64_t hits_found_ = 0;
    double largest_correction_ = 0;
    bool failed_ = false;  ///< --parity fail found an odd ray: no file is written
};

void Rays::checkOptions() {
    job_.checkOptions();
    checkRaysOptions(options_);
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
    for (const auto& file : {options_.bundles.file, options_.points})
        if (file) inputs.push_back(*file);
    return inputs;
}

void Rays::checkFiles() const {
    std::vector<fs::path> others = inputs();
    if (options_.writesFile()) {
        OutputRequest output = options_.output;
        if (options_.writesPictures()) {
            output.options.as = "composite";
            output.path = framePath(output.path.string(), 0);
            checkOutput(output, others);
        } else {
            checkExtraFile(output.path, others, "the output", "--output");
            checkTarget(output, others);
        }
        others.push_back(output.path);
    }
    checkReport(options_.report, others);
}

/// Names and checks the outputs: only now is known which files the scene is made of, and how many
/// pictures there are.
void Rays::checkOutputs() {
    if (options_.writesPictures()) {
        std::vector<int> numbers(bundles_.size());
        std::iota(numbers.begin(), numbers.end(), 0);
        files_ = checkSeries(options_.output, numbers, inputs());
        checkReport(options_.report, files_);
    } else if (options_.writesFile()) {
        files_ = {options_.output.path};
    }
    job_.checkOutputs(files_);
}

void Rays::openScene() {
    scene_ = &job_.openScene();
    posed_ = job_.pose();
}

void Rays::chooseBundles() {
    const std::optional<Bounds> all = posed_->bounds();
    if (!all)
        throw Error(ErrorKind::kInput, "the scene shows nothing that a ray could hit",
                    options_.scene.file.string(), "peeler info tells what is in it");
    if (options_.bundles.usesCamera()) {
        CameraOptions camera = options_.bundles.camera;
        if (camera.size == Size{0, 0}) camera.size = CameraOptions{}.size;
        bundles_ = {{"camera", scene_->view(*posed_, camera)}};
        return;
    }
    if (options_.voxels) {
        RayGrid grid;
        grid.resolution = *options_.voxels;
        lattice_ = axisBundles(options_.bundles.bounds.value_or(*all), *all, grid);
        bundles_ = lattice_->bundles;
        return;
    }
    bundles_ = parallelBundles(options_.bundles, *all);
}

void Rays::openOutputs() {
    if (options_.parity) {
        auto parity = std::make_unique<RayParity>(scene_->scene(), solids(), console_);
        parity_ = parity.get();
        outputs_.push_back(std::move(parity));
    }
    if (options_.writesFile()) outputs_.push_back(makeOutput());
    std::vector<Channel>& channels = capture_.channels;
    for (const auto& output : outputs_) {
        const std::vector<Channel> more = output->channels();
        channels.insert(channels.end(), more.begin(), more.end());
    }
    std::ranges::sort(channels);
    channels.erase(std::unique(channels.begin(), channels.end()), channels.end());
}

std::unique_ptr<RayOutput> Rays::makeOutput() {
    const std::string path = options_.output.path.string();
    Provenance provenance;
    provenance.version = PEELER_VERSION;
    provenance.method = "rays";
    provenance.scene = options_.scene.file.filename().string();
    provenance.scene_hash = hexText(scene_->scene().content_hash);
    provenance.time = options_.animation.time.value_or(0);
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
    source_ = &job_.openHits(*posed_);
}

/// Counts first where an output needs it: its header or arrays say how many hits follow, and come
/// before them. Then the sizes of the files are known.
void Rays::count() {
    if (std::ranges::any_of(outputs_, [](const auto& output) { return output->needsHits(); })) {
        ProgressReport progress(console_, options_.report.shownProgress(), {"count", kCountEnd});
        for (const Bundle& bundle : bundles_) {
            hits_.push_back(source_->plan(bundle.view, capture_).fragments_counted);
            progress.update(static_cast<double>(hits_.size()) /
                            static_cast<double>(bundles_.size()));
        }
    }
    if (!options_.writesFile()) return;
    const std::uint64_t hits = std::accumulate(hits_.begin(), hits_.end(), std::uint64_t{0});
    std::string contents =
        hits_.empty() ? countText(raysOf(bundles_), "ray") : countText(hits, "hit");
    contents += " of " + countText(bundles_.size(), "bundle");
    forecast_.files = {
        {options_.output.path, outputs_.back()->forecast(bundles_, hits_), std::move(contents)}};
}

/// What would be done, for --dry-run.
void Rays::describe() {
    Json json;
    json["scene"] = options_.scene.file.string();
    json["bundles"] = bundles_.size();
    json["rays"] = raysOf(bundles_);
    json["hits"] = hits_.empty()
                       ? Json()
                       : Json(std::accumulate(hits_.begin(), hits_.end(), std::uint64_t{0}));
    json["settingsHash"] = job_.settingsHash(capture_, raySettings(options_, bundles_));
    json["outputs"] = forecastJson(forecast_);
    console_.result(jsonText(json));
    tellForecast(forecast_, console_, true);
}

void Rays::trace() {
    for (const auto& output : outputs_)
        output->begin(bundles_, hits_);
    ProgressReport progress(console_, options_.report.shownProgress(), "trace");
    const auto all = static_cast<double>(bundles_.size());
    for (std::size_t i = 0; i < bundles_.size(); ++i) {
        // The source still has the plan of a lone bundle from count().
        if (hits_.size() != 1) {
            const Plan plan = source_->plan(bundles_[i].view, capture_);
            hits_found_ += plan.fragments_counted;
        }
        BundleSink sink(outputs_, i);
        const CaptureReport report = source_->capture(
            sink, [&](double share) { progress.update((static_cast<double>(i) + share) / all); });
        largest_correction_ = std::max(largest_correction_, report.largest_correction);
    }
    if (hits_.size() == 1) hits_found_ = hits_.front();
    failed_ = options_.parity == ParityUse::kFail && !parity_->holds();
    for (const auto& output : outputs_)
        if (!failed_ || output.get() == parity_) output->finish();
}

void Rays::report() {
    RunResult result;
    job_.finish(result);
    // The hash stands in the result alone: files of rays have never had it, and keep their bytes.
    result.settings_hash = job_.settingsHash(capture_, raySettings(options_, bundles_));
    const std::uint64_t rays = raysOf(bundles_);
    if (options_.writesFile()) result.forecast_bytes = forecast_.size().bytes;
    std::string line = countText(bundles_.size(), "bundle") + ", " + countText(rays, "ray") + ", " +
                       countText(hits_found_, "hit");
    if (options_.writesFile() && !failed_) {
        const fs::path& path = options_.output.path;
        line = path.string() + ": " + line;
        if (fs::exists(path)) {
            result.setFile(path);
            line += ", " + bytesText(result.bytes);
        } else {
            result.setFiles(path, files_);
        }
    }
    Json found;
    found["bundles"] = bundles_.size();
    found["rays"] = rays;
    found["hits"] = hits_found_;
    found["largestCorrection"] =
        capture_.hit_mode == HitMode::kRaw ? Json() : Json(largest_correction_);
    if (parity_) parity_->addTo(found);
    for (const auto& output : outputs_)
        addRayResults(output->results(), found);
    reportResult(options_.report, toJson(result, found),
                 line + ", " + totalText(result.milliseconds), console_);
}

}  // namespace

VerbAction declareRays(VerbOptions& verb) {
    const auto options = std::make_shared<RaysOptions>();
    addRaysOptions(verb, *options);
    return [options](Console& console) {
        Rays(*options, console).run();
        return 0;
    };
}

}  // namespace peeler::cmd
