// SPDX-License-Identifier: Apache-2.0
// Writes fragments as a .npz.
#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/base/parallel.h"
#include "core/image/layered_image.h"
#include "formats/arrays/bundle_arrays.h"
#include "formats/arrays/fragment_columns.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/arrays/table_writers.h"

namespace peeler {
namespace {

/// The arrays of every file, in this order; then that of coloured opacity, where there is any, the
/// columns, and the bundle.
enum FixedArray : std::size_t { kSplitArray, kDepthArray, kColorArray, kNear, kFar, kOpacityArray };

NumberType numberTypeOfColor(PixelType type) {
    return type == PixelType::kHalf ? NumberType::kHalf : NumberType::kFloat;
}

std::vector<NpzArray> fragmentArraysOf(const Plan& plan, const LayeredImage& band,
                                       std::span<const FragmentColumn> columns) {
    const std::uint64_t n = plan.fragments_stored;
    std::vector<NpzArray> arrays = {
        {"ray_splits", NumberType::kInt64, {plan.view.crop.pixels() + 1}},
        {"z", NumberType::kFloat, {n}},
        {"rgba", numberTypeOfColor(band.color.type), {n, 4}},
        {"near", NumberType::kDouble, {}},
        {"far", NumberType::kDouble, {}},
    };
    if (plan.tinted) arrays.push_back({"opacity", numberTypeOfColor(band.color.type), {n, 3}});
    const std::size_t first_column = arrays.size();
    for (const FragmentColumn& column : columns) {
        arrays.push_back({column.name, column.type, {n}});
        if (column.components() > 1) arrays.back().shape.push_back(column.components());
    }
    for (NpzArray& array : bundleArrays(1))
        arrays.push_back(std::move(array));
    // What other programs call their channels may be a name of ours.
    std::set<std::string> taken{"arrays_version"};
    for (std::size_t i = 0; i < arrays.size(); ++i) {
        if (i < first_column || i >= first_column + columns.size()) taken.insert(arrays[i].name);
    }
    for (std::size_t i = first_column; i < first_column + columns.size(); ++i) {
        while (!taken.insert(arrays[i].name).second)
            arrays[i].name += '_';
    }
    return arrays;
}

class FragmentArrays final : public Sink {
  public:
    FragmentArrays(std::string path, const FragmentArrayOptions& options)
        : path_(std::move(path)), options_(options) {}

    void begin(const Plan& plan) override { plan_ = plan; }
    void write(LayeredImage&& band) override;
    void finish() override { writer_->finish(); }

  private:
    void open(const LayeredImage& band);
    void writeColors(const LayeredImage& band);
    void writeColumn(const LayeredImage& band, std::size_t index);
    std::size_t firstColumn() const { return kOpacityArray + (plan_.tinted ? 1U : 0U); }

    std::string path_;
    FragmentArrayOptions options_;
    Plan plan_;
    std::vector<FragmentColumn> columns_;
    std::optional<NpzWriter> writer_;  ///< from the first band on
    std::int64_t fragments_ = 0;       ///< so far
    std::vector<std::int64_t> splits_;
    std::vector<std::byte> values_;
};

void FragmentArrays::open(const LayeredImage& band) {
    columns_ = fragmentColumns(band);
    writer_.emplace(path_, fragmentArraysOf(plan_, band, columns_));
    writer_->append(kSplitArray, std::as_bytes(std::span(&fragments_, 1)));
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    const Projection& projection = plan_.view.projection;
    for (const auto& [array, value] : {std::pair{kNear, projection.near}, {kFar, projection.far}}) {
        const double known = options_.camera_known ? value : kUnknown;
        writer_->append(array, std::as_bytes(std::span(&known, 1)));
    }
    const Bundle pixels{"", plan_.view};
    writeBundles(*writer_, firstColumn() + columns_.size(), std::span(&pixels, 1),
                 options_.camera_known);
}

void FragmentArrays::writeColumn(const LayeredImage& band, std::size_t index) {
    constexpr std::size_t kAtOnce = std::size_t{1} << 14;
    const FragmentColumn& column = columns_[index];
    const FragmentColumnReader reader(band, column, options_.default_material);
    values_.resize(band.fragments() * column.bytes());
    parallelFor((band.fragments() + kAtOnce - 1) / kAtOnce, [&](std::size_t part) {
        const std::size_t first = part * kAtOnce;
        std::byte* out = values_.data() + first * column.bytes();
        for (std::size_t f = first; f < std::min(first + kAtOnce, band.fragments()); ++f)
            out = reader.put(f, out);
    });
    writer_->append(firstColumn() + index, values_);
}

void FragmentArrays::writeColors(const LayeredImage& band) {
    if (!plan_.tinted) return writer_->append(kColorArray, band.color.data);
    const std::size_t number = pixelTypeSize(band.color.type), stride = band.color.stride();
    const auto components = [&](std::size_t first, std::size_t count) {
        values_.resize(band.fragments() * count * number);
        for (std::size_t f = 0; f < band.fragments(); ++f) {
            std::memcpy(values_.data() + f * count * number,
                        band.color.data.data() + f * stride + first * number, count * number);
        }
        return std::span<const std::byte>(values_);
    };
    writer_->append(kColorArray, components(0, kPlainComponents));
    writer_->append(kOpacityArray,
                    components(kPlainComponents, kTintedComponents - kPlainComponents));
}

void FragmentArrays::write(LayeredImage&& band) {
    if (!writer_) open(band);
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

}  // namespace

std::unique_ptr<Sink> makeFragmentArrays(std::string path, const FragmentArrayOptions& options) {
    return std::make_unique<FragmentArrays>(std::move(path), options);
}

SizeForecast forecastFragmentArrays(const Plan& plan, const LayeredImage& band) {
    return {NpzWriter::fileBytes(fragmentArraysOf(plan, band, fragmentColumns(band)))};
}

}  // namespace peeler
