// SPDX-License-Identifier: Apache-2.0
// Built-in image codecs, whose libraries load within a millisecond.
//
// PNG (ISO/IEC 15948) uses libspng and zlib; JPEG (ITU-T T.81) uses TurboJPEG, the API of
// libjpeg-turbo. KTX 2.0 is decoded by peeler's own code, with libzstd and libdeflate. BMP and TGA
// also have their own code here, since OpenImageIO 2.4 reads beyond its buffers if files are
// damaged (CVE-2023-22845, CVE-2023-24473).
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

/// Returns a decoder of any PNG. Expands grey with fewer than 8 bits to 8 bits, palette indices to
/// colours, and transparent colours to alpha. Only read() allocates pixel memory. Throws
/// std::runtime_error.
std::unique_ptr<ImageDecoder> pngDecoder(const std::string& path,
                                         std::span<const std::uint8_t> bytes);

/// Returns an encoder for 1 to 4 channels. The encoder uses all threads; the output does not depend
/// on their number. An encoder that is destroyed before close() leaves a partial file.
std::unique_ptr<ImageEncoder> pngEncoder();
/// Returns the encoder's peak memory, in bytes, for a picture of `picture` bytes.
std::uint64_t pngEncoderBytes(std::uint64_t picture);

/// Returns a decoder of grey, colour and CMYK pictures. Converts CMYK to RGB. Only read() allocates
/// pixel memory. Throws std::bad_alloc.
///
/// Returns null for files that need the module of image_library.h: files with unusual subsampling
/// or damaged headers, and all files if `bytes` is empty, because their description may be in Exif.
/// If pixels are damaged, read() decodes them with this module and adds a note.
std::unique_ptr<ImageDecoder> jpegDecoder(const std::string& path,
                                          std::span<const std::uint8_t> bytes);

/// Returns a decoder of the largest level of a 2D texture: UASTC and ETC1S, as in
/// KHR_texture_basisu, and 8-bit RGB and RGBA. The output is always RGBA with straight alpha.
/// Requires `bytes`. Only read() allocates pixel memory. Throws std::runtime_error.
std::unique_ptr<ImageDecoder> ktx2Decoder(const std::string& path,
                                          std::span<const std::uint8_t> bytes);

/// Return decoders of BMP (Microsoft, "Bitmap Storage") and TGA (Truevision, "TGA File Format
/// Specification", version 2.0). The output is always RGBA with straight alpha. Both decoders
/// require `bytes`. Only read() allocates pixel memory. Throw std::runtime_error.
std::unique_ptr<ImageDecoder> bmpDecoder(const std::string& path,
                                         std::span<const std::uint8_t> bytes);
std::unique_ptr<ImageDecoder> tgaDecoder(const std::string& path,
                                         std::span<const std::uint8_t> bytes);
/// Whether the file may be a TGA: whether all header fields have legal values, since TGA has no
/// signature.
bool isTga(std::span<const std::uint8_t> bytes);

/// Converts a stored sample to another type, with the same bits as in OpenImageIO: the full range
/// of an integer is 0 to 1, and 16 bits are rounded to 8.
template <class To, class From>
To convertedSample(From sample) {
    constexpr auto kMost = std::numeric_limits<From>::max();
    if constexpr (std::is_same_v<To, From>) {
        return sample;
    } else if constexpr (std::is_floating_point_v<To>) {
        // A division would round differently.
        return static_cast<To>(sample) * (To(1) / To(kMost));
    } else {
        constexpr unsigned kStep = kMost / std::numeric_limits<To>::max();
        return static_cast<To>((sample + kStep / 2) / kStep);
    }
}

/// Converts the channels [begin, end) of pixels with `channels` channels each. `to` must have room
/// for pixels · (end − begin) samples.
template <class To, class From>
void convertSamples(const From* from, std::size_t pixels, std::size_t channels, std::size_t begin,
                    std::size_t end, To* to) {
    if (begin == 0 && end == channels) {  // a simple loop that compilers vectorise
        for (std::size_t i = 0; i < pixels * channels; ++i)
            to[i] = convertedSample<To>(from[i]);
        return;
    }
    for (std::size_t pixel = 0; pixel < pixels; ++pixel, from += channels)
        for (std::size_t c = begin; c < end; ++c)
            *to++ = convertedSample<To>(from[c]);
}

/// A decoder whose output is always 8-bit RGBA with straight alpha.
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
