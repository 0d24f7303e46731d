// SPDX-License-Identifier: Apache-2.0
// Decoders and encoders of flat pictures.
//
// PNG, JPEG, KTX2, BMP and TGA are built in; OpenImageIO handles all other formats. OpenImageIO
// links 240 libraries, so it is in a module of its own (formats/modules/image_library.cpp), which
// is loaded for the first picture in another format.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// The properties of a picture that are known before decoding its pixels.
struct StoredImage {
    int x = 0, y = 0, width = 0, height = 0, depth = 1;           ///< data window
    int full_x = 0, full_y = 0, full_width = 0, full_height = 0;  ///< display window
    std::vector<std::string> channels{};
    bool floating_point = false;
    bool straight_alpha = false;
    bool deep = false;
    std::string description{};
    std::string codec{};         ///< name of the codec, for formats with several codecs
    std::optional<bool> srgb{};  ///< whether a KTX2 declares sRGB (true) or linear (false)
    /// Orientation as in TIFF; 1 means rows top to bottom, pixels left to right.
    int orientation = 1;
    /// Features of the file that are not shown, as clauses like "it is animated; …". Damaged pixels
    /// are noted only when they are read.
    std::vector<std::string> notes{};
};

/// An open file. Its members throw std::runtime_error with the library's message.
class ImageDecoder {
  public:
    virtual ~ImageDecoder() = default;
    virtual const StoredImage& image() const = 0;
    /// Decodes the channels [begin, end) of all pixels, row-major, top to bottom, into `samples`,
    /// which must have room for them. As floats, the full range of an integer is 0 to 1.
    virtual void read(int begin, int end, float* samples) = 0;
    virtual void read(int begin, int end, std::uint8_t* samples) = 0;
};

/// The file that an encoder writes. Members must not throw, since some encoders call them from C.
/// writeAt() and readAt() return the number of bytes transferred.
class EncodedFile {
  public:
    virtual ~EncodedFile() = default;
    virtual std::uint64_t size() const = 0;
    /// Overwrites the file or extends it.
    virtual std::size_t writeAt(std::uint64_t offset, std::span<const std::byte> bytes) = 0;
    virtual std::size_t readAt(std::uint64_t offset, std::span<std::byte> bytes) = 0;
};

struct ImageToEncode {
    std::string path;  ///< path for messages
    int width = 0, height = 0, channels = 4;
    int bits = 8;               ///< bits per unsigned sample, 8 or 16
    std::string software{};     ///< name of the program; stored in the file unless empty
    std::string description{};  ///< text; stored in the file unless empty
    bool srgb = false;          ///< whether to mark the file as sRGB
};

/// An encoder. Its members throw std::runtime_error with the library's message.
class ImageEncoder {
  public:
    virtual ~ImageEncoder() = default;
    virtual bool keepsAlpha() const = 0;
    /// `file` must outlive the encoder.
    virtual void open(const ImageToEncode& image, EncodedFile& file) = 0;
    /// Encodes the rows [begin, end). Rows must come in order, top to bottom. `samples` holds their
    /// pixels, channels interleaved, with straight alpha, in the format given by ImageToEncode.
    virtual void writeRows(int begin, int end, const void* samples) = 0;
    virtual void close() = 0;
};

/// The interface of the OpenImageIO module. `format` is OpenImageIO's name of a format, such as
/// "png". Thread-safe.
class ImageLibrary {
  public:
    virtual ~ImageLibrary() = default;
    /// Returns a decoder, like imageDecoder() below.
    virtual std::unique_ptr<ImageDecoder> decoder(
        const std::string& format, const std::string& path,
        std::span<const std::uint8_t> bytes = {}) const = 0;
    virtual std::unique_ptr<ImageEncoder> encoder(const std::string& format) const = 0;
    /// Limits the number of threads (at least 1) of OpenImageIO, and of OpenEXR as used by
    /// OpenImageIO.
    virtual void setThreads(int threads) const = 0;
};

/// Returns the module's library. The first call loads the module. Throws Error (kInternal) if the
/// module cannot be loaded.
const ImageLibrary& imageLibrary();

/// Limits the number of threads (at least 1, including the caller's) of OpenImageIO, and of OpenEXR
/// as used by OpenImageIO. If the module is not loaded yet, the limit applies from its loading on.
/// Must be called before the first file is opened.
///
/// peeler's own EXR code uses parallelFor() instead, and OpenVDB gets its limit with each call.
void setLibraryThreads(int threads);

/// Limits the decoded size of all pictures opened after this call, by built-in decoders and by the
/// module.
void limitDecodedSize(int megabytes);

/// Returns a decoder of the picture in `bytes` or, if `bytes` is empty, of the file at `path`.
/// `bytes` must outlive the decoder. Prefers built-in decoders to the module's decoders. Straight
/// alpha stays straight. Throws std::runtime_error, and the errors of imageLibrary().
std::unique_ptr<ImageDecoder> imageDecoder(const std::string& format, const std::string& path,
                                           std::span<const std::uint8_t> bytes = {});
std::unique_ptr<ImageEncoder> imageEncoder(const std::string& format);

/// Returns the approximate growth of the resident memory, in bytes, while imageEncoder() of this
/// format encodes a picture of `picture` bytes: the memory of a built-in encoder, or of the module
/// unless it is already loaded.
std::uint64_t imageEncoderBytes(const std::string& format, std::uint64_t picture);
/// Returns the part of imageEncoderBytes() that several encoders share if they take turns: the
/// memory of the module, and the buffers for the rows being encoded.
std::uint64_t sharedEncoderBytes(const std::string& format, std::uint64_t picture);

/// The type of the function that the module exports as kImageModuleFunction.
using ImageModuleFunction = const ImageLibrary*();
inline constexpr char kImageModule[] = "peeler_images";
inline constexpr char kImageModuleFunction[] = "peelerImageLibrary";

}  // namespace peeler
