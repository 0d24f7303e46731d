// SPDX-License-Identifier: Apache-2.0
// JPEG decoder based on TurboJPEG, with libjpeg's defaults: accurate transforms, smooth upsampling.
#include "formats/image/image_codecs.h"

#include <turbojpeg.h>

#include <cmath>
#include <new>
#include <string>
#include <utility>
#include <vector>

namespace peeler {
namespace {

/// The decoding for a JPEG colour space. kDecodings is indexed by TurboJPEG's TJCS.
struct Decoding {
    int format;
    std::size_t channels;  ///< number of channels that TurboJPEG returns
    bool grey, cmyk;
};
constexpr Decoding kRgb = {TJPF_RGB, 3, false, false}, kGrey = {TJPF_GRAY, 1, true, false},
                   kCmyk = {TJPF_CMYK, 4, false, true};
constexpr Decoding kDecodings[] = {kRgb, kRgb, kGrey, kCmyk, kCmyk};
static_assert(TJCS_RGB == 0 && TJCS_YCbCr == 1 && TJCS_GRAY == 2 && TJCS_CMYK == 3 &&
              TJCS_YCCK == 4);

/// Converts CMYK to RGB in place. The result is at the start of `pixels`. JPEG stores inverted ink.
void rgbFromCmyk(std::vector<std::uint8_t>& pixels) {
    std::uint8_t* rgb = pixels.data();
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        const auto paper = convertedSample<float>(pixels[i + 3]);
        for (std::size_t c = 0; c < 3; ++c)
            *rgb++ = static_cast<std::uint8_t>(
                std::lround(convertedSample<float>(pixels[i + c]) * paper * 255));
    }
}

/// libjpeg's message JWRN_JPEG_EOF. withoutJpegMetadata() has already added a note about it.
constexpr const char* kCutOff = "Premature end of JPEG file";

using Handle = std::unique_ptr<void, decltype(&tjDestroy)>;

class JpegDecoder final : public ImageDecoder {
  public:
    JpegDecoder(Handle handle, std::string path, std::span<const std::uint8_t> bytes, int width,
                int height, const Decoding& decoding)
        : handle_(std::move(handle)), path_(std::move(path)), bytes_(bytes), decoding_(decoding) {
        image_.width = image_.full_width = width;
        image_.height = image_.full_height = height;
        if (decoding.grey)
            image_.channels = {"Y"};
        else
            image_.channels = {"R", "G", "B"};
    }

    const StoredImage& image() const override { return image_; }
    void read(int begin, int end, float* samples) override { readAs(begin, end, samples); }
    void read(int begin, int end, std::uint8_t* samples) override { readAs(begin, end, samples); }

  private:
    std::size_t pixels() const {
        return static_cast<std::size_t>(image_.width) * static_cast<std::size_t>(image_.height);
    }

    template <class To>
    void readAs(int begin, int end, To* samples) {
        std::vector<std::uint8_t> stored(pixels() * decoding_.channels);
        if (tjDecompress2(handle_.get(), bytes_.data(), bytes_.size(), stored.data(), image_.width,
                          0, image_.height, decoding_.format, TJFLAG_STOPONWARNING) != 0) {
            // TurboJPEG 2.1 cannot distinguish recoverable from fatal damage if a file has both.
            // OpenImageIO can distinguish them, but does not report recoverable damage.
            const std::string damage = tjGetErrorStr2(handle_.get());
            imageLibrary().decoder("jpeg", path_, bytes_)->read(begin, end, samples);
            if (damage.find(kCutOff) == std::string::npos)
                image_.notes.push_back("the JPEG is damaged (" + damage + ')');
            return;
        }
        if (decoding_.cmyk) rgbFromCmyk(stored);
        convertSamples(stored.data(), pixels(), image_.channels.size(),
                       static_cast<std::size_t>(begin), static_cast<std::size_t>(end), samples);
    }

    Handle handle_;
    std::string path_;
    std::span<const std::uint8_t> bytes_;
    const Decoding& decoding_;
    StoredImage image_;
};

}  // namespace

std::unique_ptr<ImageDecoder> jpegDecoder(const std::string& path,
                                          std::span<const std::uint8_t> bytes) {
    if (bytes.empty()) return nullptr;
    Handle handle(tjInitDecompress(), tjDestroy);
    if (!handle) throw std::bad_alloc();
    int width = 0, height = 0, subsampling = 0, colors = 0;
    if (tjDecompressHeader3(handle.get(), bytes.data(), bytes.size(), &width, &height, &subsampling,
                            &colors) != 0)
        return nullptr;
    return std::make_unique<JpegDecoder>(std::move(handle), path, bytes, width, height,
                                         kDecodings[colors]);
}

}  // namespace peeler
