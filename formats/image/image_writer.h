// SPDX-License-Identifier: Apache-2.0
// Flat display-referred images: PNG, JPEG, TIFF.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/composite.h"
#include "core/image/sink.h"
#include "formats/file/output_options.h"

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

struct ImageFormat {
    std::string_view name;  ///< OpenImageIO's
    std::vector<std::string_view> extensions;
    std::string_view summary;
    int bits = 8;  ///< of a sample
};
/// The table.
std::span<const ImageFormat> imageFormats();
/// The row for a path's extension; null if it is another format's.
const ImageFormat* findImageFormat(const std::string& path);

/// Writes the crop of the picture, all layers composited over the background, times 2^exposure,
/// sRGB-encoded, in the format of the path's extension. PNG and TIFF keep alpha, straight: colours
/// are divided by it before tone mapping and encoding, so light without coverage (emission at alpha
/// 0) is lost. JPEG has none: what the background leaves open is black.
class ImageWriter : public Sink {
  public:
    /// Throws Error (kUsage) if there is no such tone map; (kInternal) if the path ends in no
    /// extension of the table.
    ImageWriter(std::string path, OutputOptions options);
    ~ImageWriter() override;

    /// Throws Error (kOutput) if the file cannot be created or the format cannot hold the picture.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    StageTimes times() const override { return times_; }

  private:
    struct Output;
    std::string path_;
    OutputOptions options_;
    const ImageFormat* format_ = nullptr;
    const ToneMap* tone_map_ = nullptr;
    std::unique_ptr<Output> output_;
    CompositeImage composite_;
    StageTimes times_;
};

}  // namespace peeler
