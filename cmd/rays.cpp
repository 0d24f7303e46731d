// SPDX-License-Identifier: Apache-2.0
// peeler rays: all hits of bundles of rays, and outputs made from them.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <tuple>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/report.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/rays/bundle_options.h"
#include "cmd/rays/ray_tracer.h"
#include "cmd/rays/rays_options.h"
#include "cmd/verbs.h"
#include "core/splats/splat_bounds.h"
#include "formats/file/file_name.h"
#include "formats/output_hash.h"
#include "formats/rays/ray_list.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

class Rays {
  public:
    Rays(const RaysOptions& options, Session& session)
        : options_(options),
          reporter_(session.reporter()),
          job_(options, session),
          views_(options.bundles.views, options.bundles.camera, options.scene.reading.strict,
                 session.reporter()),
          results_(eachAlone() ? "view" : "", session.reporter()),
          tracer_(options, job_, results_, session.reporter()) {}

    int run() {
        checkOptions();
        openScene();
        return eachAlone() ? makeViewFiles() : makeAll();
    }

  private:
    /// Whether each view has an output file of its own.
    bool eachAlone() const { return views_.asked() && hasViewToken(options_.output.path.string()); }
    void checkOptions();
    void checkFiles() const;
    std::vector<fs::path> outputs() const;
    fs::path outputOf(std::size_t view) const;
    void openScene();
    std::vector<Bundle> chooseBundles();
    Bundle movingBundle();
    Bundle viewBundle(std::size_t view) const;
    int makeAll();
    int makeViewFiles();
    void makeViewFile(std::size_t view);

    const RaysOptions& options_;
    Reporter& reporter_;
    CaptureJob job_;
    ViewList views_;
    std::size_t first_ = 0, end_ = 1;     ///< range of the views that this run makes
    const OpenedScene* scene_ = nullptr;  ///< owned by job_
    SequenceResults results_;
    RayTracer tracer_;
};

void Rays::checkOptions() {
    job_.checkOptions();
    checkRaysOptions(options_);
    std::tie(first_, end_) = views_.part(options_.sequence.chunk);
    if ((options_.sequence.skip_existing || options_.sequence.keep_going) && !eachAlone())
        refuse("one file contains all views", "--skip-existing, --keep-going",
               "put @@@@ into the output's name for one file per view");
    checkFiles();
}

fs::path Rays::outputOf(std::size_t view) const {
    return viewPath(options_.output.path.string(), static_cast<int>(view));
}

/// Returns the names of the outputs that do not depend on the bundles.
std::vector<fs::path> Rays::outputs() const {
    std::vector<fs::path> files;
    if (eachAlone()) {
        for (std::size_t view = first_; view < end_; ++view)
            files.push_back(outputOf(view));
    } else if (options_.writesFile()) {
        files.push_back(options_.output.path);
    }
    return files;
}

void Rays::checkFiles() const {
    OutputRequest output = options_.output;
    std::vector<fs::path> files = outputs();
    if (options_.writesPictures()) {
        output.options.as = "composite";
        for (fs::path& file : files)
            file = framePath(file.string(), 0);
        if (!files.empty()) output.path = files.front();
        checkFormat(output);
    }
    checkTargets(output, files, options_.sequence, options_.inputs());
    std::vector<fs::path> others = options_.inputs();
    others.insert(others.end(), files.begin(), files.end());
    checkReport(options_.report, others);
}

void Rays::openScene() {
    scene_ = &job_.openScene();
    if (!options_.scene.reading.metres_per_unit) job_.noteUnit();
    // The scene's files are known only now.
    job_.checkOutputs(eachAlone() ? outputs() : std::vector<fs::path>());
    tracer_.setScene(*scene_, job_.pose());
    if (!views_.asked()) return;
    views_.place(*scene_);
    if (views_.placesObjects() && !eachAlone())
        throw Error(ErrorKind::kUsage,
                    "views that place objects differently cannot share one output file",
                    "--cameras " + options_.bundles.views.file->string(),
                    "put @@@@ into the output's name for one file per view");
}

Bundle Rays::viewBundle(std::size_t view) const {
    return {views_.name(view), views_.view(*scene_, tracer_.posed(), view)};
}

Bundle Rays::movingBundle() {
    const fs::path& file = *options_.bundles.shutter;
    ReadWarnings warnings(options_.scene.reading.strict, file.string());
    Bundle bundle = shutterBundle(options_.bundles, tracer_.posed(), scene_->extent(), warnings);
    for (const Text& sentence : warnings.sentences())
        reporter_.warning(sentence);
    return bundle;
}

std::vector<Bundle> Rays::chooseBundles() {
    const PosedScene& posed = tracer_.posed();
    std::optional<Bounds> all = posed.bounds();
    if (!all)
        throw Error(ErrorKind::kInput, "the scene shows nothing that rays can hit",
                    options_.scene.file.string(), "use peeler info to see its contents");
    const auto splats = options_.writesSplats() ? splatBounds(posed) : std::nullopt;
    if (splats) all = Bounds{glm::min(all->min, splats->min), glm::max(all->max, splats->max)};
    if (views_.asked()) {
        std::vector<Bundle> bundles;
        for (std::size_t view = first_; view < end_; ++view)
            bundles.push_back(viewBundle(view));
        return bundles;
    }
    if (options_.bundles.rays) return readRays(*options_.bundles.rays);
    if (options_.bundles.shutter) return {movingBundle()};
    if (options_.bundles.usesCamera())
        return {{"camera", cmd::makeView(posed, scene_->extent(), options_.bundles.camera)}};
    if (options_.voxels) {
        RayGrid grid;
        grid.resolution = *options_.voxels;
        const AxisBundles lattice = axisBundles(options_.bundles.bounds.value_or(*all), *all, grid);
        tracer_.setLattice(lattice);
        return lattice.bundles;
    }
    return parallelBundles(options_.bundles, *all);
}

int Rays::makeAll() {
    RayTrace trace{.output = options_.output, .bundles = chooseBundles()};
    if (std::ranges::all_of(trace.bundles, [](const Bundle& b) { return bool(b.view.rays); }))
        job_.traceOnCpu();
    tracer_.make(trace);
    if (options_.sequence.dry_run) return 0;
    reportResult(options_.report, results_.json(), {}, reporter_);
    if (trace.failed) trace.parity->fail();
    return 0;
}

int Rays::makeViewFiles() {
    int code = 0;
    if (std::ranges::all_of(views_.cameras(), [](const CameraOptions& c) { return bool(c.lens); }))
        job_.traceOnCpu();
    job_.chooseEngine();  // the hashes depend on the engine
    try {
        makeEachView(
            first_, end_, options_.sequence, results_,
            [this](std::size_t view) { makeViewFile(view); },
            [this](std::size_t view) {
                tracer_.discard();
                return outputOf(view);
            });
    } catch (...) {
        code = reportError(reporter_, currentError());
    }
    if (!options_.sequence.dry_run) reportResult(options_.report, results_.json(), {}, reporter_);
    results_.reportFailures();
    return std::max(code, results_.worst());
}

void Rays::makeViewFile(std::size_t view) {
    if (view != first_) job_.restartClock();
    if (views_.placesObjects())
        tracer_.setScene(*scene_, views_.pose(*scene_, options_.animation.time.value_or(0), view));
    RayTrace trace{.output = options_.output, .view = view, .bundles = {viewBundle(view)}};
    views_.addSettings(view, trace.settings);
    trace.output.path = outputOf(view);
    if (options_.sequence.skip_existing &&
        outputHashOf(trace.output.path.string()) == tracer_.hashOf(trace)) {
        RunResult there;
        there.setFile(trace.output.path);
        job_.finish(there);
        Json found = {{"view", view}, {"camera", views_.name(view)}, {"skipped", true}};
        results_.add(toJson(there, found),
                     trace.output.path.string() + ": skipped, already complete");
        return;
    }
    if (trace.output.no_clobber) checkNotThere(trace.output.path);
    tracer_.make(trace);
}

}  // namespace

VerbAction declareRays(VerbOptions& verb) {
    const auto options = std::make_shared<RaysOptions>();
    addRaysOptions(verb, *options);
    return [options](Session& session) {
        takeLens(options->bundles.lens, options->bundles.camera);
        return Rays(*options, session).run();
    };
}

}  // namespace peeler::cmd
