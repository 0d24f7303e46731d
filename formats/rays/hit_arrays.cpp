// SPDX-License-Identifier: Apache-2.0
// Writes hits as a .npz.
#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include "formats/arrays/bundle_arrays.h"
#include "formats/arrays/table_writers.h"
#include "formats/rays/hit_columns.h"

namespace peeler {
namespace {

class HitArrays final : public RayOutput {
  public:
    HitArrays(std::string path, const HitOptions& options)
        : path_(std::move(path)), reader_(options.posed) {}

    std::vector<Channel> channels() const override { return hitChannels(); }
    bool needsHits() const override { return true; }
    SizeForecast forecast(std::span<const Bundle> bundles,
                          std::span<const std::uint64_t> hits) const override {
        return {NpzWriter::fileBytes(arraysOf(bundles, hits))};
    }

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override {
        bundles_ = {bundles.begin(), bundles.end()};
        writer_.emplace(path_, arraysOf(bundles, hits));
        const std::int64_t zero = 0;
        writer_->append(0, std::as_bytes(std::span(&zero, 1)));
        writeBundles(*writer_, 1 + hitColumns().size(), bundles);
    }

    void take(std::size_t index, const LayeredImage& band) override {
        splits_.clear();
        for (std::size_t p = 1; p < band.offsets.size(); ++p)
            splits_.push_back(hits_ + band.offsets[p]);
        hits_ += static_cast<std::int64_t>(band.fragments());
        writer_->append(0, asBytes(splits_));
        reader_.read(bundles_[index], index, band, [&](std::span<const Hit> hits) {
            for (std::size_t c = 0; c < hitColumns().size(); ++c) {
                const HitColumn& column = hitColumns()[c];
                values_.resize(hits.size() * column.bytes());
                for (std::size_t i = 0; i < hits.size(); ++i)
                    column.put(hits[i], values_.data() + i * column.bytes());
                writer_->append(1 + c, values_);
            }
        });
    }

    void finish() override { writer_->finish(); }

  private:
    /// ray_splits, the columns of hits, then the bundles.
    static std::vector<NpzArray> arraysOf(std::span<const Bundle> bundles,
                                          std::span<const std::uint64_t> hits) {
        const std::uint64_t n = std::accumulate(hits.begin(), hits.end(), std::uint64_t{0});
        std::vector<NpzArray> arrays{{"ray_splits", NumberType::kInt64, {raysOf(bundles) + 1}}};
        for (const HitColumn& column : hitColumns()) {
            arrays.push_back({std::string(column.name), column.type, {n}});
            if (column.components() > 1) arrays.back().shape.push_back(column.components());
        }
        const std::vector<NpzArray> more = bundleArrays(bundles.size());
        arrays.insert(arrays.end(), more.begin(), more.end());
        return arrays;
    }

    std::string path_;
    HitReader reader_;
    std::vector<Bundle> bundles_;
    std::optional<NpzWriter> writer_;
    std::int64_t hits_ = 0;  // so far
    std::vector<std::int64_t> splits_;
    std::vector<std::byte> values_;
};

}  // namespace

std::unique_ptr<RayOutput> makeHitArrays(const std::string& path, const HitOptions& options) {
    return std::make_unique<HitArrays>(path, options);
}

}  // namespace peeler
