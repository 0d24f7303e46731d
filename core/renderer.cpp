// SPDX-License-Identifier: Apache-2.0
#include "core/renderer.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include "core/band_capture.h"
#include "core/bands.h"
#include "core/composite.h"
#include "core/depth_complexity.h"
#include "core/error.h"
#include "core/lighting.h"
#include "core/nearest.h"
#include "core/peel/method.h"
#include "core/supersampling.h"

namespace peeler {
namespace {

// A pixel of a band costs a slot, an offset here and in the hand-over, and what a sink composites
// into.
constexpr std::uint64_t kPixelBytes = 3 * sizeof(std::uint32_t) + 5 * sizeof(float);

// What the planning has found is kept for the capture if it is no more than this share of the
// budget (or this many bytes without one); otherwise it is found again.
constexpr std::uint64_t kKeptShare = 6;
constexpr std::uint64_t kKeptBytes = 256ULL << 20;

std::uint64_t bytesOf(const LayeredImage& image) {
    return image.offsets.size() * sizeof(std::uint32_t) + image.z.size() * sizeof(float) +
           image.color.data.size() +
           std::accumulate(
               image.extra.begin(), image.extra.end(), std::size_t{0},
               [](std::size_t sum, const FragmentArray& array) { return sum + array.data.size(); });
}

}  // namespace

struct Renderer::State {
    State(gl::Context& ctx, const Scene& whole, SceneContents shown)
        : context(ctx),
          scene(whole),
          contents(std::move(shown)),
          band_capture(ctx, scene, contents, times),
          lighting(timedLighting(ctx, scene, contents, times)) {}

    /// Prefiltering an environment takes its time.
    static Lighting timedLighting(gl::Context& ctx, const Scene& scene,
                                  const SceneContents& contents, StageTimes& times) {
        const StageTimer timer(times, "upload");
        return {ctx.functions(), scene, contents};
    }

    gl::Context& context;
    const Scene& scene;
    SceneContents contents;
    NextFrame next_frame;
    StageTimes times;
    BandCapture band_capture;
    Lighting lighting;

    CaptureSettings settings;
    const MethodInfo* method = nullptr;
    std::unique_ptr<LayerMethod> layer_method;
    std::unique_ptr<CompositeMethod> composite_method;  // used if there is one
    Plan plan;
    std::uint32_t limit = 0;                 // nearest layers to keep; 0 = all
    std::vector<View> views;                 // one a sample
    std::optional<DepthComplexity> samples;  // of all views together
    std::optional<DepthComplexity> merged;   // of the layers they merge into
    std::vector<std::uint64_t> clip_rows;    // surfaces of clip meshes a row, of the worst view
    std::vector<std::uint32_t> kept_counts;  // of the whole crop, or empty; one view only
    std::vector<LayeredImage> merged_bands;  // likewise, what several views merge into
    std::vector<std::uint32_t> counts;       // of the band being captured
    LayeredImage image;
    CompositeImage composite;
    CaptureReport report;
    int merging_passes = 0;  // that several views took, over a band

    bool mergesLayers() const { return views.size() > 1 && !settings.composite; }
    bool fitsKept(std::uint64_t bytes) const {
        return bytes <= (settings.memory ? settings.memory / kKeptShare : kKeptBytes);
    }
    void freeBands();
    BandCosts costs() const;
    std::uint64_t clipFragments(const BandCosts& costs, int y) const;
    std::uint64_t rowFragments(int y) const;
    void addSinks(std::span<Sink* const> sinks, BandCosts& costs) const;
    std::vector<Window> bands(std::span<Sink* const> sinks);

    void chooseMethod();
    void chooseViews(const View& view);
    void countClip();
    void countViews();
    void mergeViews();
    void limitLayers();
    void fillPlan();

    std::span<const std::uint32_t> countsOf(const Window& band);
    void captureLayers(const Window& band, std::uint32_t most, LayeredImage& out);
    void compositeView(const Window& band, CompositeImage& out);
    void captureMerged(const Window& band, LayeredImage& out);
    void render(const Window& band, LayeredImage& out);
};

Renderer::Renderer(gl::Context& context, const Scene& scene, SceneContents contents)
    : state_(std::make_unique<State>(context, scene, std::move(contents))) {}

Renderer::~Renderer() = default;

void Renderer::setContents(SceneContents contents) {
    State& s = *state_;
    const bool still = s.contents.deformed.empty() && s.contents.meshes == contents.meshes;
    const bool lit_alike = still && s.contents.lights == contents.lights;
    s.contents = std::move(contents);
    if (!still) timed(s.times, "upload", [&] { s.band_capture.setContents(s.contents); });
    // Shadow maps are worth keeping where only the camera moves.
    if (!lit_alike) s.lighting.contentsChanged();
}

void Renderer::setNextFrame(NextFrame next) {
    state_->next_frame = std::move(next);
    state_->band_capture.setNextFrame(&state_->next_frame);
}

const DrawList& Renderer::drawList() const {
    return state_->band_capture.list();
}

const SceneContents& Renderer::contents() const {
    return state_->contents;
}

StageTimes Renderer::takeTimes() {
    return std::exchange(state_->times, {});
}

void checkSettings(const CaptureSettings& settings) {
    const MethodInfo* method = findPeelMethod(settings.method);
    const std::string where = "--method " + settings.method;
    if (!method)
        throw Error(ErrorKind::kUsage, "there is no method '" + settings.method + "'", where);
    if (!method->exact() && !settings.composite) {
        throw Error(ErrorKind::kUsage,
                    settings.method + " finds no layers: it approximates their composite", where,
                    "add --as composite or write a .png, or choose another method");
    }
    if (!method->exact() && (settings.max_layers != 0 || settings.occlusion_ratio > 0)) {
        throw Error(ErrorKind::kUsage,
                    settings.method + " takes all layers at once and can keep no few", where,
                    "leave --layers and --occlusion-ratio out, or choose another method");
    }
    if (settings.tail == Tail::kBlend && !settings.composite) {
        throw Error(ErrorKind::kUsage, "layers are stored as they are found, never blended",
                    "--tail blend", "add --as composite or write a .png, or leave --tail out");
    }
    if (settings.hits != Hits::kNone && (!method->layers()->takesAll() || settings.composite ||
                                         settings.samples > 1 || settings.max_layers != 0)) {
        throw Error(ErrorKind::kInternal, "all hits of rays are found at once, and as they are",
                    where);
    }
    if (settings.composite && !settings.channels.empty()) {
        throw Error(ErrorKind::kUsage, "a composite that is found on the fly has no channels",
                    "--channels", "leave --channels out, or capture layers");
    }
}

void Renderer::State::chooseMethod() {
    checkSettings(settings);
    method = findPeelMethod(settings.method);
    layer_method = method->exact() ? method->layers() : nullptr;
    composite_method = settings.composite && method->composite ? method->composite() : nullptr;
}

void Renderer::State::chooseViews(const View& view) {
    views.clear();
    if (settings.samples == 1) views.push_back(view);  // at its own sample
    if (settings.samples > 1) {
        for (const glm::dvec2& position : samplePositions(settings.samples)) {
            views.push_back(view);
            views.back().sample = position;
        }
    }
    band_capture.setView(views.front(), settings);
}

/// What earlier bands have left, of this plan or another, is not to be counted twice under a
/// budget: as resident memory and as what the next bands take.
void Renderer::State::freeBands() {
    if (settings.memory == 0) return;
    band_capture.free();
    image = {};
    composite = {};
    if (layer_method) layer_method = method->layers();
    if (composite_method) composite_method = method->composite();
    returnFreeMemory();
}

BandCosts Renderer::State::costs() const {
    const PixelType type = settings.color_type;
    const std::uint64_t color = settings.colorBytes();
    const std::uint64_t tile = band_capture.tilePixels();
    const bool float_color = type == PixelType::kFloat;
    BandCosts costs;
    // Large enough by default that geometry is not drawn many times, small enough to stay warm.
    costs.band_bytes = settings.band_bytes;
    costs.pixel_bytes = kPixelBytes;
    if (!clip_rows.empty()) costs.pixel_bytes += 3 * sizeof(std::uint32_t);
    costs.fixed_bytes = band_capture.tileBytes();
    if (composite_method) {
        // A pixel is a fragment: see rowFragments().
        costs.fixed_bytes += composite_method->tileBytes(tile, float_color);
        costs.fragment_bytes = band_capture.pixelBytes() + 15 * sizeof(float);
        costs.largest_array_bytes = 4 * sizeof(float);
    } else {
        costs.fixed_bytes += layer_method->tileBytes(tile, float_color);
        const std::uint64_t channels = channelBytes(settings.channels, type);
        costs.fragment_bytes = band_capture.fragmentBytes() + sizeof(float) + color + channels;
        // Keys and where fragments were captured.
        if (channels > 0 || settings.hits != Hits::kNone)
            costs.fragment_bytes += 2 * sizeof(std::uint32_t);
        costs.largest_array_bytes = std::max<std::uint64_t>(
            {color, shadedComponents(settings.channels) * sizeof(float), sizeof(float)});
        // All samples are held until they are merged, with their primitives and while sorting.
        if (mergesLayers()) {
            costs.fragment_bytes += color + channels + 16 * sizeof(float);
            costs.pixel_bytes += (views.size() + 1) * sizeof(std::uint32_t);
        }
        // A sample's composite, and what is handed over.
        if (settings.composite)
            costs.pixel_bytes += 2 * (sizeof(std::uint32_t) + 5 * sizeof(float));
    }
    costs.storage_block_bytes =
        static_cast<std::uint64_t>(context.device().limits.shader_storage_block_size);
    return costs;
}

/// As many fragments as take no less room, in memory and in a buffer, than what a row's pixels have
/// of the clip meshes.
std::uint64_t Renderer::State::clipFragments(const BandCosts& costs, int y) const {
    if (clip_rows.empty()) return 0;
    const auto row = static_cast<std::size_t>(y - plan.view.crop.y0);
    const std::uint64_t a_fragment = costs.largest_array_bytes / sizeof(float);
    return (clip_rows[row] + a_fragment - 1) / a_fragment;
}

std::uint64_t Renderer::State::rowFragments(int y) const {
    return composite_method ? static_cast<std::uint64_t>(plan.view.crop.width())
                            : samples->rowFragments(y);
}

/// What the sinks hold besides a band, and of it.
void Renderer::State::addSinks(std::span<Sink* const> sinks, BandCosts& with_sinks) const {
    const std::uint64_t fragment = sizeof(float) + settings.colorBytes() + plan.channel_bytes;
    const auto width = static_cast<std::uint64_t>(plan.view.crop.width());
    for (const Sink* sink : sinks) {
        const SinkMemory memory = sink->memory();
        const std::uint64_t pixels = static_cast<std::uint64_t>(memory.rows) * width;
        std::uint64_t fragments = samples->mostFragments(memory.rows);
        if (limit) fragments = std::min(fragments, pixels * limit);
        if (settings.composite) fragments = pixels;
        const std::uint64_t rows =
            fragments * fragment + pixels * (kPixelBytes + memory.pixel_bytes);
        // Twice: those of the last band and of this one.
        with_sinks.fixed_bytes += 2 * rows + memory.bytes;
        with_sinks.pixel_bytes += memory.pixel_bytes;
    }
}

std::vector<Window> Renderer::State::bands(std::span<Sink* const> sinks) {
    freeBands();
    BandCosts with_sinks = costs();
    addSinks(sinks, with_sinks);
    return cutBands(plan.view.crop, bandLimits(settings.memory, residentBytes(), with_sinks),
                    [&](int y) { return rowFragments(y) + clipFragments(with_sinks, y); });
}

/// Clip meshes have lists of their own in every band, which have to fit, too.
void Renderer::State::countClip() {
    clip_rows.clear();
    if (settings.clip.nodes.empty()) return;
    const Window& crop = plan.view.crop;
    const auto width = static_cast<std::ptrdiff_t>(crop.width());
    clip_rows.resize(static_cast<std::size_t>(crop.height()));
    const BandLimits limits = bandLimits(settings.memory, residentBytes(), costs());
    for (const View& view : views) {
        band_capture.setView(view, settings);
        for (const Window& band : cutBands(crop, limits, [](int) { return 0; })) {
            band_capture.countClip(band, counts);
            for (int y = band.y0; y < band.y1; ++y) {
                const auto first = counts.begin() + (y - band.y0) * width;
                std::uint64_t& most = clip_rows[static_cast<std::size_t>(y - crop.y0)];
                most = std::max(most, std::accumulate(first, first + width, std::uint64_t{0}));
            }
        }
    }
}

/// The count pass of every view.
void Renderer::State::countViews() {
    const Window& crop = plan.view.crop;
    const auto width = static_cast<std::size_t>(crop.width());
    samples.emplace(crop);
    kept_counts = {};
    merged_bands.clear();
    freeBands();
    countClip();
    if (views.size() == 1 && fitsKept(crop.pixels() * sizeof(std::uint32_t)))
        kept_counts.resize(crop.pixels());

    BandCosts counting = costs();
    counting.pixel_bytes = 2 * sizeof(std::uint32_t);
    if (!clip_rows.empty()) counting.pixel_bytes += 3 * sizeof(std::uint32_t);
    const BandLimits limits = bandLimits(settings.memory, residentBytes(), counting);
    for (const View& view : views) {
        band_capture.setView(view, settings);
        // No fragments are stored while counting.
        for (const Window& band :
             cutBands(crop, limits, [&](int y) { return clipFragments(counting, y); })) {
            band_capture.count(band, counts);
            const auto first = static_cast<std::size_t>(band.y0 - crop.y0) * width;
            for (int y = band.y0; y < band.y1; ++y) {
                const auto row = static_cast<std::size_t>(y - band.y0) * width;
                samples->addRow(y, {counts.data() + row, width});
            }
            if (!kept_counts.empty())
                std::copy(counts.begin(), counts.end(),
                          kept_counts.begin() + static_cast<std::ptrdiff_t>(first));
        }
    }
}

/// Only merging tells how many layers several views have together.
void Renderer::State::mergeViews() {
    merged.reset();
    merged_bands.clear();
    merging_passes = report.passes = 0;
    if (!mergesLayers()) return;
    merged.emplace(plan.view.crop);
    const auto width = static_cast<std::size_t>(plan.view.crop.width());
    std::uint64_t kept = 0;
    bool keeps = true;
    std::vector<std::uint32_t> row(width);
    for (const Window& band : bands({})) {
        captureMerged(band, image);
        for (int y = band.y0; y < band.y1; ++y) {
            for (std::size_t x = 0; x < width; ++x)
                row[x] = image.count(static_cast<std::size_t>(y - band.y0) * width + x);
            merged->addRow(y, row);
        }
        merging_passes = std::max(merging_passes, report.passes);
        report.passes = 0;
        kept += bytesOf(image);
        keeps = keeps && fitsKept(kept);
        if (keeps) merged_bands.push_back(image);
    }
    if (!keeps) merged_bands.clear();
}

/// --layers and --occlusion-ratio: the first layer that touches fewer pixels than the ratio is the
/// last one, as if a pass had found it out.
void Renderer::State::limitLayers() {
    limit = settings.max_layers;
    if (!(settings.occlusion_ratio > 0)) return;
    const auto layers = (merged ? *merged : *samples).layers();
    const std::uint64_t views_counted = merged ? 1 : views.size();
    const double enough =
        settings.occlusion_ratio * static_cast<double>(plan.view.crop.pixels() * views_counted);
    const auto few = std::find_if(layers.begin(), layers.end(), [&](const LayerPlan& layer) {
        return static_cast<double>(layer.pixels) < enough;
    });
    if (few == layers.end()) return;
    const auto found = static_cast<std::uint32_t>(few - layers.begin()) + 1;
    limit = limit ? std::min(limit, found) : found;
}

void Renderer::State::fillPlan() {
    const DepthComplexity& complexity = merged ? *merged : *samples;
    plan.color_type = settings.color_type;
    plan.channel_bytes = channelBytes(settings.channels, settings.color_type);
    if (settings.hits != Hits::kNone) plan.channel_bytes += sizeof(std::uint32_t);
    plan.samples = settings.samples;
    plan.layers = complexity.layers(method->exact() ? limit : 0);
    plan.fragments_counted = complexity.counted();
    plan.fragments_stored = 0;
    for (const LayerPlan& layer : plan.layers)
        plan.fragments_stored += layer.pixels;
    if (settings.composite && settings.tail == Tail::kBlend)
        plan.fragments_blended = plan.fragments_counted - plan.fragments_stored;
}

Plan Renderer::plan(const View& view, const CaptureSettings& settings) {
    State& s = *state_;
    s.lighting.castShadows(*this, s.context, settings);  // plans and captures, too
    s.settings = settings;
    s.plan = {};
    s.plan.view = view;
    s.lighting.setView(view.camera_to_world);
    s.band_capture.setLighting(s.lighting);
    s.chooseMethod();
    s.chooseViews(view);
    s.countViews();
    s.mergeViews();
    s.limitLayers();
    s.fillPlan();
    return s.plan;
}

/// The fragments of every pixel of a band of the current view.
std::span<const std::uint32_t> Renderer::State::countsOf(const Window& band) {
    if (kept_counts.empty()) {
        band_capture.count(band, counts);
        return counts;
    }
    const Window& crop = plan.view.crop;
    const auto first =
        static_cast<std::size_t>(band.y0 - crop.y0) * static_cast<std::size_t>(crop.width());
    return std::span(kept_counts).subspan(first, band.pixels());
}

void Renderer::State::captureLayers(const Window& band, std::uint32_t most, LayeredImage& out) {
    report.passes += band_capture.layers(
        *layer_method,
        {.band = band, .counts = countsOf(band), .layers = most, .keys = mergesLayers()}, out);
}

void Renderer::State::compositeView(const Window& band, CompositeImage& out) {
    LayeredImage layers;
    if (composite_method) {
        report.passes += band_capture.composite(*composite_method,
                                                {.band = band,
                                                 .counts = countsOf(band),
                                                 .layers = limit,
                                                 .tail = settings.tail == Tail::kBlend},
                                                out);
        return;
    }
    captureLayers(band, settings.tail == Tail::kBlend ? 0 : limit, layers);
    const StageTimer timer(times, "composite");
    compositeNearest(layers, limit, settings.tail, out);
}

void Renderer::State::captureMerged(const Window& band, LayeredImage& out) {
    std::vector<LayeredImage> images(views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
        band_capture.setView(views[i], settings);
        captureLayers(band, 0, images[i]);
    }
    const StageTimer timer(times, "sort");
    mergeSamples(
        images, [&](std::uint32_t primitive) { return band_capture.surfaceOf(primitive); },
        settings.color_type, out);
}

/// What the sinks get of a band.
void Renderer::State::render(const Window& band, LayeredImage& out) {
    if (!settings.composite) {
        if (mergesLayers())
            captureMerged(band, out);
        else
            captureLayers(band, limit, out);
        if (mergesLayers() && limit) keepNearest(out, limit);
        return;
    }
    CompositeImage sample;
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (views.size() > 1) band_capture.setView(views[i], settings);
        compositeView(band, views.size() > 1 ? sample : composite);
        if (views.size() > 1) addToMean(sample, static_cast<int>(i), settings.samples, composite);
    }
    toSingleLayer(composite, out);
}

CaptureReport Renderer::capture(std::span<Sink* const> sinks, const Progress& progress) {
    State& s = *state_;
    s.report = {};
    std::uint64_t stored = 0;
    int passes = 0;
    const Window& crop = s.plan.view.crop;
    const auto take = [&](LayeredImage& image) {
        stored += image.fragments();
        for (Sink* sink : sinks)
            sink->write(image);
        if (progress) {
            progress(static_cast<double>(image.window.y1 - crop.y0) /
                     static_cast<double>(crop.height()));
        }
        passes = std::max(passes, s.report.passes);
        s.report.passes = 0;
        ++s.report.bands;
    };
    if (!s.merged_bands.empty()) {
        passes = s.merging_passes;
        for (LayeredImage& image : s.merged_bands) {
            if (s.limit) keepNearest(image, s.limit);
            take(image);
        }
    } else {
        for (const Window& band : s.bands(sinks)) {
            s.render(band, s.image);
            take(s.image);
        }
    }
    s.report.passes = passes;
    s.report.largest_correction = s.band_capture.largestCorrection();
    if (!s.settings.composite && stored != s.plan.fragments_stored) {
        throw Error(ErrorKind::kInternal, std::to_string(stored) + " fragments were captured and " +
                                              std::to_string(s.plan.fragments_stored) + " planned");
    }
    return s.report;
}

}  // namespace peeler
