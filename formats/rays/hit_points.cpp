// SPDX-License-Identifier: Apache-2.0
// Writer of hits as a .ply.
#include <numeric>
#include <optional>
#include <utility>

#include "formats/arrays/table_writers.h"
#include "formats/file/byte_buffer.h"
#include "formats/rays/hit_columns.h"

namespace peeler {
namespace {

class HitPoints final : public RayOutput {
  public:
    HitPoints(std::string path, const HitOptions& options)
        : path_(std::move(path)),
          comment_(options.comment),
          double_positions_(options.double_positions),
          columns_(chosenHitColumns(options.columns, options.bundles)),
          reader_(options.posed, columns_, true) {}

    std::vector<Channel> channels() const override { return channelsOf(columns_); }
    /// The writer needs no count, but the count gives the file's size, which may exceed the free
    /// disk space.
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
        const auto bundle = static_cast<std::uint32_t>(index);
        reader_.read(bundles_[index], band, [&](const HitBatch& hits) {
            ByteBuffer points;
            const std::size_t size = writer_->pointSize();
            points.resize(hits.size * size);
            std::byte* out = putPositions(hits, points.data(), size);
            for (const HitColumn& column : columns_) {
                column.put(hits, out, size);
                out += column.bytes();
            }
            for (std::size_t i = 0; i < hits.size; ++i)
                storeNumber(bundle, out + i * size);
            writer_->writeAt(hits_ + hits.first, points);
        });
        hits_ += band.fragments();
    }

    void finish() override { writer_->finish(); }
    SinkMemory memory(const Bundle&) const override { return {.bytes = reader_.mostBytes()}; }

  private:
    std::vector<PlyProperty> properties() const {
        const NumberType position = double_positions_ ? NumberType::kDouble : NumberType::kFloat;
        std::vector<PlyProperty> all = {{"x", position}, {"y", position}, {"z", position}};
        for (const HitColumn& column : columns_) {
            for (const std::string_view name : column.properties)
                all.push_back({std::string(name), column.type});
        }
        all.push_back({"bundle", NumberType::kUint32});
        return all;
    }

    /// Stores x, y and z of points of `size` bytes. Returns the end of x, y and z in the first
    /// point.
    std::byte* putPositions(const HitBatch& hits, std::byte* out, std::size_t size) const {
        const auto put_all = [&](auto&& number) {
            for (std::size_t i = 0; i < hits.size; ++i)
                storeNumber(number(hits.positions[i]), out + i * size);
            return out + sizeof number(glm::dvec3());
        };
        if (double_positions_) return put_all([](const glm::dvec3& at) { return at; });
        return put_all([](const glm::dvec3& at) { return glm::vec3(at); });
    }

    std::string path_, comment_;
    bool double_positions_;
    std::vector<HitColumn> columns_;
    HitReader reader_;
    std::vector<Bundle> bundles_;
    std::optional<PlyWriter> writer_;
    std::uint64_t hits_ = 0;  ///< number of hits written so far
};

}  // namespace

std::unique_ptr<RayOutput> makeHitPoints(const std::string& path, const HitOptions& options) {
    return std::make_unique<HitPoints>(path, options);
}

}  // namespace peeler
