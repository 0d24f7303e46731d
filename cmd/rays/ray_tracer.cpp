// SPDX-License-Identifier: Apache-2.0
#include "cmd/rays/ray_tracer.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/errors.h"
#include "cmd/cli/report.h"
#include "cmd/machine/resources.h"
#include "cmd/options/output_checks.h"
#include "cmd/rays/median_path.h"
#include "cmd/rays/ray_map_options.h"
#include "cmd/rays/ray_results.h"
#include "cmd/rays/undecided_solids.h"
#include "cmd/session/progress_report.h"
#include "core/base/parallel.h"
#include "core/base/printable.h"
#include "formats/arrays/point_reader.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"
#include "formats/file/regular_file.h"
#include "formats/rays/ray_output.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

/// A sink that passes the bands of a bundle to the outputs.
class BundleSink final : public Sink {
  public:
    BundleSink(const RayTrace& trace, std::size_t bundle) : trace_(trace), bundle_(bundle) {}

    void begin(const Plan&) override {}
    void write(LayeredImage&& band) override {
        for (const auto& output : trace_.outputs)
            output->take(bundle_, band);
    }
    void finish() override {}
    /// Returns the memory of the outputs, without the band. The outputs process a few rows of the
    /// band at a time.
    SinkMemory memory(const Plan&) const override {
        SinkMemory all{.bytes = kBatchBytes * static_cast<std::uint64_t>(threadCount())};
        for (const auto& output : trace_.outputs) {
            const SinkMemory one = output->memory(trace_.bundles[bundle_]);
            all.rows = std::max(all.rows, one.rows);
            all.bytes += one.bytes;
            all.pixel_bytes += one.pixel_bytes;
            all.fragment_bytes += one.fragment_bytes;
        }
        return all;
    }

  private:
    // Bytes per thread for collecting the values of a batch of hits (HitReader).
    static constexpr std::uint64_t kBatchBytes = std::uint64_t{2} << 20;

    const RayTrace& trace_;
    std::size_t bundle_;
};

/// Heap bytes that a bundle leaves occupied while later bundles are traced; measured on the CPU.
constexpr std::uint64_t kLeftBytes = std::uint64_t{4} << 20;

/// Returns the capture settings for the options, without the channels that outputs add.
CaptureSettings traceSettings(const RaysOptions& options) {
    CaptureSettings capture = options.capture;
    capture.faces = options.chosenFaces();
    // With --points, t is computed from the triangle, so hits need not be refined.
    const bool refine = options.refine && !options.points;
    capture.hit_mode = refine ? HitMode::kRefined : HitMode::kRaw;
    capture.color_type = PixelType::kFloat;  // applies to normals, too
    // Camera rays end at the near and far planes; other rays are unbounded.
    capture.depth_clamp = !options.bundles.usesCamera();
    return capture;
}

}  // namespace

RayTracer::RayTracer(const RaysOptions& options, CaptureJob& job, SequenceResults& results,
                     Reporter& reporter)
    : options_(options),
      job_(job),
      results_(results),
      reporter_(reporter),
      capture_(traceSettings(options)) {}

void RayTracer::setScene(const OpenedScene& scene, const PosedScene& posed) {
    scene_ = &scene;
    posed_ = posed;
    solids_.reset();
    undecided_.reset();
    source_ = nullptr;
}

void RayTracer::discard() {
    job_.discard();
    source_ = nullptr;
}

void RayTracer::make(RayTrace& trace) {
    nameFiles(trace);
    if (!source_) source_ = &job_.openHits(*posed_, options_.writesSplats());
    if (options_.asksForInside()) job_.warnOfSplats(*posed_, "rays through solids");
    if (std::ranges::any_of(trace.bundles, [](const Bundle& b) { return bool(b.view.rays); }))
        job_.warnOfSplats(*posed_, "rays of lenses and lists");
    if (needsAttenuation(options_.maps)) findAttenuation(trace);
    openOutputs(trace);
    count(trace);
    if (options_.sequence.dry_run) return describe(trace);
    reportForecast(trace.forecast, reporter_);
    traceBundles(trace);
    report(trace);
}

/// Names the output files and checks them. Needs the bundles, because each bundle may have its own
/// picture.
void RayTracer::nameFiles(RayTrace& trace) const {
    if (options_.writesPictures()) {
        std::vector<int> numbers(trace.bundles.size());
        std::iota(numbers.begin(), numbers.end(), 0);
        OutputRequest output = trace.output;
        if (trace.view) output.no_clobber = false;  // the caller has already checked --no-clobber
        trace.files = checkSeries(output, numbers, options_.inputs());
        checkReport(options_.report, trace.files);
    } else if (options_.writesFile()) {
        trace.files = {trace.output.path};
    }
    job_.checkOutputs(trace.files);
}

/// Reports solids whose interior has no winding number: a warning with --overlap, otherwise a note.
void RayTracer::reportUndecided() {
    if (undecided_) return;
    undecided_ = undecidedSolids(scene_->scene(), solids());
    if (undecided_->empty()) return;
    const std::string what = undecidedText(*undecided_);
    if (!options_.overlap) return reporter_.note(what);
    if (options_.scene.reading.strict)
        throw Error(ErrorKind::kInput, what, options_.scene.file.string(),
                    "repair them (peeler check names the places), leave them out with --exclude, "
                    "or give --overlap parity");
    reporter_.warning(what);
}

/// Finds the median path, from which the attenuation follows. Needs a pass over all rays, so a dry
/// run skips it.
void RayTracer::findAttenuation(RayTrace& trace) {
    if (options_.sequence.dry_run) return;
    RayTrace probe{.output = {}, .bundles = trace.bundles};
    auto output = std::make_unique<MedianPath>(*posed_, solids(), options_.overlapRule());
    MedianPath& paths = *output;
    probe.outputs.push_back(std::move(output));
    paths.begin(probe.bundles, {});
    for (std::size_t i = 0; i < probe.bundles.size(); ++i) {
        const CapturePlan plan = source_->plan(probe.bundles[i].view, capture_);
        BundleSink sink(probe, i);
        source_->capture(plan, sink);
    }
    trace.median_path = paths.median();
    if (!trace.median_path) {
        reporter_.warning("no ray passes through a solid, so everything transmits X-rays fully");
        return;
    }
    reporter_.note("attenuation: " + numberText(startAttenuation(*trace.median_path), 4) +
                   " per scene unit for all materials, so that half passes along the median path "
                   "of " +
                   numberText(*trace.median_path, 4) + "; to change it, add " +
                   Parameter::kAttenuation + " '*=MU'");
}

void RayTracer::openOutputs(RayTrace& trace) {
    if (options_.writesInside() && options_.overlapRule() == Overlap::kWinding) reportUndecided();
    if (options_.parity) {
        auto parity = std::make_unique<RayParity>(scene_->scene(), solids(), reporter_);
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

std::string RayTracer::settingsHash(const RayTrace& trace, const CaptureSettings& capture) const {
    nlohmann::json settings = raySettings(options_, trace.bundles);
    settings.update(trace.settings);
    return job_.settingsHash(capture, std::move(settings));
}

std::string RayTracer::hashOf(const RayTrace& trace) const {
    CaptureSettings settings = capture_;
    settings.channels.clear();  // the outputs determine the channels
    const Json all = {
        {"scene", hexText(scene_->scene().content_hash)},
        {"settings", settingsHash(trace, settings)},
        {"time", options_.animation.time.value_or(0)},
        {"name", trace.bundles.front().name},
        {"extension", lowerExtension(trace.output.path)},
    };
    return hashText(dumpJson(all));
}

std::unique_ptr<RayOutput> RayTracer::makeOutput(const RayTrace& trace) {
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
        return makeVoxelOutput(path, solids(), *lattice_, "peeler " PEELER_VERSION,
                               options_.overlapRule());
    }
    if (options_.writesPictures()) {
        RayMapOptions maps = rayMapOptions(options_.maps, scene_->scene());
        if (needsAttenuation(options_.maps))
            maps.settings.attenuation.assign(
                scene_->scene().materials.size(),
                trace.median_path ? startAttenuation(*trace.median_path) : 0);
        maps.provenance = provenance;
        maps.settings.overlap = options_.overlapRule();
        const double unit = options_.scene.reading.metres_per_unit.value_or(0);
        if (const auto name = lengthUnitName(unit); !name.empty())
            maps.unit.emplace(std::string(name), unit);
        const Solids* inside = needsSolids(maps.settings.maps) ? &solids() : nullptr;
        return makeRayMapOutput(path, *posed_, inside, maps);
    }
    if (options_.points)
        return makeNextHitOutput(path, *posed_, readPoints(*options_.points, capture_.memory));
    HitOptions hits{.posed = *posed_,
                    .provenance = provenance,
                    .comment = "hits in world space of " + printable(provenance.scene) +
                               ", +Y up, by peeler " PEELER_VERSION,
                    .double_positions = options_.double_points,
                    .columns = options_.columns,
                    .bundles = trace.bundles};
    if (options_.output.isGiven("--dense")) hits.dense = options_.output.options.dense;
    return makeHitOutput(path, hits);
}

/// Forecasts the memory for capturing a bundle. `left`: bytes that previous bundles left occupied.
void RayTracer::forecastMemory(const RayTrace& trace, std::size_t bundle, const CapturePlan& plan,
                               std::uint64_t left) {
    memory_forecast_ = std::max({memory_forecast_, repeatedPeak(peakMemory()),
                                 source_->forecastMemory(plan, BundleSink(trace, bundle)) + left});
}

/// Counts the hits if an output needs their number before the first hit. Forecasts the file sizes.
void RayTracer::count(RayTrace& trace) {
    const auto needsHits = [](const auto& output) { return output->needsHits(); };
    if (options_.sequence.dry_run || std::ranges::any_of(trace.outputs, needsHits)) {
        ProgressReport progress(reporter_, {"count", kCountEnd});
        for (std::size_t i = 0; i < trace.bundles.size(); ++i) {
            trace.plans.push_back(source_->plan(trace.bundles[i].view, capture_));
            forecastMemory(trace, i, trace.plans.back(), trace.bundles.size() > 1 ? kLeftBytes : 0);
            trace.hits.push_back(trace.plans.back().fragments_counted);
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

/// Reports the plan, for --dry-run.
void RayTracer::describe(const RayTrace& trace) {
    Json json;
    json["scene"] = options_.scene.file.string();
    json["bundles"] = trace.bundles.size();
    json["rays"] = raysOf(trace.bundles);
    json["hits"] =
        trace.hits.empty()
            ? Json()
            : Json(std::accumulate(trace.hits.begin(), trace.hits.end(), std::uint64_t{0}));
    json["settingsHash"] = settingsHash(trace, capture_);
    json["forecastMemory"] = memory_forecast_;
    json["outputs"] = forecastJson(trace.forecast);
    reporter_.result(json);
    reportMemory(memory_forecast_, reporter_);
    reportForecast(trace.forecast, reporter_, true);
}

void RayTracer::traceBundles(RayTrace& trace) {
    for (const auto& output : trace.outputs)
        output->begin(trace.bundles, trace.hits);
    ProgressReport progress(reporter_, "trace");
    const auto all = static_cast<double>(trace.bundles.size());
    for (std::size_t i = 0; i < trace.bundles.size(); ++i) {
        const CapturePlan plan =
            trace.plans.empty() ? source_->plan(trace.bundles[i].view, capture_) : trace.plans[i];
        if (trace.plans.size() != 1) forecastMemory(trace, i, plan);
        trace.hits_found += plan.fragments_counted;
        trace.without_ray += plan.without_ray;
        BundleSink sink(trace, i);
        const CaptureReport report = source_->capture(plan, sink, [&](double share) {
            progress.update((static_cast<double>(i) + share) / all);
        });
        trace.largest_correction = std::max(trace.largest_correction, report.largest_correction);
    }
    trace.failed = options_.parity == ParityUse::kFail && !trace.parity->holds();
    for (const auto& output : trace.outputs)
        if (!trace.failed || output.get() == trace.parity) output->finish();
}

void RayTracer::report(RayTrace& trace) {
    RunResult result;
    job_.finish(result);
    if (!options_.bundles.rays)
        noteWithoutRay(trace.without_ray, raysOf(trace.bundles), reporter_);
    else if (trace.without_ray > 0)
        reporter_.note(countText(trace.without_ray, "pixel") + " of " +
                       groupedText(raysOf(trace.bundles)) +
                       " have no ray: they are not finite, or have no direction");
    // The hash is only in the result, because it must not change the bytes of the ray files.
    result.settings_hash = settingsHash(trace, capture_);
    const std::uint64_t rays = raysOf(trace.bundles);
    result.forecast_memory = memory_forecast_;
    if (options_.writesFile()) result.forecast_bytes = trace.forecast.size().bytes;
    std::string line = countText(trace.bundles.size(), "bundle") + ", " + countText(rays, "ray") +
                       ", " + countText(trace.hits_found, "hit");
    if (options_.writesFile() && !trace.failed) {
        const fs::path& path = trace.output.path;
        line = path.string() + ": " + line;
        if (isSeen(path)) {
            result.setFile(path);
            line += ", " + bytesText(result.bytes);
        } else {
            result.setFiles(path, trace.files);
        }
    }
    Json found;
    if (trace.view) {
        found["view"] = *trace.view;
        found["camera"] = trace.bundles.front().name;
    }
    found["bundles"] = trace.bundles.size();
    found["rays"] = rays;
    found["hits"] = trace.hits_found;
    if (trace.without_ray > 0) found["withoutRay"] = trace.without_ray;
    found["largestCorrection"] =
        capture_.hit_mode == HitMode::kRaw ? Json() : Json(trace.largest_correction);
    if (undecided_ && !undecided_->empty()) found["undecided"] = undecidedJson(*undecided_);
    if (trace.median_path) {
        found["medianPath"] = *trace.median_path;
        found["attenuation"] = startAttenuation(*trace.median_path);
    }
    if (trace.parity) trace.parity->addTo(found);
    for (const auto& output : trace.outputs)
        addRayResults(output->results(), found);
    results_.add(toJson(result, found), line + ", " + totalText(result.milliseconds));
}

}  // namespace peeler::cmd
