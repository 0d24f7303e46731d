// SPDX-License-Identifier: Apache-2.0
// peeler rays: all hits of bundles of rays, and what follows from them.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "cmd/bundle_options.h"
#include "cmd/capture_options.h"
#include "cmd/frames.h"
#include "cmd/hit_output.h"
#include "cmd/opened_scene.h"
#include "cmd/options.h"
#include "cmd/output_options.h"
#include "cmd/point_output.h"
#include "cmd/progress.h"
#include "cmd/ray_map_options.h"
#include "cmd/ray_map_output.h"
#include "cmd/ray_parity.h"
#include "cmd/report.h"
#include "cmd/resources.h"
#include "cmd/verbs.h"
#include "cmd/voxel_output.h"
#include "core/error.h"
#include "core/renderer.h"
#include "formats/point_reader.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

enum class ParityUse : std::uint8_t { kReport, kFail };
constexpr Choice<ParityUse> kParityUses[] = {
    {"report", ParityUse::kReport, "warn of each, and go on"},
    {"fail", ParityUse::kFail,
     "end with exit code 3; --include and --exclude say what has to be closed"},
};

struct RaysOptions {
    SceneOptions scene;
    AnimationOptions animation;
    BundleOptions bundles;
    CaptureSettings capture;
    bool refine = true;
    bool double_points = false;
    std::optional<fs::path> points;
    std::optional<int> voxels;
    std::optional<ParityUse> parity;
    RayMapFlags maps;
    gl::ContextRequest device;
    int threads = 0;
    OutputFlags output;
    ReportFlags report;
};

/// Hands the bands of a bundle on to the outputs.
class BundleSink final : public Sink {
  public:
    BundleSink(std::span<const std::unique_ptr<RayOutput>> outputs, std::size_t bundle)
        : outputs_(outputs), bundle_(bundle) {}

    void begin(const Plan&) override {}
    void write(const LayeredImage& band) override {
        for (const auto& output : outputs_)
            output->take(bundle_, band);
    }
    void finish() override {}
    /// Outputs take some rows at a time.
    SinkMemory memory() const override { return {0, std::uint64_t{48} << 20}; }

  private:
    std::span<const std::unique_ptr<RayOutput>> outputs_;
    std::size_t bundle_;
};

/// One run. run() lists its stages.
class Rays {
  public:
    Rays(const RaysOptions& options, Console& console) : options_(options), console_(console) {}

    void run() {
        const Clock::time_point start = Clock::now();
        checkOptions();
        openScene();
        chooseBundles();
        openOutputs();
        openRenderer();
        count();
        trace();
        const std::chrono::duration<double, std::milli> passed = Clock::now() - start;
        times_["total"] = passed.count();
        tell();
    }

  private:
    void checkOptions();
    void checkPoints() const;
    void checkFiles() const;
    void openScene();
    void chooseBundles();
    void openOutputs();
    std::unique_ptr<RayOutput> makeOutput();
    void openRenderer();
    void count();
    void trace();
    void tell();

    bool writesFile() const { return !options_.output.path.empty(); }
    bool writesPictures() const { return !options_.maps.maps.empty(); }
    const Solids& solids() {
        if (!solids_) solids_ = std::make_unique<Solids>(scene_->scene(), contents_);
        return *solids_;
    }

    const RaysOptions& options_;
    Console& console_;
    CaptureSettings capture_;
    std::optional<OpenedScene> scene_;
    SceneContents contents_;
    std::vector<Bundle> bundles_;
    std::optional<AxisBundles> lattice_;  ///< of voxels
    std::unique_ptr<Solids> solids_;      ///< if something needs them
    std::optional<DrawList> list_;
    std::vector<std::unique_ptr<RayOutput>> outputs_;
    std::unique_ptr<gl::Context> context_;
    std::optional<Renderer> renderer_;
    std::vector<std::uint64_t> hits_;  ///< of each bundle, if an output needs them before
    std::uint64_t hits_found_ = 0;
    double largest_correction_ = 0;
    StageTimes times_;
};

void Rays::checkOptions() {
    console_.setQuiet(options_.report.quiet);
    checkAnimationOptions(options_.animation);
    if (options_.voxels) {
        if (writesPictures() || options_.double_points)
            throw Error(ErrorKind::kUsage, "voxels are not hits", "--voxels",
                        "leave --map and --double out");
        BundleOptions bundles = options_.bundles;
        bundles.axes = true;
        checkBundleOptions(bundles);
        if (options_.bundles.axes || !options_.bundles.directions.empty() ||
            options_.bundles.count || options_.bundles.file || options_.bundles.resolution ||
            options_.bundles.spacing)
            throw Error(ErrorKind::kUsage, "voxels say which rays are traced", "--voxels",
                        "leave directions, --resolution and --spacing out");
    } else {
        checkBundleOptions(options_.bundles);
    }
    if (options_.points) checkPoints();
    checkFiles();
    capture_ = options_.capture;
    // Of what is next to points, t is found from the primitive anyway.
    const bool refine = options_.refine && !options_.points;
    capture_.hits = refine ? Hits::kRefined : Hits::kRaw;
    capture_.color_type = PixelType::kFloat;  // normals, too
    setThreads(options_.threads);
}

void Rays::checkPoints() const {
    if (options_.voxels || writesPictures() || options_.double_points)
        throw Error(ErrorKind::kUsage, "what is next to points is no picture of all hits",
                    "--points", "leave --map, --voxels and --double out");
    if (options_.bundles.usesCamera())
        throw Error(ErrorKind::kUsage, "points are looked from along parallel rays", "--points",
                    "give directions, not a camera");
    if (writesFile() && !hasExtension(options_.output.path, ".npz"))
        throw Error(ErrorKind::kUsage, "what is next to points is written as arrays",
                    options_.output.path.string(), "end the name in .npz");
}

void Rays::checkFiles() const {
    if (!writesFile() && !options_.parity)
        throw Error(ErrorKind::kUsage, "nothing to write", "", "add --output FILE, or --parity");
    if (!writesFile() &&
        (writesPictures() || options_.voxels || options_.double_points || options_.points))
        throw Error(ErrorKind::kUsage, "there is no file to write to", "--output",
                    "add --output FILE");
    if (options_.double_points && !hasExtension(options_.output.path, ".ply"))
        throw Error(ErrorKind::kUsage, "only points can be stored in 64 bits", "--double",
                    "leave it out, or write a .ply");
    std::vector<fs::path> inputs{options_.scene.file};
    for (const auto& file : {options_.bundles.file, options_.points})
        if (file) inputs.push_back(*file);
    checkRayMapFlags(options_.maps);
    if (writesFile()) {
        if (writesPictures()) {
            OutputFlags picture = options_.output;
            picture.as = "composite";
            picture.path = framePath(picture.path.string(), 0);
            checkOutput(picture, inputs);
        } else {
            if (!options_.voxels) checkHitFormat(options_.output.path.string());
            checkExtraFile(options_.output.path, inputs, "the output", "--output");
            checkTarget(options_.output, inputs);
        }
        inputs.push_back(options_.output.path);
    }
    checkReport(options_.report, inputs);
}

void Rays::openScene() {
    const StageTimer timer(times_, "load");
    scene_.emplace(options_.scene, LookOptions{}, options_.animation, false, console_);
    contents_ = scene_->at(options_.animation.time.value_or(0));
    list_.emplace(scene_->scene(), contents_);
}

void Rays::chooseBundles() {
    const std::optional<Bounds> all = bounds(scene_->scene(), contents_);
    if (!all)
        throw Error(ErrorKind::kInput, "the scene shows nothing that a ray could hit",
                    options_.scene.file.string(), "peeler info tells what is in it");
    if (options_.bundles.usesCamera()) {
        bundles_ = {{"camera", scene_->view(contents_, options_.bundles.camera)}};
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
    if (writesFile()) outputs_.push_back(makeOutput());
    if (options_.parity) {
        outputs_.push_back(std::make_unique<RayParity>(
            scene_->scene(), solids(), *options_.parity == ParityUse::kFail, console_));
    }
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
        return std::make_unique<VoxelOutput>(path, solids(), *lattice_, capture_.memory,
                                             "peeler " PEELER_VERSION);
    }
    if (writesPictures()) {
        RayMapOptions maps = rayMapOptions(options_.maps, scene_->scene());
        maps.provenance = provenance;
        const Solids* inside = needsSolids(maps.settings.maps) ? &solids() : nullptr;
        return makeRayMapOutput(path, scene_->scene(), contents_, inside, maps);
    }
    const HitSources sources{scene_->scene(), contents_, *list_, provenance};
    if (options_.points) return makePointOutput(path, sources, readPoints(*options_.points));
    return makeHitOutput(path, sources, options_.double_points);
}

void Rays::openRenderer() {
    {
        const StageTimer timer(times_, "context");
        context_ = openContext(options_.device, console_);
    }
    renderer_.emplace(*context_, scene_->scene(), contents_);
}

/// Headers and arrays say how many hits follow, and come before them.
void Rays::count() {
    if (std::ranges::any_of(outputs_, [](const auto& output) { return output->needsHits(); })) {
        ProgressReport progress(console_, options_.report.shownProgress(), "count");
        for (const Bundle& bundle : bundles_) {
            hits_.push_back(renderer_->plan(bundle.view, capture_).fragments_counted);
            progress.update(static_cast<double>(hits_.size()) /
                            static_cast<double>(bundles_.size()));
        }
    }
    for (const auto& output : outputs_)
        output->begin(bundles_, hits_);
}

void Rays::trace() {
    ProgressReport progress(console_, options_.report.shownProgress(), "trace");
    const auto all = static_cast<double>(bundles_.size());
    for (std::size_t i = 0; i < bundles_.size(); ++i) {
        // The plan of a lone bundle is still there.
        if (hits_.size() != 1) {
            const Plan plan = renderer_->plan(bundles_[i].view, capture_);
            hits_found_ += plan.fragments_counted;
        }
        BundleSink sink(outputs_, i);
        Sink* const sinks[] = {&sink};
        const CaptureReport report = renderer_->capture(
            sinks, [&](double share) { progress.update((static_cast<double>(i) + share) / all); });
        largest_correction_ = std::max(largest_correction_, report.largest_correction);
    }
    if (hits_.size() == 1) hits_found_ = hits_.front();
    for (const auto& output : outputs_)
        output->finish();
    add(times_, renderer_->takeTimes());
}

void Rays::tell() {
    const std::uint64_t rays = std::accumulate(
        bundles_.begin(), bundles_.end(), std::uint64_t{0},
        [](std::uint64_t sum, const Bundle& bundle) { return sum + bundle.rays(); });
    nlohmann::ordered_json json;
    if (writesFile()) json["output"] = options_.output.path.string();
    const bool one_file = writesFile() && fs::exists(options_.output.path);
    if (one_file) json["bytes"] = fs::file_size(options_.output.path);
    json["bundles"] = bundles_.size();
    json["rays"] = rays;
    json["hits"] = hits_found_;
    json["largestCorrection"] = capture_.hits == Hits::kRaw
                                    ? nlohmann::ordered_json()
                                    : nlohmann::ordered_json(largest_correction_);
    for (const auto& output : outputs_)
        output->tell(json);
    json["renderer"] = context_->device().renderer;
    json["backend"] = context_->device().backend;
    json["peakMemory"] = peakMemory();
    json["milliseconds"] = times_;
    if (options_.report.file) writeReport(*options_.report.file, json);
    std::string line = countText(bundles_.size(), "bundle") + ", " + countText(rays, "ray") + ", " +
                       countText(hits_found_, "hit");
    if (writesFile()) line = options_.output.path.string() + ": " + line;
    if (one_file) line += ", " + bytesText(fs::file_size(options_.output.path));
    console_.note(line + ", " + groupedText(static_cast<std::uint64_t>(times_["total"])) + " ms");
    if (options_.report.json) console_.result(jsonText(json));
}

constexpr const char* kFooter =
    "Arrays of the .npz, for n hits of m rays in b bundles (names and shapes of Open3D's\n"
    "RaycastingScene.list_intersections where it has them): ray_splits (m + 1, int64; ray r has\n"
    "the hits ray_splits[r] to ray_splits[r + 1], sorted), t_hit (n; distance along the ray),\n"
    "geometry_ids (n; which of the meshes in their places), primitive_ids (n; which triangle of\n"
    "its mesh), primitive_uvs (n, 2; weights of the second and third corner), facing (n; 1 = the\n"
    "front), normals and geometric_normals (n, 3; world space, on the front), node_ids, mesh_ids,\n"
    "instance_ids (among those of the node), material_ids (n; indices into the glTF); of each\n"
    "bundle, float64: bundle_origin, bundle_direction, bundle_right, bundle_up (b, 3),\n"
    "bundle_size and bundle_resolution (b, 2), and bundle_perspective (b, 0 or 1). Rays go bundle\n"
    "by bundle, row by row from the top. With (w, h) = bundle_resolution ray (i, j) starts at\n"
    "  origin + ((i + 0.5) / w - 0.5) * size[0] * right - ((j + 0.5) / h - 0.5) * size[1] * up\n"
    "along direction; with perspective it starts at origin, along that sum + direction - origin,\n"
    "made a unit vector. The .ply has a point a hit, the .exr a deep part a bundle (Z: distance\n"
    "along the axis). What --parity and maps call inside: of a closed surface, between its first\n"
    "and second hit, its third and fourth, and so on. A primitive that is closed by itself is a\n"
    "surface of its own; what else a mesh has is one together.\n"
    "Arrays of --points, for n points and d directions: t_before and t_after (d, n; distance to\n"
    "the next hit against and along the direction, inf = none), geometry_ids_before, ..._after,\n"
    "primitive_ids_before, ..._after (d, n; 0xFFFFFFFF = none), points (n, 3) and directions\n"
    "(d, 3). A surface that a point lies on is before it, at distance 0.";

}  // namespace

VerbAction declareRays(CLI::App& app) {
    const auto options = std::make_shared<RaysOptions>();
    options->capture.faces = Faces::kBoth;
    addValue(
        app, "SCENE", "", options->scene.file,
        [](const std::string& text) { return fs::path(text); }, "a glTF scene (.gltf or .glb)")
        ->required();
    addOutputFile(app, options->output);
    app.get_option("--output")
        ->required(false)
        ->description(wrapped("hits: .npz (arrays for numpy), .ply (points), .exr (deep); of "
                              "--map .exr, .png, .jpg or .tif; of --voxels .npz or .vdb"));
    addValue(
        app, "--points", "FILE", options->points,
        [](const std::string& text) { return fs::path(text); },
        "write the next hits before and after each of these points along every direction, not "
        "all hits: a .ply, or a .npz with the array points (n, 3)")
        ->group("Output");
    app.add_flag("--double", options->double_points, "x, y, z of a .ply in 64 bits, not 32")
        ->group("Output");
    addBundleOptions(app, options->bundles);
    app.add_flag("--refine,!--no-refine", options->refine,
                 wrapped("find t anew in double precision from the triangle (default); otherwise "
                         "it is as the rasteriser has it: a 32-bit depth, corners on a grid of "
                         "1/256 pixel"))
        ->group("Rays");
    addRayFacesOption(app, options->capture);
    addRayMapOptions(app, options->maps);
    addValue(
        app, "--voxels", "R", options->voxels,
        [](const std::string& text) { return static_cast<int>(parseInteger(text, 1, 4096)); },
        "which cells of a lattice, R along its longest side, are inside: by parity along each of "
        "the three axes, and the majority of them")
        ->group("Inside");
    std::string parity_help =
        "check that what is shown is closed: a ray that enters a surface leaves it. If rays hit "
        "one an odd number of times:";
    for (const Choice<ParityUse>& use : kParityUses)
        parity_help += '\n' + std::string(use.name) + ": " + std::string(use.summary);
    addValue(
        app, "--parity", "NAME", options->parity,
        [](const std::string& text) {
            return choose<ParityUse>("use of parity", kParityUses, text);
        },
        parity_help)
        ->group("Inside");
    addSceneOptions(app, options->scene);
    addTimeOptions(app, options->animation);
    addMachineOptions(app, options->device, options->threads, options->capture);
    addReportOptions(app, options->report);
    app.footer(kFooter);
    return [options](Console& console) {
        Rays(*options, console).run();
        return 0;
    };
}

}  // namespace peeler::cmd
