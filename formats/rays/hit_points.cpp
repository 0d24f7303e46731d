// SPDX-License-Identifier: Apache-2.0
// Writes hits as a .ply.
#include <cstring>
#include <numeric>
#include <optional>
#include <utility>

#include "formats/arrays/table_writers.h"
#include "formats/rays/hit_columns.h"

namespace peeler {
namespace {

class HitPoints final : public RayOutput {
  public:
    HitPoints(std::string path, const HitOptions& options)
        : path_(std::move(path)),
          comment_(options.comment),
          double_positions_(options.double_positions),
          reader_(options.posed) {}

    std::vector<Channel> channels() const override { return hitChannels(); }
    /// The writer itself would do without: the header is filled in at the end. But a point cloud
    /// may be larger than the disk.
    bool needsHits() const override { return true; }
    SizeForecast forecast(std::span<const Bundle>,
                          std::span<const std::uint64_t> hits) const override {
        return {PlyWriter::fileBytes(properties(), std::span(&comment_, 1),
                                     std::accumulate(hits.begin(), hits.end(), std::uint64_t{0}))};
    }

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t>) override {
        bundles_ = {bundles.begin(), bundles.end()};
        writer_.emplace(path_, properties(), std::vector<std::string>{comment_});
    }

    void take(std::size_t index, const LayeredImage& band) override {
        reader_.read(bundles_[index], index, band, [&](std::span<const Hit> hits) {
            points_.resize(hits.size() * writer_->pointSize());
            std::byte* out = points_.data();
            for (const Hit& hit : hits)
                out = put(hit, out);
            writer_->append(points_);
        });
    }

    void finish() override { writer_->finish(); }

  private:
    std::vector<PlyProperty> properties() const {
        const NumberType position = double_positions_ ? NumberType::kDouble : NumberType::kFloat;
        std::vector<PlyProperty> all = {{"x", position}, {"y", position}, {"z", position}};
        for (const HitColumn& column : hitColumns()) {
            for (const std::string_view name : column.properties)
                all.push_back({std::string(name), column.type});
        }
        all.push_back({"bundle", NumberType::kUint32});
        return all;
    }
    std::byte* put(const Hit& hit, std::byte* out) const {
        const auto store = [&](const auto& value) {
            std::memcpy(out, &value, sizeof value);
            out += sizeof value;
        };
        if (double_positions_)
            store(hit.position);
        else
            store(glm::vec3(hit.position));
        for (const HitColumn& column : hitColumns()) {
            column.put(hit, out);
            out += column.bytes();
        }
        store(hit.bundle);
        return out;
    }

    std::string path_, comment_;
    bool double_positions_;
    HitReader reader_;
    std::vector<Bundle> bundles_;
    std::optional<PlyWriter> writer_;
    std::vector<std::byte> points_;
};

}  // namespace

std::unique_ptr<RayOutput> makeHitPoints(const std::string& path, const HitOptions& options) {
    return std::make_unique<HitPoints>(path, options);
}

}  // namespace peeler
