// SPDX-License-Identifier: Apache-2.0
// Writer of a map as PNG, JPEG or TIFF in false colours.
#include <algorithm>
#include <cmath>
#include <utility>

#include <peeler/error.h>
#include "core/base/color.h"
#include "formats/file/file_name.h"
#include "formats/image/image_writer.h"
#include "formats/image/legend.h"
#include "formats/rays/ray_map_output.h"

namespace peeler {
namespace {

constexpr int kRowsAtOnce = 64;

using ValueRange = std::pair<double, double>;

/// Returns the colour for a transmission (0 to 1), as on X-ray film: black for full transmission,
/// white for zero transmission. The scale is perceptually uniform, to show details of dense parts.
std::array<float, 3> film(float transmission) {
    const float grey = linearFromSrgb(std::clamp(1 - transmission, 0.0F, 1.0F));
    return {grey, grey, grey};
}

using Ramp = std::array<float, 3> (*)(float share);

Ramp rampOf(RayMap map) {
    return map == RayMap::kTransmission ? film : inferno;
}

constexpr std::pair<RayMap, const char*> kTitles[] = {
    {RayMap::kFirst, "distance to the first hit"},
    {RayMap::kLast, "distance to the last hit"},
    {RayMap::kCount, "number of hits"},
    {RayMap::kThickness, "thickness"},
    {RayMap::kTransmission, "share of X-rays that pass"},
    {RayMap::kParity, "solids hit an odd number of times"},
    {RayMap::kOverlap, "length inside both parts"},
};

bool isDistance(RayMap map) {
    return map == RayMap::kFirst || map == RayMap::kLast;
}

class RayMapPictures : public RayMapOutput {
  public:
    RayMapPictures(std::string path, const PosedScene& posed, const Solids* solids,
                   const RayMapOptions& options)
        : RayMapOutput(posed, solids, options.settings),
          path_(std::move(path)),
          given_(options.range),
          legend_(options.legend),
          unit_(options.unit) {
        map_ = options.settings.maps.front();
        const bool colors = map_ == RayMap::kBaseColor && options.settings.maps.size() == 1;
        if (maps().channels().size() != 1 && !colors) {
            throw Error(
                ErrorKind::kUsage,
                options.settings.maps.size() == 1
                    ? "path-length has one value per material, but a picture shows one value"
                    : "a picture shows one map",
                path_,
                "write .exr, or give " + Parameter::kAttenuation + " for an X-ray, or " +
                    Parameter::kMaps + " once");
        }
        output_.provenance = options.provenance;
        map_ = maps().channels().front().map;
        if (colors) {
            if (given_)
                throw Error(ErrorKind::kUsage, "base colours have no range", Parameter::kRange,
                            "leave it out");
            given_ = {0, 1};
            legend_ = false;
        }
        if (!given_ && map_ == RayMap::kTransmission) given_ = {0, 1};
    }

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override {
        checkNames(bundles);
        RayMapOutput::begin(bundles, hits);
    }
    SizeForecast forecast(std::span<const Bundle> bundles,
                          std::span<const std::uint64_t>) const override {
        checkNames(bundles);
        SizeForecast size;
        for (const Bundle& bundle : bundles)
            size += imageForecast(path_, pixelsOf(bundle));
        return size;
    }
    void finish() override {}
    SinkMemory memory(const Bundle& bundle) const override {
        SinkMemory memory = RayMapOutput::memory(bundle);
        // values_, kept until the range is known
        if (!given_) memory.bytes += bundle.rays() * sizeof(float);
        Plan plan;
        plan.view = bundle.view;
        memory.bytes += ImageWriter(path_, output_).memory(plan).bytes;
        // Painted rows are in memory twice: as one fragment per pixel, and as a composite.
        constexpr std::uint64_t kPainted = 2 * sizeof(std::uint32_t) +
                                           sizeof(std::array<float, 4>) +
                                           CompositeImage::pixelBytes(false);
        memory.bytes +=
            kRowsAtOnce * static_cast<std::uint64_t>(bundle.view.crop.width()) * kPainted;
        return memory;
    }

  protected:
    void beginBundle(std::size_t bundle) override {
        bundle_ = bundle;
        picture_ = std::make_unique<ImageWriter>(pathOf(bundle), output_);
        Plan plan;
        plan.view = bundles()[bundle].view;
        if (legend_) makeRoom(plan.view);
        picture_->begin(plan);
        values_.clear();
        if (!given_) values_.reserve(bundles()[bundle].rays());
    }
    void writeRows(const Window& rows, std::span<const float> planes) override {
        if (map_ == RayMap::kBaseColor) {
            paintColors(rows, planes);
        } else if (given_) {
            paint(rows, planes, *given_);
        } else {
            values_.insert(values_.end(), planes.begin(), planes.end());
        }
    }
    void finishBundle() override {
        const ValueRange range = given_.value_or(foundRange());
        if (!given_) paintAll(range);
        if (legend_) writeLegend(range);
        picture_->finish();
        picture_.reset();
    }
    std::string pathOf(std::size_t bundle) const override {
        return hasFrameToken(path_) ? framePath(path_, static_cast<int>(bundle)) : path_;
    }

  private:
    void checkNames(std::span<const Bundle> bundles) const {
        if (bundles.size() <= 1 || hasFrameToken(path_)) return;
        throw Error(ErrorKind::kUsage, "the pictures of the bundles would have the same name",
                    path_, "put #### where the number of the bundle goes, or write .exr");
    }
    /// Returns the number of pixels in a bundle's picture, including the legend.
    std::uint64_t pixelsOf(const Bundle& bundle) const {
        if (!legend_) return bundle.rays();
        const auto size = colorBarSize(bar({}).title, bundle.view.crop.width());
        return static_cast<std::uint64_t>(size.width) *
               static_cast<std::uint64_t>(bundle.view.crop.height() + size.height);
    }

    /// Enlarges the picture by the legend's height. If the legend is wider than the picture, the
    /// picture gets the legend's width.
    void makeRoom(View& view) {
        size_ = colorBarSize(bar({}).title, view.crop.width());
        view.crop.x1 = view.crop.x0 + size_.width;
        view.crop.y1 += size_.height;
        view.width = std::max(view.width, view.crop.x1);
        view.height = std::max(view.height, view.crop.y1);
    }

    /// Returns the legend for a range.
    ColorBar bar(const ValueRange& range) const {
        const auto title = std::ranges::find(kTitles, map_, &std::pair<RayMap, const char*>::first);
        ColorBar bar{title->second, range.first, range.second, rampOf(map_)};
        if (!infoOf(map_).length && !isDistance(map_)) return bar;
        const bool small = std::max(std::abs(range.first), std::abs(range.second)) < 1;
        const auto [name, metres] =
            unit_.value_or(small ? std::pair<std::string, double>("mm", 1e-3)
                                 : std::pair<std::string, double>("m", 1));
        bar.title += ", " + name;
        bar.low /= metres;
        bar.high /= metres;
        return bar;
    }

    void writeLegend(const ValueRange& range) {
        const CompositeImage legend = drawColorBar(bar(range), size_);
        const Window& crop = bundles()[bundle_].view.crop;
        const Window rows{crop.x0, crop.y1, crop.x0 + size_.width, crop.y1 + size_.height};
        const std::span<float> out = onePerPixel(rows, colors_);
        for (std::size_t i = 0; i < legend.rgba.size(); ++i)
            std::ranges::copy(legend.rgba[i], &out[4 * i]);
        picture_->write(std::move(colors_));
    }

    ValueRange foundRange() const {
        const RayMapStatistics& found = statistics(bundle_).front();
        // Without finite values, no pixel is painted, and the range does not matter.
        return {isDistance(map_) ? found.least.value_or(0) : 0, found.greatest.value_or(0)};
    }

    /// Paints values_ after the range is known.
    void paintAll(const ValueRange& range) {
        const Window& crop = bundles()[bundle_].view.crop;
        const auto width = static_cast<std::size_t>(crop.width());
        for (int y = crop.y0; y < crop.y1; y += kRowsAtOnce) {
            const Window rows{crop.x0, y, crop.x1, std::min(y + kRowsAtOnce, crop.y1)};
            const std::size_t first = static_cast<std::size_t>(y - crop.y0) * width;
            paint(rows, std::span(values_).subspan(first, rows.pixels()), range);
        }
    }

    void paintColors(const Window& rows, std::span<const float> planes) {
        const std::span<float> out = onePerPixel(rows, colors_);
        const std::size_t pixels = rows.pixels();
        for (std::size_t i = 0; i < pixels; ++i)
            for (std::size_t c = 0; c < 4; ++c)
                out[4 * i + c] = planes[c * pixels + i];
        picture_->write(std::move(colors_));
    }

    void paint(const Window& rows, std::span<const float> values, const ValueRange& range) {
        const auto ramp = rampOf(map_);
        const auto [low, high] = range;
        const auto columns = static_cast<std::size_t>(rows.width());
        const auto wide = legend_ ? static_cast<std::size_t>(size_.width) : columns;
        const std::span<float> out =
            onePerPixel({rows.x0, rows.y0, rows.x0 + static_cast<int>(wide), rows.y1}, colors_);
        if (wide > columns) std::ranges::fill(out, 1.0F);  // white, as the legend's background
        for (std::size_t i = 0; i < values.size(); ++i) {
            const bool known = std::isfinite(values[i]);
            const double share = high > low ? (values[i] - low) / (high - low) : 0;
            const auto color = known ? ramp(static_cast<float>(share)) : std::array<float, 3>{};
            float* pixel = &out[4 * (i / columns * wide + i % columns)];
            std::ranges::copy(color, pixel);
            pixel[3] = known ? 1.0F : 0.0F;
        }
        picture_->write(std::move(colors_));
    }

    std::string path_;
    OutputOptions output_;
    std::optional<ValueRange> given_;
    bool legend_ = false;
    std::optional<std::pair<std::string, double>> unit_;
    LegendSize size_;  ///< size of the current bundle's legend
    RayMap map_ = RayMap::kFirst;
    std::size_t bundle_ = 0;
    std::unique_ptr<Sink> picture_;
    /// Values of the current bundle, kept until their range is known.
    std::vector<float> values_;
    LayeredImage colors_;
};

}  // namespace

std::unique_ptr<RayOutput> makeRayMapPictures(const std::string& path, const PosedScene& posed,
                                              const Solids* solids, const RayMapOptions& options) {
    return std::make_unique<RayMapPictures>(path, posed, solids, options);
}

}  // namespace peeler
