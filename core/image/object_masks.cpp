// SPDX-License-Identifier: Apache-2.0
#include "core/image/object_masks.h"

#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>
#include <algorithm>
#include <cstring>
#include <limits>

#include <peeler/error.h>
#include "core/base/stage_times.h"
#include "core/lens/lens.h"
#include "core/lens/picture_rays.h"
#include "core/scene/camera_choice.h"

namespace peeler {

namespace {

constexpr std::size_t kAlphaComponent = 3;  // index in a colour's components
/// Bytes that an object without pixels takes, mostly for the first blocks of its two deques.
constexpr std::uint64_t kObjectBytes = sizeof(ObjectMasks) + 1300;

float alphaOf(const LayeredImage& band, std::size_t fragment) {
    const FragmentArray& color = band.color;
    const std::byte* const at =
        color.data.data() + fragment * color.stride() + kAlphaComponent * pixelTypeSize(color.type);
    if (color.type == PixelType::kHalf) {
        std::uint16_t bits = 0;
        std::memcpy(&bits, at, sizeof(bits));
        half value;
        value.setBits(bits);
        return value;
    }
    float value = 0;
    std::memcpy(&value, at, sizeof(value));
    return value;
}

/// Returns the first fragment of a pixel with at least this opacity, or the first fragment if all
/// have less.
std::size_t visibleFragment(const LayeredImage& band, std::size_t begin, std::size_t end,
                            float see_through) {
    if (see_through > 0)
        for (std::size_t f = begin; f < end; ++f)
            if (alphaOf(band, f) >= see_through) return f;
    return begin;
}

}  // namespace

Window PixelRuns::box() const {
    Window box;
    const auto width = static_cast<int>(width_);
    for (const Run& run : runs_) {
        const int y = static_cast<int>(run.begin / width_);
        const int x = static_cast<int>(run.begin % width_);
        const int end = std::min(width, x + static_cast<int>(run.end - run.begin));
        box = unite(box, {x, y, end, y + 1});
    }
    return box;
}

void PixelRuns::fill(std::uint8_t value, std::vector<std::uint8_t>& bytes) const {
    for (const Run& run : runs_)
        std::fill(bytes.begin() + run.begin, bytes.begin() + run.end, value);
}

std::vector<std::uint32_t> PixelRuns::columnCounts(int height) const {
    const Window box = this->box();
    const auto rows = static_cast<std::size_t>(box.height());
    // Transposes only the bounding box. In the transposed copy, columns are contiguous.
    std::vector<std::uint8_t> inside(box.pixels());
    for (const Run& run : runs_) {
        const auto y =
            static_cast<std::size_t>(run.begin / width_) - static_cast<std::size_t>(box.y0);
        const auto x =
            static_cast<std::size_t>(run.begin % width_) - static_cast<std::size_t>(box.x0);
        for (std::size_t i = 0; i < run.end - run.begin; ++i)
            inside[(x + i) * rows + y] = 1;
    }
    std::vector<std::uint32_t> counts;
    std::uint32_t end = 0;  // the pixel after the previous run of set pixels
    for (int x = box.x0; x < box.x1; ++x) {
        for (int y = box.y0; y < box.y1; ++y) {
            const auto at =
                static_cast<std::size_t>(x - box.x0) * rows + static_cast<std::size_t>(y - box.y0);
            if (!inside[at]) continue;
            const auto pixel = static_cast<std::uint32_t>(x) * static_cast<std::uint32_t>(height) +
                               static_cast<std::uint32_t>(y);
            if (!counts.empty() && pixel == end) {
                ++counts.back();
            } else {
                counts.push_back(pixel - end);
                counts.push_back(1);
            }
            end = pixel + 1;
        }
    }
    if (const std::uint32_t all = width_ * static_cast<std::uint32_t>(height); end < all)
        counts.push_back(all - end);
    return counts;
}

double ObjectMasks::visibleFraction() const {
    if (canvas_pixels == 0) return 0;
    return static_cast<double>(visible.count()) / static_cast<double>(canvas_pixels);
}

std::uint32_t ObjectLayers::layers() const {
    std::uint32_t most = 0;
    for (std::size_t p = 0; p + 1 < offsets.size(); ++p)
        most = std::max(most, offsets[p + 1] - offsets[p]);
    return most;
}

std::vector<std::uint16_t> ObjectLayers::layer(std::uint32_t index) const {
    std::vector<std::uint16_t> result(offsets.size() - 1, 0);
    for (std::size_t p = 0; p < result.size(); ++p)
        if (index < offsets[p + 1] - offsets[p]) result[p] = numbers[offsets[p] + index];
    return result;
}

/// The ids of a band's fragments.
struct ObjectMaskSink::Ids {
    FragmentChannel owner{};     ///< node or material id
    FragmentChannel instance{};  ///< instance number; used only if instances are separate objects

    std::uint32_t numberOf(const ObjectTable& table, std::size_t fragment) const {
        const std::uint32_t id = owner.id(fragment);
        if (id == 0 || id > table.numbers.size()) return 0;
        const std::uint32_t number = table.numbers[id - 1];
        return number != 0 && instance ? number + instance.id(fragment) - 1 : number;
    }
};

struct ObjectMaskSink::Pixel {
    std::size_t begin = 0, end = 0;  ///< range of the pixel's fragments
    int x = 0, y = 0;                ///< position relative to the picture's upper left corner
    std::uint64_t of_canvas = 0;     ///< index of the pixel in the canvas, counted from 1
    bool inside = false;             ///< whether the pixel is in the picture
    std::uint32_t of_picture = 0;
};

ObjectMaskSink::ObjectMaskSink(const ObjectTable& table, const ObjectMaskOptions& options)
    : table_(table), options_(options) {}

void ObjectMaskSink::begin(const Plan& plan) {
    const std::uint64_t fragments = plan.fragments_stored;
    const std::uint64_t pixels = options_.picture.pixels();
    if (options_.layers && fragments > std::numeric_limits<std::uint32_t>::max())
        throw Error(ErrorKind::kMemory,
                    "a picture of " + std::to_string(fragments) + " fragments is too large", "",
                    "make a smaller picture");
    ObjectMasks none;
    none.amodal = none.visible = PixelRuns(options_.picture.width());
    objects_.assign(table_.objects, none);
    last_pixel_.assign(table_.objects, 0);
    layers_ = {};
    if (options_.layers) {
        layers_.offsets.reserve(pixels + 1);
        layers_.numbers.reserve(fragments);
    }
}

SinkMemory ObjectMaskSink::memory(const Plan& plan) const {
    const std::uint64_t fragments = plan.fragments_stored;
    const std::uint64_t pixels = options_.picture.pixels();
    // Runs in a row have pixels outside the set between them, so at most every second pixel begins
    // a run.
    const std::uint64_t every_other =
        table_.objects *
        (pixels / 2 + pixels % 2 + static_cast<std::uint64_t>(options_.picture.height()));
    const std::uint64_t runs = std::min(fragments, every_other) + std::min(pixels, fragments);
    std::uint64_t bytes = table_.objects * (kObjectBytes + sizeof(std::uint64_t)) +
                          runs * sizeof(PixelRuns::Run) + options_.more_bytes;
    if (options_.layers)
        bytes += (pixels + 1) * sizeof(std::uint32_t) + fragments * sizeof(std::uint16_t);
    return {.bytes = bytes};
}

void ObjectMaskSink::write(LayeredImage&& band) {
    const StageTimer timer(times_, "masks");
    Ids ids;
    ids.owner = findIds(band, table_.by_material ? "id.material" : "id.object");
    if (table_.instances_apart) ids.instance = findIds(band, "id.instance");
    if (band.fragments() > 0 && (!ids.owner || (table_.instances_apart && !ids.instance)))
        throw Error(ErrorKind::kInternal, "a band without ids has no objects");
    const Window& picture = options_.picture;
    Pixel pixel;
    pixel.of_canvas = 1 + static_cast<std::uint64_t>(band.window.y0) *
                              static_cast<std::uint64_t>(band.window.width());
    std::size_t p = 0;
    for (int y = band.window.y0; y < band.window.y1; ++y) {
        pixel.y = y - picture.y0;
        const bool in_rows = y >= picture.y0 && y < picture.y1;
        for (int x = band.window.x0; x < band.window.x1; ++x, ++p, ++pixel.of_canvas) {
            pixel.x = x - picture.x0;
            pixel.inside = in_rows && x >= picture.x0 && x < picture.x1;
            pixel.begin = band.offsets[p];
            pixel.end = band.offsets[p + 1];
            if (pixel.begin != pixel.end) {
                pixel.of_picture = static_cast<std::uint32_t>(pixel.y * picture.width() + pixel.x);
                takePixel(band, ids, pixel);
            }
            if (options_.layers && pixel.inside)
                layers_.offsets.push_back(static_cast<std::uint32_t>(layers_.numbers.size()));
        }
    }
}

void ObjectMaskSink::takePixel(const LayeredImage& band, const Ids& ids, const Pixel& pixel) {
    for (std::size_t f = pixel.begin; f < pixel.end; ++f) {
        const std::uint32_t number = ids.numberOf(table_, f);
        if (options_.layers && pixel.inside)
            layers_.numbers.push_back(static_cast<std::uint16_t>(number));
        if (number == 0 || last_pixel_[number - 1] == pixel.of_canvas) continue;
        last_pixel_[number - 1] = pixel.of_canvas;
        ObjectMasks& masks = objects_[number - 1];
        ++masks.canvas_pixels;
        masks.canvas_box = unite(masks.canvas_box, {pixel.x, pixel.y, pixel.x + 1, pixel.y + 1});
        if (pixel.inside) masks.amodal.add(pixel.of_picture);
    }
    if (!pixel.inside) return;
    const std::size_t seen = visibleFragment(band, pixel.begin, pixel.end, options_.see_through);
    if (const std::uint32_t number = ids.numberOf(table_, seen); number != 0)
        objects_[number - 1].visible.add(pixel.of_picture);
}

View canvasOf(const View& view, int times, Window& picture) {
    picture = view.crop;
    if (times == 1) return view;
    const int width = view.crop.width(), height = view.crop.height();
    const int around = (times - 1) / 2;
    const auto most = static_cast<std::int64_t>(kMostPictureSide);
    if (std::int64_t{width} * times > most || std::int64_t{height} * times > most)
        throw Error(ErrorKind::kUsage,
                    "a canvas of " + std::to_string(std::int64_t{width} * times) + " x " +
                        std::to_string(std::int64_t{height} * times) + " pixels is too large",
                    "", "make the picture or the canvas smaller");
    checkPixels({width * times, height * times});
    if (view.rays && view.rays->lens() && lensModel(view.rays->lens()->lens).filling)
        throw Error(
            ErrorKind::kUsage,
            "a picture of all directions has no surroundings: " + view.rays->lens()->lens.model, "",
            "leave the canvas out");
    View canvas = view;
    if (view.rays)
        canvas.rays = mappedPicture(view.rays, glm::dvec2(-around * glm::ivec2(width, height)),
                                    glm::dvec2(1));
    // The display window grows equally on all sides, so that its centre stays on the optical axis.
    canvas.width += 2 * around * width;
    canvas.height += 2 * around * height;
    canvas.projection.half_width *= static_cast<double>(canvas.width) / view.width;
    canvas.projection.half_height *= static_cast<double>(canvas.height) / view.height;
    // In the canvas's display window, a pixel at x moves to x + around · width. The canvas begins
    // `around · width` before the moved crop, so its x0 is the original crop's x0.
    canvas.crop = {view.crop.x0, view.crop.y0, view.crop.x0 + times * width,
                   view.crop.y0 + times * height};
    picture = {canvas.crop.x0 + around * width, canvas.crop.y0 + around * height,
               canvas.crop.x1 - around * width, canvas.crop.y1 - around * height};
    return canvas;
}

}  // namespace peeler
