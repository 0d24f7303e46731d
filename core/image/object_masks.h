// SPDX-License-Identifier: Apache-2.0
// Which pixels the objects of a scene cover, and on which of them they are seen: of one capture of
// all layers, for all objects at once.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/sink.h>
#include <peeler/view.h>

namespace peeler {

/// Which object a fragment is of, by its channel `id`.
struct ObjectTable {
    bool by_material = false;  ///< by id.material; else by id.object, the node
    bool instances_apart =
        false;  ///< of a node: its first instance is the number, the next one + 1
    /// Of each node or material the number of its object, from 1; 0 = it is of none.
    std::vector<std::uint32_t> numbers;
    std::uint32_t objects = 0;  ///< the greatest number
};

/// A set of pixels of a picture, filled in the order of rows.
class PixelRuns {
  public:
    /// Pixels [begin, end), counted row after row. No run reaches into another row.
    struct Run {
        std::uint32_t begin = 0, end = 0;
        bool operator==(const Run&) const = default;
    };

    explicit PixelRuns(int width = 0) : width_(static_cast<std::uint32_t>(width)) {}

    /// `pixel` must be greater than all before.
    void add(std::uint32_t pixel) {
        ++count_;
        if (!runs_.empty() && runs_.back().end == pixel && pixel % width_ != 0)
            ++runs_.back().end;
        else
            runs_.push_back({pixel, pixel + 1});
    }

    std::uint64_t count() const { return count_; }
    const std::deque<Run>& runs() const { return runs_; }
    /// The least window that has them all; empty if there are none. Its origin is the picture's
    /// upper left corner.
    Window box() const;
    /// Sets the bytes of these pixels; `bytes` has one for each of the picture.
    void fill(std::uint8_t value, std::vector<std::uint8_t>& bytes) const;
    /// Lengths of runs, down column after column, in turn of pixels that are not in the set and of
    /// those that are: the uncompressed run lengths of COCO (its API's maskApi.h). The first is 0
    /// if the first pixel is in the set. `height` is the picture's.
    std::vector<std::uint32_t> columnCounts(int height) const;

  private:
    std::uint32_t width_ = 0;
    std::uint64_t count_ = 0;
    /// In blocks, so that it never takes more than it needs to grow.
    std::deque<Run> runs_;
};

/// What a view shows of one object. Windows count from the picture's upper left corner.
struct ObjectMasks {
    PixelRuns amodal;   ///< where it has any fragment
    PixelRuns visible;  ///< where it is what is seen
    /// Of its silhouette on the whole canvas, which may be larger than the picture.
    std::uint64_t canvas_pixels = 0;
    Window canvas_box{};

    /// The share of its silhouette on the canvas that is seen on the picture; 0 if it has none.
    double visibleFraction() const;
};

/// The objects of every fragment of a picture, front to back; 0 = of none.
struct ObjectLayers {
    std::vector<std::uint32_t> offsets{0};  ///< as LayeredImage::offsets
    std::vector<std::uint16_t> numbers;

    /// The most fragments that a pixel has.
    std::uint32_t layers() const;
    /// The number of the object in one layer at each pixel; 0 where there is none.
    std::vector<std::uint16_t> layer(std::uint32_t index) const;
};

struct ObjectMaskOptions {
    Window picture{};  ///< the pixels that masks are of; the rest of the crop is canvas
    /// An object is seen where it has the first fragment of at least this opacity (A), or, where
    /// none has, the first one.
    float see_through = 0;
    bool layers = false;           ///< the numbers of all fragments are wanted, too
    std::uint64_t more_bytes = 0;  ///< that are needed when the picture is whole
};

/// Takes the bands of all layers with the channel `id`, and finds of each object its masks on the
/// way. It holds 8 bytes for each run of pixels, so at most for each fragment.
class ObjectMaskSink final : public Sink {
  public:
    /// The table must outlive it.
    ObjectMaskSink(const ObjectTable& table, const ObjectMaskOptions& options);

    /// Throws Error (kMemory) if the picture has 2^32 fragments or more and layers are wanted.
    void begin(const Plan& plan) override;
    /// Throws Error (kInternal) if the band has no ids.
    void write(LayeredImage&& band) override;
    void finish() override {}
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return times_; }

    /// Of each object, the one numbered 1 first; after finish().
    const std::vector<ObjectMasks>& objects() const { return objects_; }
    const ObjectLayers& layers() const { return layers_; }

  private:
    struct Ids;
    struct Pixel;
    void takePixel(const LayeredImage& band, const Ids& ids, const Pixel& pixel);

    const ObjectTable& table_;
    ObjectMaskOptions options_;
    std::vector<ObjectMasks> objects_;
    std::vector<std::uint64_t> last_pixel_;  ///< of each object: of the canvas, from 1; 0 = none
    ObjectLayers layers_;
    StageTimes times_;
};

/// The view of a canvas: `times` (odd) as many pixels of the same size each way around the crop of
/// `view`, at the same ray each. In the result the crop is the canvas; `picture` becomes the window
/// of the view's own crop in it. Throws Error (kUsage) if it would be too large.
View canvasOf(const View& view, int times, Window& picture);

}  // namespace peeler
