// SPDX-License-Identifier: Apache-2.0
// Flat display-referred images: PNG, JPEG, TIFF.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "core/image/composite.h"
#include "core/image/sink.h"

namespace peeler {

/// From linear Rec. 709, scene-referred and straight, to linear display values (0–1 where the curve
/// ends there; the rest is clipped).
struct ToneMap {
    std::string_view name, summary;
    std::array<float, 3> (*map)(std::array<float, 3>);
};
/// The table: the first row is the default.
std::span<const ToneMap> toneMaps();
/// Throws Error (kUsage) that lists them.
const ToneMap& findToneMap(const std::string& name);

/// The sRGB transfer function (IEC 61966-2-1), linear to encoded, clipped to 0–1; NaN becomes 0.
float encodeSrgb(float linear);

struct ImageOptions {
    std::array<float, 4> background{};  ///< premultiplied linear RGBA
    float exposure = 0;                 ///< stops: colours are multiplied by 2^exposure
    std::string tone_map = "none";
    std::string software;     ///< said in the file; empty = nothing
    std::string output_hash;  ///< likewise
};

/// Writes the crop of the picture, all layers composited over the background, sRGB-encoded, in 8
/// bits (TIFF: 16). PNG and TIFF keep alpha, straight: colours are divided by it before tone
/// mapping and encoding, so light without coverage (emission at alpha 0) is lost. JPEG has none:
/// what the background leaves open is black.
class ImageWriter : public Sink {
  public:
    /// `format`: "png", "jpeg" or "tiff". Throws Error (kUsage) if there is no such tone map.
    ImageWriter(std::string path, std::string format, ImageOptions options);
    ~ImageWriter() override;

    /// Throws Error (kOutput) if the file cannot be created or the format cannot hold the picture.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    StageTimes times() const override { return times_; }

  private:
    struct Output;
    std::string path_, format_;
    ImageOptions options_;
    const ToneMap* tone_map_ = nullptr;
    std::unique_ptr<Output> output_;
    CompositeImage composite_;
    StageTimes times_;
};

}  // namespace peeler
