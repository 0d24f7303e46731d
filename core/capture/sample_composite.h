// SPDX-License-Identifier: Apache-2.0
// Composites of several samples per pixel in which an opaque triangle is shaded once per pixel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/stage_times.h>
#include <peeler/window.h>
#include "core/capture/band_buffers.h"
#include "core/capture/hit_shader.h"
#include "core/capture/pass_context.h"
#include "core/capture/sample_target.h"
#include "core/capture/scene_rasterizer.h"
#include "core/fragments/bands.h"
#include "core/fragments/depth_sort.h"
#include "core/fragments/pixel_places.h"
#include "core/gl/context.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// A callback that receives some rows of a composite, and each pixel's number of visible fragments.
/// With several samples, the numbers of the first sample come first.
using TakeVisible = std::function<void(const CompositeImage&, std::span<const std::uint32_t>)>;
/// A callback that receives the number of visible fragments of each pixel of some rows.
using TakeCounts = std::function<void(const Window& rows, std::span<const std::uint32_t> counts)>;

/// The mean of kPixelSamples composites per pixel, without hidden fragments. Multisampling finds
/// the nearest opaque triangle of every sample. Each triangle of a pixel is shaded at the centroid
/// of the samples that show it. Transparent fragments in front are shaded for every sample.
class SampleComposite {
  public:
    /// All arguments must outlive this object, except the pose.
    SampleComposite(const gl::Context& context, PosedScene posed, SceneRasterizer& rasterizer,
                    BandBuffers& buffers, const PassContext& pass_context, StageTimes& times);

    /// Returns the bytes of targets, of hits, and of the rows that are composited at once, for a
    /// raster tile with this many pixels.
    static std::uint64_t bytes(std::uint64_t tile_pixels);

    /// Composites a part of a raster tile. Lists transparent fragments for as many rows at a time
    /// as the limits allow. The view must be at the sample position 0.5, 0.5 of the picture.
    /// Returns the number of geometry passes. Throws Error (kInternal) if the number of captured
    /// fragments of a pixel differs from its count.
    int composite(const Window& tile, const Window& area, const BandLimits& limits,
                  const TakeVisible& take);

    /// Counts the fragments of every sample that composite() shows, without shading them. Passes
    /// the samples on one after another.
    void count(const Window& tile, const Window& area, const TakeCounts& take);

    /// Frees the target and the rows.
    void free();

  private:
    const gl::Functions& gl() const { return context_.functions(); }
    struct Rows;
    int captureOpaque(const Window& tile, const Window& area);
    void drawIntoLists(GeometryPass pass, const Window& part);
    void countInFront(const Window& area);
    void listInFront(const Window& part, const Window& area);
    void readSamples(const Window& rows);
    void readRows(const Window& rows, const Window& part, const TakeVisible& take);
    void takeRows(const Rows& rows, const TakeVisible& take);
    void shadePlaces(const Rows& rows);
    void averagePlaces(const Rows& rows);
    void addLists(const Rows& rows);
    std::size_t fragmentWords() const;

    const gl::Context& context_;
    PosedScene posed_;
    SceneRasterizer& rasterizer_;
    BandBuffers& buffers_;
    const PassContext& pass_context_;
    StageTimes& times_;
    HitShader shader_;
    SampleTarget target_;
    gl::Buffer keys_, depths_;  ///< of some rows, from sample_keys.comp
    bool blends_;               ///< whether the scene has transparent surfaces
    // By sample, then by pixel of a part of the tile:
    std::vector<std::uint32_t> in_front_;  ///< number of transparent fragments
    std::vector<std::uint32_t> first_;     ///< start of each list, then the end; empty = no lists
    // Of some rows:
    std::vector<PixelPlace> places_;
    std::vector<ShadedHit> hits_;  ///< of places_
    FragmentArray colors_;         ///< of hits_
    std::vector<std::uint32_t> behind_;
    std::vector<std::uint32_t> counts_;
    CompositeImage mean_, sample_, listed_;
};

}  // namespace peeler
