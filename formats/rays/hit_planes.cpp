// SPDX-License-Identifier: Apache-2.0
// Writer of hits as planes of arrays.
#include <optional>
#include <utility>

#include <peeler/error.h>
#include "formats/arrays/bundle_arrays.h"
#include "formats/arrays/table_writers.h"
#include "formats/file/byte_buffer.h"
#include "formats/rays/hit_columns.h"

namespace peeler {
namespace {

/// The indices of `count` and of the first column's planes. The arrays of bundleArrays() follow.
constexpr std::size_t kCounts = 0, kFirstPlanes = 1;

std::string sizeText(const Bundle& bundle) {
    const Window& rays = bundle.view.crop;
    return bundle.name + ": " + std::to_string(rays.width()) + " x " +
           std::to_string(rays.height());
}

/// Returns the shape of a plane: (h, w) for one bundle, (b, h, w) for b bundles.
std::vector<std::uint64_t> pixelsOf(std::span<const Bundle> bundles) {
    const Window& first = bundles.front().view.crop;
    for (const Bundle& bundle : bundles) {
        const Window& rays = bundle.view.crop;
        if (rays.width() == first.width() && rays.height() == first.height()) continue;
        throw Error(ErrorKind::kUsage, "bundles of different sizes do not fit one array of planes",
                    sizeText(bundle) + "; " + sizeText(bundles.front()),
                    "trace them one by one, or write lists: leave " + Parameter::kDense + " out");
    }
    std::vector<std::uint64_t> pixels = {static_cast<std::uint64_t>(first.height()),
                                         static_cast<std::uint64_t>(first.width())};
    if (bundles.size() > 1) pixels.insert(pixels.begin(), bundles.size());
    return pixels;
}

class HitPlanes final : public RayOutput {
  public:
    HitPlanes(std::string path, const HitOptions& options)
        : path_(std::move(path)),
          output_hash_(options.provenance.output_hash),
          columns_(chosenHitColumns(options.columns, options.bundles)),
          reader_(options.posed, columns_),
          planes_(*options.dense, options.dense->layers) {}

    std::vector<Channel> channels() const override { return channelsOf(columns_); }
    SizeForecast forecast(std::span<const Bundle> bundles,
                          std::span<const std::uint64_t>) const override {
        return {
            ArrayWriter::fileBytes(path_, arraysOf(bundles), bundleTexts(bundles, output_hash_))};
    }

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t>) override {
        bundles_ = {bundles.begin(), bundles.end()};
        writer_.emplace(path_, arraysOf(bundles), bundleTexts(bundles, output_hash_));
        writeBundles(*writer_, kFirstPlanes + columns_.size(), bundles);
    }

    void take(std::size_t index, const LayeredImage& band) override {
        std::size_t widest = sizeof(std::uint32_t);
        for (const HitColumn& column : columns_)
            widest = std::max(widest, planes_.pixelBytes(planesOf(column)));
        DensePlanes::forEachRange(band.offsets, widest, [&](std::size_t first, std::size_t last) {
            writeRange(bundles_[index], band, first, last);
        });
        rays_ += band.window.pixels();
    }

    void finish() override { writer_->finish(); }
    SinkMemory memory(const Bundle&) const override { return {.bytes = reader_.mostBytes()}; }

  private:
    static DensePlanes::Column planesOf(const HitColumn& column) {
        return {column.type, column.components()};
    }

    std::vector<NamedArray> arraysOf(std::span<const Bundle> bundles) const {
        const std::vector<std::uint64_t> pixels = pixelsOf(bundles);
        std::vector<NamedArray> arrays{{"count", NumberType::kUint32, pixels}};
        for (const HitColumn& column : columns_)
            arrays.push_back(planes_.array(std::string(column.name), planesOf(column), pixels));
        const std::vector<NamedArray> more = bundleArrays(bundles.size());
        arrays.insert(arrays.end(), more.begin(), more.end());
        return arrays;
    }

    /// Writes the hits of the rays [first, last) of a band.
    void writeRange(const Bundle& bundle, const LayeredImage& band, std::size_t first,
                    std::size_t last) {
        const std::span offsets = std::span(band.offsets).subspan(first, last - first + 1);
        std::vector<std::uint32_t> counts;
        for (std::size_t p = first; p < last; ++p)
            counts.push_back(band.count(p));
        writer_->writeAt(kCounts, (rays_ + first) * sizeof counts[0], asBytes(counts));
        const auto write = [&](const HitBatch& hits) {
            ByteBuffer numbers, planes;
            for (std::size_t c = 0; c < columns_.size(); ++c) {
                const HitColumn& column = columns_[c];
                numbers.resize(hits.size * column.bytes());
                column.put(hits, numbers.data(), column.bytes());
                planes_.fill(planesOf(column), offsets, numbers, planes);
                writer_->writeAt(kFirstPlanes + c,
                                 (rays_ + first) * planes_.pixelBytes(planesOf(column)), planes);
            }
        };
        reader_.readSome(bundle, band, offsets.front(), offsets.back() - offsets.front(), write);
    }

    std::string path_, output_hash_;
    std::vector<HitColumn> columns_;
    HitReader reader_;
    DensePlanes planes_;
    std::vector<Bundle> bundles_;
    std::optional<ArrayWriter> writer_;
    std::uint64_t rays_ = 0;  ///< number of rays written so far
};

}  // namespace

std::unique_ptr<RayOutput> makeHitPlanes(const std::string& path, const HitOptions& options) {
    return std::make_unique<HitPlanes>(path, options);
}

}  // namespace peeler
