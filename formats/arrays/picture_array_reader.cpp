// SPDX-License-Identifier: Apache-2.0
// Reader of pictures as fragment lists in arrays.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include <peeler/error.h>
#include "core/base/resize_anew.h"
#include "core/image/layers.h"
#include "formats/arrays/picture_arrays.h"
#include "formats/exr/exr_picture.h"

namespace peeler {
namespace {

/// The number of splits per read when only the list lengths are needed.
constexpr std::size_t kSplitsAtOnce = std::size_t{1} << 17;
constexpr std::uint64_t kMostOfPixel = 65536;  ///< maximum fragments per pixel, as for deep files

class PictureArrayReader final : public LayeredInput {
  public:
    PictureArrayReader(std::unique_ptr<PictureArrays> arrays, bool pixels);

    const ExrInfo& info() const override { return info_; }
    void read(const Window& window, LayeredImage& out) override;
    void readComposite(const Window& window, CompositeImage& out) override;
    int rowsFor(std::uint64_t bytes) const override;
    BandRead mostOf(int rows) const override;
    std::vector<Text> takeWarnings() override { return arrays_->warnings.take(); }

  private:
    /// A range of consecutive fragments in the file.
    struct Run {
        std::uint64_t from = 0, count = 0;
    };
    void countFragments();
    std::vector<std::uint64_t> splitsFrom(std::uint64_t first, std::size_t count) const;
    std::vector<Run> place(const Window& window, LayeredImage& out) const;
    /// Reads an array's values for the fragments in `runs`, `size` bytes per fragment.
    void readRuns(const SafetensorsArray& array, std::size_t size, std::span<const Run> runs,
                  std::byte* out) const;
    void readColors(std::span<const Run> runs, std::size_t fragments, LayeredImage& out) const;
    [[noreturn]] void fail(const std::string& what) const;

    std::unique_ptr<PictureArrays> arrays_;
    ExrInfo info_;
    Window stored_;  ///< window of the pixels that the file stores
    std::uint64_t fragment_bytes_ = 0;
    std::optional<DepthComplexity> complexity_;
};

PictureArrayReader::PictureArrayReader(std::unique_ptr<PictureArrays> arrays, bool pixels)
    : arrays_(std::move(arrays)), info_(arrays_->info()), stored_(info_.parts.front().data_window) {
    if (arrays_->options.choosesPicture())
        throw Error(ErrorKind::kUsage, "a file of arrays has one picture, without parts or views",
                    arrays_->path(),
                    "leave " + Parameter::kPart + " and " + Parameter::kView + " out");
    if (pixels != arrays_->composite())
        throw Error(
            ErrorKind::kInput,
            pixels ? "the file is not a composite" : "the file is a composite without layers",
            arrays_->path(),
            "render with " + Parameter::kAs + " " + std::string(pixels ? "composite" : "layers"));
    placePixels(info_.plan.view, stored_, arrays_->options.pixels_only, arrays_->path());
    stored_ = intersect(stored_, info_.plan.view.crop);
    if (stored_.empty()) stored_ = {};
    fragment_bytes_ =
        sizeof(float) +
        pixelTypeSize(arrays_->rgba->type == "F16" ? PixelType::kHalf : PixelType::kFloat) *
            colorComponents(arrays_->opacity != nullptr);
    for (const PictureArrays::ExtraArray& array : arrays_->extra)
        fragment_bytes_ += array.like.stride();
    if (!pixels) {
        countFragments();
        return;
    }
    info_.plan.layers.resize(info_.layersOfComposite());
}

void PictureArrayReader::fail(const std::string& what) const {
    throw Error(ErrorKind::kInput, what, arrays_->path(),
                "formats/README.md, \"Pictures as arrays\", describes the arrays");
}

/// Returns the start of each of `count` consecutive lists, then the end of the last list.
std::vector<std::uint64_t> PictureArrayReader::splitsFrom(std::uint64_t first,
                                                          std::size_t count) const {
    std::vector<std::uint64_t> splits(count + 1);
    if (arrays_->composite()) {
        for (std::size_t i = 0; i <= count; ++i)
            splits[i] = first + i;
        return splits;
    }
    const SafetensorsArray& array = *arrays_->splits;
    const std::size_t size = array.number->size;
    std::vector<char> bytes(splits.size() * size);
    if (!arrays_->file().read(array.offset + first * size, bytes)) fail("the file ends early");
    const std::uint64_t n = arrays_->z->shape.front();
    for (std::size_t i = 0; i <= count; ++i) {
        const auto* const at = reinterpret_cast<const std::uint8_t*>(bytes.data()) + i * size;
        const double split = array.number->decode(at, false);
        // `split` is exact as a double, because no file has more than 2^53 fragments.
        if (!(split >= 0 && split <= static_cast<double>(n)))
            fail("a list ends beyond the fragments");
        splits[i] = static_cast<std::uint64_t>(split);
        if (i == 0) continue;
        if (splits[i] < splits[i - 1]) fail("a list ends before it begins");
        if (splits[i] - splits[i - 1] > kMostOfPixel) fail("a pixel has more than 65536 fragments");
    }
    return splits;
}

/// Fills in the plan's fragment counts from the list lengths.
void PictureArrayReader::countFragments() {
    const Window& all = info_.parts.front().data_window;
    const auto width = static_cast<std::size_t>(all.width());
    DepthComplexity& complexity = complexity_.emplace(stored_);
    const int at_once = static_cast<int>(std::max<std::size_t>(1, kSplitsAtOnce / width));
    std::vector<std::uint32_t> counts;
    std::uint64_t end = 0;
    for (int y = all.y0; y < all.y1; y += at_once) {
        const int rows = std::min(at_once, all.y1 - y);
        const auto splits = splitsFrom(static_cast<std::uint64_t>(y - all.y0) * width,
                                       static_cast<std::size_t>(rows) * width);
        if (splits.front() != end) fail("the lists do not begin at 0");
        end = splits.back();
        counts.resize(splits.size() - 1);
        for (std::size_t p = 0; p < counts.size(); ++p)
            counts[p] = static_cast<std::uint32_t>(splits[p + 1] - splits[p]);
        for (int row = std::max(y, stored_.y0); row < std::min(y + rows, stored_.y1); ++row) {
            const std::size_t first = static_cast<std::size_t>(row - y) * width +
                                      static_cast<std::size_t>(stored_.x0 - all.x0);
            complexity.addRow(stored_.x0, row,
                              std::span<const std::uint32_t>(counts).subspan(
                                  first, static_cast<std::size_t>(stored_.width())));
        }
    }
    if (end != arrays_->z->shape.front()) fail("some fragments are in no list");
    Plan& plan = info_.plan;
    plan.layers = complexity.layers();
    plan.fragments_stored = complexity.counted();
    if (!info_.is_peeler) plan.fragments_counted = plan.fragments_stored;
}

/// Sets the offsets of `out`. Returns the window's fragments as ranges in the file.
std::vector<PictureArrayReader::Run> PictureArrayReader::place(const Window& window,
                                                               LayeredImage& out) const {
    const Window& all = info_.parts.front().data_window;
    out.window = window;
    out.offsets.assign(window.pixels() + 1, 0);
    std::vector<Run> runs;
    const Window inside = intersect(window, stored_);
    for (int y = inside.y0; y < inside.y1; ++y) {
        const auto count = static_cast<std::size_t>(inside.width());
        const auto splits = splitsFrom(
            static_cast<std::uint64_t>(y - all.y0) * static_cast<std::uint64_t>(all.width()) +
                static_cast<std::uint64_t>(inside.x0 - all.x0),
            count);
        std::uint32_t* const counts = out.offsets.data() + 1 + out.pixelIndex(inside.x0, y);
        for (std::size_t p = 0; p < count; ++p)
            counts[p] = static_cast<std::uint32_t>(splits[p + 1] - splits[p]);
        const Run run{splits.front(), splits.back() - splits.front()};
        if (!runs.empty() && runs.back().from + runs.back().count == run.from)
            runs.back().count += run.count;
        else
            runs.push_back(run);
    }
    countsToOffsets(out.offsets, arrays_->path());
    return runs;
}

void PictureArrayReader::readRuns(const SafetensorsArray& array, std::size_t size,
                                  std::span<const Run> runs, std::byte* out) const {
    for (const Run& run : runs) {
        const std::span bytes(reinterpret_cast<char*>(out), run.count * size);
        if (!arrays_->file().read(array.offset + run.from * size, bytes))
            fail("the file ends early");
        out += bytes.size();
    }
}

void PictureArrayReader::readColors(std::span<const Run> runs, std::size_t fragments,
                                    LayeredImage& out) const {
    const Plan& plan = info_.plan;
    out.color = {colorNames(plan.tinted), plan.color_type, std::move(out.color.data)};
    resizeAnew(out.color.data, fragments * out.color.stride());
    const std::size_t number = pixelTypeSize(plan.color_type);
    if (!plan.tinted)
        return readRuns(*arrays_->rgba, out.color.stride(), runs, out.color.data.data());
    std::vector<std::byte> values;
    std::size_t first = 0;
    for (const auto& [array, components] :
         {std::pair(arrays_->rgba, kPlainComponents),
          std::pair(arrays_->opacity, kTintedComponents - kPlainComponents)}) {
        const std::size_t size = components * number;
        resizeAnew(values, fragments * size);
        readRuns(*array, size, runs, values.data());
        for (std::size_t f = 0; f < fragments; ++f)
            std::memcpy(out.color.data.data() + f * out.color.stride() + first,
                        values.data() + f * size, size);
        first += size;
    }
}

void PictureArrayReader::read(const Window& window, LayeredImage& out) {
    if (window.empty() || intersect(window, info_.plan.view.crop) != window)
        throw Error(ErrorKind::kInternal, "the window is empty or outside the picture",
                    arrays_->path());
    const std::vector<Run> runs = place(window, out);
    const std::size_t fragments = out.offsets.back();
    resizeAnew(out.z, fragments);
    readRuns(*arrays_->z, sizeof(float), runs, reinterpret_cast<std::byte*>(out.z.data()));
    // Writers take Z = +inf to mean a pixel without a fragment.
    const auto is_number = [](float z) { return z < std::numeric_limits<float>::infinity(); };
    if (!arrays_->composite() && !std::ranges::all_of(out.z, is_number))
        fail("a fragment's Z is infinite or NaN");
    readColors(runs, fragments, out);
    out.extra.resize(arrays_->extra.size());
    for (std::size_t i = 0; i < arrays_->extra.size(); ++i) {
        const auto& [like, stored] = arrays_->extra[i];
        out.extra[i] = {like.channels, like.type, std::move(out.extra[i].data)};
        resizeAnew(out.extra[i].data, fragments * like.stride());
        readRuns(*stored, like.stride(), runs, out.extra[i].data.data());
    }
}

void PictureArrayReader::readComposite(const Window& window, CompositeImage& out) {
    if (!arrays_->composite())
        throw Error(ErrorKind::kInput, "layers in arrays have no composite", arrays_->path(),
                    "flatten the layers first");
    LayeredImage pixels;
    read(window, pixels);
    compositeOver(pixels, {}, out);
}

int PictureArrayReader::rowsFor(std::uint64_t bytes) const {
    const Window& crop = info_.plan.view.crop;
    const auto width = static_cast<std::uint64_t>(crop.width());
    const std::uint64_t fragments = complexity_ ? complexity_->mostFragments(1) : width;
    const std::uint64_t row = fragment_bytes_ * fragments + width * sizeof(std::uint64_t);
    const auto rows = static_cast<std::uint64_t>(std::max(1, crop.height()));
    return static_cast<int>(
        std::clamp(bytes / std::max<std::uint64_t>(1, row), std::uint64_t{1}, rows));
}

BandRead PictureArrayReader::mostOf(int rows) const {
    const auto width = static_cast<std::uint64_t>(info_.plan.view.crop.width());
    const std::uint64_t fragments =
        complexity_ ? complexity_->mostFragments(rows) : width * static_cast<std::uint64_t>(rows);
    // Memory for the splits of the rows, and for `rgba` before it is interleaved with `opacity`.
    return {fragments,
            2 * width * sizeof(std::uint64_t) +
                (arrays_->opacity ? fragments * kPlainComponents * sizeof(float) : 0),
            true};
}

}  // namespace

std::unique_ptr<LayeredInput> openArrays(std::unique_ptr<PictureArrays> arrays, bool pixels) {
    return std::make_unique<PictureArrayReader>(std::move(arrays), pixels);
}

}  // namespace peeler
