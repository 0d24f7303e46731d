// SPDX-License-Identifier: Apache-2.0
#include "core/trace/traced_hits.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "core/base/memory_budget.h"
#include "core/base/parallel.h"
#include "core/base/process_memory.h"
#include "core/base/stage_times.h"
#include "core/fragments/bands.h"
#include "core/fragments/hit_bands.h"
#include "core/image/channels.h"
#include "core/image/layers.h"
#include "core/raster/surface_values.h"
#include "core/trace/ray_tracer.h"

namespace peeler {
namespace {

// Rays that are traced together, and the side of the squares of pixels in which rays of one eye are
// passed to the tracer.
constexpr std::uint64_t kRaysOfRows = std::uint64_t{1} << 15;
constexpr int kTile = 8;
constexpr int kRaysAtOnce = 1024;        // that a thread fills together
constexpr std::uint64_t kKeptBands = 4;  // maximum bytes of the kept hits, in largest bands
// The bytes of a ray while it is traced: the ray itself, and its numbers of hits.
constexpr std::uint64_t kRayBytes = sizeof(Ray) + 2 * sizeof(std::uint64_t);
// Planning takes nearly all of the time if all hits are kept.
constexpr double kTracedPlanShare = 0.8;

/// The hits of some rows of a picture.
struct TracedRows {
    Window window;
    std::vector<std::uint32_t> offsets;  ///< as in LayeredImage
    std::vector<float> z;
    std::vector<std::uint32_t> keys;
    std::uint64_t without_ray = 0;

    std::uint64_t bytes() const { return 4 * (offsets.size() + z.size() + keys.size()); }
};

/// A plan, and the hits of its first rows.
struct TracedPlan final : CapturePlan::Details {
    TracedPlan(const View& of, const CaptureSettings& asked,
               std::shared_ptr<std::atomic<std::uint64_t>> all_kept)
        : view(of), settings(asked), complexity(of.crop), kept_bytes(std::move(all_kept)) {}
    TracedPlan(const TracedPlan&) = delete;
    TracedPlan& operator=(const TracedPlan&) = delete;
    ~TracedPlan() override {
        for (const TracedRows& rows : kept)
            *kept_bytes -= rows.bytes();
    }

    View view;
    CaptureSettings settings;
    std::uint64_t number = 0;  ///< among the plans of a source, from 1
    DepthComplexity complexity;
    std::vector<TracedRows> kept{};                          ///< from the top
    std::uint64_t largest_rows = 0;                          ///< bytes of the largest TracedRows
    std::shared_ptr<std::atomic<std::uint64_t>> kept_bytes;  ///< of all plans of a source
};

/// Returns the rows, from `y0` on, that are traced together.
Window rowsAt(const Window& crop, int y0) {
    const std::uint64_t rows = kRaysOfRows / static_cast<std::uint64_t>(crop.width());
    const auto limit = static_cast<int>(std::max<std::uint64_t>(rows / kTile, 1)) * kTile;
    return {crop.x0, y0, crop.x1, std::min(crop.y1, y0 + std::min(limit, crop.y1 - y0))};
}

/// Calls visit(i) with the pixels of a window tile by tile, as indices of its rows.
template <class Visit>
void forEachTiled(const Window& window, const Visit& visit) {
    for (int y0 = 0; y0 < window.height(); y0 += kTile)
        for (int x0 = 0; x0 < window.width(); x0 += kTile)
            for (int y = y0; y < std::min(window.height(), y0 + kTile); ++y)
                for (int x = x0; x < std::min(window.width(), x0 + kTile); ++x)
                    visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(window.width()) +
                          static_cast<std::size_t>(x));
}

/// Writes the rays of a window in world space, row by row.
void fillRays(const View& view, const Window& window, std::span<Ray> rays) {
    view.rays->fill(window, view.sample, rays);
    const glm::dmat3 turn(view.camera_to_world);
    for (Ray& ray : rays)
        ray = {glm::dvec3(view.camera_to_world * glm::dvec4(ray.origin, 1)), turn * ray.direction};
}

/// Finds the rays of a window, tile by tile or row by row. Overwrites `rays`.
void findRays(const View& view, const Window& window, bool tiled, std::vector<Ray>& rays) {
    rays.resize(window.pixels());
    const int height = tiled ? kTile : 1, width = std::max(kRaysAtOnce / height, kTile);
    const auto columns = static_cast<std::size_t>((window.width() + width - 1) / width),
               rows = static_cast<std::size_t>((window.height() + height - 1) / height);
    parallelFor(rows * columns, [&](std::size_t task) {
        const int x0 = window.x0 + static_cast<int>(task % columns) * width,
                  y0 = window.y0 + static_cast<int>(task / columns) * height;
        const Window part = intersect({x0, y0, x0 + width, y0 + height}, window);
        const std::size_t first =
            static_cast<std::size_t>(y0 - window.y0) * static_cast<std::size_t>(window.width()) +
            static_cast<std::size_t>((x0 - window.x0) * part.height());
        const std::span to = std::span(rays).subspan(first, part.pixels());
        if (!tiled) return fillRays(view, part, to);
        std::vector<Ray> by_row(part.pixels());
        fillRays(view, part, by_row);
        auto next = to.begin();
        forEachTiled(part, [&](std::size_t i) { *next++ = by_row[i]; });
    });
}

}  // namespace

struct TracedHits::State {
    State(PosedScene in_pose, HitSource* other_views)
        : posed(std::move(in_pose)), others(other_views), levels(posed.scene()) {}

    HitSource& elsewhere() const {
        if (others) return *others;
        throw Error(ErrorKind::kInternal, "the rays of this view are not of a lens");
    }
    void build(const MemoryBudget& memory);
    TracedRows trace(const TracedPlan& plan, const Window& window);
    std::uint64_t mostKept(const Window& crop, const CaptureSettings& settings) const;
    void keep(TracedPlan& plan, TracedRows&& rows, std::uint64_t most);
    BandCosts costs(const TracedPlan& traced, const Plan& plan, const Sink& sink) const;
    const TracedRows& rowsOf(const TracedPlan& plan, int y);
    void captureBand(const TracedPlan& plan, const Window& band, LayeredImage& out);

    PosedScene posed;
    HitSource* others;     ///< may be null
    TextureLevels levels;  ///< of posed.scene()
    std::unique_ptr<RayTracer> tracer;
    StageTimes times;
    std::shared_ptr<std::atomic<std::uint64_t>> kept_bytes =
        std::make_shared<std::atomic<std::uint64_t>>(0);
    TracedRows again;              ///< rows that were traced again
    std::uint64_t again_of = 0;    ///< TracedPlan::number of these rows
    std::uint64_t plans = 0;       ///< number of plans made
    std::vector<Ray> window_rays;  ///< that are traced together, and their hits
    std::vector<HitList> parts;
    LayeredImage image;
};

TracedHits::TracedHits(PosedScene posed, HitSource* others)
    : state_(std::make_unique<State>(std::move(posed), others)) {}

TracedHits::~TracedHits() = default;

const PosedScene& TracedHits::posed() const {
    return state_->posed;
}

bool TracedHits::prefersLines() const {
    return state_->others && state_->others->prefersLines();
}

StageTimes TracedHits::takeTimes() {
    StageTimes times = std::exchange(state_->times, {});
    if (state_->others) add(times, state_->others->takeTimes());
    return times;
}

void TracedHits::State::build(const MemoryBudget& memory) {
    if (tracer) return;
    const StageTimer timer(times, "tree");
    const std::uint64_t needed = RayTracer::mostBytes(posed);
    if (memory != 0)
        checkMemory(memory, usedBytesWith(memory, needed) + needed, "for the tree of triangles");
    tracer = std::make_unique<RayTracer>(posed);
}

TracedRows TracedHits::State::trace(const TracedPlan& plan, const Window& window) {
    const View& view = plan.view;
    const bool tiled = view.rays->oneEye();
    TraceSettings settings{.faces = plan.settings.faces};
    if (!plan.settings.depth_clamp) {
        settings.near = view.projection.near;
        settings.far = view.projection.far;
    }
    findRays(view, window, tiled, window_rays);
    const auto without =
        static_cast<std::uint64_t>(std::ranges::count(window_rays, glm::dvec3(0), &Ray::direction));
    tracer->trace(window_rays, settings, parts);
    std::size_t hits = 0;
    for (const HitList& part : parts)
        hits += part.hits.size();
    if (hits > std::numeric_limits<std::uint32_t>::max())
        throw Error(ErrorKind::kInput, "some rows of the picture have more than 2^32 hits", "",
                    "give a smaller " + Parameter::kSize);
    TracedRows rows{window, std::vector<std::uint32_t>(window.pixels() + 1),
                    std::vector<float>(hits), std::vector<std::uint32_t>(hits), without};
    // Calls visit(pixel, part, i) for each ray i of each part.
    const auto each_ray = [&](const auto& visit) {
        constexpr std::size_t kPart = RayTracer::kRaysOfPart;
        std::size_t ray = 0;
        const auto next = [&](std::size_t pixel) {
            visit(pixel, parts[ray / kPart], ray % kPart);
            ++ray;
        };
        if (tiled) return forEachTiled(window, next);
        for (std::size_t pixel = 0; pixel < window.pixels(); ++pixel)
            next(pixel);
    };
    each_ray([&](std::size_t pixel, const HitList& part, std::size_t i) {
        rows.offsets[pixel + 1] = part.counts[i];
    });
    std::partial_sum(rows.offsets.begin(), rows.offsets.end(), rows.offsets.begin());
    const SortedHit* from = nullptr;
    each_ray([&](std::size_t pixel, const HitList& part, std::size_t i) {
        if (i == 0) from = part.hits.data();
        for (std::size_t to = rows.offsets[pixel]; to < rows.offsets[pixel + 1]; ++to, ++from) {
            rows.z[to] = tOf(*from);
            rows.keys[to] = keyOf(*from);
        }
    });
    return rows;
}

/// Returns the limit of the bytes of all kept hits: half of the memory that bands may take.
std::uint64_t TracedHits::State::mostKept(const Window& crop,
                                          const CaptureSettings& settings) const {
    const std::uint64_t most = kKeptBands * settings.band_bytes;
    if (settings.memory == 0) return most;
    BandCosts costs;
    costs.band_bytes = most;
    costs.use = {kRayBytes * rowsAt(crop, crop.y0).pixels(), 1, 1};
    costs.largest_array_bytes = 1;
    costs.storage_block_bytes = std::numeric_limits<std::uint64_t>::max();
    const BandLimits left = bandLimits(settings.memory, usedBytes(settings.memory), costs);
    return std::min(most, *kept_bytes + left.row_fragments / 3 * 4 / 2);
}

/// Keeps rows whose predecessors are kept, too, if they fit.
void TracedHits::State::keep(TracedPlan& plan, TracedRows&& rows, std::uint64_t most) {
    const int next = plan.kept.empty() ? plan.view.crop.y0 : plan.kept.back().window.y1;
    if (rows.window.y0 != next || *kept_bytes + rows.bytes() > most) return;
    *kept_bytes += rows.bytes();
    plan.kept.push_back(std::move(rows));
}

CapturePlan TracedHits::plan(const View& view, const CaptureSettings& settings,
                             const Progress& progress) {
    State& s = *state_;
    if (!view.rays) return s.elsewhere().plan(view, settings, progress);
    checkHitSettings(settings);
    if (settings.hit_mode == HitMode::kSloped)
        throw Error(ErrorKind::kInternal, "rays of a lens have no depth slopes");
    s.build(settings.memory);
    const StageTimer timer(s.times, "count");
    auto traced = std::make_shared<TracedPlan>(view, settings, s.kept_bytes);
    traced->number = ++s.plans;
    const Window& crop = view.crop;
    const std::uint64_t most = s.mostKept(crop, settings);
    std::uint64_t without_ray = 0;
    for (Window rows = rowsAt(crop, crop.y0); !rows.empty(); rows = rowsAt(crop, rows.y1)) {
        TracedRows found = s.trace(*traced, rows);
        const auto width = static_cast<std::size_t>(rows.width());
        std::vector<std::uint32_t> counts(width);
        for (int y = rows.y0; y < rows.y1; ++y) {
            const std::size_t first = static_cast<std::size_t>(y - rows.y0) * width;
            for (std::size_t x = 0; x < width; ++x)
                counts[x] = found.offsets[first + x + 1] - found.offsets[first + x];
            traced->complexity.addRow(rows.x0, y, counts);
        }
        without_ray += found.without_ray;
        traced->largest_rows = std::max(traced->largest_rows, found.bytes());
        s.keep(*traced, std::move(found), most);
        if (progress)
            progress(kTracedPlanShare * static_cast<double>(rows.y1 - crop.y0) / crop.height());
    }
    s.window_rays = {};
    s.parts = {};
    const Plan plan = hitPlan(view, settings, traced->complexity);
    return {plan, std::move(traced), without_ray};
}

BandCosts TracedHits::State::costs(const TracedPlan& traced, const Plan& plan,
                                   const Sink& sink) const {
    BandCosts costs = hitBandCosts(plan, traced.settings, traced.complexity, sink);
    if (shadedComponents(traced.settings.channels) > 0) costs.use.fixed += levels.mostBytes();
    const bool all_kept = !traced.kept.empty() && traced.kept.back().window.y1 == plan.view.crop.y1;
    if (!all_kept)
        costs.use.fixed += kRayBytes * rowsAt(plan.view.crop, plan.view.crop.y0).pixels() +
                           3 * traced.largest_rows;
    return costs;
}

/// Returns the traced rows that contain row y. Traces them again if they were not kept.
const TracedRows& TracedHits::State::rowsOf(const TracedPlan& plan, int y) {
    const Window& crop = plan.view.crop;
    const int height = rowsAt(crop, crop.y0).height(), index = (y - crop.y0) / height;
    if (static_cast<std::size_t>(index) < plan.kept.size())
        return plan.kept[static_cast<std::size_t>(index)];
    const int first = crop.y0 + index * height;
    if (again_of != plan.number || again.window.empty() || again.window.y0 != first) {
        const StageTimer timer(times, "count");
        again = {};
        again_of = plan.number;
        again = trace(plan, rowsAt(crop, first));
    }
    return again;
}

/// Copies the hits of a band from traced rows, and fills the channels.
void TracedHits::State::captureBand(const TracedPlan& plan, const Window& band, LayeredImage& out) {
    const CaptureSettings& settings = plan.settings;
    std::size_t hits = 0;
    for (int y = band.y0; y < band.y1; ++y)
        hits += plan.complexity.rowFragments(y);
    beginHitBand(band, hits, {band.pixels(), hits}, settings, out);
    const std::span keys = out.extra.front().as<std::uint32_t>();
    const auto width = static_cast<std::size_t>(band.width());
    std::uint32_t stored = 0;
    for (int y = band.y0; y < band.y1;) {
        const TracedRows& rows = rowsOf(plan, y);
        const int end = std::min(band.y1, rows.window.y1);
        const std::size_t first = static_cast<std::size_t>(y - rows.window.y0) * width;
        const std::size_t pixels = static_cast<std::size_t>(end - y) * width;
        const std::uint32_t from = rows.offsets[first], to = rows.offsets[first + pixels];
        std::uint32_t* const offsets = out.offsets.data() + out.pixelIndex(band.x0, y);
        for (std::size_t p = 0; p < pixels; ++p)
            offsets[p] = stored + rows.offsets[first + p] - from;
        std::copy(rows.z.begin() + from, rows.z.begin() + to, out.z.begin() + stored);
        std::copy(rows.keys.begin() + from, rows.keys.begin() + to, keys.begin() + stored);
        stored += to - from;
        y = end;
    }
    out.offsets.back() = stored;
    if (!settings.channels.empty())
        fillHitChannels(posed, plan.view, settings.channels, settings.color_type, out, &levels);
}

namespace {

/// Returns the plan of a view with rays, or null for a plan of another source.
std::shared_ptr<TracedPlan> tracedPlan(const CapturePlan& plan) {
    return std::dynamic_pointer_cast<TracedPlan>(plan.details);
}

BandLimits bandLimitsOf(const TracedPlan& plan, const BandCosts& costs) {
    return bandLimits(plan.settings.memory, usedBytes(plan.settings.memory), costs);
}

}  // namespace

std::uint64_t TracedHits::forecastMemory(const CapturePlan& planned, const Sink& sink) {
    State& s = *state_;
    const auto plan = tracedPlan(planned);
    if (!plan) return s.elsewhere().forecastMemory(planned, sink);
    const BandCosts costs = s.costs(*plan, planned, sink);
    const auto row_hits = [&](int y) { return plan->complexity.rowFragments(y); };
    const auto bands = cutBands(plan->view.crop, bandLimitsOf(*plan, costs), row_hits);
    return residentBytes() + costs.use.fixed + largestBandBytes(bands, costs, row_hits);
}

CaptureReport TracedHits::capture(const CapturePlan& planned, Sink& sink,
                                  const Progress& progress) {
    State& s = *state_;
    const auto plan = tracedPlan(planned);
    if (!plan) return s.elsewhere().capture(planned, sink, progress);
    const BandLimits limits = bandLimitsOf(*plan, s.costs(*plan, planned, sink));
    const Window& crop = plan->view.crop;
    const auto bands =
        cutBands(crop, limits, [&](int y) { return plan->complexity.rowFragments(y); });
    CaptureReport report{.passes = 1};
    for (const Window& band : bands) {
        {
            const StageTimer timer(s.times, "capture");
            s.captureBand(*plan, band, s.image);
        }
        ++report.bands;
        sink.write(std::move(s.image));
        if (progress)
            progress(kTracedPlanShare + (1 - kTracedPlanShare) *
                                            static_cast<double>(band.y1 - crop.y0) / crop.height());
    }
    s.again = {};
    s.window_rays = {};
    s.parts = {};
    return report;
}

void TracedHits::captureBand(const CapturePlan& planned, const Window& band, LayeredImage& out) {
    const auto plan = tracedPlan(planned);
    if (!plan) throw Error(ErrorKind::kInternal, "the plan is not for traced rays");
    state_->captureBand(*plan, band, out);
}

}  // namespace peeler
