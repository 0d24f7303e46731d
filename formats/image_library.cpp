// SPDX-License-Identifier: Apache-2.0
#include "formats/image_library.h"

#include <atomic>
#include <mutex>
#include <stdexcept>
#include <string_view>

#include "formats/jpeg_codec.h"
#include "formats/module.h"
#include "formats/png_codec.h"

namespace peeler {
namespace {

std::mutex mutex;
const ImageLibrary* loaded = nullptr;
int wanted_threads = 0;               ///< 0 = nothing was said
std::atomic<int> most_megabytes = 0;  ///< likewise

/// What needs no module. A decoder that is not returned is one that does need it.
struct BuiltIn {
    std::string_view format;
    std::unique_ptr<ImageDecoder> (*decoder)(const std::string&, std::span<const std::uint8_t>);
    std::unique_ptr<ImageEncoder> (*encoder)();
};
constexpr BuiltIn kBuiltIn[] = {
    {"png", pngDecoder, pngEncoder},
    {"jpeg", jpegDecoder, nullptr},
};

void checkSize(const StoredImage& image) {
    const std::uint64_t bytes = static_cast<std::uint64_t>(image.width) *
                                static_cast<std::uint64_t>(image.height) * image.channels.size();
    if (most_megabytes > 0 && bytes >> 20U >= static_cast<std::uint64_t>(most_megabytes))
        throw std::runtime_error("an image of " + std::to_string(image.width) + " x " +
                                 std::to_string(image.height) + " pixels is too large");
}

}  // namespace

const ImageLibrary& imageLibrary() {
    const std::lock_guard lock(mutex);
    if (loaded) return *loaded;
    void* const function = moduleFunction(kImageModule, kImageModuleFunction);
    loaded = reinterpret_cast<ImageModuleFunction*>(function)();
    if (wanted_threads > 0) loaded->setThreads(wanted_threads);
    if (most_megabytes > 0) loaded->limitDecodedSize(most_megabytes);
    return *loaded;
}

void setImageLibraryThreads(int threads) {
    const std::lock_guard lock(mutex);
    wanted_threads = threads;
    if (loaded) loaded->setThreads(threads);
}

void limitDecodedSize(int megabytes) {
    const std::lock_guard lock(mutex);
    most_megabytes = megabytes;
    if (loaded) loaded->limitDecodedSize(megabytes);
}

std::unique_ptr<ImageDecoder> imageDecoder(const std::string& format, const std::string& path,
                                           std::span<const std::uint8_t> bytes) {
    for (const BuiltIn& row : kBuiltIn) {
        if (row.format != format) continue;
        if (auto decoder = row.decoder(path, bytes)) {
            checkSize(decoder->image());
            return decoder;
        }
    }
    return imageLibrary().decoder(format, path, bytes);
}

std::unique_ptr<ImageEncoder> imageEncoder(const std::string& format) {
    for (const BuiltIn& row : kBuiltIn)
        if (row.format == format && row.encoder) return row.encoder();
    return imageLibrary().encoder(format);
}

}  // namespace peeler
