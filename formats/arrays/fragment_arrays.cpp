// SPDX-License-Identifier: Apache-2.0
// Writer of fragments as arrays of lists or planes.
#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <peeler/layered_image.h>
#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/image/channels.h"
#include "core/image/layers.h"
#include "core/scene/view.h"
#include "formats/arrays/bundle_arrays.h"
#include "formats/arrays/fragment_columns.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/arrays/table_writers.h"

namespace peeler {
namespace {

/// The indices of the first arrays in every file. The remaining arrays are the coloured opacity, if
/// any (kOpacityArray), the columns, and the bundle. In files of planes, kSplitArray is the index
/// of `count`, otherwise of `ray_splits`.
enum FixedArray : std::size_t { kSplitArray, kDepthArray, kColorArray, kNear, kFar, kOpacityArray };

constexpr std::string_view kLayerName = "layer";

/// Returns the columns of the file. Planes omit `layer`, because plane k holds layer k; but they
/// store `layer` if the options list only some layers.
std::vector<FragmentColumn> columnsOf(const LayeredImage& band,
                                      const FragmentArrayOptions& options) {
    std::vector<FragmentColumn> columns = fragmentColumns(band);
    if (options.dense && !options.layers_listed)
        std::erase_if(columns, [](const FragmentColumn& c) { return c.name == kLayerName; });
    return columns;
}

std::uint32_t planesOf(const Plan& plan, const DenseSettings& dense) {
    const auto all = static_cast<std::uint32_t>(plan.layers.size());
    return dense.layers != 0 ? dense.layers : std::max(all, 1U);
}

struct FragmentLayout {
    std::vector<NamedArray> arrays;
    std::size_t first_column = 0;
};

FragmentLayout layoutOf(const Plan& plan, const LayeredImage& band,
                        std::span<const FragmentColumn> columns,
                        const FragmentArrayOptions& options) {
    const Window& crop = plan.view.crop;
    const std::vector<std::uint64_t> pixels = {static_cast<std::uint64_t>(crop.height()),
                                               static_cast<std::uint64_t>(crop.width())};
    const auto array = [&](std::string name, NumberType type, std::size_t components) {
        if (options.dense) {
            const DensePlanes planes(*options.dense, planesOf(plan, *options.dense));
            return planes.array(std::move(name), {type, components}, pixels);
        }
        NamedArray list{std::move(name), type, {plan.fragments_stored}};
        if (components > 1) list.shape.push_back(components);
        return list;
    };
    const NumberType color = numberTypeOf(band.color.type);
    FragmentLayout layout;
    std::vector<NamedArray>& arrays = layout.arrays;
    arrays = {options.dense ? NamedArray{"count", NumberType::kUint32, pixels}
                            : NamedArray{"ray_splits", NumberType::kInt64, {crop.pixels() + 1}},
              array("z", NumberType::kFloat, 1),
              array("rgba", color, kPlainComponents),
              {"near", NumberType::kDouble, {}},
              {"far", NumberType::kDouble, {}}};
    if (plan.tinted)
        arrays.push_back(array("opacity", color, kTintedComponents - kPlainComponents));
    layout.first_column = arrays.size();
    for (const FragmentColumn& column : columns)
        arrays.push_back(array(column.name, column.type, column.components()));
    for (NamedArray& more : bundleArrays(1))
        arrays.push_back(std::move(more));
    // Channels of other programs may have the same name as one of our arrays.
    std::set<std::string> taken{"arrays_version", "__metadata__"};
    if (lensCameraOf(plan.view)) taken.insert("bundle_lens");
    if (!options.output_hash.empty()) taken.insert("output_hash");
    const std::size_t first = layout.first_column, end = first + columns.size();
    for (std::size_t i = 0; i < arrays.size(); ++i) {
        if (i < first || i >= end) taken.insert(arrays[i].name);
    }
    for (std::size_t i = first; i < end; ++i) {
        while (!taken.insert(arrays[i].name).second)
            arrays[i].name += '_';
    }
    return layout;
}

class FragmentArrays final : public Sink {
  public:
    FragmentArrays(std::string path, FragmentArrayOptions options)
        : path_(std::move(path)), options_(std::move(options)) {}

    void begin(const Plan& plan) override {
        plan_ = plan;
        options_.camera_known = options_.camera_known && plan.view.known;
        if (options_.dense) planes_.emplace(*options_.dense, planesOf(plan, *options_.dense));
    }
    void write(LayeredImage&& band) override;
    void finish() override { writer_->finish(); }
    /// Returns the memory of the splits and of one array's values. For planes, returns the memory
    /// of the ranges being filled.
    SinkMemory memory(const Plan& plan) const override {
        const LayeredImage band = emptyBand(plan);
        const std::uint64_t compression =
            options_.compress
                ? ArrayWriter::compressionBytes(forecastFragmentArrays(path_, plan, band, options_))
                : 0;
        if (options_.dense) return {.bytes = DensePlanes::rangeBytes() + compression};
        return {.bytes = compression,
                .pixel_bytes = sizeof(std::int64_t),
                .fragment_bytes = fragmentArrayBytes(band, options_)};
    }

  private:
    void open(const LayeredImage& band);
    void writeLists(const LayeredImage& band);
    void writeColors(const LayeredImage& band);
    void writeColumn(const LayeredImage& band, std::size_t index);
    void writePlanes(const LayeredImage& band);
    /// Writes the planes of one array for the pixels [first, last). put(fragment, out) stores a
    /// fragment's values.
    template <class Put>
    void writeRange(const LayeredImage& band, std::size_t first, std::size_t last,
                    std::size_t array, const DensePlanes::Column& column, Put&& put);

    std::string path_;
    FragmentArrayOptions options_;
    Plan plan_;
    std::optional<DensePlanes> planes_;
    std::vector<FragmentColumn> columns_;
    std::size_t first_column_ = 0;
    std::optional<ArrayWriter> writer_;  ///< created with the first band
    std::int64_t fragments_ = 0;         ///< number of fragments written so far
    std::uint64_t pixels_ = 0;           ///< number of pixels written so far
    std::vector<std::int64_t> splits_;
    std::vector<std::byte> values_;
};

void FragmentArrays::open(const LayeredImage& band) {
    columns_ = columnsOf(band, options_);
    FragmentLayout layout = layoutOf(plan_, band, columns_, options_);
    first_column_ = layout.first_column;
    const Bundle pixels{"", plan_.view};
    writer_.emplace(path_, std::move(layout.arrays),
                    bundleTexts(std::span(&pixels, 1), options_.output_hash), options_.compress);
    if (!planes_) writer_->append(kSplitArray, std::as_bytes(std::span(&fragments_, 1)));
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    const Projection& projection = plan_.view.projection;
    for (const auto& [array, value] : {std::pair{kNear, projection.near}, {kFar, projection.far}}) {
        const double known = options_.camera_known ? value : kUnknown;
        writer_->append(array, std::as_bytes(std::span(&known, 1)));
    }
    writeBundles(*writer_, first_column_ + columns_.size(), std::span(&pixels, 1),
                 options_.camera_known);
}

void FragmentArrays::writeColumn(const LayeredImage& band, std::size_t index) {
    constexpr std::size_t kAtOnce = std::size_t{1} << 14;
    const FragmentColumn& column = columns_[index];
    const FragmentColumnReader reader(band, column, options_.default_material);
    resizeAnew(values_, band.fragments() * column.bytes());
    parallelFor((band.fragments() + kAtOnce - 1) / kAtOnce, [&](std::size_t part) {
        const std::size_t first = part * kAtOnce;
        std::byte* out = values_.data() + first * column.bytes();
        for (std::size_t f = first; f < std::min(first + kAtOnce, band.fragments()); ++f)
            out = reader.put(f, out);
    });
    writer_->append(first_column_ + index, values_);
}

void FragmentArrays::writeColors(const LayeredImage& band) {
    if (!plan_.tinted) return writer_->append(kColorArray, band.color.data);
    writer_->append(kColorArray, componentsOf(band.color, 0, kPlainComponents, values_));
    writer_->append(kOpacityArray, componentsOf(band.color, kPlainComponents,
                                                kTintedComponents - kPlainComponents, values_));
}

void FragmentArrays::writeLists(const LayeredImage& band) {
    splits_.clear();
    for (std::size_t p = 1; p < band.offsets.size(); ++p)
        splits_.push_back(fragments_ + band.offsets[p]);
    fragments_ += static_cast<std::int64_t>(band.fragments());
    writer_->append(kSplitArray, std::as_bytes(std::span(splits_)));
    writer_->append(kDepthArray, std::as_bytes(std::span(band.z)));
    writeColors(band);
    for (std::size_t i = 0; i < columns_.size(); ++i)
        writeColumn(band, i);
}

template <class Put>
void FragmentArrays::writeRange(const LayeredImage& band, std::size_t first, std::size_t last,
                                std::size_t array, const DensePlanes::Column& column, Put&& put) {
    ByteBuffer numbers, planes;
    const std::span offsets = std::span(band.offsets).subspan(first, last - first + 1);
    numbers.resize((offsets.back() - offsets.front()) * column.components *
                   infoOf(column.type).size);
    std::byte* out = numbers.data();
    for (std::size_t f = offsets.front(); f < offsets.back(); ++f)
        out = put(f, out);
    planes_->fill(column, offsets, numbers, planes);
    writer_->writeAt(array, (pixels_ + first) * planes_->pixelBytes(column), planes);
}

void FragmentArrays::writePlanes(const LayeredImage& band) {
    std::vector<FragmentColumnReader> readers;
    for (const FragmentColumn& column : columns_)
        readers.emplace_back(band, column, options_.default_material);
    const NumberType color = numberTypeOf(band.color.type);
    const std::size_t number = pixelTypeSize(band.color.type);
    const auto put_color = [&](std::size_t from, std::size_t count) {
        return [&, from, count](std::size_t f, std::byte* out) {
            const std::byte* const color_of = band.color.data.data() + f * band.color.stride();
            return std::copy_n(color_of + from * number, count * number, out);
        };
    };
    constexpr std::size_t kTints = kTintedComponents - kPlainComponents;
    // No column has more components than a colour.
    const std::size_t widest = planes_->pixelBytes({NumberType::kFloat, kPlainComponents});
    DensePlanes::forEachRange(band.offsets, widest, [&](std::size_t first, std::size_t last) {
        const auto write = [&](std::size_t array, const DensePlanes::Column& column, auto&& put) {
            writeRange(band, first, last, array, column, put);
        };
        std::vector<std::uint32_t> counts;
        for (std::size_t p = first; p < last; ++p)
            counts.push_back(band.count(p));
        writer_->writeAt(kSplitArray, (pixels_ + first) * sizeof counts[0], asBytes(counts));
        write(kDepthArray, {NumberType::kFloat, 1},
              [&](std::size_t f, std::byte* out) { return storeNumber(band.z[f], out); });
        write(kColorArray, {color, kPlainComponents}, put_color(0, kPlainComponents));
        if (plan_.tinted)
            write(kOpacityArray, {color, kTints}, put_color(kPlainComponents, kTints));
        for (std::size_t i = 0; i < columns_.size(); ++i) {
            write(first_column_ + i, {columns_[i].type, columns_[i].components()},
                  [&](std::size_t f, std::byte* out) { return readers[i].put(f, out); });
        }
    });
    pixels_ += band.window.pixels();
}

void FragmentArrays::write(LayeredImage&& band) {
    if (!findChannel(band, kLayerName)) addLayerIndices(band);
    if (!writer_) open(band);
    if (planes_)
        writePlanes(band);
    else
        writeLists(band);
}

}  // namespace

FragmentArrayOptions arrayOptions(const OutputOptions& options) {
    FragmentArrayOptions arrays;
    // The last material id means glTF's default material; tables of hits store no index for it.
    arrays.default_material = static_cast<std::uint32_t>(options.provenance.ids.materials.size());
    arrays.output_hash = options.provenance.output_hash;
    arrays.compress = options.compress;
    if (options.as == "dense") arrays.dense = options.dense;
    return arrays;
}

std::unique_ptr<Sink> makeFragmentArrays(std::string path, const FragmentArrayOptions& options) {
    return std::make_unique<FragmentArrays>(std::move(path), options);
}

SizeForecast forecastFragmentArrays(const std::string& path, const Plan& plan,
                                    const LayeredImage& band, const FragmentArrayOptions& options) {
    LayeredImage numbered;  // `band` with a channel `layer`
    numbered.color = {band.color.channels, band.color.type, {}};
    for (const FragmentArray& array : band.extra)
        numbered.extra.push_back({array.channels, array.type, {}});
    if (!findChannel(numbered, kLayerName))
        numbered.extra.push_back({{std::string(kLayerName)}, PixelType::kUint, {}});
    const std::vector<FragmentColumn> columns = columnsOf(numbered, options);
    const Bundle pixels{"", plan.view};
    return ArrayWriter::forecast(path, layoutOf(plan, numbered, columns, options).arrays,
                                 bundleTexts(std::span(&pixels, 1), options.output_hash),
                                 options.compress);
}

std::uint64_t fragmentArrayBytes(const LayeredImage& band, const FragmentArrayOptions& options) {
    if (options.dense) return 0;
    std::size_t widest = band.tinted() ? kPlainComponents * pixelTypeSize(band.color.type) : 0;
    for (const FragmentColumn& column : columnsOf(band, options))
        widest = std::max(widest, column.bytes());
    return widest;
}

}  // namespace peeler
