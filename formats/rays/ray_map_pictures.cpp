// SPDX-License-Identifier: Apache-2.0
// Writes a map as PNG, JPEG or TIFF, its numbers as colours.
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/color.h"
#include "core/base/error.h"
#include "formats/file/file_name.h"
#include "formats/image/image_writer.h"
#include "formats/rays/ray_map_output.h"

namespace peeler {
namespace {

using ValueRange = std::pair<double, double>;

/// The colour of a transmission (0 to 1), like a film: black where all passes, white where nothing
/// does; even to the eye, so that dense parts keep their details.
std::array<float, 3> film(float transmission) {
    const float grey = linearFromSrgb(std::clamp(1 - transmission, 0.0F, 1.0F));
    return {grey, grey, grey};
}

class RayMapPictures : public RayMapOutput {
  public:
    RayMapPictures(std::string path, const PosedScene& posed, const Solids* solids,
                   const RayMapOptions& options)
        : RayMapOutput(posed, solids, options.settings),
          path_(std::move(path)),
          given_(options.range) {
        if (maps().channels().size() != 1) {
            throw Error(ErrorKind::kUsage,
                        options.settings.maps.size() == 1
                            ? "path-length is a number a material, and a picture shows one number"
                            : "a picture shows one map",
                        path_, "write .exr, or give --attenuation for an X-ray, or --map once");
        }
        output_.provenance = options.provenance;
        map_ = maps().channels().front().map;
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
            size += imageForecast(path_, bundle.rays());
        return size;
    }
    void finish() override {}

  protected:
    void beginBundle(std::size_t bundle) override {
        bundle_ = bundle;
        picture_ = std::make_unique<ImageWriter>(pathOf(bundle), output_);
        Plan plan;
        plan.view = bundles()[bundle].view;
        picture_->begin(plan);
        values_.clear();
    }
    void writeRows(const Window& rows, std::span<const float> planes) override {
        if (given_) {
            paint(rows, planes, *given_);
        } else {
            values_.insert(values_.end(), planes.begin(), planes.end());
        }
    }
    void finishBundle() override {
        if (!given_) paintAll();
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
    /// Paints the values that were kept until their range was known.
    void paintAll() {
        constexpr int kRowsAtOnce = 64;
        const RayMapStatistics& found = statistics(bundle_).front();
        const bool distance = map_ == RayMap::kFirst || map_ == RayMap::kLast;
        // Without a finite value nothing is shown, whatever the range.
        const ValueRange range{distance ? found.least.value_or(0) : 0, found.greatest.value_or(0)};
        const Window& crop = bundles()[bundle_].view.crop;
        const auto width = static_cast<std::size_t>(crop.width());
        for (int y = crop.y0; y < crop.y1; y += kRowsAtOnce) {
            const Window rows{crop.x0, y, crop.x1, std::min(y + kRowsAtOnce, crop.y1)};
            const std::size_t first = static_cast<std::size_t>(y - crop.y0) * width;
            paint(rows, std::span(values_).subspan(first, rows.pixels()), range);
        }
    }

    void paint(const Window& rows, std::span<const float> values, const ValueRange& range) {
        const auto ramp = map_ == RayMap::kTransmission ? film : inferno;
        const auto [low, high] = range;
        const std::span<float> out = onePerPixel(rows, colors_);
        for (std::size_t i = 0; i < values.size(); ++i) {
            const bool known = std::isfinite(values[i]);
            const double share = high > low ? (values[i] - low) / (high - low) : 0;
            const auto color = known ? ramp(static_cast<float>(share)) : std::array<float, 3>{};
            std::ranges::copy(color, &out[4 * i]);
            out[4 * i + 3] = known ? 1.0F : 0.0F;
        }
        picture_->write(std::move(colors_));
    }

    std::string path_;
    OutputOptions output_;
    std::optional<ValueRange> given_;
    RayMap map_ = RayMap::kFirst;
    std::size_t bundle_ = 0;  ///< the bundle at hand
    std::unique_ptr<Sink> picture_;
    std::vector<float> values_;  ///< of that bundle so far, if their range is not known yet
    LayeredImage colors_;
};

}  // namespace

std::unique_ptr<RayOutput> makeRayMapPictures(const std::string& path, const PosedScene& posed,
                                              const Solids* solids, const RayMapOptions& options) {
    return std::make_unique<RayMapPictures>(path, posed, solids, options);
}

}  // namespace peeler
