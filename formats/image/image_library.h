// SPDX-License-Identifier: Apache-2.0
// Decoders and encoders of flat pictures. PNG, JPEG, KTX2, BMP and TGA are built in; all other
// formats go through OpenImageIO. It links 240 libraries, so it is a module (only
// formats/modules/image_library.cpp includes it), which is loaded for the first picture of another
// format.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// Properties of a picture known before its pixels are decoded.
struct StoredImage {
    int x = 0, y = 0, width = 0, height = 0, depth = 1;           ///< data window
    int full_x = 0, full_y = 0, full_width = 0, full_height = 0;  ///< display window
    std::vector<std::string> channels{};                          ///< channel names
    bool floating_point = false;
    bool straight_alpha = false;
    bool deep = false;
    std::string description{};
    std::string codec{};         ///< of formats with several codecs
    std::optional<bool> srgb{};  ///< colour space declared by a KTX2; false: linear
    int orientation = 1;         ///< TIFF orientation of the rows: 1 = from the top, from the left
    /// Features of the file that are not shown, a clause each: "it is animated; …". Damaged pixels
    /// are noted only after read().
    std::vector<std::string> notes{};
};

/// An open file. Members throw std::runtime_error with the library's message.
class ImageDecoder {
  public:
    virtual ~ImageDecoder() = default;
    virtual const StoredImage& image() const = 0;
    /// Decodes the channels [begin, end) of all pixels, row-major, top to bottom, into `samples`,
    /// which has room for them: floats, with an integer's full range as 0 to 1, or 8-bit integers.
    virtual void read(int begin, int end, float* samples) = 0;
    virtual void read(int begin, int end, std::uint8_t* samples) = 0;
};

/// An encoder's output file. Members must not throw (some encoders are C inside); they return the
/// number of bytes transferred.
class EncodedFile {
  public:
    virtual ~EncodedFile() = default;
    virtual std::uint64_t size() const = 0;
    /// Overwrites or extends the file.
    virtual std::size_t writeAt(std::uint64_t offset, std::span<const std::byte> bytes) = 0;
    virtual std::size_t readAt(std::uint64_t offset, std::span<std::byte> bytes) = 0;
};

struct ImageToEncode {
    std::string path;  ///< for messages
    int width = 0, height = 0, channels = 4;
    int bits = 8;               ///< per unsigned sample, 8 or 16; alpha is straight
    std::string software{};     ///< stored in the file unless empty
    std::string description{};  ///< stored in the file unless empty
    bool srgb = false;          ///< the file declares sRGB
};

/// Members throw std::runtime_error with the library's message.
class ImageEncoder {
  public:
    virtual ~ImageEncoder() = default;
    virtual bool keepsAlpha() const = 0;
    /// `file` must outlive the encoder.
    virtual void open(const ImageToEncode& image, EncodedFile& file) = 0;
    /// Encodes the rows [begin, end), which come in order, top to bottom; `samples` has their
    /// interleaved pixels in the format of ImageToEncode.
    virtual void writeRows(int begin, int end, const void* samples) = 0;
    virtual void close() = 0;
};

/// The interface of the OpenImageIO module; `format` is OpenImageIO's format name, such as "png".
/// Thread-safe.
class ImageLibrary {
  public:
    virtual ~ImageLibrary() = default;
    /// As imageDecoder() below.
    virtual std::unique_ptr<ImageDecoder> decoder(
        const std::string& format, const std::string& path,
        std::span<const std::uint8_t> bytes = {}) const = 0;
    virtual std::unique_ptr<ImageEncoder> encoder(const std::string& format) const = 0;
    /// Limits the threads (at least 1) of OpenImageIO, and of OpenEXR when used by OpenImageIO.
    virtual void setThreads(int threads) const = 0;
};

/// Returns the library, loaded by the first call. Throws Error (kInternal) if it cannot be loaded.
const ImageLibrary& imageLibrary();

/// Limits the threads (at least 1, including the caller's) of OpenImageIO, and of OpenEXR when used
/// by OpenImageIO, through setThreads(), now or when the library is loaded. Our own EXR files are
/// packed and unpacked by parallelFor, and OpenVDB gets its limit with each call. Call it before
/// the first file is opened.
void setLibraryThreads(int threads);

/// Limits the size of pictures decoded from now on, by built-in decoders and the library.
void limitDecodedSize(int megabytes);

/// Returns a decoder of the picture at `path`, or in `bytes` if not empty, which must outlive it;
/// built in, or else the library's. Straight alpha stays straight. Throws std::runtime_error, or
/// Error like imageLibrary().
std::unique_ptr<ImageDecoder> imageDecoder(const std::string& format, const std::string& path,
                                           std::span<const std::uint8_t> bytes = {});
std::unique_ptr<ImageEncoder> imageEncoder(const std::string& format);

/// Returns the approximate additional resident bytes while imageEncoder() of that format encodes a
/// picture of `picture` bytes: the encoder's memory, and the library's unless it is built in or
/// already loaded.
std::uint64_t imageEncoderBytes(const std::string& format, std::uint64_t picture);
/// Returns the part of imageEncoderBytes() that encoders share when they take turns: the library,
/// and the buffers of the rows being encoded.
std::uint64_t sharedEncoderBytes(const std::string& format, std::uint64_t picture);

/// The function that the module exports, named kImageModuleFunction.
using ImageModuleFunction = const ImageLibrary*();
inline constexpr char kImageModule[] = "peeler_images";
inline constexpr char kImageModuleFunction[] = "peelerImageLibrary";

}  // namespace peeler
