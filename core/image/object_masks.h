// SPDX-License-Identifier: Apache-2.0
// Object masks: the amodal and visible pixels of all objects, from one capture of all layers.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/sink.h>
#include <peeler/view.h>

namespace peeler {

/// A map from fragments to objects, based on the fragments' channel `id`. Object numbers are
/// positions in the caller's list, counted from 1.
struct ObjectTable {
    /// Whether objects are materials (id.material) instead of nodes (id.object).
    bool by_material = false;
    /// Whether each instance is an object of its own. The instances of a node are numbered from the
    /// node's number on.
    bool instances_apart = false;
    /// The object number of each node or material, counted from 1; 0 = no object.
    std::vector<std::uint32_t> numbers;
    std::uint32_t objects = 0;  ///< the largest object number
};

/// A set of pixels of a picture. Pixels are added row by row.
class PixelRuns {
  public:
    /// Pixels [begin, end), counted row by row. A run never extends into another row.
    struct Run {
        std::uint32_t begin = 0, end = 0;
        bool operator==(const Run&) const = default;
    };

    explicit PixelRuns(int width = 0) : width_(static_cast<std::uint32_t>(width)) {}

    /// Adds a pixel. Its number must be greater than the numbers of all pixels added before.
    void add(std::uint32_t pixel) {
        ++count_;
        if (!runs_.empty() && runs_.back().end == pixel && pixel % width_ != 0)
            ++runs_.back().end;
        else
            runs_.push_back({pixel, pixel + 1});
    }

    std::uint64_t count() const { return count_; }
    const std::deque<Run>& runs() const { return runs_; }
    /// Returns the bounding box of the pixels, relative to the picture's upper left corner; an
    /// empty box if there are no pixels.
    Window box() const;
    /// Sets the bytes of the set's pixels to `value`. `bytes` has one byte per pixel of the
    /// picture.
    void fill(std::uint8_t value, std::vector<std::uint8_t>& bytes) const;
    /// Returns run lengths in column order: the uncompressed run lengths of COCO (maskApi.h). Runs
    /// of pixels outside the set alternate with runs inside. The first run is outside; its length
    /// is 0 if the first pixel is in the set. `height`: height of the picture.
    std::vector<std::uint32_t> columnCounts(int height) const;

  private:
    std::uint32_t width_ = 0;
    std::uint64_t count_ = 0;
    /// A deque, because growing it copies nothing.
    std::deque<Run> runs_;
};

/// The masks of one object in a view. Windows are relative to the picture's upper left corner.
struct ObjectMasks {
    PixelRuns amodal;   ///< pixels with a fragment of the object
    PixelRuns visible;  ///< pixels where the object is visible
    /// The object's silhouette on the whole canvas, which may be larger than the picture.
    std::uint64_t canvas_pixels = 0;
    Window canvas_box{};

    /// Returns the visible share of the silhouette: pixels visible in the picture, divided by
    /// pixels of the silhouette on the canvas; 0 if there is no silhouette.
    double visibleFraction() const;
};

/// The object numbers of every fragment of a picture, front to back; 0 = no object.
struct ObjectLayers {
    std::vector<std::uint32_t> offsets{0};  ///< same meaning as LayeredImage::offsets
    std::vector<std::uint16_t> numbers;

    /// Returns the maximum number of fragments per pixel.
    std::uint32_t layers() const;
    /// Returns the object number of one layer at each pixel; 0 = no object or no fragment.
    std::vector<std::uint16_t> layer(std::uint32_t index) const;
};

struct ObjectMaskOptions {
    /// The picture's window in the plan's crop. Masks have only its pixels; the silhouettes on the
    /// canvas (`canvas_pixels`, `canvas_box`) have all pixels of the crop.
    Window picture{};
    /// The minimum opacity (A) of a visible fragment. A pixel's visible fragment is the first
    /// fragment with at least this opacity or, if all fragments have less, the first fragment.
    float see_through = 0;
    bool layers = false;           ///< whether to keep the object numbers of all fragments
    std::uint64_t more_bytes = 0;  ///< memory that the caller needs for the finished picture
};

/// A sink that receives the bands of all layers with the channel `id`, and collects the masks of
/// every object. Takes 8 bytes per run of pixels. Amodal masks have at most one run per fragment;
/// visible masks have at most one run per pixel.
class ObjectMaskSink final : public Sink {
  public:
    /// The table must outlive this object.
    ObjectMaskSink(const ObjectTable& table, const ObjectMaskOptions& options);

    /// Throws Error (kMemory) if ObjectMaskOptions::layers is set and the picture has 2^32
    /// fragments or more.
    void begin(const Plan& plan) override;
    /// Throws Error (kInternal) if the band has no ids.
    void write(LayeredImage&& band) override;
    void finish() override {}
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return times_; }

    /// Returns the masks of all objects, beginning with object number 1. Valid only after finish().
    const std::vector<ObjectMasks>& objects() const { return objects_; }
    const ObjectLayers& layers() const { return layers_; }

  private:
    struct Ids;
    struct Pixel;
    void takePixel(const LayeredImage& band, const Ids& ids, const Pixel& pixel);

    const ObjectTable& table_;
    ObjectMaskOptions options_;
    std::vector<ObjectMasks> objects_;
    /// For each object: the last canvas pixel with a fragment of the object, counted from 1; 0 = no
    /// pixel.
    std::vector<std::uint64_t> last_pixel_;
    ObjectLayers layers_;
    StageTimes times_;
};

/// Returns a view whose crop is a canvas around the crop of `view`. The canvas has `times` (odd)
/// times as many pixels in each direction. Pixels keep their size, and the original crop's pixels
/// keep their rays. Sets `picture` to the window of the original crop in the canvas. Throws Error
/// (kUsage) if the canvas is too large, or if a lens fills the picture (LensModel::filling).
View canvasOf(const View& view, int times, Window& picture);

}  // namespace peeler
