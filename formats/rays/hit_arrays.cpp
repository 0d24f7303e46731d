// SPDX-License-Identifier: Apache-2.0
// Writer of hits as arrays.
#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include "core/base/parallel.h"
#include "formats/arrays/bundle_arrays.h"
#include "formats/arrays/table_writers.h"
#include "formats/file/byte_buffer.h"
#include "formats/rays/hit_columns.h"

namespace peeler {
namespace {

/// The indices of ray_splits and of the first column. The arrays of bundleArrays() follow the
/// columns.
constexpr std::size_t kRaySplits = 0, kFirstColumn = 1;

class HitArrays final : public RayOutput {
  public:
    HitArrays(std::string path, const HitOptions& options)
        : path_(std::move(path)),
          output_hash_(options.provenance.output_hash),
          columns_(chosenHitColumns(options.columns, options.bundles)),
          reader_(options.posed, columns_) {}

    std::vector<Channel> channels() const override { return channelsOf(columns_); }
    bool needsHits() const override { return true; }
    SizeForecast forecast(std::span<const Bundle> bundles,
                          std::span<const std::uint64_t> hits) const override {
        return {ArrayWriter::fileBytes(path_, arraysOf(bundles, hits),
                                       bundleTexts(bundles, output_hash_))};
    }

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override {
        bundles_ = {bundles.begin(), bundles.end()};
        writer_.emplace(path_, arraysOf(bundles, hits), bundleTexts(bundles, output_hash_));
        const std::int64_t zero = 0;
        writer_->append(kRaySplits, std::as_bytes(std::span(&zero, 1)));
        writeBundles(*writer_, kFirstColumn + columns_.size(), bundles);
    }

    void take(std::size_t index, const LayeredImage& band) override {
        writeSplits(band);
        reader_.read(bundles_[index], band, [&](const HitBatch& hits) {
            ByteBuffer numbers;
            for (std::size_t c = 0; c < columns_.size(); ++c) {
                const HitColumn& column = columns_[c];
                const std::size_t bytes = column.bytes();
                numbers.resize(hits.size * bytes);
                column.put(hits, numbers.data(), bytes);
                writer_->writeAt(kFirstColumn + c, (hits_ + hits.first) * bytes, numbers);
            }
        });
        hits_ += band.fragments();
        rays_ += band.window.pixels();
    }

    void finish() override { writer_->finish(); }
    SinkMemory memory(const Bundle&) const override { return {.bytes = reader_.mostBytes()}; }

  private:
    std::vector<NamedArray> arraysOf(std::span<const Bundle> bundles,
                                     std::span<const std::uint64_t> hits) const {
        const std::uint64_t n = std::accumulate(hits.begin(), hits.end(), std::uint64_t{0});
        std::vector<NamedArray> arrays{{"ray_splits", NumberType::kInt64, {raysOf(bundles) + 1}}};
        for (const HitColumn& column : columns_) {
            arrays.push_back({std::string(column.name), column.type, {n}});
            if (column.components() > 1) arrays.back().shape.push_back(column.components());
        }
        const std::vector<NamedArray> more = bundleArrays(bundles.size());
        arrays.insert(arrays.end(), more.begin(), more.end());
        return arrays;
    }

    /// Writes the end of each ray's hits to ray_splits.
    void writeSplits(const LayeredImage& band) {
        constexpr std::size_t kRaysAtOnce = std::size_t{1} << 15;
        const std::size_t rays = band.window.pixels();
        parallelFor((rays + kRaysAtOnce - 1) / kRaysAtOnce, [&](std::size_t part) {
            std::vector<std::int64_t> splits;
            const std::size_t first = part * kRaysAtOnce;
            splits.resize(std::min(kRaysAtOnce, rays - first));
            for (std::size_t i = 0; i < splits.size(); ++i)
                splits[i] = static_cast<std::int64_t>(hits_ + band.offsets[first + i + 1]);
            // ray_splits[0] is the beginning of the first ray's hits, so each end has the index of
            // the ray + 1.
            writer_->writeAt(kRaySplits, (1 + rays_ + first) * sizeof splits[0], asBytes(splits));
        });
    }

    std::string path_, output_hash_;
    std::vector<HitColumn> columns_;
    HitReader reader_;
    std::vector<Bundle> bundles_;
    std::optional<ArrayWriter> writer_;
    std::uint64_t hits_ = 0, rays_ = 0;  ///< numbers of hits and rays written so far
};

}  // namespace

std::unique_ptr<RayOutput> makeHitArrays(const std::string& path, const HitOptions& options) {
    return std::make_unique<HitArrays>(path, options);
}

}  // namespace peeler
