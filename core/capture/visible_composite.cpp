// SPDX-License-Identifier: Apache-2.0
// Composites without hidden fragments: first opaque surfaces with a depth test, then the
// transparent fragments in front of them.
#include <algorithm>
#include <numeric>

#include "core/base/stage_times.h"
#include "core/capture/band_capture.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

// The number of pixels that are composited and passed on at once. It is small enough for their
// memory to stay in the caches, since touching fresh memory costs more than compositing into it.
constexpr std::uint64_t kPixelsAtOnce = 1 << 18;

}  // namespace

std::uint64_t BandCapture::opaqueBytes() const {
    const CaptureSettings& settings = pass_context_.settings;
    // The opaque fragments and the composite of some rows, in the capture and as they are passed
    // on.
    const std::uint64_t row_pixel =
        OpaqueTarget::words(settings.color_type) * sizeof(std::uint32_t) +
        2 * (sizeof(std::uint32_t) + (settings.tinted ? 8 : 5) * sizeof(float));
    return OpaqueTarget::bytes(tilePixels(), settings.color_type) + kPixelsAtOnce * row_pixel;
}

gl::Framebuffer BandCapture::framebufferInFront() const {
    std::vector<GLuint> list_heads;
    if (ListHeadTarget::supported(gl_->context))
        list_heads.push_back(gl_->list_head_target.texture());
    return gl::makeFramebuffer(gl(), list_heads, gl_->opaque.depth());
}

int BandCapture::captureOpaque(const Window& tile, const Window& area) {
    const StageTimer timer(times_, "capture");
    const auto gpu = gl_->timer.span("gpuCapture");
    const auto& draws = posed_->drawList().draws();
    gl_->opaque.reserve(gl(), tile, pass_context_.settings.color_type);
    gl::clear(gl(), gl_->rasterizer.passState(gl_->opaque.framebuffer(), area));
    const bool any = std::ranges::any_of(draws, &Draw::opaque);
    if (any) {
        gl_->rasterizer.draw({.fragment_shader = "opaque.frag",
                              .shades = true,
                              .draws = Draws::kOpaque,
                              .bounded = false,
                              .framebuffer = gl_->opaque.framebuffer(),
                              .depth_test = gl::DepthTest::kNearest},
                             area);
    }
    gl::checkErrors(gl(), "capturing opaque fragments");
    return any ? 1 : 0;
}

void BandCapture::countInFront(const Window& tile, const Window& area,
                               std::vector<std::uint32_t>& counts) {
    const StageTimer timer(times_, "count");
    const auto gpu = gl_->timer.span("gpuCount");
    counts.resize(area.pixels());
    const bool target = ListHeadTarget::supported(gl_->context);
    if (target) {
        gl_->list_head_target.write(gl(), tile, area, area, {});
    } else {
        gl_->buffers.reserveListHeads(area.pixels());
        gl_->buffers.listHeads().clearToZero(area.pixels() * sizeof(std::uint32_t));
        gl_->buffers.bindForLayers();
    }
    const gl::Framebuffer framebuffer = framebufferInFront();
    gl_->opaque.bindForReading(gl());
    GeometryPass pass{.fragment_shader = "count.frag", .framebuffer = framebuffer.name()};
    if (target) pass.definitions = kFetchedListHeads;
    gl_->rasterizer.draw(pass.inFront(), area);
    if (target) {
        gl_->list_head_target.read(gl(), tile, area, area, counts);
    } else {
        gl::waitForGpu(gl());
        const auto list_heads =
            gl_->buffers.listHeads().read(area.pixels() * sizeof(std::uint32_t));
        std::copy_n(list_heads.as<const std::uint32_t>(), area.pixels(), counts.begin());
    }
    gl::checkErrors(gl(), "counting fragments");
}

void BandCapture::takeVisible(const Window& tile, const Window& rows,
                              const CapturedFragments& captured, const TakeVisible& take) {
    constexpr std::size_t kWords = OpaqueFragments::kWords;
    const auto width = static_cast<std::size_t>(rows.width());
    const auto height = static_cast<std::size_t>(rows.height());
    {
        const StageTimer timer(times_, "capture");
        gl_->opaque.read(gl(), tile, rows, opaque_pixels_);
    }
    visible_counts_.resize(rows.pixels());
    {
        const StageTimer timer(times_, "composite");
        OpaqueFragments behind{.fragments = opaque_pixels_.data() + (height - 1) * width * kWords};
        if (pass_context_.settings.color_type == PixelType::kFloat)
            behind.colors = behind.fragments + rows.pixels() * kWords;
        for (std::size_t row = 0; row < height; ++row) {
            const std::size_t first = row * width;
            const std::uint32_t* const opaque = behind.fragments - first * kWords;
            for (std::size_t x = 0; x < width; ++x) {
                const std::uint32_t listed =
                    captured.first[first + x + 1] - captured.first[first + x];
                visible_counts_[first + x] = listed + (opaque[x * kWords] != 0 ? 1 : 0);
            }
        }
        visible_.window = rows;
        depthSortComposite(
            captured, pass_context_.view.projection, 0, Tail::kDrop,
            {colorNames(pass_context_.settings.tinted), pass_context_.settings.color_type, {}},
            visible_, &behind);
    }
    take(visible_, visible_counts_);
}

int BandCapture::compositeVisible(LayerMethod& method, const Window& band, const BandLimits& limits,
                                  const TakeVisible& take) {
    const bool blends = !std::ranges::all_of(posed_->drawList().draws(), &Draw::opaque);
    std::vector<std::uint32_t> in_front;
    int passes = 0;
    forEachTile(band, [&](const Window& tile, const Window& area) {
        gl_->rasterizer.setBand(area);
        gl_->rasterizer.setTile(tile);
        passes += captureOpaque(tile, area);
        if (blends) countInFront(tile, area, in_front);
        const auto width = static_cast<std::uint64_t>(area.width());
        const auto rowsBelow = [&](const Window& rows, int y) {
            const auto step = static_cast<int>(std::max<std::uint64_t>(kPixelsAtOnce / width, 1));
            return Window{rows.x0, y, rows.x1, std::min(y + step, rows.y1)};
        };
        const auto pixelsAbove = [&](const Window& rows, int y) {
            return static_cast<std::size_t>(width) * static_cast<std::size_t>(y - rows.y0);
        };
        if (!blends) {
            const std::vector<std::uint32_t> none(rowsBelow(area, area.y0).pixels() + 1);
            for (Window rows = rowsBelow(area, area.y0); !rows.empty();
                 rows = rowsBelow(area, rows.y1))
                takeVisible(tile, rows, {.first = none}, take);
            return;
        }
        const auto listed = [&](int y) {
            const auto first = in_front.begin() + static_cast<std::ptrdiff_t>(pixelsAbove(area, y));
            return std::accumulate(first, first + area.width(), std::uint64_t{0});
        };
        int most = 0;
        for (const Window& part : cutBands(area, limits, listed)) {
            const std::span<const std::uint32_t> counts =
                std::span(in_front).subspan(pixelsAbove(area, part.y0), part.pixels());
            gl_->opaque.bindForReading(gl());
            most = std::max(
                most, fillLists(method, {.band = part, .counts = counts, .in_front = true}, 0));
            const auto takeRows = [&](CapturedFragments captured) {
                for (Window rows = rowsBelow(part, part.y0); !rows.empty();
                     rows = rowsBelow(part, rows.y1)) {
                    captured.first = std::span<const std::uint32_t>(lists_.first)
                                         .subspan(pixelsAbove(part, rows.y0), rows.pixels() + 1);
                    takeVisible(tile, rows, captured, take);
                }
            };
            if (lists_.first.back() == 0) {
                takeRows({});
            } else {
                const auto stored = readFragments(lists_);
                takeRows(capturedIn(lists_, stored.as<const std::uint32_t>()));
            }
        }
        passes += most;
    });
    return passes;
}

bool BandCapture::takesSamples(std::span<const glm::dvec2> positions) const {
    const auto triangles = [](const Draw& draw) { return (draw.flags & PEELER_IS_TRIANGLES) != 0; };
    return std::ranges::all_of(posed_->drawList().draws(), triangles) &&
           SampleTarget::supported(gl(), positions);
}

SampleComposite& BandCapture::sampleComposite() {
    if (!gl_->samples)
        gl_->samples.emplace(gl_->context, *posed_, gl_->rasterizer, gl_->buffers, pass_context_,
                             times_);
    return *gl_->samples;
}

int BandCapture::compositeSamples(const Window& band, const BandLimits& limits,
                                  const TakeVisible& take) {
    const auto gpu = gl_->timer.span("gpuCapture");
    int passes = 0;
    forEachTile(band, [&](const Window& tile, const Window& area) {
        passes += sampleComposite().composite(tile, area, limits, take);
    });
    return passes;
}

void BandCapture::countVisibleSamples(const Window& band, const TakeCounts& take) {
    const auto gpu = gl_->timer.span("gpuCount");
    forEachTile(band, [&](const Window& tile, const Window& area) {
        sampleComposite().count(tile, area, take);
    });
}

}  // namespace peeler
