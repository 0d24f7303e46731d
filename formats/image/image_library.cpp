// SPDX-License-Identifier: Apache-2.0
// Choice between built-in codecs and the OpenImageIO module, and loading of the module.
#include "formats/image/image_library.h"

#include <atomic>
#include <mutex>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "formats/file/module.h"
#include "formats/image/image_codecs.h"

namespace peeler {
namespace {

std::mutex library_mutex;
const ImageLibrary* loaded_library = nullptr;
int wanted_threads = 0;               ///< 0 if the number is not set
std::atomic<int> most_megabytes = 0;  ///< 0 if the limit is not set

/// A format with built-in codecs. If `decoder` returns null, the module decodes the file.
struct BuiltIn {
    std::string_view format;
    std::unique_ptr<ImageDecoder> (*decoder)(const std::string&, std::span<const std::uint8_t>);
    std::unique_ptr<ImageEncoder> (*encoder)();
    std::uint64_t (*encoder_bytes)(std::uint64_t picture);
};
constexpr BuiltIn kBuiltIn[] = {
    {"png", pngDecoder, pngEncoder, pngEncoderBytes}, {"jpeg", jpegDecoder, nullptr, nullptr},
    {"ktx2", ktx2Decoder, nullptr, nullptr},          {"bmp", bmpDecoder, nullptr, nullptr},
    {"targa", tgaDecoder, nullptr, nullptr},
};

/// Checks the size limit here: OpenImageIO's own limit cannot be used, because a host program may
/// also set it.
std::unique_ptr<ImageDecoder> checked(std::unique_ptr<ImageDecoder> decoder) {
    const StoredImage& image = decoder->image();
    const std::uint64_t bytes = static_cast<std::uint64_t>(image.width) *
                                static_cast<std::uint64_t>(image.height) * image.channels.size();
    if (most_megabytes > 0 && bytes >> 20U >= static_cast<std::uint64_t>(most_megabytes))
        throw std::runtime_error("an image of " + std::to_string(image.width) + " x " +
                                 std::to_string(image.height) + " pixels is too large");
    return decoder;
}

}  // namespace

const ImageLibrary& imageLibrary() {
    const std::lock_guard lock(library_mutex);
    if (loaded_library) return *loaded_library;
    void* const function = moduleFunction(kImageModule, kImageModuleFunction, PEELER_OPENIMAGEIO);
    loaded_library = reinterpret_cast<ImageModuleFunction*>(function)();
    if (wanted_threads > 0) loaded_library->setThreads(wanted_threads);
    return *loaded_library;
}

void setLibraryThreads(int threads) {
    const std::lock_guard lock(library_mutex);
    wanted_threads = threads;
    if (loaded_library) loaded_library->setThreads(threads);
}

void limitDecodedSize(int megabytes) {
    most_megabytes = megabytes;
}

std::unique_ptr<ImageDecoder> imageDecoder(const std::string& format, const std::string& path,
                                           std::span<const std::uint8_t> bytes) {
    for (const BuiltIn& row : kBuiltIn) {
        if (row.format != format) continue;
        if (auto decoder = row.decoder(path, bytes)) return checked(std::move(decoder));
    }
    return checked(imageLibrary().decoder(format, path, bytes));
}

std::unique_ptr<ImageEncoder> imageEncoder(const std::string& format) {
    for (const BuiltIn& row : kBuiltIn)
        if (row.format == format && row.encoder) return row.encoder();
    return imageLibrary().encoder(format);
}

std::uint64_t imageEncoderBytes(const std::string& format, std::uint64_t picture) {
    // OpenImageIO 2.4 in Debian 12 takes 96 to 110 MB with its dependencies.
    constexpr std::uint64_t kLibraryBytes = std::uint64_t{112} << 20;
    for (const BuiltIn& row : kBuiltIn)
        if (row.format == format && row.encoder) return row.encoder_bytes(picture);
    const std::lock_guard lock(library_mutex);
    return loaded_library ? 0 : kLibraryBytes;
}

std::uint64_t sharedEncoderBytes(const std::string& format, std::uint64_t picture) {
    // A quarter of a built-in encoder's memory (waiting rows) belongs to each encoder alone.
    const std::uint64_t all = imageEncoderBytes(format, picture);
    for (const BuiltIn& row : kBuiltIn)
        if (row.format == format && row.encoder) return all / 4 * 3;
    return all;
}

}  // namespace peeler
