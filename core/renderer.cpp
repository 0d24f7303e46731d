// SPDX-License-Identifier: Apache-2.0
#include "core/renderer.h"

#include <algorithm>
#include <optional>

#include "core/band_buffers.h"
#include "core/bands.h"
#include "core/depth_complexity.h"
#include "core/error.h"
#include "core/gather.h"
#include "core/gpu_scene.h"
#include "core/lighting.h"
#include "core/peel/method.h"
#include "core/scene_rasterizer.h"

namespace peeler {
namespace {

// A pixel of a band costs a slot, an offset here and in the hand-over, and what a sink composites
// into.
constexpr std::uint64_t kPixelBytes = 3 * sizeof(std::uint32_t) + 5 * sizeof(float);

// The counts of the whole picture are kept for the capture if they are no more than this share of
// the budget (or this many bytes without one); otherwise each band is counted again.
constexpr std::uint64_t kKeptCountsShare = 6;
constexpr std::uint64_t kKeptCountsBytes = 256ULL << 20;

}  // namespace

struct Renderer::State {
    State(gl::Context& ctx, const Scene& scene, const SceneContents& contents)
        : context(ctx),
          gpu_scene(timed(times, "upload", [&] { return GpuScene(ctx, scene, contents); })),
          lighting(ctx.functions(), scene, contents),
          rasterizer(ctx, gpu_scene),
          buffers(ctx.functions()) {}

    gl::Context& context;
    StageTimes times;
    GpuScene gpu_scene;
    Lighting lighting;
    SceneRasterizer rasterizer;
    BandBuffers buffers;

    CaptureSettings settings;
    Plan plan;
    std::optional<DepthComplexity> complexity;
    std::vector<std::uint32_t> kept_counts;  // of the whole crop, or empty
    std::vector<std::uint32_t> first;        // of the band being captured
    LayeredImage band_image;

    std::uint64_t largestTilePixels() const {
        std::uint64_t largest = 0;
        for (const auto& tile : rasterizer.tilesOf(plan.view.crop))
            largest = std::max(largest, tile.pixels());
        return largest;
    }
    BandCosts costs(const PeelMethod& method) const;
    std::uint64_t bytesOf(std::span<Sink* const> sinks) const;
    void drawCounts(const Window& band);
    template <class Take>
    void count(const Window& band, Take&& take);
    void prefixSum(const Window& band, std::uint32_t limit);
    std::uint64_t captureBand(PeelMethod& method, const Window& band, CaptureReport& report);
    void checkSlots(const std::uint32_t* slots, const Window& band) const;
};

Renderer::Renderer(gl::Context& context, const Scene& scene, const SceneContents& contents)
    : state_(std::make_unique<State>(context, scene, contents)) {}

Renderer::~Renderer() = default;

const StageTimes& Renderer::times() const {
    return state_->times;
}

BandCosts Renderer::State::costs(const PeelMethod& method) const {
    const PixelType type = settings.color_type;
    const std::uint64_t color = 4 * pixelTypeSize(type);
    const std::uint64_t tile = largestTilePixels();
    BandCosts costs;
    // Large enough by default that geometry is not drawn many times, small enough to stay warm.
    costs.band_bytes = settings.band_bytes;
    costs.fragment_bytes = BandBuffers::fragmentBytes(type) + sizeof(float) + color;
    costs.largest_array_bytes = color;
    costs.pixel_bytes = kPixelBytes;
    costs.fixed_bytes =
        method.tileBytes(tile, type == PixelType::kFloat) + rasterizer.boundBytes(tile);
    costs.storage_block_bytes =
        static_cast<std::uint64_t>(context.device().limits.shader_storage_block_size);
    return costs;
}

/// What the sinks hold besides a band.
std::uint64_t Renderer::State::bytesOf(std::span<Sink* const> sinks) const {
    const std::uint64_t fragment = sizeof(float) + 4 * pixelTypeSize(settings.color_type);
    const auto width = static_cast<std::uint64_t>(plan.view.crop.width());
    std::uint64_t bytes = 0;
    for (const Sink* sink : sinks) {
        const SinkMemory memory = sink->memory();
        const std::uint64_t pixels = static_cast<std::uint64_t>(memory.rows) * width;
        std::uint64_t fragments = complexity->mostFragments(memory.rows);
        if (settings.max_layers) fragments = std::min(fragments, pixels * settings.max_layers);
        const std::uint64_t rows = fragments * fragment + pixels * kPixelBytes;
        bytes += 2 * rows + memory.bytes;  // twice: those of the last band and of this one
    }
    return bytes;
}

/// Draws the count pass of a band into the slots.
void Renderer::State::drawCounts(const Window& band) {
    const auto& gl = context.functions();
    buffers.reserveSlots(band.pixels());
    buffers.slots().clearToZero(band.pixels() * sizeof(std::uint32_t));
    buffers.bind();
    rasterizer.setBand(band, 0);
    for (const Window& tile : rasterizer.tilesOf(band)) {
        rasterizer.setTile(tile);
        const auto framebuffer = gl::makeEmptyFramebuffer(gl, tile.width(), tile.height());
        rasterizer.draw({.fragment_shader = "count.frag", .framebuffer = framebuffer.name()},
                        intersect(tile, band));
    }
    gl::waitForGpu(gl);
    gl::checkErrors(gl, "counting fragments");
}

/// Counts the fragments of a band's pixels and hands the array to `take`.
template <class Take>
void Renderer::State::count(const Window& band, Take&& take) {
    const StageTimer timer(times, "count");
    drawCounts(band);
    const auto mapping = buffers.slots().read(band.pixels() * sizeof(std::uint32_t));
    take(mapping.as<const std::uint32_t>());
}

Plan Renderer::plan(const View& view, const CaptureSettings& settings) {
    State& s = *state_;
    const MethodInfo* method = findPeelMethod(settings.method);
    if (!method)
        throw Error(ErrorKind::kUsage, "there is no method '" + settings.method + "'", "--method");
    s.lighting.castShadows(*this, s.context, settings);  // plans and captures, too
    s.settings = settings;
    s.plan = {};
    s.plan.view = view;
    s.plan.color_type = settings.color_type;
    s.lighting.setView(view.camera_to_world);
    s.rasterizer.setLighting(s.lighting);
    s.rasterizer.setView(view, settings);
    const Window& crop = view.crop;
    s.complexity.emplace(crop, settings.max_layers);

    const std::uint64_t counts_bytes = crop.pixels() * sizeof(std::uint32_t);
    const bool keep =
        counts_bytes <= (settings.memory ? settings.memory / kKeptCountsShare : kKeptCountsBytes);
    s.kept_counts.clear();
    if (keep) s.kept_counts.resize(crop.pixels());

    BandCosts costs = s.costs(*method->create());
    costs.pixel_bytes = sizeof(std::uint32_t);
    BandLimits limits = bandLimits(settings.memory, residentBytes(), costs);
    limits.fragments = 1;  // none are stored while counting
    const auto width = static_cast<std::size_t>(crop.width());
    for (const Window& band : cutBands(crop, limits, [](int) { return 0; })) {
        s.count(band, [&](const std::uint32_t* counts) {
            for (int y = band.y0; y < band.y1; ++y) {
                const auto row = static_cast<std::size_t>(y - band.y0) * width;
                s.complexity->addRow(y, {counts + row, width});
            }
            if (keep) {
                std::copy_n(
                    counts, band.pixels(),
                    s.kept_counts.data() + static_cast<std::size_t>(band.y0 - crop.y0) * width);
            }
        });
    }
    s.plan.layers = s.complexity->layers();
    s.plan.fragments_counted = s.complexity->counted();
    s.plan.fragments_stored = s.complexity->stored();
    return s.plan;
}

/// Fills `first`: where each pixel's list begins in the band's buffers, and the end of the last.
void Renderer::State::prefixSum(const Window& band, std::uint32_t limit) {
    first.resize(band.pixels() + 1);
    const auto sum = [&](const std::uint32_t* counts) {
        first[0] = 0;
        for (std::size_t p = 0; p < band.pixels(); ++p)
            first[p + 1] = first[p] + (limit ? std::min(counts[p], limit) : counts[p]);
    };
    const Window& crop = plan.view.crop;
    if (kept_counts.empty())
        count(band, sum);
    else
        sum(kept_counts.data() +
            static_cast<std::size_t>(band.y0 - crop.y0) * static_cast<std::size_t>(crop.width()));
}

/// The completeness certificate: the capture advanced every pixel's slot exactly to the next
/// pixel's list.
void Renderer::State::checkSlots(const std::uint32_t* slots, const Window& band) const {
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        if (slots[p] == first[p + 1]) continue;
        const auto width = static_cast<std::size_t>(band.width());
        const std::string pixel = std::to_string(band.x0 + static_cast<int>(p % width)) + ", " +
                                  std::to_string(band.y0 + static_cast<int>(p / width));
        throw Error(ErrorKind::kInternal,
                    "method " + settings.method + " captured " +
                        std::to_string(slots[p] - first[p]) + " fragments where " +
                        std::to_string(first[p + 1] - first[p]) + " were counted",
                    "pixel " + pixel, "please report this with the scene and the GL renderer");
    }
}

/// Captures one band into band_image; returns the fragments captured.
std::uint64_t Renderer::State::captureBand(PeelMethod& method, const Window& band,
                                           CaptureReport& report) {
    const auto& gl = context.functions();
    prefixSum(band, method.takesAll() ? 0 : settings.max_layers);
    const std::size_t pixels = band.pixels(), fragments = first[pixels];
    {
        const StageTimer timer(times, "capture");
        buffers.reserveSlots(pixels);
        buffers.reserveFragments(fragments, settings.color_type);
        {
            const auto mapping = buffers.slots().overwrite(pixels * sizeof(std::uint32_t));
            std::copy_n(first.begin(), pixels, mapping.as<std::uint32_t>());
        }
        buffers.bind();
        rasterizer.setBand(band, static_cast<std::uint32_t>(fragments));
        int passes = 0;
        for (const Window& tile : rasterizer.tilesOf(band)) {
            const Window area = intersect(tile, band);
            std::uint32_t layers = 0;
            for (int y = area.y0; y < area.y1; ++y) {
                const auto row =
                    static_cast<std::size_t>(y - band.y0) * static_cast<std::size_t>(band.width());
                for (int x = area.x0; x < area.x1; ++x) {
                    const auto p = row + static_cast<std::size_t>(x - band.x0);
                    layers = std::max(layers, first[p + 1] - first[p]);
                }
            }
            if (layers == 0) continue;
            rasterizer.setTile(tile);
            passes += method.capture(rasterizer, area, layers);
        }
        report.passes = std::max(report.passes, passes);
        gl::waitForGpu(gl);
        gl::checkErrors(gl, "capturing fragments");
    }
    const StageTimer timer(times, "sort");
    {
        const auto slots = buffers.slots().read(pixels * sizeof(std::uint32_t));
        checkSlots(slots.as<const std::uint32_t>(), band);
    }
    const auto depths = buffers.depths().read(fragments * sizeof(float));
    const auto primitives = buffers.primitives().read(fragments * sizeof(std::uint32_t));
    const auto colors = buffers.colors().read(fragments * 4 * pixelTypeSize(settings.color_type));
    band_image.window = band;
    band_image.color.channels = {"R", "G", "B", "A"};
    band_image.color.type = settings.color_type;
    gather({first, depths.as<const float>(), primitives.as<const std::uint32_t>(),
            colors.as<const void>()},
           plan.view.projection, settings.max_layers, band_image);
    return fragments;
}

CaptureReport Renderer::capture(std::span<Sink* const> sinks, const Progress& progress) {
    State& s = *state_;
    CaptureReport report;
    const auto method = findPeelMethod(s.settings.method)->create();
    BandCosts costs = s.costs(*method);
    costs.fixed_bytes += s.bytesOf(sinks);
    const BandLimits limits = bandLimits(s.settings.memory, residentBytes(), costs);
    const auto bands =
        cutBands(s.plan.view.crop, limits, [&](int y) { return s.complexity->rowFragments(y); });
    std::uint64_t stored = 0;
    for (const Window& band : bands) {
        report.fragments_captured += s.captureBand(*method, band, report);
        stored += s.band_image.fragments();
        for (Sink* sink : sinks)
            sink->write(s.band_image);
        if (progress) {
            progress(static_cast<double>(band.y1 - s.plan.view.crop.y0) /
                     static_cast<double>(s.plan.view.crop.height()));
        }
    }
    report.bands = static_cast<int>(bands.size());
    if (stored != s.plan.fragments_stored) {
        throw Error(ErrorKind::kInternal, std::to_string(stored) + " fragments were captured and " +
                                              std::to_string(s.plan.fragments_stored) + " planned");
    }
    return report;
}

}  // namespace peeler
