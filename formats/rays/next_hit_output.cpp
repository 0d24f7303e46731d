// SPDX-License-Identifier: Apache-2.0
// Writer of the hits before and after points, as arrays.
#include <algorithm>
#include <optional>
#include <utility>

#include "core/rays/point_hits.h"
#include "formats/arrays/table_writers.h"
#include "formats/rays/ray_output.h"

namespace peeler {
namespace {

constexpr std::size_t kPointsAtOnce = std::size_t{1} << 16;
constexpr std::uint32_t kInvalidId = 0xFFFFFFFFU;

class NextHitOutput final : public RayOutput {
  public:
    NextHitOutput(std::string path, const PosedScene& posed, std::vector<glm::dvec3> points)
        : path_(std::move(path)), posed_(posed), points_(std::move(points)) {}

    SizeForecast forecast(std::span<const Bundle> bundles,
                          std::span<const std::uint64_t>) const override {
        return {ArrayWriter::fileBytes(path_, arraysOf(bundles.size()))};
    }

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t>) override {
        bundles_ = {bundles.begin(), bundles.end()};
        writer_.emplace(path_, arraysOf(bundles.size()));
        writer_->append(6, asBytes(points_));
        for (const Bundle& bundle : bundles_) {
            const glm::dvec3 direction = bundle.direction();
            writer_->append(7, asBytes(std::span(&direction, 1)));
        }
        found_.resize(points_.size());
    }

    void take(std::size_t bundle, const LayeredImage& band) override {
        findPointHits(posed_, bundles_[bundle], band, points_, found_);
        if (band.window.y1 != bundles_[bundle].view.crop.y1) return;
        write();
        beside_ +=
            static_cast<std::uint64_t>(std::ranges::count_if(points_, [&](const glm::dvec3& point) {
                return !nearestRay(bundles_[bundle], point);
            }));
        std::ranges::fill(found_, PointHits{});
    }

    void finish() override { writer_->finish(); }
    SinkMemory memory(const Bundle&) const override {
        return {.bytes = points_.size() * sizeof(PointHits)};
    }
    RayResults results() const override {
        RayResults results;
        results.next_hits = {points_.size(), before_, after_, beside_};
        return results;
    }

  private:
    std::vector<NamedArray> arraysOf(std::uint64_t d) const {
        const std::uint64_t n = points_.size();
        std::vector<NamedArray> arrays;
        for (const char* side : {"before", "after"}) {
            arrays.push_back({std::string("t_") + side, NumberType::kFloat, {d, n}});
            for (const char* ids : {"geometry_ids_", "primitive_ids_"})
                arrays.push_back({std::string(ids) + side, NumberType::kUint32, {d, n}});
        }
        arrays.push_back({"points", NumberType::kDouble, {n, 3}});
        arrays.push_back({"directions", NumberType::kDouble, {d, 3}});
        return arrays;
    }
    /// Writes the hits of the current bundle.
    void write() {
        for (std::size_t first = 0; first < found_.size(); first += kPointsAtOnce) {
            const auto some =
                std::span(found_).subspan(first, std::min(kPointsAtOnce, found_.size() - first));
            before_ += writeSide(0, some, &PointHits::before);
            after_ += writeSide(3, some, &PointHits::after);
        }
    }

    /// Writes the hits on one side to three arrays; `array` is the index of the first. Returns the
    /// number of hits.
    std::uint64_t writeSide(std::size_t array, std::span<const PointHits> hits,
                            NextHit PointHits::*side) {
        std::uint64_t count = 0;
        t_.clear();
        geometry_.clear();
        primitive_.clear();
        for (const PointHits& hit : hits) {
            const NextHit& next = hit.*side;
            const bool is_hit = next.key != 0;
            const KeyOrigin origin = is_hit ? posed_.drawList().originOf(next.key) : KeyOrigin{};
            t_.push_back(static_cast<float>(next.distance));
            geometry_.push_back(is_hit ? static_cast<std::uint32_t>(origin.instance) : kInvalidId);
            primitive_.push_back(is_hit ? origin.in_mesh : kInvalidId);
            if (is_hit) ++count;
        }
        writer_->append(array, asBytes(t_));
        writer_->append(array + 1, asBytes(geometry_));
        writer_->append(array + 2, asBytes(primitive_));
        return count;
    }

    std::string path_;
    PosedScene posed_;
    std::vector<glm::dvec3> points_;
    std::vector<Bundle> bundles_;
    std::optional<ArrayWriter> writer_;
    std::vector<PointHits> found_;  ///< hits of the current bundle
    std::uint64_t before_ = 0, after_ = 0, beside_ = 0;
    std::vector<float> t_;
    std::vector<std::uint32_t> geometry_, primitive_;
};

}  // namespace

std::unique_ptr<RayOutput> makeNextHitOutput(std::string path, const PosedScene& posed,
                                             std::vector<glm::dvec3> points) {
    return std::make_unique<NextHitOutput>(std::move(path), posed, std::move(points));
}

}  // namespace peeler
