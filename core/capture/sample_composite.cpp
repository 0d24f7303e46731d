// SPDX-License-Identifier: Apache-2.0
#include "core/capture/sample_composite.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <string>
#include <utility>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/base/stage_times.h"
#include "core/fragments/supersampling.h"
#include "core/image/channels.h"
#include "core/image/composite.h"
#include "core/image/stored_colors.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

// The number of pixels whose samples are read at once.
constexpr std::uint64_t kPixelsRead = 1 << 18;

/// Returns the window of the first rows of `rows`: at least one, and at most kPixelsRead pixels.
Window rowsRead(const Window& rows) {
    const auto width = static_cast<std::uint64_t>(rows.width());
    const auto height = static_cast<int>(std::max<std::uint64_t>(kPixelsRead / width, 1));
    return {rows.x0, rows.y0, rows.x1, std::min(rows.y0 + height, rows.y1)};
}

}  // namespace

/// Some rows of a part of a raster tile.
struct SampleComposite::Rows {
    Window window;
    Window part;                ///< the part of the tile whose lists are captured
    const SampleKeys* keys;     ///< by pixel
    const float* depths;        ///< by pixel: the nearest, reversed Z; 0 = none
    const std::size_t* places;  ///< by row: index of the first place; then the end

    std::size_t width() const { return static_cast<std::size_t>(window.width()); }
    std::size_t height() const { return static_cast<std::size_t>(window.height()); }
    std::size_t pixels() const { return window.pixels(); }
    std::size_t firstPlace(std::size_t row) const { return places[row] - places[0]; }
};

SampleComposite::SampleComposite(const gl::Context& context, PosedScene posed,
                                 SceneRasterizer& rasterizer, BandBuffers& buffers,
                                 const PassContext& pass_context, StageTimes& times)
    : context_(context),
      posed_(std::move(posed)),
      rasterizer_(rasterizer),
      buffers_(buffers),
      pass_context_(pass_context),
      times_(times),
      shader_(context, posed_, rasterizer, pass_context),
      blends_(!std::ranges::all_of(posed_.drawList().draws(), &Draw::opaque)) {}

std::uint64_t SampleComposite::bytes(std::uint64_t tile_pixels) {
    // The keys, depths and counts of samples; places; the mean and a sample with coloured opacity;
    // what is behind the lists.
    constexpr std::uint64_t kPixel = sizeof(SampleKeys) + sizeof(float) +
                                     kPixelSamples * sizeof(std::uint32_t) + 16 * sizeof(float) +
                                     8 * sizeof(std::uint32_t);
    return SampleTarget::bytes(tile_pixels) + HitShader::bytes() +
           HitShader::kAtOnce * sizeof(PixelPlace) + kPixelsRead * kPixel;
}

void SampleComposite::free() {
    target_.free();
    keys_ = {};
    depths_ = {};
    in_front_ = first_ = behind_ = counts_ = {};
    places_ = {};
    hits_ = {};
    colors_ = {};
    mean_ = sample_ = listed_ = {};
}

int SampleComposite::captureOpaque(const Window& tile, const Window& area) {
    const StageTimer timer(times_, "capture");
    target_.reserve(gl(), tile);
    gl::clear(gl(), rasterizer_.passState(target_.framebuffer(), area));
    if (std::ranges::none_of(posed_.drawList().draws(), &Draw::opaque)) return 0;
    rasterizer_.draw({.fragment_shader = "opaque_key.frag",
                      .draws = Draws::kOpaque,
                      .bounded = false,
                      .multisampled = true,
                      .framebuffer = target_.framebuffer(),
                      .depth_test = gl::DepthTest::kNearest},
                     area);
    gl::checkErrors(gl(), "capturing opaque triangles");
    return 1;
}

/// Draws the transparent fragments of all samples of `part` that are in front of opaque triangles.
void SampleComposite::drawIntoLists(GeometryPass pass, const Window& part) {
    const gl::Framebuffer framebuffer = gl::makeFramebuffer(gl(), {}, target_.depth());
    buffers_.bindForLayers();
    rasterizer_.setBand(part);
    target_.bindForReading(gl());
    pass = pass.inFront();
    pass.multisampled = true;
    pass.framebuffer = framebuffer.name();
    rasterizer_.draw(pass, part);
    gl::waitForGpu(gl());
    gl::checkErrors(gl(), "listing the fragments of samples");
}

void SampleComposite::countInFront(const Window& area) {
    const StageTimer timer(times_, "count");
    in_front_.resize(kPixelSamples * area.pixels());
    const std::size_t bytes = in_front_.size() * sizeof(std::uint32_t);
    buffers_.reserveListHeads(in_front_.size());
    buffers_.listHeads().clearToZero(bytes);
    drawIntoLists({.fragment_shader = "count.frag"}, area);
    const auto counts = buffers_.listHeads().read(bytes);
    std::copy_n(counts.as<const std::uint32_t>(), in_front_.size(), in_front_.begin());
}

/// Captures the lists of transparent fragments of `part`. Without any, `first_` is empty
/// afterwards.
void SampleComposite::listInFront(const Window& part, const Window& area) {
    const StageTimer timer(times_, "capture");
    const std::size_t above =
        static_cast<std::size_t>(part.y0 - area.y0) * static_cast<std::size_t>(area.width());
    first_.assign(1, 0);
    for (std::size_t sample = 0; sample < kPixelSamples; ++sample) {
        const auto counts =
            std::span(in_front_).subspan(sample * area.pixels() + above, part.pixels());
        for (const std::uint32_t count : counts)
            first_.push_back(first_.back() + count);
    }
    if (first_.back() == 0) return first_.clear();
    const std::size_t lists = first_.size() - 1, bytes = lists * sizeof(std::uint32_t);
    buffers_.reserveListHeads(lists);
    buffers_.reserveFragments(first_.back() * fragmentWords());
    {
        const auto heads = buffers_.listHeads().overwrite(bytes);
        std::copy_n(first_.begin(), lists, heads.as<std::uint32_t>());
    }
    drawIntoLists({.fragment_shader = "a_buffer.frag", .shades = true}, part);
    const auto heads = buffers_.listHeads().read(bytes);
    if (!std::equal(first_.begin() + 1, first_.end(), heads.as<const std::uint32_t>()))
        throw Error(ErrorKind::kInternal, "other fragments of samples were captured than counted",
                    "", "please report this with the scene and the GL renderer");
}

std::size_t SampleComposite::fragmentWords() const {
    return BandBuffers::fragmentWords(pass_context_.settings.storedColorBytes());
}

int SampleComposite::composite(const Window& tile, const Window& area, const BandLimits& limits,
                               const TakeVisible& take) {
    rasterizer_.setBand(area);
    rasterizer_.setTile(tile);
    int passes = captureOpaque(tile, area);
    const auto takeAll = [&](const Window& part) {
        for (Window rows = rowsRead(part); !rows.empty();
             rows = rowsRead({part.x0, rows.y1, part.x1, part.y1}))
            readRows(rows, part, take);
    };
    first_.clear();
    if (!blends_) {
        takeAll(area);
        return passes;
    }
    countInFront(area);
    const auto width = static_cast<std::size_t>(area.width());
    const auto listed = [&](int y) {
        std::uint64_t fragments = 0;
        for (std::size_t sample = 0; sample < kPixelSamples; ++sample) {
            const std::size_t row =
                sample * area.pixels() + static_cast<std::size_t>(y - area.y0) * width;
            for (std::size_t x = 0; x < width; ++x)
                fragments += in_front_[row + x];
        }
        return fragments;
    };
    int lists = 0;
    for (const Window& part : cutBands(area, limits, listed)) {
        listInFront(part, area);
        if (!first_.empty()) lists = 1;
        takeAll(part);
    }
    return passes + lists;
}

void SampleComposite::count(const Window& tile, const Window& area, const TakeCounts& take) {
    rasterizer_.setBand(area);
    rasterizer_.setTile(tile);
    captureOpaque(tile, area);
    if (blends_) countInFront(area);
    std::vector<std::uint32_t> counts;
    for (Window rows = rowsRead(area); !rows.empty();
         rows = rowsRead({area.x0, rows.y1, area.x1, area.y1})) {
        readSamples(rows);
        const StageTimer timer(times_, "count");
        const auto keys = keys_.read(rows.pixels() * sizeof(SampleKeys));
        const auto above =
            static_cast<std::size_t>(rows.y0 - area.y0) * static_cast<std::size_t>(area.width());
        for (std::size_t sample = 0; sample < kPixelSamples; ++sample) {
            counts.assign(rows.pixels(), 0);
            if (blends_)
                std::copy_n(&in_front_[sample * area.pixels() + above], counts.size(),
                            counts.begin());
            for (std::size_t pixel = 0; pixel < counts.size(); ++pixel)
                counts[pixel] += keys.as<const SampleKeys>()[pixel][sample] != 0 ? 1 : 0;
            take(rows, counts);
        }
    }
}

/// Reads the samples of `rows` into `keys_` and `depths_`.
void SampleComposite::readSamples(const Window& rows) {
    const StageTimer timer(times_, "capture");
    gl::reserve(gl(), keys_, rows.pixels() * sizeof(SampleKeys));
    gl::reserve(gl(), depths_, rows.pixels() * sizeof(float));
    keys_.bindStorage(PEELER_SAMPLE_KEYS);
    depths_.bindStorage(PEELER_SAMPLE_DEPTHS);
    target_.bindForReading(gl());
    rasterizer_.compute("sample_keys.comp", "", rows);
    gl::waitForGpu(gl());
    gl::checkErrors(gl(), "reading samples");
}

/// Reads the samples of `rows`, and composites as many rows at once as have kAtOnce places.
void SampleComposite::readRows(const Window& rows, const Window& part, const TakeVisible& take) {
    const auto width = static_cast<std::size_t>(rows.width());
    const auto height = static_cast<std::size_t>(rows.height());
    readSamples(rows);
    const auto keys = keys_.read(rows.pixels() * sizeof(SampleKeys));
    const auto depths = depths_.read(rows.pixels() * sizeof(float));
    const auto* const key = keys.as<const SampleKeys>();
    std::vector<std::size_t> places(height + 1);
    parallelFor(height, [&](std::size_t row) {
        for (const SampleKeys& pixel : std::span(key + row * width, width))
            places[row + 1] += numberOfPlaces(pixel);
    });
    for (std::size_t row = 0; row < height; ++row)
        places[row + 1] += places[row];
    for (std::size_t row = 0, end = 0; row < height; row = end) {
        while (end < height && (end == row || places[end + 1] - places[row] <= HitShader::kAtOnce))
            ++end;
        const int y0 = rows.y0 + static_cast<int>(row), y1 = rows.y0 + static_cast<int>(end);
        takeRows({.window = {rows.x0, y0, rows.x1, y1},
                  .part = part,
                  .keys = key + row * width,
                  .depths = depths.as<const float>() + row * width,
                  .places = places.data() + row},
                 take);
    }
}

void SampleComposite::takeRows(const Rows& rows, const TakeVisible& take) {
    shadePlaces(rows);
    {
        const StageTimer timer(times_, "composite");
        averagePlaces(rows);
        if (!first_.empty()) addLists(rows);
    }
    take(mean_, counts_);
}

/// Shades each place at the centroid of its samples.
void SampleComposite::shadePlaces(const Rows& rows) {
    const StageTimer timer(times_, "capture");
    const glm::dvec2 shift = pass_context_.view.sample - 0.5;
    std::array<glm::dvec2, 1 << kPixelSamples> centroids;
    for (std::uint32_t samples = 1; samples < centroids.size(); ++samples)
        centroids[samples] = shift + centroid(samples, target_.positions());
    places_.resize(rows.firstPlace(rows.height()));
    hits_.resize(places_.size());
    parallelFor(rows.height(), [&](std::size_t row) {
        std::size_t to = rows.firstPlace(row);
        for (std::size_t x = 0; x < rows.width(); ++x) {
            const std::size_t pixel = row * rows.width() + x;
            const glm::ivec2 at(rows.window.x0 + static_cast<int>(x),
                                rows.window.y0 + static_cast<int>(row));
            forEachPlace(rows.keys[pixel], [&](std::uint32_t key, std::uint32_t samples) {
                places_[to] = {static_cast<std::uint32_t>(pixel), samples};
                hits_[to++] = {at, centroids[samples], samples, key};
            });
        }
    });
    colors_.channels = colorNames(false);
    colors_.type = pass_context_.settings.color_type;
    resizeAnew(colors_.data, hits_.size() * colors_.stride());
    shader_.shade(hits_, colors_.data, colors_.stride(), &target_.positions());
}

/// Sets `mean_` to the mean of the opaque samples, and `counts_` to their number.
void SampleComposite::averagePlaces(const Rows& rows) {
    const bool tinted = pass_context_.settings.tinted;
    const Projection& projection = pass_context_.view.projection;
    constexpr float kWeight = 1.0F / kPixelSamples;
    beginMean(rows.window, mean_, tinted);
    counts_.resize(kPixelSamples * rows.pixels());
    parallelFor(rows.height(), [&](std::size_t row) {
        for (std::size_t i = rows.firstPlace(row); i < rows.firstPlace(row + 1); ++i) {
            const auto& [pixel, samples] = places_[i];
            const auto color = loadColor<std::array<float, 4>>(colors_, i);
            const float weight = kWeight * static_cast<float>(std::popcount(samples));
            for (std::size_t c = 0; c < 4; ++c)
                mean_.rgba[pixel][c] += weight * color[c];
            for (std::size_t c = 0; c < 3 && tinted; ++c)
                mean_.opacity[pixel][c] += weight * color[3];
        }
        for (std::size_t pixel = row * rows.width(); pixel < (row + 1) * rows.width(); ++pixel) {
            for (std::size_t sample = 0; sample < kPixelSamples; ++sample)
                counts_[sample * rows.pixels() + pixel] = rows.keys[pixel][sample] != 0 ? 1 : 0;
            if (rows.depths[pixel] != 0)
                mean_.z[pixel] =
                    static_cast<float>(projection.linearZ(static_cast<double>(rows.depths[pixel])));
        }
    });
}

/// Replaces the rows of `mean_` that have lists by the mean of all samples' composites.
void SampleComposite::addLists(const Rows& rows) {
    const std::size_t width = rows.width(), lists = rows.part.pixels();
    const auto firstOf = [&](std::size_t sample, int y) {
        return sample * lists + static_cast<std::size_t>(y - rows.part.y0) * width;
    };
    const auto hasLists = [&](int y) {
        for (std::size_t sample = 0; sample < kPixelSamples; ++sample)
            if (first_[firstOf(sample, y)] != first_[firstOf(sample, y) + width]) return true;
        return false;
    };
    Window window = rows.window;
    while (window.y0 < rows.window.y1 && !hasLists(window.y0))
        ++window.y0;
    while (window.y1 > window.y0 && !hasLists(window.y1 - 1))
        --window.y1;
    if (window.empty()) return;

    const CaptureSettings& settings = pass_context_.settings;
    const bool floats = settings.color_type == PixelType::kFloat;
    constexpr std::size_t kWords = OpaqueFragments::kWords;
    const auto fragments =
        buffers_.fragments().read(first_.back() * fragmentWords() * sizeof(std::uint32_t));
    const std::size_t above =
        static_cast<std::size_t>(window.y0 - rows.window.y0) * width;  // pixels above `window`
    beginMean(window, listed_, settings.tinted);
    for (std::size_t sample = 0; sample < kPixelSamples; ++sample) {
        behind_.assign((floats ? 2 : 1) * kWords * window.pixels(), 0);
        for (std::size_t i = 0; i < places_.size(); ++i) {
            const PixelPlace& place = places_[i];
            if ((place.samples >> sample & 1U) == 0 || place.pixel < above ||
                place.pixel >= above + window.pixels())
                continue;
            // The rows of OpaqueFragments go up.
            const std::size_t row = (place.pixel - above) / width;
            const std::size_t up = static_cast<std::size_t>(window.height()) - 1 - row;
            const std::size_t to = kWords * (up * width + place.pixel % width);
            std::memcpy(&behind_[to], &rows.depths[place.pixel], sizeof(float));
            std::memcpy(&behind_[floats ? kWords * window.pixels() + to : to + 2],
                        colors_.data.data() + i * colors_.stride(), colors_.stride());
        }
        const std::size_t top = kWords * (window.pixels() - width);
        OpaqueFragments behind{.fragments = behind_.data() + top};
        if (floats) behind.colors = behind.fragments + kWords * window.pixels();
        const CapturedFragments captured{
            std::span(first_).subspan(firstOf(sample, window.y0), window.pixels() + 1),
            fragments.as<const std::uint32_t>(), fragmentWords()};
        for (std::size_t pixel = 0; pixel < window.pixels(); ++pixel)
            counts_[sample * rows.pixels() + above + pixel] +=
                captured.first[pixel + 1] - captured.first[pixel];
        sample_.window = window;
        depthSortComposite(captured, pass_context_.view.projection, 0, Tail::kDrop,
                           {colorNames(settings.tinted), settings.color_type, {}}, sample_,
                           &behind);
        addToMean(sample_, kPixelSamples, listed_);
    }
    const auto to = static_cast<std::ptrdiff_t>(above);
    std::ranges::copy(listed_.rgba, mean_.rgba.begin() + to);
    std::ranges::copy(listed_.z, mean_.z.begin() + to);
    if (settings.tinted) std::ranges::copy(listed_.opacity, mean_.opacity.begin() + to);
}

}  // namespace peeler
