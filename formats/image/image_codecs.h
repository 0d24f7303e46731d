// SPDX-License-Identifier: Apache-2.0
// The decoders and encoders that are built in, since their libraries load in a millisecond: PNG
// (ISO/IEC 15948) by libspng and zlib, JPEG (ITU-T T.81) by TurboJPEG, libjpeg-turbo's own
// interface; KTX 2.0, by code of our own, libzstd and libdeflate; BMP and TGA, by code of our own,
// since OpenImageIO 2.4 reads beyond its buffers where they are damaged (CVE-2023-22845,
// CVE-2023-24473).
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "formats/image/image_library.h"

namespace peeler {

/// A decoder of every kind of PNG. Grey of less than 8 bits comes as 8, a palette as its colours,
/// transparent colours as alpha. No memory is allocated for pixels before they are read. Throws
/// std::runtime_error.
std::unique_ptr<ImageDecoder> pngDecoder(const std::string& path,
                                         std::span<const std::uint8_t> bytes);

/// An encoder of 1 to 4 channels, on all threads; what it writes does not depend on how many. If it
/// is destroyed before close(), what it has written is left as it is.
std::unique_ptr<ImageEncoder> pngEncoder();
/// What it holds at most of a picture of so many bytes.
std::uint64_t pngEncoderBytes(std::uint64_t picture);

/// A decoder of grey, colour and CMYK, which becomes RGB. No memory is allocated for pixels before
/// they are read. Null for what is left to the module of image_library.h: unusual subsampling,
/// damaged headers, and files without `bytes`, since their descriptions may be in Exif. A file
/// whose pixels are damaged is decoded by the module as well, and has a note once it is read.
/// Throws std::bad_alloc.
std::unique_ptr<ImageDecoder> jpegDecoder(const std::string& path,
                                          std::span<const std::uint8_t> bytes);

/// A decoder of the largest level of a 2D texture, always to RGBA with straight alpha: UASTC and
/// ETC1S, which KHR_texture_basisu has, and RGB and RGBA of 8 bits. Needs `bytes`. No memory is
/// allocated for pixels before they are read. Throws std::runtime_error.
std::unique_ptr<ImageDecoder> ktx2Decoder(const std::string& path,
                                          std::span<const std::uint8_t> bytes);

/// Decoders of BMP (Microsoft, "Bitmap Storage") and TGA (Truevision, "TGA File Format
/// Specification", version 2.0), always to RGBA with straight alpha. Need `bytes`. No memory is
/// allocated for pixels before they are read. Throw std::runtime_error.
std::unique_ptr<ImageDecoder> bmpDecoder(const std::string& path,
                                         std::span<const std::uint8_t> bytes);
std::unique_ptr<ImageDecoder> tgaDecoder(const std::string& path,
                                         std::span<const std::uint8_t> bytes);
/// Whether this can be a TGA, which has no signature: all fields of its header have legal values.
bool isTga(std::span<const std::uint8_t> bytes);

/// A stored sample as another type, with the bits that OpenImageIO gives: the whole range of an
/// integer is 0 to 1; 16 bits are rounded to 8.
template <class To, class From>
To convertedSample(From sample) {
    constexpr auto kMost = std::numeric_limits<From>::max();
    if constexpr (std::is_same_v<To, From>) {
        return sample;
    } else if constexpr (std::is_floating_point_v<To>) {
        return static_cast<To>(sample) * (To(1) / To(kMost));  // a quotient has another last bit
    } else {
        constexpr unsigned kStep = kMost / std::numeric_limits<To>::max();
        return static_cast<To>((sample + kStep / 2) / kStep);
    }
}

/// Converts the channels [begin, end) of `pixels` pixels that have `channels` channels each. `to`
/// has room for pixels · (end − begin) samples.
template <class To, class From>
void convertSamples(const From* from, std::size_t pixels, std::size_t channels, std::size_t begin,
                    std::size_t end, To* to) {
    if (begin == 0 && end == channels) {  // a loop that compilers know to be simple
        for (std::size_t i = 0; i < pixels * channels; ++i)
            to[i] = convertedSample<To>(from[i]);
        return;
    }
    for (std::size_t pixel = 0; pixel < pixels; ++pixel, from += channels)
        for (std::size_t c = begin; c < end; ++c)
            *to++ = convertedSample<To>(from[c]);
}

/// A decoder whose pixels are always RGBA of 8 bits with straight alpha.
class RgbaDecoder : public ImageDecoder {
  public:
    const StoredImage& image() const override { return image_; }
    void read(int begin, int end, float* samples) override { readAs(begin, end, samples); }
    void read(int begin, int end, std::uint8_t* samples) override {
        if (begin == 0 && end == 4)
            decode(samples);
        else
            readAs(begin, end, samples);
    }

  protected:
    RgbaDecoder() {
        image_.channels = {"R", "G", "B", "A"};
        image_.straight_alpha = true;
    }
    void setSize(int width, int height) {
        image_.width = image_.full_width = width;
        image_.height = image_.full_height = height;
    }
    std::size_t pixels() const {
        return static_cast<std::size_t>(image_.width) * static_cast<std::size_t>(image_.height);
    }

    StoredImage image_;

  private:
    /// Fills all pixels.
    virtual void decode(std::uint8_t* rgba) const = 0;

    template <class To>
    void readAs(int begin, int end, To* samples) const {
        std::vector<std::uint8_t> rgba(4 * pixels());
        decode(rgba.data());
        convertSamples(rgba.data(), pixels(), 4, static_cast<std::size_t>(begin),
                       static_cast<std::size_t>(end), samples);
    }
};

}  // namespace peeler
