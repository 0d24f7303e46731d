// SPDX-License-Identifier: Apache-2.0
#include "core/capture/gl_planner.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/error.h>
#include "core/base/names.h"
#include "core/base/process_memory.h"
#include "core/base/stage_times.h"
#include "core/fragments/supersampling.h"
#include "core/image/channels.h"
#include "core/splats/projected_splats.h"

namespace peeler {
namespace {

// The approximate fraction of a picture's rendering time that planning takes. If planning only
// counts, it is one fast pass; one or two capture passes and the writing follow. If planning merges
// samples, it already captures all samples once. If planning composites, little work remains.
constexpr double kCountShare = 0.2, kMergeShare = 0.6, kCompositeShare = 0.8;

std::uint64_t imageBytes(const LayeredImage& image) {
    return image.offsets.size() * sizeof(std::uint32_t) + image.z.size() * sizeof(float) +
           image.color.data.size() +
           std::accumulate(
               image.extra.begin(), image.extra.end(), std::size_t{0},
               [](std::size_t sum, const FragmentArray& array) { return sum + array.data.size(); });
}

}  // namespace

void checkSettings(const CaptureSettings& settings) {
    const MethodInfo* method = findPeelMethod(settings.method);
    const Text where = Parameter::kMethod + " " + settings.method;
    if (!method) {
        std::vector<std::string_view> names;
        for (const MethodInfo& known : peelMethods())
            names.push_back(known.name);
        throw Error(ErrorKind::kUsage, "unknown method '" + settings.method + "'", where,
                    choiceHint(settings.method, "methods", names));
    }
    if (!method->exact() && !settings.composite) {
        throw Error(ErrorKind::kUsage,
                    settings.method + " produces no layers, only an approximate composite", where,
                    "add " + Parameter::kComposite + " or write a .png, or choose another method");
    }
    if (!method->exact() && (settings.max_layers != 0 || settings.occlusion_ratio > 0)) {
        throw Error(ErrorKind::kUsage,
                    settings.method + " takes all layers at once and cannot limit them", where,
                    "leave " + Parameter::kMaxLayers + " and " + Parameter::kOcclusionRatio +
                        " out, or choose another method");
    }
    if (settings.tail == Tail::kBlend && !settings.composite) {
        throw Error(ErrorKind::kUsage, "stored layers are never blended",
                    Parameter::kTail + " blend",
                    "add " + Parameter::kComposite + " or write a .png, or leave " +
                        Parameter::kTail + " out");
    }
    if (settings.hit_mode != HitMode::kNone &&
        (!method->layers()->takesAll() || settings.composite || settings.samples > 1 ||
         settings.max_layers != 0)) {
        throw Error(ErrorKind::kInternal,
                    "tracing rays requires a method that takes all layers at once, one sample per "
                    "pixel, and neither a composite nor a layer limit",
                    where);
    }
    if (settings.composite && !settings.channels.empty()) {
        throw Error(
            ErrorKind::kUsage, "a composite that is blended during rendering has no channels",
            Parameter::kChannels, "leave " + Parameter::kChannels + " out, or render layers");
    }
}

void checkRays(const View& view, const CaptureSettings& settings) {
    const Text where(view.camera_name);
    if (settings.hit_mode != HitMode::kNone)
        throw Error(ErrorKind::kInternal, "traced rays have colours only in pictures", where);
    if (!findPeelMethod(settings.method)->exact())
        throw Error(ErrorKind::kUsage,
                    settings.method + " cannot look through a lens, since it only rasterises",
                    Parameter::kMethod + " " + settings.method, "choose an exact method");
    if (settings.clip.active())
        throw Error(ErrorKind::kUsage, "a picture through a lens cannot be clipped", where,
                    "leave the clip volume out, or render a pinhole picture");
}

void checkSplats(const View& view, const CaptureSettings& settings) {
    const Text where(view.camera_name);
    if (settings.hit_mode != HitMode::kNone) return;  // rays do not hit splats
    if (view.rays)
        throw Error(ErrorKind::kUsage, "Gaussian splats are not seen through lenses", where,
                    "render a pinhole picture, or leave the splats out: " + Parameter::kExclude);
    if (!findPeelMethod(settings.method)->exact())
        throw Error(ErrorKind::kUsage, settings.method + " does not render Gaussian splats",
                    Parameter::kMethod + " " + settings.method, "choose an exact method");
    if (settings.clip.active())
        throw Error(ErrorKind::kUsage, "Gaussian splats cannot be clipped", where,
                    "leave the clip volume out");
}

void checkSplatBlending(const PosedScene& posed, const CaptureSettings& settings) {
    if (settings.splat_blending != SplatBlending::kDisplay) return;
    const Text display = Parameter::kSplatBlending + " display";
    if (!settings.composite)
        throw Error(ErrorKind::kUsage, "layers blend in linear light", display,
                    "leave it out, or render a composite without channels");
    if (!hasOnlySplats(posed))
        throw Error(ErrorKind::kUsage, "surfaces blend in linear light", display,
                    "leave it out, or show splats alone: " + Parameter::kInclude);
}

bool skipsHidden(const CaptureSettings& settings) {
    const MethodInfo* const method = findPeelMethod(settings.method);
    return settings.composite && method && method->exact() && settings.max_layers == 0 &&
           !(settings.occlusion_ratio > 0) && settings.surfaces != Surfaces::kTransparent;
}

GlPlanner::GlPlanner(BandRenderer& renderer, const DrawList& draws, StageTimes& times, GlPlan& plan,
                     const Progress& progress)
    : renderer_(renderer), draws_(draws), times_(times), plan_(plan), progress_(progress) {
    plan_.method = findPeelMethod(plan_.settings.method);
    plan_.on_cpu = plan_.view.rays ||
                   (renderer_.capture().hasSplats() && plan_.settings.hit_mode == HitMode::kNone);
    plan_.positions = {plan_.view.sample};
    if (plan_.settings.samples == 1) return;
    plan_.positions = samplePositions(plan_.settings.samples);
    for (glm::dvec2& position : plan_.positions)
        position += plan_.view.sample - 0.5;
}

void GlPlanner::count() {
    renderer_.begin(plan_);
    chooseSurfaces();
    checkShadePer();
    if (progress_) plan_.share = plan_.mergesLayers() ? kMergeShare : kCountShare;
    if (!countVisible()) {
        countSamples();
        countMerged();
    }
    limitLayers();
}

/// Reports progress within a stage of planning. The stage extends from `from` to `to`, as fractions
/// of planning (0–1).
void GlPlanner::report(double from, double to, double share) const {
    if (progress_) progress_(plan_.share * (from + (to - from) * share));
}

/// Skips the fragments behind opaque surfaces for exact composites of all layers. Approximations
/// average all fragments, and layer limits count them. Skips none if no surface is opaque.
void GlPlanner::chooseSurfaces() {
    CaptureSettings& settings = plan_.settings;
    if (std::ranges::none_of(draws_.draws(), &Draw::opaque)) {
        settings.surfaces = Surfaces::kAll;  // nothing hides anything
        return renderer_.takeSurfaces();
    }
    if (!skipsHidden(settings)) return;
    settings.surfaces = Surfaces::kVisible;
    renderer_.takeSurfaces();
    const PlanMethods& methods = renderer_.methods();
    if (methods.composite || !methods.layers->takesOpaqueFirst() || !settings.clip.nodes.empty() ||
        settings.depth_clamp || plan_.on_cpu)
        return;
    plan_.shades_pixels = shadesPixels();
    plan_.opaque_first = true;  // costs() below depends on opaque_first
    if (!plan_.shades_pixels)
        plan_.opaque_first =
            hasRoom(settings.memory, usedBytes(settings.memory), renderer_.budget().costs());
    if (plan_.opaque_first) plan_.drawn = renderer_.capture().drawnWindow();
    if (plan_.shades_pixels) renderer_.showSample(0);
}

/// Whether a composite without hidden fragments can and shall shade an opaque triangle once per
/// pixel. Depends on the budget, but not on the memory in use, so that repeated runs are alike.
bool GlPlanner::shadesPixels() const {
    const CaptureSettings& settings = plan_.settings;
    const BandCapture& capture = renderer_.capture();
    if (settings.shade_per == ShadePer::kSample ||
        !capture.takesSamples(samplePositions(settings.samples)))
        return false;
    if (settings.shade_per == ShadePer::kPixel) return true;
    // Transparent surfaces are shaded for every sample, which takes longer in multisampled passes
    // of llvmpipe: it also shades the samples that a triangle does not cover.
    const bool fits =
        settings.memory == 0 || capture.sampleBytes() <= settings.memory / kSampleShare;
    return fits && std::ranges::all_of(draws_.draws(), &Draw::opaque);
}

/// Throws Error (kUsage) if each pixel is to be shaded once, but that is not possible.
void GlPlanner::checkShadePer() const {
    if (plan_.settings.shade_per != ShadePer::kPixel || plan_.shades_pixels) return;
    throw Error(ErrorKind::kUsage,
                "only composites of triangles with 4 samples per pixel, made by the A-buffer from "
                "all layers, without clip meshes, lenses or splats, are shaded once per pixel",
                Parameter::kShadePer + " pixel", "leave it out");
}

/// Counts the visible fragments of composites. Also keeps the composites if there is room, because
/// counting alone takes nearly as long. Returns false if there is no room and countSamples() finds
/// the same fragments: those of shaded samples.
bool GlPlanner::countVisible() {
    const Window& crop = plan_.view.crop;
    const std::uint64_t composite_bytes = CompositeImage::pixelBytes(plan_.settings.tinted);
    const bool keeps = plan_.fitsKept(crop.pixels() * (composite_bytes + sizeof(std::uint32_t)));
    if (!plan_.opaque_first || (!keeps && !plan_.shades_pixels)) return false;
    plan_.counted.emplace(crop);
    if (progress_ && keeps) plan_.share = kCompositeShare;
    const auto count_visible = [&](const Window& rows, std::span<const std::uint32_t> counts) {
        const auto width = static_cast<std::size_t>(rows.width());
        for (int y = rows.y0; y < rows.y1; ++y) {
            const auto row = static_cast<std::size_t>(y - rows.y0) * width;
            plan_.counted->addRow(rows.x0, y, counts.subspan(row, width));
        }
    };
    renderer_.takePasses();
    renderer_.freeBands();
    const BandBudget budget = renderer_.budget();
    const BandLimits limits = budget.limits();
    for (const Window& band : budget.cut(limits)) {
        const auto keep = [&](LayeredImage& rows) { plan_.kept_bands.push_back(std::move(rows)); };
        if (keeps)
            renderer_.renderVisible(band, limits, keep, count_visible);
        else
            renderer_.countVisible(band, count_visible);
        plan_.kept_passes = std::max(plan_.kept_passes, renderer_.takePasses());
        report(0, 1, static_cast<double>(band.y1 - crop.y0) / crop.height());
    }
    return true;
}

/// Counts the clip-mesh surfaces per row. The counts are needed because a band's memory also
/// includes lists of these surfaces.
void GlPlanner::countClip() {
    if (plan_.settings.clip.nodes.empty()) return;
    const Window& crop = plan_.view.crop;
    const auto width = static_cast<std::ptrdiff_t>(crop.width());
    const BandLimits limits = renderer_.budget().limits();
    std::vector<std::uint64_t> most_of(static_cast<std::size_t>(crop.height()));
    std::vector<std::uint32_t> counts;
    plan_.clip_rows.clear();
    for (std::size_t i = 0; i < plan_.positions.size(); ++i) {
        renderer_.showSample(i);
        for (const Window& band : cutBands(crop, limits, [](int) { return 0; })) {
            renderer_.capture().countClip(band, counts);
            for (int y = band.y0; y < band.y1; ++y) {
                const auto first = counts.begin() + (y - band.y0) * width;
                std::uint64_t& most = most_of[static_cast<std::size_t>(y - crop.y0)];
                most = std::max(most, std::accumulate(first, first + width, std::uint64_t{0}));
            }
        }
    }
    plan_.clip_rows = std::move(most_of);
}

/// Makes room for the counts of all views if they are worth keeping.
void GlPlanner::keepCounts(const BandCosts& costs) {
    const std::uint64_t views = plan_.positions.size(), counts = views * plan_.view.crop.pixels();
    const std::uint64_t bytes = counts * sizeof(std::uint32_t);
    const MemoryBudget& memory = plan_.settings.memory;
    if (plan_.opaque_first || !plan_.fitsKept(bytes)) return;
    if (views > 1 && !hasRoom(memory, usedBytes(memory) + bytes, costs)) return;
    plan_.kept_counts.resize(counts);
}

/// Runs the count pass of every view.
void GlPlanner::countSamples() {
    const Window& crop = plan_.view.crop;
    const auto width = static_cast<std::size_t>(crop.width());
    plan_.counted.emplace(crop);
    renderer_.freeBands();
    countClip();
    BandBudget counting = renderer_.budget();
    keepCounts(counting.costs());
    counting.costs().use.pixel = 2 * sizeof(std::uint32_t);
    if (!plan_.clip_rows.empty()) counting.costs().use.pixel += 3 * sizeof(std::uint32_t);
    const BandLimits limits = counting.limits();
    const double counted = plan_.mergesLayers() ? kCountShare : 1;
    std::uint64_t rows = 0;
    const std::uint64_t all_rows =
        plan_.positions.size() * static_cast<std::uint64_t>(crop.height());
    std::vector<std::uint32_t> counts;
    for (std::size_t i = 0; i < plan_.positions.size(); ++i) {
        renderer_.showSample(i);
        // The count pass stores no fragments, so its bands may have more rows than captured bands.
        for (const Window& band : counting.cutForCounting(limits)) {
            renderer_.capture().count(band, counts);
            const StageTimer timer(times_, "count");
            const std::size_t first =
                i * crop.pixels() + static_cast<std::size_t>(band.y0 - crop.y0) * width;
            for (int y = band.y0; y < band.y1; ++y) {
                const auto row = static_cast<std::size_t>(y - band.y0) * width;
                plan_.counted->addRow(crop.x0, y, {counts.data() + row, width});
            }
            if (!plan_.kept_counts.empty())
                std::copy(counts.begin(), counts.end(),
                          plan_.kept_counts.begin() + static_cast<std::ptrdiff_t>(first));
            rows += static_cast<std::uint64_t>(band.height());
            report(0, counted, static_cast<double>(rows) / static_cast<double>(all_rows));
        }
    }
}

/// Merges all views to count their layers. The number of layers is not known before merging.
void GlPlanner::countMerged() {
    if (!plan_.mergesLayers()) return;
    const Window& crop = plan_.view.crop;
    plan_.merged.emplace(crop);
    std::uint64_t kept = 0;
    bool keeps = true;
    LayeredImage image;
    renderer_.takePasses();
    renderer_.freeBands();
    const BandBudget budget = renderer_.budget();
    for (const Window& band : budget.cut(budget.limits())) {
        renderer_.renderMerged(band, image);
        plan_.merged->addBand(image);
        plan_.kept_passes = std::max(plan_.kept_passes, renderer_.takePasses());
        kept += imageBytes(image);
        keeps = keeps && plan_.fitsKept(kept);
        if (keeps) plan_.kept_bands.push_back(image);
        report(kCountShare, 1, static_cast<double>(band.y1 - crop.y0) / crop.height());
    }
    if (keeps)
        plan_.kept_counts = {};
    else
        plan_.kept_bands.clear();
}

/// Applies the settings max_layers and occlusion_ratio. The first layer that covers less than
/// occlusion_ratio of the pixels becomes the last layer, as if an occlusion query followed each
/// peeling pass.
void GlPlanner::limitLayers() {
    plan_.limit = plan_.settings.max_layers;
    if (!(plan_.settings.occlusion_ratio > 0)) return;
    const auto layers = found().layers();
    const std::uint64_t views_counted = plan_.merged ? 1 : plan_.positions.size();
    const double enough = plan_.settings.occlusion_ratio *
                          static_cast<double>(plan_.view.crop.pixels() * views_counted);
    const auto few = std::find_if(layers.begin(), layers.end(), [&](const LayerPlan& layer) {
        return static_cast<double>(layer.pixels) < enough;
    });
    if (few == layers.end()) return;
    const auto last = static_cast<std::uint32_t>(few - layers.begin()) + 1;
    plan_.limit = plan_.limit ? std::min(plan_.limit, last) : last;
}

Plan GlPlanner::plan() const {
    const CaptureSettings& settings = plan_.settings;
    Plan plan;
    plan.view = plan_.view;
    plan.color_type = settings.color_type;
    plan.tinted = settings.tinted;
    plan.channel_bytes = channelBytes(settings.channels, settings.color_type);
    if (settings.hit_mode != HitMode::kNone) plan.channel_bytes += sizeof(std::uint32_t);
    for (const Channel channel : settings.channels)
        plan.channels.push_back(emptyArray(channel, settings.color_type));
    plan.samples = settings.samples;
    plan.layers = found().layers(plan_.method->exact() ? plan_.limit : 0);
    plan.fragments_counted = found().counted();
    for (const LayerPlan& layer : plan.layers)
        plan.fragments_stored += layer.pixels;
    if (settings.composite && settings.tail == Tail::kBlend)
        plan.fragments_blended = plan.fragments_counted - plan.fragments_stored;
    return plan;
}

}  // namespace peeler
