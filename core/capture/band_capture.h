// SPDX-License-Identifier: Apache-2.0
// Capture of one band of one view on the GPU: counting, capturing and compositing.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <peeler/composite.h>
#include <peeler/gl_layers.h>
#include <peeler/layered_image.h>
#include <peeler/stage_times.h>
#include <peeler/view.h>
#include "core/capture/band_buffers.h"
#include "core/capture/gpu_scene.h"
#include "core/capture/method.h"
#include "core/capture/pass_context.h"
#include "core/capture/sample_composite.h"
#include "core/capture/scene_rasterizer.h"
#include "core/capture/shown_fragments.h"
#include "core/capture/traced_layers.h"
#include "core/fragments/bands.h"
#include "core/fragments/depth_sort.h"
#include "core/fragments/surface_channels.h"
#include "core/gl/gpu_timer.h"
#include "core/splats/splat_layers.h"

namespace peeler {

/// A band to capture, with the number of fragments per pixel.
struct BandRequest {
    Window band;
    std::span<const std::uint32_t> counts;  ///< number of fragments in each pixel, from count()
    std::uint32_t layers = 0;               ///< number of nearest layers to keep; 0 = all
    /// The keys that layers() outputs as the first extra array; none if kOrder. With channels, they
    /// are those of primitives. Hits always have the keys of primitives.
    StoredKeys keys = StoredKeys::kOrder;
    /// Whether to capture only the transparent fragments in front of the OpaqueTarget's fragments.
    bool in_front = false;

    std::uint32_t limit() const {
        return layers ? layers : std::numeric_limits<std::uint32_t>::max();
    }
};

/// The fragment lists of a captured band, in the GPU's buffers or in copies for the CPU.
struct BandLists {
    Window band;
    std::uint32_t layers = 0;          ///< as in BandRequest
    StoredKeys keys{};                 ///< as in BandRequest
    bool channels = false;             ///< whether channels.frag has run
    int passes = 0;                    ///< geometry passes so far
    std::vector<std::uint32_t> first;  ///< start of each pixel's list, pixels + 1 entries
    // Copies that run while the GPU works on another band.
    gl::ReadBack copied_heads, copied_fragments, copied_channels;
    gl::Fence copied;
};

/// The capture of bands. Owns the uploaded scene and the buffers. Adds to the times of the stages
/// "count", "capture", "sort" and others.
class BandCapture {
  public:
    /// `context`: null for scenes of splats alone, which need no GL. Throws like GpuScene. All
    /// arguments must outlive this object.
    BandCapture(gl::Context* context, const PosedScene& posed, const PassContext& pass_context,
                StageTimes& times);

    /// Sets another pose of the same scene, used from the next begin() on.
    void setPose(const PosedScene& posed);
    /// Sets the frame that motion is measured against; null if nothing moves. The frame must exist
    /// as long as it is set.
    void setNextFrame(const NextFrame* next) { next_frame_ = next; }

    /// Applies the current state of the pass context.
    void begin();

    /// Counts the fragments of every pixel of the band. Overwrites `counts`.
    void count(const Window& band, std::vector<std::uint32_t>& counts);

    /// Counts the clip-mesh surfaces of every pixel of the band. Overwrites `counts`.
    void countClip(const Window& band, std::vector<std::uint32_t>& counts);

    // Defined in band_lists.cpp.

    /// Captures a band's fragments and sorts them into `out`, with the channels of the settings as
    /// extra arrays. Returns the number of geometry passes. Throws Error (kInternal) if the number
    /// of captured fragments of any pixel differs from its count.
    int layers(LayerMethod& method, const BandRequest& request, LayeredImage& out);

    /// Captures a band's fragments as layers() does, without channels, but sorts them on the GPU
    /// and leaves them in GPU buffers. The buffers' contents are valid until the next capture of
    /// any kind. Shaders and commands may read the buffers without a barrier.
    GlLayers layersOnGpu(LayerMethod& method, const BandRequest& request);

    /// Whether the GPU can capture a band while the CPU sorts another. False for software renderers
    /// and for list heads in a render target.
    bool overlaps() const;
    /// The two halves of layers(), available if overlaps(). submit() makes the GPU capture a band
    /// and copy its lists. take() waits for the copies, checks them and sorts them. Other bands may
    /// be submitted between the two calls.
    void submit(LayerMethod& method, const BandRequest& request, BandLists& lists);
    int take(BandLists& lists, LayeredImage& out);

    /// Composites the layers that layers() would capture, without storing the layers. Returns and
    /// throws like layers().
    int composite(LayerMethod& method, const BandRequest& request, CompositeImage& out);

    /// Returns the window of the picture that can contain fragments, for any sample position.
    Window drawnWindow() const { return gl_->rasterizer.drawnWindow(); }

    // Defined in visible_composite.cpp.

    /// Composites the visible fragments of a band: the nearest opaque fragment of every pixel and
    /// the transparent fragments in front of it. Only transparent fragments go into lists, for as
    /// many rows at a time as the limits allow. Clip meshes are not supported. Returns and throws
    /// like layers().
    int compositeVisible(LayerMethod& method, const Window& band, const BandLimits& limits,
                         const TakeVisible& take);

    /// Whether compositeSamples() shows the scene as compositeVisible() does: all surfaces are
    /// triangles, and the driver rasterises samples at these positions.
    bool takesSamples(std::span<const glm::dvec2> positions) const;
    /// Composites the mean of all samples by SampleComposite. Returns and throws like
    /// compositeVisible().
    int compositeSamples(const Window& band, const BandLimits& limits, const TakeVisible& take);
    /// Counts the fragments that compositeSamples() shows (SampleComposite::count()).
    void countVisibleSamples(const Window& band, const TakeCounts& take);

    // Defined in band_capture.cpp.

    /// Composites a band on the fly. Returns and throws like layers().
    int composite(CompositeMethod& method, const BandRequest& request, CompositeImage& out);

    /// Returns the largest change of Z that hit refinement has made since the last begin().
    double largestCorrection() const { return largest_correction_; }
    /// Returns the number of pixels of the current view that have no ray (View::rays).
    std::uint64_t pixelsWithoutRay() {
        return pass_context_.view.rays ? tracedLayers().pixelsWithoutRay() : 0;
    }
    /// Whether the scene has Gaussian splats.
    bool hasSplats() const { return splats_.has_value(); }
    /// Whether captures show them: SplatHits adds those that rays hit, and shadow maps have none.
    bool showsSplats() const {
        return hasSplats() && pass_context_.settings.hit_mode == HitMode::kNone &&
               !pass_context_.settings.opaque_only;
    }
    std::uint64_t splatBytes() const { return splats_ ? splats_->splats.bytes() : 0; }
    /// Returns the surface of the primitive with this key (DrawList::surfaceOf). Every splat is a
    /// surface of its own.
    std::uint32_t surfaceOf(std::uint32_t key) const;

    /// Return the bytes that a band takes: per fragment for layers(), per pixel for composite().
    /// The memory of the sinks, and of the image that is passed to them, is not included.
    std::uint64_t fragmentBytes() const;
    std::uint64_t pixelBytes() const;
    /// Returns the maximum bytes of a buffer for lists.
    std::uint64_t mostBufferBytes() const;
    /// Return the bytes, per fragment and per pixel, of the copies for two bands that are captured
    /// at the same time; 0 if bands do not overlap.
    std::uint64_t copiedFragmentBytes() const { return overlaps() ? 2 * fragmentBytes() : 0; }
    std::uint64_t copiedPixelBytes() const {
        // The list heads and the list starts of both bands.
        return overlaps() ? 4 * sizeof(std::uint32_t) : 0;
    }
    /// Returns the number of pixels in the largest raster tile that the crop touches; 0 without GL.
    std::uint64_t tilePixels() const;
    /// Returns the number of raster tiles that a row of the band touches.
    int tilesAcross(const Window& band) const {
        const Window row{band.x0, band.y0, band.x1, band.y0 + 1};
        return static_cast<int>(gl_->rasterizer.tilesOf(row).size());
    }
    /// Returns the bytes of textures that compositeVisible() needs for the largest tile, in
    /// addition to tileBytes().
    std::uint64_t opaqueBytes() const;
    /// Returns the bytes of SampleComposite for the largest tile, in addition to tileBytes().
    std::uint64_t sampleBytes() const { return SampleComposite::bytes(tilePixels()); }
    std::uint64_t tileBytes() const {
        if (!gl_) return 0;
        const std::uint64_t list_heads =
            ListHeadTarget::supported(gl_->context) ? ListHeadTarget::bytes(tilePixels()) : 0;
        return gl_->rasterizer.boundBytes(tilePixels()) + list_heads;
    }

    /// Waits for the GPU. Adds the GPU time since the previous call to the stages "gpuCount" and
    /// "gpuCapture". Adds nothing for software renderers: the stages "count" and "capture" include
    /// their time.
    void takeGpuTimes() {
        if (gl_) gl_->timer.takeInto(times_);
    }

    /// Frees everything except the scene.
    void free();

  private:
    const gl::Functions& gl() const { return gl_->context.functions(); }
    /// Finds the boundary of the clip meshes in a band, unless the buffers already hold that
    /// boundary.
    void prepareClip(const Window& band);
    /// Draws a pass without attachments, for shaders that write to list heads and storage buffers.
    void drawIntoLists(const GeometryPass& pass, const Window& band);
    /// Draws a pass that counts the fragments of every pixel, with the list heads as counters.
    /// Overwrites `counts`.
    void countInLists(const GeometryPass& pass, const Window& band,
                      std::vector<std::uint32_t>& counts);
    /// Returns the maximum of value(p) over the pixels of `area`, where p is a pixel's index in
    /// `band`.
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
    /// Calls f(tile, part of the band in the tile) for each raster tile that the band touches.
    template <class F>
    void forEachTile(const Window& band, F&& f) {
        for (const Window& tile : gl_->rasterizer.tilesOf(band)) {
            f(tile, intersect(tile, band));
            // Tiles have no pixels in common, but their shaders access the same buffers.
            gl().MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        }
    }
    bool takesListHeadTarget(const LayerMethod& method) const {
        return method.takesListHeadTarget() && ListHeadTarget::supported(gl_->context);
    }
    void checkListHeads(const std::uint32_t* list_heads, const Window& band,
                        std::span<const std::uint32_t> first,
                        std::span<const std::uint32_t> end) const;
    /// Draws a band's fragments into lists. Each pixel's list holds at least its nearest `layers`
    /// fragments (0 = all). Waits for the GPU only if necessary.
    void drawLists(LayerMethod& method, const BandRequest& request, std::uint32_t layers,
                   BandLists& lists);
    /// Draws into `lists_`, waits for the GPU and checks the list heads. Returns the number of
    /// geometry passes.
    int fillLists(LayerMethod& method, const BandRequest& request, std::uint32_t layers);
    /// Returns a framebuffer with the OpaqueTarget's depths and, if supported, the list heads.
    gl::Framebuffer framebufferInFront() const;
    /// Captures the nearest opaque fragments of `area`. Returns the number of geometry passes.
    int captureOpaque(const Window& tile, const Window& area);
    /// Counts, for every pixel of `area`, the transparent fragments in front of the opaque
    /// fragment. Overwrites `counts`.
    void countInFront(const Window& tile, const Window& area, std::vector<std::uint32_t>& counts);
    SampleComposite& sampleComposite();
    /// Composites some rows of a tile and passes them to `take`. `captured` holds the fragments in
    /// front of the opaque ones.
    void takeVisible(const Window& tile, const Window& rows, const CapturedFragments& captured,
                     const TakeVisible& take);
    /// Returns the keys that lists need if a request asks for `asked`.
    StoredKeys keysOf(StoredKeys asked) const;
    bool blendsTail() const { return pass_context_.settings.tail == Tail::kBlend; }
    /// Return the bytes of the lists' fragments in the buffers, and of the output of channels.frag.
    std::size_t storedBytes(const BandLists& lists) const;
    std::size_t shadedBytes(const BandLists& lists) const;
    gl::Buffer::Mapping readFragments(const BandLists& lists) const;
    CapturedFragments capturedIn(const BandLists& lists, const std::uint32_t* stored) const;
    /// Sorts lists into `out`. Adds the channels that are computed from the keys and, if
    /// channels.frag has run, its output channels.
    void sortLists(const BandLists& lists, const std::uint32_t* stored, const float* values,
                   LayeredImage& out);
    void setListHeads(std::span<const std::uint32_t> list_heads);
    /// Runs channels.frag for the captured fragments, in another geometry pass.
    void drawChannels(BandLists& lists);
    /// Returns the layers of views with View::rays, which methods do not capture.
    TracedLayers& tracedLayers();
    void countSurfaces(const Window& band, std::vector<std::uint32_t>& counts);
    int surfaceLayers(LayerMethod& method, const BandRequest& request, LayeredImage& out);
    /// Whether opaque surfaces may hide splats.
    bool hidesSplats() const {
        return pass_context_.shown != Surfaces::kAll && !posed_->drawList().draws().empty();
    }
    /// Captures the shown surfaces of a band, and what they hide, into SplatParts, unless they are
    /// there. Returns the number of geometry passes.
    int captureHiding(LayerMethod& method, const Window& band);
    /// Captures the surfaces of a band by a method and its splats, merged by depth.
    int layersWithSplats(LayerMethod& method, const BandRequest& request, LayeredImage& out);
    void addChannels(const BandLists& lists, const CapturedFragments& captured,
                     std::span<std::uint32_t> sources, const float* values, LayeredImage& out);
    void readComposite(const BandRequest& request, CompositeImage& out);

    /// The uploaded scene, and all that GL needs to draw it.
    struct GlParts {
        GlParts(gl::Context& gl_context, const PosedScene& posed, const PassContext& pass_context,
                StageTimes& times);

        gl::Context& context;
        gl::GpuTimer timer;
        GpuScene scene;
        SceneRasterizer rasterizer;
        BandBuffers buffers;
        ListHeadTarget list_head_target{};
        OpaqueTarget opaque{};
        std::optional<TracedLayers> traced{};      ///< made when a view first needs it
        std::optional<SampleComposite> samples{};  ///< made when a picture first needs it
    };

    const PassContext& pass_context_;
    StageTimes& times_;
    const PosedScene* posed_;
    const NextFrame* next_frame_ = nullptr;
    std::optional<GlParts> gl_;  ///< none: only splats are captured
    /// The splats of the scene, if there are any.
    struct SplatParts {
        explicit SplatParts(const PosedScene& posed) : splats(posed), shown(posed) {}

        SplatLayers splats;
        ShownFragments shown;
        std::vector<std::uint32_t> surface_counts{}, splat_counts{};
        std::array<LayeredImage, 2> layers{};  ///< of surfaces and of splats, to be merged
        // Of the band whose surfaces are in `layers`; empty = none.
        Window band{};
        int passes = 0;                    ///< geometry passes that captured them
        std::vector<float> hidden_from{};  ///< empty if nothing is hidden
    };
    std::optional<SplatParts> splats_;
    std::vector<std::uint32_t> opaque_pixels_;   ///< rows read back from GlParts::opaque
    CompositeImage visible_;                     ///< rows composited by compositeVisible()
    std::vector<std::uint32_t> visible_counts_;  ///< fragments per pixel of visible_
    BandLists lists_;                  ///< lists of the current band, except in submit() and take()
    std::vector<std::uint32_t> ends_;  ///< list heads read from a ListHeadTarget
    Window clip_band_;                 ///< band whose clip boundary is in the buffers
    double largest_correction_ = 0;
};

}  // namespace peeler
