// SPDX-License-Identifier: Apache-2.0
// Writes flat pictures for displays (PNG, JPEG, TIFF), with tone maps and sRGB.
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
    std::string_view name;  ///< as OpenImageIO has it
    std::vector<std::string_view> extensions;
    std::string_view summary;
    int bits = 8;  ///< of a sample
};
/// The table of the formats that ImageWriter writes.
std::span<const ImageFormat> imageFormats();
/// The row for the extension of a path; null if the extension is in no row.
const ImageFormat* findImageFormat(const std::string& path);

/// How large a file of so many pixels will be at most: compressed pixels take no more than others,
/// but for a thousandth. The path ends in an extension of the table.
SizeForecast imageForecast(const std::string& path, std::uint64_t pixels);

/// What alpha says in a file.
enum class PictureAlpha : std::uint8_t {
    kOpacity,  ///< how much of what is behind the picture shows through
    /// Whether a pixel has any fragment: 255, or 0 and black. The picture is over black then, in
    /// place of the background, and a pixel that has one is never quite black: (1, 1, 1) at least
    /// where it would be (0, 0, 0). So the mask is the same by alpha and by colour.
    kAnyFragment
};

/// Writes the crop of the picture, all layers composited, shown as `options` say (Display), over
/// the background, sRGB-encoded, in the format of the path's extension. PNG and TIFF keep alpha,
/// straight (straightPixel). JPEG has none: what the background leaves open is black. If the
/// exposure is automatic the composite is kept until finish(), 16 bytes a pixel (28 with coloured
/// opacity), and metered; what is but a part of a picture is not metered, so that parts agree.
class ImageWriter : public Sink {
  public:
    /// Throws Error (kUsage) if there is no such tone map; (kInternal) if the path ends in no
    /// extension of the table.
    ImageWriter(std::string path, OutputOptions options,
                PictureAlpha alpha = PictureAlpha::kOpacity);
    ~ImageWriter() override;

    /// Throws Error (kOutput) if the file cannot be created or the format cannot hold the picture.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    /// finish() without its commit, for commitAll().
    AtomicFile& close();
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return times_; }

  private:
    struct Output;
    void encode(const CompositeImage& composite);
    /// Whether the exposure is found of such a picture.
    bool metersOf(const Plan& plan) const;

    std::string path_;
    OutputOptions options_;
    PictureAlpha alpha_;
    const ImageFormat* format_ = nullptr;
    Display display_;
    bool metered_ = false;  ///< the exposure is found at finish(), of what `kept_` has
    bool tinted_ = false;   ///< the picture has coloured opacity
    CompositeImage kept_;
    std::unique_ptr<Output> output_;
    CompositeImage composite_;
    StageTimes times_;
};

/// Writes a picture of grey samples of 8 bits, row-major, as a PNG into a file that is left to be
/// committed. They are stored as they are. `software` stands in the file unless empty. Throws Error
/// (kOutput).
void writeGreyPng(AtomicFile& file, int width, int height, std::span<const std::uint8_t> samples,
                  const std::string& software = {});
/// The same of 16 bits.
void writeGreyPng(AtomicFile& file, int width, int height, std::span<const std::uint16_t> samples,
                  const std::string& software = {});

/// Makes `image` one fragment at Z = 0 in every pixel of the window, which is how writers take a
/// finished picture. Returns the room for their colours, row-major: premultiplied linear RGBA in
/// float. Reuses the storage of `image`.
std::span<float> onePerPixel(const Window& window, LayeredImage& image);

/// Calculates round(255 · encodeSrgb(linear)) exactly, for every float, by a table; NaN becomes 0.
class SrgbBytes {
  public:
    /// Fills the table: finds by bisection where each byte begins.
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
    /// A bucket is the exponent and 6 bits of the mantissa, from 2^-13 on: about one byte begins in
    /// each.
    static constexpr unsigned kShift = 17;
    static constexpr std::uint32_t kFirst = std::bit_cast<std::uint32_t>(0x1p-13F) >> kShift,
                                   kEnd = std::bit_cast<std::uint32_t>(1.0F) >> kShift;
    static std::size_t bucketOf(float linear) {
        return (std::bit_cast<std::uint32_t>(linear) >> kShift) - kFirst;
    }

    std::array<float, 257> begins_;                    ///< the least float of each byte, then +inf
    std::array<std::uint8_t, kEnd - kFirst> first_{};  ///< byte at the beginning of each bucket
};

}  // namespace peeler
