// SPDX-License-Identifier: Apache-2.0
// Writer of layers for X-Ray. The loader that reads them is load_xrays() in src/dataset.py; the
// authors' writer is preprocess/get_xray/gen_objaverse.py. The authors' files have float data and
// int32 indices and are compressed; numpy reads both in the same way.
#include <algorithm>
#include <array>
#include <glm/glm.hpp>
#include <limits>
#include <numeric>
#include <optional>

#include <peeler/error.h>
#include "core/base/color.h"
#include "core/base/parallel.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/arrays/table_writers.h"

namespace peeler {
namespace {

constexpr std::size_t kXrayRows = 16, kXrayNumbers = 7;

enum XrayArray : std::size_t { kData, kIndices, kIndptr, kShape };

/// Returns, for each layer, the number of hits stored in the layers before it.
std::array<std::uint64_t, kXrayRows + 1> firstHits(const Plan& plan) {
    std::array<std::uint64_t, kXrayRows + 1> first{};
    for (std::size_t row = 0; row < kXrayRows; ++row) {
        const bool there = row < plan.layers.size();
        first[row + 1] = first[row] + (there ? plan.layers[row].pixels : 0);
    }
    return first;
}

std::vector<NamedArray> xrayArrays(const Plan& plan) {
    const std::uint64_t numbers = kXrayNumbers * firstHits(plan).back();
    const std::uint64_t columns = kXrayNumbers * plan.view.crop.pixels();
    const bool is_wide = std::max(numbers, columns) > std::numeric_limits<std::int32_t>::max();
    const NumberType index = is_wide ? NumberType::kInt64 : NumberType::kInt32;
    return {{"data", NumberType::kFloat, {numbers}},
            {"indices", index, {numbers}},
            {"indptr", index, {kXrayRows + 1}},
            {"shape", NumberType::kInt64, {2}}};
}

/// The seven X-Ray values of a band's fragments.
class XrayNumbers {
  public:
    XrayNumbers(const LayeredImage& band, const View& view)
        : to_camera_(glm::transpose(glm::dmat3(view.camera_to_world))) {
        const auto find = [&](std::string_view name) {
            const FragmentChannel found = findChannel(band, name);
            if (found) return found;
            throw Error(ErrorKind::kUsage,
                        "the picture has no channel " + std::string(name) + ", which " +
                            Parameter::kAs + " xray needs",
                        Parameter::kChannels,
                        "give distance, geometric-normal, facing and base-color");
        };
        distance_ = find("distance");
        facing_ = find("facing");
        for (std::size_t c = 0; c < 3; ++c) {
            normal_[c] = find(infoOf(Channel::kGeometricNormal).components[c]);
            color_[c] = find(infoOf(Channel::kBaseColor).components[c]);
        }
    }

    std::array<float, kXrayNumbers> of(std::size_t fragment) const {
        const double side = facing_.value(fragment) < 0 ? -1 : 1;
        const glm::dvec3 toward{normal_[0].value(fragment), normal_[1].value(fragment),
                                normal_[2].value(fragment)};
        const glm::vec3 normal = to_camera_ * (side * toward);
        std::array<float, kXrayNumbers> numbers = {distance_.value(fragment), normal.x, normal.y,
                                                   normal.z};
        for (std::size_t c = 0; c < 3; ++c)
            numbers[4 + c] = srgbFromLinear(std::clamp(color_[c].value(fragment), 0.0F, 1.0F));
        return numbers;
    }

  private:
    glm::dmat3 to_camera_;
    FragmentChannel distance_, facing_;
    std::array<FragmentChannel, 3> normal_, color_;
};

ArrayTexts textsOf(const OutputOptions& options) {
    return {{"output_hash", options.provenance.output_hash}};
}

class XrayWriter final : public Sink {
  public:
    XrayWriter(std::string path, OutputOptions options)
        : path_(std::move(path)), options_(std::move(options)) {}

    void begin(const Plan& plan) override {
        plan_ = plan;
        first_ = firstHits(plan);
        std::vector<NamedArray> arrays = xrayArrays(plan);
        is_wide_ = arrays[kIndices].type == NumberType::kInt64;
        writer_.emplace(path_, std::move(arrays), textsOf(options_), options_.compress);
        for (const std::uint64_t first : first_)
            writer_->append(kIndptr, indexBytes({kXrayNumbers * first}));
        const std::array<std::int64_t, 2> shape = {
            kXrayRows, static_cast<std::int64_t>(kXrayNumbers * plan.view.crop.pixels())};
        writer_->append(kShape, asBytes(shape));
    }

    void write(LayeredImage&& band) override {
        // The data of this number of pixels fits into the cache of one core.
        constexpr std::size_t kPixelsAtOnce = std::size_t{1} << 15;
        const XrayNumbers numbers(band, plan_.view);
        parallelFor(kXrayRows, [&](std::size_t row) {
            for (std::size_t first = 0; first < band.window.pixels(); first += kPixelsAtOnce)
                writeHits(band, numbers, row, first,
                          std::min(first + kPixelsAtOnce, band.window.pixels()));
        });
        pixels_ += band.window.pixels();
    }

    void finish() override { writer_->finish(); }
    SinkMemory memory(const Plan& plan) const override {
        if (!options_.compress) return {};
        return {.bytes = ArrayWriter::compressionBytes(forecastXray(path_, plan, options_))};
    }

  private:
    /// Returns the indices as bytes of the stored type.
    ByteBuffer indexBytes(const std::vector<std::uint64_t>& indices) const {
        ByteBuffer bytes(indices.size() * (is_wide_ ? sizeof(std::int64_t) : sizeof(std::int32_t)));
        std::byte* out = bytes.data();
        for (const std::uint64_t index : indices)
            out = is_wide_ ? storeNumber(static_cast<std::int64_t>(index), out)
                           : storeNumber(static_cast<std::int32_t>(index), out);
        return bytes;
    }

    /// Writes the hits of layer `row` in the pixels [first, last) of the band. The layer's matrix
    /// row holds the distances of all pixels, then the X components of all normals, and so on.
    void writeHits(const LayeredImage& band, const XrayNumbers& numbers, std::size_t row,
                   std::size_t first, std::size_t last) {
        std::vector<std::uint64_t> places;
        std::vector<std::array<float, kXrayNumbers>> hits;
        for (std::size_t p = first; p < last; ++p) {
            if (band.count(p) <= row) continue;
            places.push_back(pixels_ + p);
            hits.push_back(numbers.of(band.offsets[p] + row));
        }
        if (hits.empty()) return;
        const std::uint64_t all = first_[row + 1] - first_[row];
        std::vector<float> values(hits.size());
        for (std::size_t c = 0; c < kXrayNumbers; ++c) {
            std::ranges::transform(hits, values.begin(), [c](const auto& hit) { return hit[c]; });
            const std::uint64_t to = kXrayNumbers * first_[row] + c * all + written_[row];
            writer_->writeAt(kData, to * sizeof(float), asBytes(values));
            const ByteBuffer indices = indexBytes(places);
            writer_->writeAt(kIndices, to * (indices.size() / places.size()), indices);
            for (std::uint64_t& place : places)
                place += plan_.view.crop.pixels();
        }
        written_[row] += hits.size();
    }

    std::string path_;
    OutputOptions options_;
    Plan plan_;
    bool is_wide_ = false;  ///< whether indices have 64 bits
    std::array<std::uint64_t, kXrayRows + 1> first_{};
    std::array<std::uint64_t, kXrayRows> written_{};
    std::uint64_t pixels_ = 0;  ///< number of pixels written so far
    std::optional<ArrayWriter> writer_;
};

}  // namespace

std::span<const Channel> xrayChannels() {
    static constexpr Channel kNeeded[] = {Channel::kGeometricNormal, Channel::kBaseColor,
                                          Channel::kFacing, Channel::kDistance};
    return kNeeded;
}

std::unique_ptr<Sink> makeXray(const std::string& path, const OutputOptions& options) {
    return std::make_unique<XrayWriter>(path, options);
}

SizeForecast forecastXray(const std::string& path, const Plan& plan, const OutputOptions& options) {
    return ArrayWriter::forecast(path, xrayArrays(plan), textsOf(options), options.compress);
}

}  // namespace peeler
