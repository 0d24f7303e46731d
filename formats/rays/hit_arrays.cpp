// SPDX-License-Identifier: Apache-2.0
// Writes hits as a .npz.
#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

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

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override {
        bundles_ = {bundles.begin(), bundles.end()};
        std::uint64_t rays = 0;
        for (const Bundle& bundle : bundles)
            rays += bundle.rays();
        const std::uint64_t n = std::accumulate(hits.begin(), hits.end(), std::uint64_t{0});
        std::vector<NpzArray> arrays{{"ray_splits", NumberType::kInt64, {rays + 1}}};
        for (const HitColumn& column : hitColumns()) {
            arrays.push_back({std::string(column.name), column.type, {n}});
            if (column.components() > 1) arrays.back().shape.push_back(column.components());
        }
        first_of_bundles_ = arrays.size();
        const std::uint64_t count = bundles.size();
        for (const char* name : {"bundle_origin", "bundle_direction", "bundle_right", "bundle_up"})
            arrays.push_back({name, NumberType::kDouble, {count, 3}});
        for (const char* name : {"bundle_size", "bundle_resolution"})
            arrays.push_back({name, NumberType::kDouble, {count, 2}});
        arrays.push_back({"bundle_window", NumberType::kDouble, {count, 4}});
        arrays.push_back({"bundle_perspective", NumberType::kUint8, {count}});
        writer_.emplace(path_, std::move(arrays));
        const std::int64_t zero = 0;
        writer_->append(0, std::as_bytes(std::span(&zero, 1)));
        for (const Bundle& bundle : bundles)
            describe(bundle);
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
    void describe(const Bundle& bundle) {
        const auto put = [&](std::size_t array, const auto& value) {
            writer_->append(first_of_bundles_ + array, std::as_bytes(std::span(&value, 1)));
        };
        put(0, bundle.origin());
        put(1, bundle.direction());
        put(2, bundle.right());
        put(3, bundle.up());
        put(4, bundle.size());
        put(5, glm::dvec2(bundle.view.width, bundle.view.height));
        const Window& rays = bundle.view.crop;
        put(6, glm::dvec4(rays.x0, rays.y0, rays.width(), rays.height()));
        put(7, static_cast<std::uint8_t>(bundle.parallel() ? 0 : 1));
    }

    std::string path_;
    HitReader reader_;
    std::vector<Bundle> bundles_;
    std::optional<NpzWriter> writer_;
    std::size_t first_of_bundles_ = 0;  // among the arrays
    std::int64_t hits_ = 0;             // so far
    std::vector<std::int64_t> splits_;
    std::vector<std::byte> values_;
};

}  // namespace

std::unique_ptr<RayOutput> makeHitArrays(const std::string& path, const HitOptions& options) {
    return std::make_unique<HitArrays>(path, options);
}

}  // namespace peeler
