// SPDX-License-Identifier: Apache-2.0
// One band of one view through the GPU: counted, captured or composited.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/stage_times.h>
#include <peeler/view.h>
#include "core/capture/band_buffers.h"
#include "core/capture/gpu_scene.h"
#include "core/capture/method.h"
#include "core/capture/pass_context.h"
#include "core/capture/scene_rasterizer.h"
#include "core/fragments/bands.h"
#include "core/fragments/depth_sort.h"
#include "core/fragments/surface_channels.h"
#include "core/gl/gpu_timer.h"

namespace peeler {

/// How much of every pixel a band shall show.
struct BandRequest {
    Window band;
    std::span<const std::uint32_t> counts;  ///< of the band's pixels, as count() found them
    std::uint32_t layers = 0;               ///< the nearest to keep; 0 = all
    /// Layers: with their draw-order keys as the first extra array; hits always have them.
    bool keys = false;
    /// Only what is transparent and in front of the fragments of the OpaqueTarget.
    bool in_front = false;
};

/// The lists of a band, as they come from the GPU: in its buffers, or on the way from there.
struct BandLists {
    Window band;
    std::uint32_t layers = 0;          ///< as BandRequest has it
    bool keys = false;                 ///< likewise
    bool channels = false;             ///< whether channels.frag has run
    int passes = 0;                    ///< geometry passes until now
    std::vector<std::uint32_t> first;  ///< where pixels' lists begin, pixels + 1 entries
    // Copies that are made while the GPU goes on with another band.
    gl::ReadBack copied_heads, copied_fragments, copied_channels;
    gl::Fence copied;
};

/// Takes a part of a band's composite, and how many fragments every pixel of it shows.
using TakeVisible = std::function<void(const CompositeImage&, std::span<const std::uint32_t>)>;

/// Owns the uploaded scene and the buffers. "count", "capture" and "sort" are added to the times.
class BandCapture {
  public:
    /// Throws like GpuScene. The pass context and the times must outlive it.
    BandCapture(gl::Context& context, const PosedScene& posed, const PassContext& pass_context,
                StageTimes& times);

    /// Shows the same scene in another pose, from the next begin() on.
    void setPose(const PosedScene& posed);
    /// What motion is measured against; must outlive its use. None: nothing moves.
    void setNextFrame(const NextFrame* next) { next_frame_ = next; }

    /// Takes the pass context as it is now.
    void begin();

    /// The fragments of every pixel of the band. Overwrites `counts`.
    void count(const Window& band, std::vector<std::uint32_t>& counts);

    /// How many surfaces of the clip meshes every pixel of the band has. Overwrites `counts`.
    void countClip(const Window& band, std::vector<std::uint32_t>& counts);

    // band_lists.cpp.

    /// Captures a band's fragments and sorts them into `out`, with the channels of the settings as
    /// extra arrays. Returns the geometry passes. Throws Error (kInternal) if any pixel's fragments
    /// differ in number from the count.
    int layers(LayerMethod& method, const BandRequest& request, LayeredImage& out);

    /// Whether the GPU can capture a band while the CPU takes another: it is not the CPU itself.
    bool overlaps() const;
    /// The two halves of layers() where it can: has the GPU capture a band and copy its lists, and
    /// waits for those, checks and sorts them. Other bands may be submitted between.
    void submit(LayerMethod& method, const BandRequest& request, BandLists& lists);
    int take(BandLists& lists, LayeredImage& out);

    /// Composites what layers() would give, without storing it. Returns and throws like that.
    int composite(LayerMethod& method, const BandRequest& request, CompositeImage& out);

    /// Where in the picture there may be fragments, whatever the sample position.
    Window drawnWindow() const { return rasterizer_.drawnWindow(); }

    // visible_composite.cpp.

    /// Composites what is visible of a band: the nearest opaque fragment of every pixel, and those
    /// transparent ones in front of it, which alone are put into lists, of as many rows at a time
    /// as the limits allow. There may be no clip meshes. Returns and throws like layers().
    int compositeVisible(LayerMethod& method, const Window& band, const BandLimits& limits,
                         const TakeVisible& take);

    // band_capture.cpp.

    /// Composites a band on the fly. Returns and throws like layers().
    int composite(CompositeMethod& method, const BandRequest& request, CompositeImage& out);

    /// The largest change of Z that refining hits has made since the last begin().
    double largestCorrection() const { return largest_correction_; }
    /// Which surface a primitive's key belongs to (DrawList::surfaceOf).
    std::uint32_t surfaceOf(std::uint32_t key) const {
        return gpu_scene_.posed().drawList().surfaceOf(key);
    }

    /// What bands cost besides what the hand-over and sinks take: a fragment of layers(), or a
    /// pixel of composite().
    std::uint64_t fragmentBytes() const;
    std::uint64_t pixelBytes() const;
    /// Of those of a fragment, and of a pixel, what the copies of two bands take that are under way
    /// at once; 0 if none are.
    std::uint64_t copiedFragmentBytes() const { return overlaps() ? 2 * fragmentBytes() : 0; }
    std::uint64_t copiedPixelBytes() const {
        return overlaps() ? 4 * sizeof(std::uint32_t)
                          : 0;  // list heads, and the lists' first entries
    }
    /// Pixels of the largest raster tile that the crop touches, and bytes of the textures that
    /// every method needs for it.
    std::uint64_t tilePixels() const;
    /// How many raster tiles a row of the band touches.
    int tilesAcross(const Window& band) const {
        const Window row{band.x0, band.y0, band.x1, band.y0 + 1};
        return static_cast<int>(rasterizer_.tilesOf(row).size());
    }
    /// Bytes that compositeVisible() needs for it besides those of tileBytes().
    std::uint64_t opaqueBytes() const {
        return OpaqueTarget::bytes(tilePixels(), pass_context_.settings.color_type);
    }
    std::uint64_t tileBytes() const {
        const std::uint64_t list_heads =
            ListHeadTarget::supported(context_) ? ListHeadTarget::bytes(tilePixels()) : 0;
        return rasterizer_.boundBytes(tilePixels()) + list_heads;
    }

    /// Adds how long the GPU has worked since the last time, as "gpuCount" and "gpuCapture", to the
    /// times; waits for it. Where it is the CPU nothing is added: that is in "count" and "capture".
    void takeGpuTimes() { gpu_timer_.takeInto(times_); }

    /// Frees what it holds besides the scene.
    void free();

  private:
    const gl::Functions& gl() const { return context_.functions(); }
    /// Finds the boundary of the clip meshes in a band, unless that is what the buffers hold.
    void prepareClip(const Window& band);
    /// Draws a pass without attachments that touches every pixel's list head.
    void drawIntoLists(const GeometryPass& pass, const Window& band);
    /// The fragments that a pass counts in every pixel's list head. Overwrites `counts`.
    void countInLists(const GeometryPass& pass, const Window& band,
                      std::vector<std::uint32_t>& counts);
    /// The largest value of the pixels of `area`, which lies in `band`.
    template <class Value>
    static std::uint32_t largestIn(const Window& band, const Window& area, Value&& value) {
        std::uint32_t most = 0;
        for (int y = area.y0; y < area.y1; ++y) {
            const auto row =
                static_cast<std::size_t>(y - band.y0) * static_cast<std::size_t>(band.width());
            for (int x = area.x0; x < area.x1; ++x)
                most = std::max(most, value(row + static_cast<std::size_t>(x - band.x0)));
        }
        return most;
    }
    /// Calls f(tile, area of the band in it).
    template <class F>
    void forEachTile(const Window& band, F&& f) {
        for (const Window& tile : rasterizer_.tilesOf(band)) {
            f(tile, intersect(tile, band));
            // Tiles have pixels of their own, but in the same buffers.
            gl().MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        }
    }
    bool takesListHeadTarget(const LayerMethod& method) const {
        return method.takesListHeadTarget() && ListHeadTarget::supported(context_);
    }
    void checkListHeads(const std::uint32_t* list_heads, const Window& band,
                        std::span<const std::uint32_t> first,
                        std::span<const std::uint32_t> end) const;
    /// Draws a band's fragments, the nearest `layers` (0 = all) of every pixel at least, into
    /// lists, without waiting for the GPU where it need not.
    void drawLists(LayerMethod& method, const BandRequest& request, std::uint32_t layers,
                   BandLists& lists);
    /// The same into `lists_`, waited for and checked. Returns the geometry passes.
    int fillLists(LayerMethod& method, const BandRequest& request, std::uint32_t layers);
    /// That of the list heads, if they can be a render target, with the depths of the OpaqueTarget.
    gl::Framebuffer framebufferInFront() const;
    /// Captures the nearest opaque fragments of `area`. Returns the geometry passes.
    int captureOpaque(const Window& tile, const Window& area);
    /// The transparent fragments in front of them, of every pixel of `area`. Overwrites `counts`.
    void countInFront(const Window& tile, const Window& area, std::vector<std::uint32_t>& counts);
    /// Composites rows of `tile`: `captured` has what is in front of the opaque fragments.
    void takeVisible(const Window& tile, const Window& rows, const CapturedFragments& captured,
                     const TakeVisible& take);
    bool needsKeys(bool asked) const;
    bool blendsTail() const { return pass_context_.settings.tail == Tail::kBlend; }
    /// Bytes that the fragments of lists take in the buffers, and what channels.frag yields of
    /// them.
    std::size_t storedBytes(const BandLists& lists) const;
    std::size_t shadedBytes(const BandLists& lists) const;
    gl::Buffer::Mapping readFragments(const BandLists& lists) const;
    CapturedFragments capturedIn(const BandLists& lists, const std::uint32_t* stored) const;
    /// Sorts lists into `out`, with what follows from the keys and, if it has run, what
    /// channels.frag yielded.
    void sortLists(const BandLists& lists, const std::uint32_t* stored, const float* values,
                   LayeredImage& out);
    void setListHeads(std::span<const std::uint32_t> list_heads);
    /// Another geometry pass, which finds what channels.frag yields of the captured fragments.
    void drawChannels(BandLists& lists);
    void addChannels(const BandLists& lists, const CapturedFragments& captured,
                     std::span<std::uint32_t> sources, const float* values, LayeredImage& out);
    void readComposite(const BandRequest& request, CompositeImage& out);

    gl::Context& context_;
    const PassContext& pass_context_;
    StageTimes& times_;
    gl::GpuTimer gpu_timer_;
    const NextFrame* next_frame_ = nullptr;
    GpuScene gpu_scene_;
    SceneRasterizer rasterizer_;
    BandBuffers buffers_;
    ListHeadTarget list_head_target_;
    OpaqueTarget opaque_;
    std::vector<std::uint32_t> opaque_pixels_;   ///< some rows that were read of it
    CompositeImage visible_;                     ///< some rows of a composite
    std::vector<std::uint32_t> visible_counts_;  ///< of their pixels
    BandLists lists_;                            ///< of a band that nothing overlaps
    std::vector<std::uint32_t> ends_;            ///< where a ListHeadTarget has left its list heads
    Window clip_band_;                           ///< whose boundary the buffers hold
    double largest_correction_ = 0;
};

}  // namespace peeler
