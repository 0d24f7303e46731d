// SPDX-License-Identifier: Apache-2.0
#include "core/splats/splat_hits.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "core/base/memory_budget.h"
#include "core/base/process_memory.h"
#include "core/base/stage_times.h"
#include "core/fragments/bands.h"
#include "core/fragments/hit_bands.h"
#include "core/image/layers.h"
#include "core/image/merge.h"
#include "core/splats/splat_channels.h"

namespace peeler {
namespace {

constexpr std::uint64_t kMergedBandBytes = std::uint64_t{32} << 20;
constexpr std::uint64_t kColorBytes = kPlainComponents * sizeof(float);

struct SplatPlan final : CapturePlan::Details {
    SplatPlan(const CaptureSettings& asked, CapturePlan planned)
        : settings(asked), surfaces(std::move(planned)), complexity(surfaces.view.crop) {}

    CaptureSettings settings;
    CapturePlan surfaces;
    DepthComplexity complexity;  ///< of surfaces and splats
};

const SplatPlan& detailsOf(const CapturePlan& plan) {
    const auto* details = dynamic_cast<const SplatPlan*>(plan.details.get());
    if (!details) throw Error(ErrorKind::kInternal, "the plan belongs to another source");
    return *details;
}

/// Counts the hits of bands of surfaces, and the splats there.
class HitCounter : public Sink {
  public:
    HitCounter(SplatLayers& splats, DepthComplexity& complexity, StageTimes& times)
        : splats_(splats), complexity_(complexity), times_(times) {}

    void begin(const Plan&) override {}
    void write(LayeredImage&& band) override {
        const StageTimer timer(times_, "count");
        const auto width = static_cast<std::size_t>(band.window.width());
        counts_.resize(band.window.pixels());
        for (std::size_t pixel = 0; pixel < counts_.size(); ++pixel)
            counts_[pixel] = band.count(pixel);
        splats_.addCounts(band.window, counts_);
        for (int y = band.window.y0; y < band.window.y1; ++y)
            complexity_.addRow(
                band.window.x0, y,
                std::span(counts_).subspan(band.pixelIndex(band.window.x0, y), width));
    }
    void finish() override {}
    SinkMemory memory(const Plan&) const override {
        return {.bytes = splats_.bytes(), .pixel_bytes = sizeof(std::uint32_t)};
    }

  private:
    SplatLayers& splats_;
    DepthComplexity& complexity_;
    StageTimes& times_;
    std::vector<std::uint32_t> counts_;
};

/// Returns the costs of a band of merged hits: the surfaces and the splats, until they are merged,
/// and what a sink takes.
BandCosts mergedCosts(const SplatPlan& details, const Plan& plan, const SplatLayers& splats,
                      const Sink& sink) {
    BandCosts costs = hitBandCosts(plan, details.settings, details.complexity, sink);
    const std::uint64_t hit = sizeof(float) + plan.channel_bytes;
    costs.use.fragment += hit + 2 * kColorBytes + splatChannelBytes(details.settings.channels);
    costs.use.pixel += 2 * sizeof(std::uint32_t);
    costs.use.fixed += splats.bytes();
    const auto width = static_cast<std::uint64_t>(plan.view.crop.width());
    costs.band_bytes = std::max(std::min(details.settings.band_bytes, kMergedBandBytes),
                                4 * width * costs.use.pixel);
    return costs;
}

/// The memory that merged bands take in addition to the bands of surfaces.
class MergedMemory : public Sink {
  public:
    MergedMemory(const SplatPlan& details, const Plan& plan, const SplatLayers& splats,
                 const Sink& sink)
        : details_(details), costs_(mergedCosts(details, plan, splats, sink)) {
        const MemoryBudget& memory = details.settings.memory;
        limits_ = bandLimits(memory, usedBytes(memory), costs_);
        const auto bands = cut(plan.view.crop);
        most_ =
            costs_.use.fixed + largestBandBytes(bands, costs_, [&](int y) { return hitsOf(y); });
    }

    void begin(const Plan&) override {}
    void write(LayeredImage&&) override {}
    void finish() override {}
    SinkMemory memory(const Plan&) const override {
        return {.bytes = most_, .fragment_bytes = kColorBytes};
    }

  protected:
    std::uint64_t hitsOf(int y) const { return details_.complexity.rowFragments(y); }
    std::vector<Window> cut(const Window& window) const {
        return cutBands(window, limits_, [&](int y) { return hitsOf(y); });
    }

    const SplatPlan& details_;

  private:
    BandCosts costs_;
    BandLimits limits_;
    std::uint64_t most_ = 0;
};

/// Merges bands of surfaces with the splats there, and passes them on.
class Merger final : public MergedMemory {
  public:
    Merger(const SplatPlan& details, const Plan& plan, SplatLayers& splats, const PosedScene& posed,
           StageTimes& times, Sink& sink)
        : MergedMemory(details, plan, splats, sink),
          layers_(splats),
          posed_(posed),
          times_(times),
          sink_(sink) {}

    void write(LayeredImage&& band) override {
        auto& [surfaces, splats] = elements_;
        std::swap(surfaces, band);
        const CaptureSettings& settings = details_.settings;
        surfaces.color = {colorNames(false), settings.color_type, {}};
        surfaces.color.data.resize(surfaces.fragments() * surfaces.color.stride());
        for (const Window& window : cut(surfaces.window)) {
            {
                const StageTimer timer(times_, "splats");
                layers_.capture(window, splats);
                fillSplatChannels(posed_, details_.surfaces.view, settings.channels, nullptr,
                                  splats);
                mergeByDepth(elements_, window, splats, merged_);
            }
            hits_ += merged_.fragments();
            ++bands_;
            sink_.write(std::move(merged_));
        }
        surfaces.color = {};
        std::swap(surfaces, band);
    }

    std::uint64_t hits() const { return hits_; }
    int bands() const { return bands_; }

  private:
    SplatLayers& layers_;
    const PosedScene& posed_;
    StageTimes& times_;
    Sink& sink_;
    std::array<LayeredImage, 2> elements_{};  ///< of surfaces and of splats
    LayeredImage merged_;
    std::uint64_t hits_ = 0;
    int bands_ = 0;
};

}  // namespace

SplatHits::SplatHits(HitSource& surfaces) : surfaces_(surfaces), splats_(surfaces.posed()) {}

StageTimes SplatHits::takeTimes() {
    StageTimes times = std::exchange(times_, {});
    add(times, surfaces_.takeTimes());
    return times;
}

CapturePlan SplatHits::plan(const View& view, const CaptureSettings& settings,
                            const Progress& progress) {
    if (view.rays || settings.hit_mode == HitMode::kSloped)
        throw Error(ErrorKind::kInternal, "these rays do not hit splats");
    CaptureSettings by_ray = settings;
    by_ray.splat_order = SplatOrder::kRay;
    by_ray.tinted = false;
    const auto details =
        std::make_shared<SplatPlan>(by_ray, surfaces_.plan(view, settings, progress));
    splats_.begin(view, by_ray);
    HitCounter counter(splats_, details->complexity, times_);
    surfaces_.capture(details->surfaces, counter);
    CapturePlan plan{hitPlan(view, by_ray, details->complexity), details};
    plan.without_ray = details->surfaces.without_ray;
    return plan;
}

CaptureReport SplatHits::capture(const CapturePlan& plan, Sink& sink, const Progress& progress) {
    const SplatPlan& details = detailsOf(plan);
    splats_.begin(plan.view, details.settings);
    Merger merger(details, plan, splats_, posed(), times_, sink);
    CaptureReport report = surfaces_.capture(details.surfaces, merger, progress);
    report.bands = merger.bands();
    if (merger.hits() != plan.fragments_stored)
        throw Error(ErrorKind::kInternal, std::to_string(merger.hits()) +
                                              " hits were captured and " +
                                              std::to_string(plan.fragments_stored) + " planned");
    return report;
}

std::uint64_t SplatHits::forecastMemory(const CapturePlan& plan, const Sink& sink) {
    const SplatPlan& details = detailsOf(plan);
    return surfaces_.forecastMemory(details.surfaces, MergedMemory(details, plan, splats_, sink));
}

}  // namespace peeler
