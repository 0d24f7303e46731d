// SPDX-License-Identifier: Apache-2.0
// Evaluation of ray maps, checks of their settings, and their writers for OpenEXR and arrays.
#include "formats/rays/ray_map_output.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "formats/arrays/bundle_arrays.h"
#include "formats/arrays/fragment_columns.h"
#include "formats/exr/exr_plane_writer.h"
#include "formats/file/file_name.h"
#include "formats/image/image_writer.h"

namespace peeler {
namespace {

constexpr std::size_t kValuesAtOnce = std::size_t{1} << 22;

/// Returns the area of a pixel of a parallel bundle, in square scene units.
double rayArea(const View& view) {
    return 4 * view.projection.half_width * view.projection.half_height /
           (double(view.width) * view.height);
}

/// Returns the values of some rows as 32-bit words: integers for integer maps, else floats.
std::span<const std::uint32_t> bitsOf(const RayMaps& maps, const Window& rows,
                                      std::span<const float> planes,
                                      std::vector<std::uint32_t>& numbers) {
    numbers.resize(planes.size());
    const std::size_t plane = rows.pixels();
    for (std::size_t c = 0; c < maps.channels().size(); ++c) {
        const auto from = planes.subspan(c * plane, plane);
        const bool whole = infoOf(maps.channels()[c].map).type == PixelType::kUint;
        std::ranges::transform(from, &numbers[c * plane], [&](float value) {
            return whole ? static_cast<std::uint32_t>(value) : std::bit_cast<std::uint32_t>(value);
        });
    }
    return numbers;
}

/// Writer of maps as OpenEXR: a part for each bundle, and in it a channel for each map or material.
class RayMapFile : public RayMapOutput {
  public:
    RayMapFile(std::string path, const PosedScene& posed, const Solids* solids,
               const RayMapOptions& options)
        : RayMapOutput(posed, solids, options.settings),
          path_(std::move(path)),
          provenance_(options.provenance) {}

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override {
        RayMapOutput::begin(bundles, hits);
        const std::vector<View> views = withCommonDisplay(bundles);
        std::vector<ExrPlanePart> parts;
        for (std::size_t i = 0; i < bundles.size(); ++i) {
            Plan plan;
            plan.view = views[i];
            parts.push_back({bundles[i].name, plan, false});
        }
        std::vector<ExrPlaneChannel> channels;
        for (const RayMapChannel& channel : maps().channels())
            channels.push_back({channel.name, infoOf(channel.map).type});
        writer_ = std::make_unique<ExrPlaneWriter>(path_, parts, provenance_, channels);
    }
    SizeForecast forecast(std::span<const Bundle> bundles,
                          std::span<const std::uint64_t>) const override {
        std::uint64_t bytes = 0;
        for (const Bundle& bundle : bundles) {
            bytes += exrHeaderBytes(provenance_.ids) +
                     sizeof(float) * maps().channels().size() * bundle.rays() +
                     kExrChunkBytes * static_cast<std::uint64_t>(bundle.view.crop.height());
        }
        return {bytes, Certainty::kAtMost};
    }
    void finish() override { writer_->finish(); }
    SinkMemory memory(const Bundle& bundle) const override {
        SinkMemory memory = RayMapOutput::memory(bundle);
        const std::size_t channels = maps().channels().size();
        memory.bytes += ExrPlaneWriter::memory(bundle.view.crop.width(), channels);
        memory.pixel_bytes += channels * sizeof(std::uint32_t);  // numbers_
        return memory;
    }

  protected:
    void beginBundle(std::size_t) override {}
    void writeRows(const Window& rows, std::span<const float> planes) override {
        writer_->append(asBytes(bitsOf(maps(), rows, planes, numbers_)));
    }
    void finishBundle() override {}
    std::string pathOf(std::size_t) const override { return path_; }

  private:
    std::string path_;
    Provenance provenance_;
    std::unique_ptr<ExrPlaneWriter> writer_;
    std::vector<std::uint32_t> numbers_;  ///< values of the rows being written, as 32-bit words
};

/// Writer of maps as arrays: an array for each map or material of each bundle, then the arrays of
/// bundleArrays().
class RayMapArrays : public RayMapOutput {
  public:
    RayMapArrays(std::string path, const PosedScene& posed, const Solids* solids,
                 const RayMapOptions& options)
        : RayMapOutput(posed, solids, options.settings),
          path_(std::move(path)),
          output_hash_(options.provenance.output_hash) {}

    SizeForecast forecast(std::span<const Bundle> bundles,
                          std::span<const std::uint64_t>) const override {
        return {
            ArrayWriter::fileBytes(path_, arraysOf(bundles), bundleTexts(bundles, output_hash_))};
    }
    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override {
        RayMapOutput::begin(bundles, hits);
        writer_.emplace(path_, arraysOf(bundles), bundleTexts(bundles, output_hash_));
        writeBundles(*writer_, bundles.size() * maps().channels().size(), bundles);
    }
    void finish() override { writer_->finish(); }
    SinkMemory memory(const Bundle& bundle) const override {
        SinkMemory memory = RayMapOutput::memory(bundle);
        // numbers_
        memory.pixel_bytes += maps().channels().size() * sizeof(std::uint32_t);
        return memory;
    }

  protected:
    void beginBundle(std::size_t bundle) override { first_ = bundle * maps().channels().size(); }
    void writeRows(const Window& rows, std::span<const float> planes) override {
        const auto numbers = bitsOf(maps(), rows, planes, numbers_);
        for (std::size_t c = 0; c < maps().channels().size(); ++c)
            writer_->append(first_ + c, asBytes(numbers.subspan(c * rows.pixels(), rows.pixels())));
    }
    void finishBundle() override {}
    std::string pathOf(std::size_t) const override { return path_; }

  private:
    std::vector<NamedArray> arraysOf(std::span<const Bundle> bundles) const {
        std::vector<NamedArray> arrays;
        for (std::size_t i = 0; i < bundles.size(); ++i) {
            const Window& rays = bundles[i].view.crop;
            for (const RayMapChannel& channel : maps().channels())
                arrays.push_back({channel.name + '.' + std::to_string(i),
                                  numberTypeOf(infoOf(channel.map).type),
                                  {static_cast<std::uint64_t>(rays.height()),
                                   static_cast<std::uint64_t>(rays.width())}});
        }
        std::ranges::move(bundleArrays(bundles.size()), std::back_inserter(arrays));
        return arrays;
    }

    std::string path_, output_hash_;
    std::optional<ArrayWriter> writer_;
    std::size_t first_ = 0;               ///< index of the current bundle's first array
    std::vector<std::uint32_t> numbers_;  ///< values of the rows being written, as 32-bit words
};

bool hasMap(const RayMapSettings& settings, RayMap map) {
    return std::ranges::find(settings.maps, map) != settings.maps.end();
}

void checkMapSettings(const RayMapSettings& settings) {
    if (hasMap(settings, RayMap::kTransmission) && settings.attenuation.empty()) {
        throw Error(ErrorKind::kUsage, "transmission needs the attenuation of materials",
                    "transmission", "give " + Parameter::kAttenuation + " MATERIAL=MU");
    }
    if (!hasMap(settings, RayMap::kOverlap)) return;
    const auto& [a, b] = settings.parts;
    if (a.empty() || b.empty()) {
        throw Error(ErrorKind::kUsage, "an overlap needs two parts", "overlap",
                    "give " + Parameter::kParts + " twice");
    }
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
        if (a[i] && b[i]) {
            throw Error(ErrorKind::kUsage, "a node belongs to both parts",
                        "/nodes/" + std::to_string(i),
                        "give " + Parameter::kParts + " names that do not share nodes");
        }
    }
}

void addValues(std::span<const float> values, RayMapStatistics& statistics) {
    constexpr double kInfinite = std::numeric_limits<double>::infinity();
    double least = statistics.least.value_or(kInfinite);
    double greatest = statistics.greatest.value_or(-kInfinite);
    double sum = statistics.sum;  // a local, since storing each sum takes longer than adding
    for (const float value : values) {
        if (!std::isfinite(value)) continue;
        least = std::min(least, double{value});
        greatest = std::max(greatest, double{value});
        sum += double{value};
    }
    if (least > greatest) return;
    statistics.sum = sum;
    statistics.least = least;
    statistics.greatest = greatest;
}

}  // namespace

void RayMapOutput::begin(std::span<const Bundle> bundles, std::span<const std::uint64_t>) {
    bundles_.assign(bundles.begin(), bundles.end());
    std::vector<RayMapStatistics> none;
    for (const RayMapChannel& channel : maps_.channels())
        none.push_back({.name = channel.name});
    statistics_.assign(bundles.size(), none);
}

void RayMapOutput::take(std::size_t bundle, const LayeredImage& band) {
    const Window& window = band.window;
    const Window& crop = bundles_[bundle].view.crop;
    if (window.y0 == crop.y0) {
        maps_.begin(bundles_[bundle]);
        beginBundle(bundle);
    }
    const std::size_t channels = maps_.channels().size();
    const std::size_t row = std::max<std::size_t>(1, channels * std::size_t(window.width()));
    const int at_once = static_cast<int>(std::clamp<std::size_t>(kValuesAtOnce / row, 1, 1024));
    for (int y = window.y0; y < window.y1; y += at_once) {
        const Window rows{window.x0, y, window.x1, std::min(y + at_once, window.y1)};
        maps_.evaluateRows(bundles_[bundle], band, rows.y0, rows.y1, planes_);
        const std::span<const float> planes(planes_);
        for (std::size_t c = 0; c < channels; ++c)
            addValues(planes.subspan(c * rows.pixels(), rows.pixels()), statistics_[bundle][c]);
        writeRows(rows, planes);
    }
    if (window.y1 == crop.y1) finishBundle();
}

SinkMemory RayMapOutput::memory(const Bundle&) const {
    return {.bytes = maps_.mostBytes(), .pixel_bytes = maps_.channels().size() * sizeof(float)};
}

RayResults RayMapOutput::results() const {
    RayResults results;
    for (std::size_t i = 0; i < bundles_.size(); ++i) {
        RayMapResult& result =
            results.maps.emplace_back(RayMapResult{bundles_[i].name, pathOf(i), statistics_[i]});
        if (!bundles_[i].parallel()) continue;
        for (std::size_t c = 0; c < result.channels.size(); ++c)
            if (infoOf(maps_.channels()[c].map).length)
                result.channels[c].volume = result.channels[c].sum * rayArea(bundles_[i].view);
    }
    return results;
}

bool needsSolids(std::span<const RayMap> maps) {
    return std::ranges::any_of(maps, [](RayMap map) { return infoOf(map).solids; });
}

std::unique_ptr<RayOutput> makeRayMapOutput(const std::string& path, const PosedScene& posed,
                                            const Solids* solids, RayMapOptions options) {
    std::vector<RayMap>& maps = options.settings.maps;
    checkMapSettings(options.settings);
    const bool picture = findImageFormat(path) != nullptr;
    const auto paths = std::ranges::find(maps, RayMap::kPathLength);
    if (paths != maps.end() && !options.settings.attenuation.empty() &&
        !hasMap(options.settings, RayMap::kTransmission)) {
        if (picture) {
            *paths = RayMap::kTransmission;
        } else {
            maps.insert(paths + 1, RayMap::kTransmission);
        }
    }
    if (picture) return makeRayMapPictures(path, posed, solids, options);
    const bool arrays = isArrayName(path);
    if (lowerExtension(path) != ".exr" && !arrays) {
        throw Error(ErrorKind::kUsage, "maps cannot be written in this format", path,
                    "end the name in .exr, .npz, .safetensors, .png, .jpg or .tif");
    }
    if (options.range) {
        throw Error(ErrorKind::kUsage,
                    std::string("a range is for pictures: ") +
                        (arrays ? "arrays hold" : "an EXR holds") + " unscaled numbers",
                    Parameter::kRange, "leave it out, or write .png, .jpg or .tif");
    }
    if (arrays) return std::make_unique<RayMapArrays>(path, posed, solids, options);
    return std::make_unique<RayMapFile>(path, posed, solids, options);
}

}  // namespace peeler
