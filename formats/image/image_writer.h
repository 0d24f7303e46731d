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
    std::string_view name;  ///< name in OpenImageIO
    std::vector<std::string_view> extensions;
    std::string_view summary;
    int bits = 8;  ///< bits per sample
};
/// Returns the table of the formats that ImageWriter writes.
std::span<const ImageFormat> imageFormats();
/// Returns the row for a path's extension, or null if the table has none.
const ImageFormat* findImageFormat(const std::string& path);

/// Returns the maximum file size for a number of pixels. Compression enlarges the data by at most a
/// thousandth. The path's extension must be in the table.
SizeForecast imageForecast(const std::string& path, std::uint64_t pixels);

/// The meaning of alpha in a file.
enum class PictureAlpha : std::uint8_t {
    kOpacity,  ///< alpha is the opacity over the background
    /// Alpha is 255 for pixels with a fragment. Other pixels have alpha 0 and are black. The
    /// picture is composited over black instead of the background. A pixel with a fragment is never
    /// black, since (0, 0, 0) becomes (1, 1, 1), so alpha and colour give the same mask.
    kAnyFragment
};

/// A writer of the picture's crop: all layers composited over the background, with the display
/// transform of `options` (Display), sRGB-encoded, in the format of the path's extension. PNG and
/// TIFF have straight alpha (straightPixel()). JPEG has no alpha, so transparent areas become
/// black.
///
/// For automatic exposure, keeps the composite until finish(), with 16 bytes per pixel (28 with
/// coloured opacity), then meters it. A part of a picture is not metered, so that all parts have
/// the same exposure.
class ImageWriter : public Sink {
  public:
    /// Throws Error (kUsage) if there is no tone map of this name, and Error (kInternal) if the
    /// table lacks the path's extension.
    ImageWriter(std::string path, OutputOptions options,
                PictureAlpha alpha = PictureAlpha::kOpacity);
    ~ImageWriter() override;

    /// Throws Error (kOutput) if the file cannot be created or the format cannot hold the picture.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    /// Finishes the file like finish(), but does not commit it. Returns the file for commitAll().
    AtomicFile& close();
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return times_; }

  private:
    struct Output;
    void encode(const CompositeImage& composite);
    /// Whether the exposure of a picture with this plan is automatic and metered.
    bool metersOf(const Plan& plan) const;

    std::string path_;
    OutputOptions options_;
    PictureAlpha alpha_;
    const ImageFormat* format_ = nullptr;
    Display display_;
    bool metered_ = false;  ///< whether finish() meters the exposure of `kept_`
    bool tinted_ = false;   ///< whether the picture has coloured opacity
    CompositeImage kept_;
    std::unique_ptr<Output> output_;
    CompositeImage composite_;
    StageTimes times_;
};

/// Writes 8-bit grey samples, row-major, as a PNG into a file that the caller then commits. The
/// samples are stored unchanged. `software` is stored unless empty. Throws Error (kOutput) if
/// writing fails.
void writeGreyPng(AtomicFile& file, int width, int height, std::span<const std::uint8_t> samples,
                  const std::string& software = {});
/// Like writeGreyPng() above, for 16-bit samples.
void writeGreyPng(AtomicFile& file, int width, int height, std::span<const std::uint16_t> samples,
                  const std::string& software = {});

/// Gives `image` exactly one fragment, at Z = 0, in every pixel of the window: writers take
/// finished pictures in this form. Returns the colours for the caller to fill in, row-major:
/// premultiplied linear RGBA in float. Reuses the storage of `image`.
std::span<float> onePerPixel(const Window& window, LayeredImage& image);

/// A table that gives exactly round(255 · encodeSrgb(linear)) for any float; NaN becomes 0.
class SrgbBytes {
  public:
    /// Finds the least float for each byte by bisection.
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
    /// A bucket holds the floats with the same exponent and the same upper 6 mantissa bits, from
    /// 2^-13 on. On average, about one byte value begins in each bucket.
    static constexpr unsigned kShift = 17;
    static constexpr std::uint32_t kFirst = std::bit_cast<std::uint32_t>(0x1p-13F) >> kShift,
                                   kEnd = std::bit_cast<std::uint32_t>(1.0F) >> kShift;
    static std::size_t bucketOf(float linear) {
        return (std::bit_cast<std::uint32_t>(linear) >> kShift) - kFirst;
    }

    /// The least float that encodes to each byte, then +inf.
    std::array<float, 257> begins_;
    std::array<std::uint8_t, kEnd - kFirst> first_{};  ///< byte for the least float in each bucket
};

}  // namespace peeler
