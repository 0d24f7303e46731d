// SPDX-License-Identifier: Apache-2.0
// The number of fragments of every pixel.
#include <algorithm>
#include <span>
#include <utility>

#include "core/base/color.h"
#include "formats/exr/exr_plane_writer.h"
#include "formats/file/file_name.h"
#include "formats/image/image_writer.h"

namespace peeler {

CountMap::CountMap(std::string path, OutputOptions options)
    : path_(std::move(path)), options_(std::move(options)) {}

CountMap::~CountMap() = default;

void CountMap::begin(const Plan& plan) {
    ramp_end_ = static_cast<float>(std::max<std::size_t>(1, plan.layers.size()));
    if (lowerExtension(path_) == ".exr") {
        plane_ = std::make_unique<ExrPlaneWriter>(path_, plan, options_.provenance,
                                                  "depth-complexity", "count", PixelType::kUint);
        return;
    }
    picture_ = std::make_unique<ImageWriter>(path_, options_);
    picture_->begin(plan);
}

void CountMap::write(LayeredImage&& band) {
    const std::size_t pixels = band.window.pixels();
    counts_.resize(pixels);
    for (std::size_t p = 0; p < pixels; ++p) {
        counts_[p] = band.count(p);
        largest_ = std::max(largest_, counts_[p]);
    }
    if (plane_) {
        plane_->append(std::as_bytes(std::span(counts_)));
        return;
    }
    // An opaque fragment in every pixel: what the writers of pictures take.
    colors_.window = band.window;
    colors_.color.channels = {"R", "G", "B", "A"};
    colors_.color.type = PixelType::kFloat;
    colors_.offsets.resize(pixels + 1);
    colors_.z.assign(pixels, 0.0F);
    colors_.color.data.resize(pixels * colors_.color.stride());
    const std::span<float> out = colors_.color.as<float>();
    for (std::size_t p = 0; p < pixels; ++p) {
        const auto color = inferno(static_cast<float>(counts_[p]) / ramp_end_);
        std::copy(color.begin(), color.end(), &out[4 * p]);
        out[4 * p + 3] = 1;
        colors_.offsets[p + 1] = static_cast<std::uint32_t>(p + 1);
    }
    picture_->write(std::move(colors_));
}

void CountMap::finish() {
    if (plane_) {
        plane_->finish();
    } else {
        picture_->finish();
    }
}

StageTimes CountMap::times() const {
    return plane_ ? plane_->times() : picture_->times();
}

}  // namespace peeler
