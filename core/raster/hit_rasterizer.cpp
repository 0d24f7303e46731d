// SPDX-License-Identifier: Apache-2.0
#include "core/raster/hit_rasterizer.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/base/process_memory.h"
#include "core/base/resize_anew.h"
#include "core/base/stage_times.h"
#include "core/fragments/bands.h"
#include "core/fragments/hit_bands.h"
#include "core/fragments/supersampling.h"
#include "core/image/channels.h"
#include "core/image/layers.h"
#include "core/raster/hit_lists.h"
#include "core/raster/scene_triangles.h"
#include "core/raster/surface_values.h"

namespace peeler {
namespace {

// The maximum number of columns: spans store columns in 16 bits.
constexpr int kMostSide = 65536;
constexpr int kRowsAtOnce = 8;     // maximum number of rows per task
constexpr int kGroupsAThread = 4;  // groups of rows per thread and band, for load balancing
// The maximum bytes of spans. Under a memory budget, spans also get at most 1 / kSpanShare of the
// remaining memory. A picture whose spans need more is processed in several sections.
constexpr std::uint64_t kSpanBytes = std::uint64_t{2} << 30;
constexpr std::uint64_t kSpanShare = 2;
constexpr std::uint64_t kLeastSpanBytes = std::uint64_t{4} << 20;
constexpr std::uint64_t kLeastBandBytes = std::uint64_t{16} << 20;  // memory reserved for bands
// The approximate fraction of a bundle's time that planning takes. Used for progress.
constexpr double kPlanShare = 0.4;

void checkView(const View& view) {
    if (view.rays)
        throw Error(ErrorKind::kInternal, "the rasteriser does not support rays of a lens");
    if (view.crop.width() <= kMostSide && view.crop.height() <= kMostSide) return;
    throw Error(ErrorKind::kUsage,
                "a bundle would have more than " + std::to_string(kMostSide) + " rays per side", "",
                "give a lower " + Parameter::kResolution + " or a smaller " + Parameter::kSize);
}

}  // namespace

namespace {

struct HitPlan final : CapturePlan::Details {
    HitPlan(const View& view, const CaptureSettings& asked)
        : settings(asked), seen(view, asked), complexity(view.crop) {}

    CaptureSettings settings;
    HitView seen;
    DepthComplexity complexity;
    /// Row sections, top to bottom. Only one section's spans are held at a time.
    std::vector<Window> sections{};
    std::uint64_t span_limit = kSpanBytes;
    double share = 0;  ///< planning's fraction of a bundle's work, for progress
};

}  // namespace

struct HitRasterizer::State {
    explicit State(PosedScene in_pose) : posed(std::move(in_pose)), triangles(posed) {}

    HitPlan& show(const CapturePlan& plan);
    bool findSpans(const Window& section, std::vector<Window>& to_do);
    void findSections();
    void countSection(const Window& section);
    void freeBands();
    BandCosts costs(const Plan& plan, const Sink& sink) const;
    std::uint64_t spansToCome() const;
    BandLimits limits(const BandCosts& costs) const;
    HitBandSize largest(std::span<const Window> bands) const;
    void captureBand(const Window& band, int section_top, const HitBandSize& most);
    void captureRow(const Window& band, int section_top, int y, std::uint32_t first,
                    HitSorter& sorter);

    PosedScene posed;
    SceneTriangles triangles;
    SpanStore store;
    StageTimes times;
    std::shared_ptr<HitPlan> shown;  // the plan that is being planned or captured
    Window held;                     // the section whose spans are in the store
    ObjectPool<HitSorter> sorters;
    LayeredImage image;
};

HitRasterizer::HitRasterizer(PosedScene posed)
    : state_(std::make_unique<State>(std::move(posed))) {}

HitRasterizer::~HitRasterizer() = default;

const PosedScene& HitRasterizer::posed() const {
    return state_->posed;
}

StageTimes HitRasterizer::takeTimes() {
    return std::exchange(state_->times, {});
}

int HitRasterizer::gridBits() const {
    return state_->shown ? state_->shown->seen.grid.bits() : 0;
}

std::size_t HitRasterizer::sections() const {
    return state_->shown ? state_->shown->sections.size() : 0;
}

/// Selects the plan to capture. Discards the spans of any other plan.
HitPlan& HitRasterizer::State::show(const CapturePlan& plan) {
    auto details = std::dynamic_pointer_cast<HitPlan>(plan.details);
    if (!details) throw Error(ErrorKind::kInternal, "the plan belongs to another source");
    if (details != shown) {
        shown = std::move(details);
        held = {};
    }
    return *shown;
}

/// Counts the hits of a section whose spans are in the store.
void HitRasterizer::State::countSection(const Window& section) {
    const auto width = static_cast<std::size_t>(section.width());
    const auto groups =
        static_cast<std::size_t>((section.height() + kRowsAtOnce - 1) / kRowsAtOnce);
    std::mutex mutex;
    parallelFor(groups, [&](std::size_t group) {
        std::vector<std::uint32_t> counts(width);
        Window rows = section;
        rows.y0 += static_cast<int>(group) * kRowsAtOnce;
        rows.y1 = std::min(section.y1, rows.y0 + kRowsAtOnce);
        DepthComplexity part(rows);
        for (int y = rows.y0; y < rows.y1; ++y) {
            const HitCount found =
                countHits(store, static_cast<std::size_t>(y - section.y0), counts);
            const std::size_t used = found.end - found.begin;
            part.addRow(rows.x0 + static_cast<int>(found.begin), y,
                        std::span(counts).subspan(found.begin, used));
            part.addEmpty(width - used);
        }
        const std::lock_guard lock(mutex);
        shown->complexity.add(part);
    });
}

/// Finds the spans of a section. If they do not fit, queues the two halves of the section instead
/// and returns false.
bool HitRasterizer::State::findSpans(const Window& section, std::vector<Window>& to_do) {
    if (section == held) return true;
    triangles.findSpans(shown->seen, section, shown->span_limit, store);
    if (!store.overflowed()) {
        held = section;
        return true;
    }
    held = {};
    const int middle = section.y0 + section.height() / 2;
    if (middle == section.y0) {
        throw Error(ErrorKind::kMemory,
                    "the triangles' coverage of one row does not fit the memory budget",
                    shown->settings.memory.where(),
                    shown->settings.memory.hint(usedBytes(shown->settings.memory) +
                                                kSpanShare * shown->span_limit));
    }
    to_do.push_back({section.x0, middle, section.x1, section.y1});
    to_do.push_back({section.x0, section.y0, section.x1, middle});
    return false;
}

/// Divides the picture into sections whose spans fit, and counts the hits of each section.
void HitRasterizer::State::findSections() {
    held = {};
    std::vector<Window> to_do{shown->seen.view.crop};
    while (!to_do.empty()) {
        const Window section = to_do.back();
        to_do.pop_back();
        if (section.empty() || !findSpans(section, to_do)) continue;
        shown->sections.push_back(section);
        countSection(section);
    }
}

/// Frees the memory of the previous bundle if memory is tight. Otherwise a budget would count this
/// memory twice: as resident, and as needed for the next bundle.
void HitRasterizer::State::freeBands() {
    BandCosts costs;
    costs.band_bytes = kHitBandBytes + store.bytes();
    if (isRoomy(shown->settings.memory, usedBytes(shown->settings.memory), costs)) return;
    image = {};
    sorters.free();
    store.free();
    triangles.free();
    returnFreeMemory();
}

CapturePlan HitRasterizer::plan(const View& view, const CaptureSettings& settings,
                                const Progress& progress) {
    State& s = *state_;
    checkHitSettings(settings);
    checkView(view);
    s.shown = std::make_shared<HitPlan>(view, settings);
    HitPlan& plan = *s.shown;
    s.freeBands();
    if (settings.memory != 0) {
        // Computes the limit of the spans like the limit of a band: the remaining memory minus a
        // reserve.
        BandCosts costs;
        costs.band_bytes = kSpanBytes;
        costs.use.fragment = costs.use.pixel = costs.largest_array_bytes = 1;
        costs.storage_block_bytes = std::numeric_limits<std::uint64_t>::max();
        costs.use.fixed = s.triangles.mostBytes() + kLeastBandBytes;
        const std::uint64_t left =
            bandLimits(settings.memory, usedBytes(settings.memory), costs).row_fragments / 3 * 4;
        plan.span_limit = std::clamp(left / kSpanShare, kLeastSpanBytes, kSpanBytes);
    }
    timed(s.times, "count", [&] { s.findSections(); });
    plan.share = progress ? kPlanShare : 0;
    if (progress) progress(plan.share);
    return {hitPlan(view, settings, plan.complexity), s.shown};
}

BandCosts HitRasterizer::State::costs(const Plan& plan, const Sink& sink) const {
    const DepthComplexity& complexity = shown->complexity;
    BandCosts costs = hitBandCosts(plan, shown->settings, complexity, sink);
    const auto width = static_cast<std::uint64_t>(plan.view.crop.width());
    costs.use.fixed += static_cast<std::uint64_t>(threadCount()) *
                       HitSorter::bytes(width, complexity.mostFragments(1));
    return costs;
}

void HitRasterizer::State::captureRow(const Window& band, int section_top, int y,
                                      std::uint32_t first, HitSorter& sorter) {
    const std::size_t row = static_cast<std::size_t>(y - section_top);
    const auto width = static_cast<std::size_t>(band.width());
    std::uint32_t* const offsets = image.offsets.data() + image.pixelIndex(band.x0, y);
    // Only the offsets of this row are written. The offset after them belongs to the next row.
    const std::span<std::uint32_t> counts = sorter.counts(width);
    const HitCount found = countHits(store, row, counts);
    if (found.hits != shown->complexity.rowFragments(y)) {
        throw Error(ErrorKind::kInternal,
                    std::to_string(found.hits) + " hits were found, but " +
                        std::to_string(shown->complexity.rowFragments(y)) + " were counted",
                    "row " + std::to_string(y), "please report this with the scene");
    }
    std::uint32_t at = first;
    std::fill_n(offsets, found.begin, at);
    for (std::size_t x = found.begin; x < found.end; ++x) {
        offsets[x] = at;
        at += counts[x];
    }
    std::fill(offsets + found.end, offsets + width, at);
    HitRow hits;
    hits.row = row;
    hits.column = static_cast<std::uint32_t>(found.begin);
    hits.x0 = band.x0 + static_cast<int>(found.begin);
    hits.y = y;
    hits.perspective = shown->seen.view.projection.perspective;
    hits.offsets = {offsets + found.begin, found.end - found.begin};
    hits.end = at;
    hits.z = image.z.data() + first;
    hits.keys = image.extra.front().as<std::uint32_t>().data() + first;
    if (shown->settings.hit_mode == HitMode::kSloped) {
        hits.slopes = image.color.as<float>().data() + 2 * std::size_t{first};
        hits.slope_scale = slopeScale(shown->seen.view.projection);
    }
    if (!sorter.sortRow(store, hits)) {
        throw Error(ErrorKind::kInternal, "a ray has more or fewer hits than were counted",
                    "row " + std::to_string(y), "please report this with the scene");
    }
}

void HitRasterizer::State::captureBand(const Window& band, int section_top,
                                       const HitBandSize& most) {
    const CaptureSettings& settings = shown->settings;
    std::vector<std::uint32_t> first(static_cast<std::size_t>(band.height()) + 1);
    for (int y = band.y0; y < band.y1; ++y) {
        const auto row = static_cast<std::size_t>(y - band.y0);
        first[row + 1] = first[row] + static_cast<std::uint32_t>(shown->complexity.rowFragments(y));
    }
    beginHitBand(band, first.back(), most, settings, image);
    image.offsets.back() = first.back();
    const StageTimer timer(times, "capture");
    const int at_once =
        std::clamp(band.height() / (kGroupsAThread * threadCount()), 1, kRowsAtOnce);
    const auto groups = static_cast<std::size_t>((band.height() + at_once - 1) / at_once);
    parallelFor(groups, [&](std::size_t group) {
        sorters.with([&](HitSorter& sorter) {
            const int begin = band.y0 + static_cast<int>(group) * at_once;
            for (int y = begin; y < std::min(begin + at_once, band.y1); ++y)
                captureRow(band, section_top, y, first[static_cast<std::size_t>(y - band.y0)],
                           sorter);
        });
    });
    if (settings.channels.empty()) return;
    fillHitChannels(posed, shown->seen.view, settings.channels, settings.color_type, image);
}

HitBandSize HitRasterizer::State::largest(std::span<const Window> bands) const {
    HitBandSize most;
    for (const Window& band : bands) {
        std::size_t hits = 0;
        for (int y = band.y0; y < band.y1; ++y)
            hits += shown->complexity.rowFragments(y);
        most = {std::max<std::size_t>(most.pixels, band.pixels()), std::max(most.hits, hits)};
    }
    return most;
}

/// Returns the bytes by which the spans of a later section may exceed the spans in the store.
std::uint64_t HitRasterizer::State::spansToCome() const {
    return shown->sections.size() > 1
               ? shown->span_limit - std::min(shown->span_limit, store.bytes())
               : 0;
}

BandLimits HitRasterizer::State::limits(const BandCosts& costs) const {
    return bandLimits(shown->settings.memory, usedBytes(shown->settings.memory) + spansToCome(),
                      costs);
}

std::uint64_t HitRasterizer::forecastMemory(const CapturePlan& planned, const Sink& sink) {
    State& s = *state_;
    const HitPlan& plan = s.show(planned);
    const BandCosts costs = s.costs(planned, sink);
    const BandLimits limits = s.limits(costs);
    const auto row_hits = [&](int y) { return plan.complexity.rowFragments(y); };
    std::uint64_t most = 0;
    for (const Window& section : plan.sections)
        most =
            std::max(most, largestBandBytes(cutBands(section, limits, row_hits), costs, row_hits));
    return residentBytes() + s.spansToCome() + costs.use.fixed + most;
}

CaptureReport HitRasterizer::capture(const CapturePlan& planned, Sink& sink,
                                     const Progress& progress) {
    State& s = *state_;
    const HitPlan& plan = s.show(planned);
    CaptureReport report;
    report.passes = 1;
    const Window& crop = plan.seen.view.crop;
    std::uint64_t stored = 0;
    // Computes the limits first, so that a plan that does not fit fails before any band is
    // captured.
    const BandLimits limits = s.limits(s.costs(planned, sink));
    std::vector<Window> to_do(plan.sections.rbegin(), plan.sections.rend());
    while (!to_do.empty()) {
        const Window section = to_do.back();
        to_do.pop_back();
        {
            // The bytes that spans take depend on thread timing. A section that just fitted during
            // planning may exceed the limit now. It is then halved.
            const StageTimer timer(s.times, "count");
            if (!s.findSpans(section, to_do)) continue;
        }
        const std::vector<Window> bands =
            cutBands(section, limits, [&](int y) { return plan.complexity.rowFragments(y); });
        const HitBandSize most = s.largest(bands);
        for (const Window& band : bands) {
            s.captureBand(band, section.y0, most);
            stored += s.image.fragments();
            ++report.bands;
            sink.write(std::move(s.image));
            if (progress) {
                const double share = static_cast<double>(band.y1 - crop.y0) / crop.height();
                progress(plan.share + (1 - plan.share) * share);
            }
        }
    }
    if (stored != planned.fragments_stored) {
        throw Error(ErrorKind::kInternal, std::to_string(stored) + " hits were captured and " +
                                              std::to_string(planned.fragments_stored) +
                                              " planned");
    }
    return report;
}

}  // namespace peeler
