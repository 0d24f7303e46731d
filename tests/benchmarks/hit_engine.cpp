// SPDX-License-Identifier: Apache-2.0
// Benchmark of finding and using all hits of rays on the CPU without GL, compared with Embree.
// Prints JSON with the processor time of every run (all threads, including kernel time) and its
// wall-clock time, in milliseconds.
//
//     hit_engine SCENE [--size 1920x1080] [--bundles 1] [--lens NAME] [--runs 3] [--what
//     hits,embree]
//
// A lens (fisheye: in front of the scene; equirectangular: in its middle) has a ray for each pixel.
// The lens "lidar" is a list: the columns of a sensor that turns in the scene's middle and moves.
// Otherwise, a single bundle shows the whole scene in square cells, and --size is its numbers of
// rays. Several bundles are spread over the sphere, like those of `peeler rays --directions`, and
// the width is their resolution.
// - hits: creates a HitRasterizer (with a lens: builds a tree of the triangles), captures t and
// triangles of all bundles, and counts the hits
// - embree: builds its hierarchy once, and finds and sorts all hits of the same rays, 16 at once
// - thickness, parity: hits, and the results of `--map thickness` and `--parity` for all rays
// - axes: hits of the three bundles of `--voxels`; the width is the number of cells along the
//   longest side
// - voxels: axes, and the inside test of the cells
// - kept: hits, all stored in memory. Runs once, before all others: "resident" is the growth of
//   the peak resident memory, in bytes
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "benchmarks/embree_layers.h"
#include "benchmarks/measured_scene.h"
#include "cmd/machine/resources.h"
#include "core/base/parallel.h"
#include "core/base/process_memory.h"
#include "core/lens/picture_rays.h"
#include "core/raster/hit_rasterizer.h"
#include "core/rays/solids.h"
#include "core/rays/voxels.h"
#include "core/scene/intrinsics.h"
#include "core/trace/traced_hits.h"
#include "formats/rays/ray_map_output.h"

namespace peeler::benchmark {
namespace {

/// Not along an axis or in a symmetry plane of the scenes.
constexpr glm::dvec3 kDirection{0.36, -0.48, -0.8};

/// A sink that forwards the bands of a bundle to a function.
template <class Take>
class BandSink final : public Sink {
  public:
    explicit BandSink(Take take) : take_(std::move(take)) {}
    void begin(const Plan&) override {}
    void write(LayeredImage&& band) override { take_(std::move(band)); }
    void finish() override {}

  private:
    Take take_;
};

/// Maps that are evaluated, but not written.
class UnwrittenMaps final : public RayMapOutput {
  public:
    using RayMapOutput::RayMapOutput;
    void finish() override {}

  protected:
    void beginBundle(std::size_t) override {}
    void writeRows(const Window&, std::span<const float>) override {}
    void finishBundle() override {}
    std::string pathOf(std::size_t) const override { return {}; }
};

/// Returns a bundle of `width` x `height` rays in square cells that shows the whole scene.
Bundle framed(const Bounds& scene, int width, int height) {
    RayGrid grid;
    grid.resolution = width;
    Bundle bundle = parallelBundle("", scene, scene, kDirection, grid);
    const glm::dvec2 size = bundle.size();
    const double spacing = std::max(size.x / width, size.y / height);
    View& view = bundle.view;
    view.width = width;
    view.height = height;
    view.crop = {0, 0, width, height};
    view.projection.half_width = width * spacing / 2;
    view.projection.half_height = height * spacing / 2;
    return bundle;
}

/// The rays of a LiDAR sensor: a column of 40° for each azimuth. The sensor moves between columns.
class LidarSweep final : public PictureRays {
  public:
    LidarSweep(const Size& size, double way) : size_(size), way_(way) {}
    Ray at(const glm::dvec2& pixel) const override {
        const double turn = 2 * std::numbers::pi * pixel.x / size_.width;
        const double rise = (15 - 40 * pixel.y / size_.height) * std::numbers::pi / 180;
        return {
            {way_ * (pixel.x / size_.width - 0.5), 0, 0},
            {std::cos(rise) * std::sin(turn), std::sin(rise), -std::cos(rise) * std::cos(turn)}};
    }
    bool oneEye() const override { return false; }
    std::string text() const override { return "lidar"; }

  private:
    Size size_;
    double way_;
};

Bundle throughLens(const Bounds& scene, const Options& options) {
    const Size size{options.width, options.height};
    const glm::dvec3 middle = 0.5 * (scene.min + scene.max);
    const double extent = glm::length(scene.max - scene.min);
    Bundle bundle;
    View& view = bundle.view;
    view.width = size.width;
    view.height = size.height;
    view.crop = {0, 0, size.width, size.height};
    const bool in_front = options.lens == "fisheye";
    view.camera_to_world =
        *lookAlong(middle - (in_front ? 0.5 * extent : 0.0) * kDirection, kDirection, {0, 1, 0});
    view.projection.near = 0;
    const double focal = size.height / std::numbers::pi;  // the picture shows 180°
    if (options.lens == "lidar")
        view.rays = std::make_shared<LidarSweep>(size, 0.1 * extent);
    else
        setLens(view, {{options.lens}, {focal, focal, size.width / 2.0, size.height / 2.0}});
    return bundle;
}

std::vector<Bundle> bundlesOf(const Bounds& scene, const Options& options) {
    if (!options.lens.empty()) return {throughLens(scene, options)};
    if (options.bundles == 1) return {framed(scene, options.width, options.height)};
    RayGrid grid;
    grid.resolution = options.width;
    std::vector<Bundle> bundles;
    for (const glm::dvec3& direction : sphereDirections(options.bundles))
        bundles.push_back(parallelBundle("", scene, scene, direction, grid));
    return bundles;
}

AxisBundles latticeOf(const Bounds& scene, const Options& options) {
    RayGrid grid;
    grid.resolution = options.width;
    return axisBundles(scene, scene, grid);
}

class HitEngine {
  public:
    explicit HitEngine(const Options& options)
        : scene_(options),
          box_(scene_.posed.bounds().value()),
          bundles_(bundlesOf(box_, options)),
          lattice_(latticeOf(box_, options)) {
        settings_.faces = Faces::kBoth;
        settings_.hit_mode = HitMode::kRefined;
        settings_.color_type = PixelType::kFloat;
        settings_.depth_clamp = true;
    }

    Contender contender(const std::string& name);
    /// Stores all hits in memory. Returns their bytes.
    std::uint64_t kept();
    nlohmann::json result() const {
        nlohmann::json result = told_;
        result["threads"] = threadCount();
        result["rays"] = std::accumulate(
            bundles_.begin(), bundles_.end(), std::uint64_t{0},
            [](std::uint64_t sum, const Bundle& bundle) { return sum + bundle.rays(); });
        return result;
    }

  private:
    /// Traces bundles with a new source. Calls take(i, band) with each band of bundle i. Returns
    /// the number of hits.
    template <class Take>
    std::uint64_t trace(const std::vector<Bundle>& bundles, const Take& take) {
        HitRasterizer rasterizer(scene_.posed);
        TracedHits source(scene_.posed, &rasterizer);
        std::uint64_t hits = 0;
        for (std::size_t i = 0; i < bundles.size(); ++i) {
            const CapturePlan plan = source.plan(bundles[i].view, settings_);
            hits += plan.fragments_counted;
            BandSink sink([&](LayeredImage&& band) { take(i, std::move(band)); });
            source.capture(plan, sink);
        }
        return hits;
    }
    static void ignore(std::size_t, const LayeredImage&) {}

    void hits() { told_["hits"] = trace(bundles_, ignore); }
    void traceByEmbree() {
        told_["embree"]["build"].push_back(milliseconds([&] { embree_->build(); }));
        std::uint64_t hits = 0;
        for (const Bundle& bundle : bundles_)
            hits += embree_->trace(bundle.view, Packet::k16);
        told_["embree"]["hits"] = hits;
    }
    void thickness();
    void parity();
    void voxels();

    MeasuredScene scene_;
    Bounds box_;
    std::vector<Bundle> bundles_;
    AxisBundles lattice_;
    CaptureSettings settings_;
    std::optional<EmbreeLayers> embree_;
    nlohmann::json told_ = nlohmann::json::object();
};

void HitEngine::thickness() {
    const Solids solids(scene_.posed);
    RayMapSettings settings;
    settings.maps = {RayMap::kThickness};
    UnwrittenMaps output(scene_.posed, &solids, settings);
    output.begin(bundles_, {});
    trace(bundles_, [&](std::size_t i, const LayeredImage& band) { output.take(i, band); });
    double volume = 0;
    for (const RayMapResult& map : output.results().maps)
        volume += map.channels.front().volume.value_or(0);
    told_["volume"] = volume / static_cast<double>(bundles_.size());
}

void HitEngine::parity() {
    const Solids solids(scene_.posed);
    Parity parity(solids);
    trace(bundles_, [&](std::size_t i, const LayeredImage& band) { parity.add(i, band); });
    told_["oddRays"] = parity.oddRays();
}

void HitEngine::voxels() {
    const Solids solids(scene_.posed);
    VoxelVotes votes(lattice_, solids);
    trace(lattice_.bundles, [&](std::size_t axis, const LayeredImage& band) {
        votes.add(axis, lattice_.bundles[axis], band);
    });
    votes.finish();
    told_["cells"] = VoxelVotes::cellsOf(lattice_);
    told_["occupied"] = votes.occupied();
}

std::uint64_t HitEngine::kept() {
    std::ofstream("/proc/self/clear_refs") << 5;  // resets the peak memory to the current size
    const std::uint64_t before = residentBytes();
    std::vector<LayeredImage> bands;
    told_["hits"] = trace(
        bundles_, [&](std::size_t, LayeredImage&& band) { bands.push_back(std::move(band)); });
    return cmd::peakMemory() - before;
}

Contender HitEngine::contender(const std::string& name) {
    if (name == "hits") return {name, [this] { hits(); }};
    if (name == "thickness") return {name, [this] { thickness(); }};
    if (name == "parity") return {name, [this] { parity(); }};
    if (name == "axes") return {name, [this] { told_["axes"] = trace(lattice_.bundles, ignore); }};
    if (name == "voxels") return {name, [this] { voxels(); }};
    if (name != "embree") throw Error(ErrorKind::kUsage, "there is no such work", name);
    embree_.emplace(scene_.posed, settings_.faces);
    told_["embree"] = {{"version", embree_->version()}, {"triangles", embree_->triangles()}};
    return {name, [this] { traceByEmbree(); }};
}

nlohmann::json measure(const Options& options) {
    HitEngine engine(options);
    std::vector<std::string> names = options.what;
    if (names.empty()) names = {"hits", "embree"};
    nlohmann::json times = nlohmann::json::object();
    if (std::erase(names, "kept") > 0) times["resident"] = engine.kept();
    std::vector<Contender> contenders;
    for (const std::string& name : names)
        contenders.push_back(engine.contender(name));
    for (const Contender& contender : contenders)
        contender.work();
    for (int i = 0; i < options.runs; ++i) {
        for (const Contender& contender : contenders) {
            const double before = processorMilliseconds();
            times["milliseconds"][contender.name].push_back(milliseconds(contender.work));
            times["processor"][contender.name].push_back(processorMilliseconds() - before);
        }
    }
    times.update(engine.result());
    return times;
}

}  // namespace
}  // namespace peeler::benchmark

int main(int count, char** arguments) {
    return peeler::benchmark::run(count, arguments, peeler::benchmark::measure);
}
