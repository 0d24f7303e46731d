// SPDX-License-Identifier: Apache-2.0
// Decoders and encoders of flat pictures. Those of PNG, JPEG, KTX2, BMP and TGA are built in; all
// others are OpenImageIO's. It brings 240 libraries, so it is a module
// (formats/modules/image_library.cpp alone includes it), which is loaded for the first picture of
// another kind.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// What a file tells before its pixels are decoded.
struct StoredImage {
    int x = 0, y = 0, width = 0, height = 0, depth = 1;           ///< data window
    int full_x = 0, full_y = 0, full_width = 0, full_height = 0;  ///< display window
    std::vector<std::string> channels{};                          ///< their names
    bool floating_point = false;
    bool straight_alpha = false;
    bool deep = false;
    std::string description{};
    std::string codec{};         ///< of formats that have several
    std::optional<bool> srgb{};  ///< what a KTX2 says of its colours; false: they are linear
    int orientation = 1;         ///< of the rows, TIFF's: 1 = from the top, from the left
    /// What the file says and is not shown, each a clause: "it is animated; …". Of damaged pixels
    /// only when they have been read.
    std::vector<std::string> notes{};
};

/// An open file. Members throw std::runtime_error with the library's message.
class ImageDecoder {
  public:
    virtual ~ImageDecoder() = default;
    virtual const StoredImage& image() const = 0;
    /// Decodes the channels [begin, end) of every pixel, row-major, top to bottom, into `samples`,
    /// which has room for them: as floats, in which the range of an integer is 0 to 1, or as
    /// integers of 8 bits.
    virtual void read(int begin, int end, float* samples) = 0;
    virtual void read(int begin, int end, std::uint8_t* samples) = 0;
};

/// The file that an encoder writes. Members must not throw (some encoders are C inside); they
/// return how many bytes they took or gave.
class EncodedFile {
  public:
    virtual ~EncodedFile() = default;
    virtual std::uint64_t size() const = 0;
    /// Overwrites or extends it.
    virtual std::size_t writeAt(std::uint64_t offset, std::span<const std::byte> bytes) = 0;
    virtual std::size_t readAt(std::uint64_t offset, std::span<std::byte> bytes) = 0;
};

struct ImageToEncode {
    std::string path;  ///< for messages
    int width = 0, height = 0, channels = 4;
    int bits = 8;               ///< of an unsigned sample, 8 or 16; alpha is straight
    std::string software{};     ///< stands in the file unless empty
    std::string description{};  ///< likewise
    bool srgb = false;          ///< the file is to say that it is
};

/// Members throw std::runtime_error with the library's message.
class ImageEncoder {
  public:
    virtual ~ImageEncoder() = default;
    virtual bool keepsAlpha() const = 0;
    /// `file` must outlive the encoder.
    virtual void open(const ImageToEncode& image, EncodedFile& file) = 0;
    /// Encodes the rows [begin, end), which come in order, top to bottom; `samples` has their
    /// pixels, each with all its channels, as ImageToEncode says.
    virtual void writeRows(int begin, int end, const void* samples) = 0;
    virtual void close() = 0;
};

/// OpenImageIO as its module offers it; `format` is its name of a format, such as "png". May be
/// used from several threads.
class ImageLibrary {
  public:
    virtual ~ImageLibrary() = default;
    /// As imageDecoder() below.
    virtual std::unique_ptr<ImageDecoder> decoder(
        const std::string& format, const std::string& path,
        std::span<const std::uint8_t> bytes = {}) const = 0;
    virtual std::unique_ptr<ImageEncoder> encoder(const std::string& format) const = 0;
    /// Limits the threads (from 1) of OpenImageIO, and of OpenEXR where OpenImageIO reads or writes
    /// with it.
    virtual void setThreads(int threads) const = 0;
};

/// The library, which the first call loads. Throws Error (kInternal) if it cannot be loaded.
const ImageLibrary& imageLibrary();

/// Limits the threads (from 1, the caller's among them) of OpenImageIO, and of OpenEXR where
/// OpenImageIO reads or writes with it, by setThreads(), now or when the library is loaded. Our own
/// EXR files are packed and unpacked by parallelFor, and OpenVDB is told how many when it is
/// called. To be called before the first file is opened.
void setLibraryThreads(int threads);

/// Refuses larger pictures from now on, whether their decoder is built in or the library's.
void limitDecodedSize(int megabytes);

/// A decoder of the picture stored at `path`, or of `bytes` where there are any, which must outlive
/// it; built in, or else the library's. Alpha is left straight where the file has it so. Throws
/// std::runtime_error, and what imageLibrary() throws.
std::unique_ptr<ImageDecoder> imageDecoder(const std::string& format, const std::string& path,
                                           std::span<const std::uint8_t> bytes = {});
std::unique_ptr<ImageEncoder> imageEncoder(const std::string& format);

/// About how many bytes more are resident while imageEncoder() of that format encodes a picture of
/// so many bytes: what it holds, and the library, unless it is built in or loaded already.
std::uint64_t imageEncoderBytes(const std::string& format, std::uint64_t picture);
/// What of that several encoders that take turns share: the library, and what is made of the rows
/// at hand.
std::uint64_t sharedEncoderBytes(const std::string& format, std::uint64_t picture);

/// What the module exports, under the name kImageModuleFunction.
using ImageModuleFunction = const ImageLibrary*();
inline constexpr char kImageModule[] = "peeler_images";
inline constexpr char kImageModuleFunction[] = "peelerImageLibrary";

}  // namespace peeler
