// SPDX-License-Identifier: Apache-2.0
// Writer of flat display pictures (PNG, JPEG, TIFF), with tone maps and sRGB.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/composite.h>
#include <peeler/output_options.h>
#include <peeler/sink.h>
#include "formats/file/size_forecast.h"
#include "formats/image/display.h"

namespace peeler {

class AtomicFile;

struct ImageFormat {
    std::string_view name;  ///< in OpenImageIO
    std::vector<std::string_view> extensions;
    std::string_view summary;
    int bits = 8;  ///< per sample
};
/// Returns the table of formats that ImageWriter writes.
std::span<const ImageFormat> imageFormats();
/// Returns the row for a path's extension; null if there is none.
const ImageFormat* findImageFormat(const std::string& path);

/// Returns the maximum file size for a number of pixels: compression adds at most a thousandth. The
/// path must have an extension of the table.
SizeForecast imageForecast(const std::string& path, std::uint64_t pixels);

/// The meaning of alpha in a file.
enum class PictureAlpha : std::uint8_t {
    kOpacity,  ///< opacity over the background
    /// Whether a pixel has any fragment: 255, or 0 and black. The picture is then over black
    /// instead of the background, and a pixel with a fragment is never fully black: at least (1, 1,
    /// 1) in place of (0, 0, 0). So alpha and colour give the same mask.
    kAnyFragment
};

/// Writes the crop of the picture, all layers composited over the background, with the display
/// transform of `options` (Display), sRGB-encoded, in the format of the path's extension. PNG and
/// TIFF keep straight alpha (straightPixel). JPEG has no alpha: transparent areas become black.
/// With automatic exposure the composite is kept until finish(), 16 bytes per pixel (28 with
/// coloured opacity), and metered; a part of a picture is not metered, so that parts match.
class ImageWriter : public Sink {
  public:
    /// Throws Error (kUsage) if there is no such tone map, and Error (kInternal) if the path has no
    /// extension of the table.
    ImageWriter(std::string path, OutputOptions options,
                PictureAlpha alpha = PictureAlpha::kOpacity);
    ~ImageWriter() override;

    /// Throws Error (kOutput) if the file cannot be created or the format cannot hold the picture.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    /// Does finish() without the commit, for commitAll().
    AtomicFile& close();
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return times_; }

  private:
    struct Output;
    void encode(const CompositeImage& composite);
    /// Whether such a picture is metered for its exposure.
    bool metersOf(const Plan& plan) const;

    std::string path_;
    OutputOptions options_;
    PictureAlpha alpha_;
    const ImageFormat* format_ = nullptr;
    Display display_;
    bool metered_ = false;  ///< finish() meters the exposure of `kept_`
    bool tinted_ = false;   ///< the picture has coloured opacity
    CompositeImage kept_;
    std::unique_ptr<Output> output_;
    CompositeImage composite_;
    StageTimes times_;
};

/// Writes 8-bit grey samples, row-major, as a PNG into a file that the caller commits. The samples
/// are stored unchanged. `software` is stored in the file unless empty. Throws Error (kOutput) if
/// writing fails.
void writeGreyPng(AtomicFile& file, int width, int height, std::span<const std::uint8_t> samples,
                  const std::string& software = {});
/// Writes 16-bit grey samples in the same way.
void writeGreyPng(AtomicFile& file, int width, int height, std::span<const std::uint16_t> samples,
                  const std::string& software = {});

/// Makes `image` one fragment at Z = 0 in every pixel of the window, the form in which writers take
/// a finished picture. Returns its colours to fill in, row-major: premultiplied linear RGBA in
/// float. Reuses the storage of `image`.
std::span<float> onePerPixel(const Window& window, LayeredImage& image);

/// Exact table for round(255 · encodeSrgb(linear)) of any float; NaN becomes 0.
class SrgbBytes {
  public:
    /// Builds the table: finds the lower bound of each byte by bisection.
    SrgbBytes();

    std::uint8_t operator()(float linear) const {
        if (!(linear >= begins_[1])) return 0;
        if (linear >= 1) return 255;
        std::size_t byte = first_[bucketOf(linear)];
        while (linear >= begins_[byte + 1])
            ++byte;
        return static_cast<std::uint8_t>(byte);
    }

  private:
    /// A bucket covers one value of the exponent and 6 mantissa bits, from 2^-13 on: about one byte
    /// starts in each.
    static constexpr unsigned kShift = 17;
    static constexpr std::uint32_t kFirst = std::bit_cast<std::uint32_t>(0x1p-13F) >> kShift,
                                   kEnd = std::bit_cast<std::uint32_t>(1.0F) >> kShift;
    static std::size_t bucketOf(float linear) {
        return (std::bit_cast<std::uint32_t>(linear) >> kShift) - kFirst;
    }

    std::array<float, 257> begins_;                    ///< least float of each byte, then +inf
    std::array<std::uint8_t, kEnd - kFirst> first_{};  ///< byte at the start of each bucket
};

}  // namespace peeler
