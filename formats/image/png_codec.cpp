// SPDX-License-Identifier: Apache-2.0
// PNG decoder based on libspng. Pixels are returned as stored or expanded, without other
// conversions.
#include "formats/image/image_codecs.h"

#include <fcntl.h>
#include <spng.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <new>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/file/regular_file.h"

namespace peeler {
namespace {

/// Whether libspng or zlib ran out of memory in the last call. The error code is not enough:
/// libspng has several codes for lack of memory, and one of them also means damage.
thread_local bool ran_out = false;

void* allocated(void* memory) {
    ran_out = ran_out || !memory;
    return memory;
}

void check(int result) {
    if (std::exchange(ran_out, false)) throw std::bad_alloc();
    if (result != SPNG_OK) throw std::runtime_error("PNG: " + std::string(spng_strerror(result)));
}

/// Checks the result of reading a row. Returns false if there is no further row.
bool more(int result) {
    if (result == SPNG_EOI) return false;
    check(result);
    return true;
}

using Context = std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)>;

Context newContext(int flags) {
    spng_alloc allocator{
        [](std::size_t size) { return allocated(std::malloc(size)); },
        [](void* old, std::size_t size) { return allocated(std::realloc(old, size)); },
        [](std::size_t n, std::size_t size) { return allocated(std::calloc(n, size)); }, std::free};
    ran_out = false;
    Context context(spng_ctx_new2(&allocator, flags), spng_ctx_free);
    if (!context) throw std::bad_alloc();
    return context;
}

/// The format to which a PNG with these properties is expanded.
struct Expansion {
    std::uint8_t color_type;
    bool sixteen_bits, transparency;
    int format;  ///< SPNG_FMT_*
    std::string_view channels;
};
constexpr Expansion kExpansions[] = {
    {SPNG_COLOR_TYPE_GRAYSCALE, false, false, SPNG_FMT_G8, "Y"},
    {SPNG_COLOR_TYPE_GRAYSCALE, false, true, SPNG_FMT_GA8, "YA"},
    {SPNG_COLOR_TYPE_GRAYSCALE, true, false, SPNG_FMT_PNG, "Y"},
    {SPNG_COLOR_TYPE_GRAYSCALE, true, true, SPNG_FMT_GA16, "YA"},
    {SPNG_COLOR_TYPE_TRUECOLOR, false, false, SPNG_FMT_PNG, "RGB"},
    {SPNG_COLOR_TYPE_TRUECOLOR, false, true, SPNG_FMT_RGBA8, "RGBA"},
    {SPNG_COLOR_TYPE_TRUECOLOR, true, false, SPNG_FMT_PNG, "RGB"},
    {SPNG_COLOR_TYPE_TRUECOLOR, true, true, SPNG_FMT_RGBA16, "RGBA"},
    {SPNG_COLOR_TYPE_INDEXED, false, false, SPNG_FMT_RGB8, "RGB"},
    {SPNG_COLOR_TYPE_INDEXED, false, true, SPNG_FMT_RGBA8, "RGBA"},
    {SPNG_COLOR_TYPE_GRAYSCALE_ALPHA, false, false, SPNG_FMT_PNG, "YA"},
    {SPNG_COLOR_TYPE_GRAYSCALE_ALPHA, true, false, SPNG_FMT_PNG, "YA"},
    {SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, false, false, SPNG_FMT_PNG, "RGBA"},
    {SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, true, false, SPNG_FMT_PNG, "RGBA"},
};

const Expansion& expansionOf(const spng_ihdr& header, bool transparency) {
    const auto* const found = std::ranges::find_if(kExpansions, [&](const Expansion& row) {
        return row.color_type == header.color_type &&
               row.sixteen_bits == (header.bit_depth == 16) && row.transparency == transparency;
    });
    if (found == std::end(kExpansions)) throw std::runtime_error("PNG: unknown colour type");
    return *found;
}

bool sameLetters(std::string_view a, std::string_view b) {
    return std::ranges::equal(
        a, b, {}, [](char c) { return c | 0x20; }, [](char c) { return c | 0x20; });
}

/// Returns the description (Description or ImageDescription) before the pixels; the last one if
/// there are several.
std::string descriptionIn(spng_ctx* png) {
    std::uint32_t count = 0;
    if (spng_get_text(png, nullptr, &count) != SPNG_OK) return {};
    std::vector<spng_text> texts(count);
    check(spng_get_text(png, texts.data(), &count));
    std::string description;
    for (const spng_text& text : texts)
        if (sameLetters(text.keyword, "Description") ||
            sameLetters(text.keyword, "ImageDescription"))
            description.assign(text.text, text.length);
    return description;
}

struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Close>;

class PngDecoder final : public ImageDecoder {
  public:
    PngDecoder(const std::string& path, std::span<const std::uint8_t> bytes) : bytes_(bytes) {
        if (bytes_.empty()) {
            const RegularFile file(path);
            file.check();
            const int own = fcntl(file.descriptor(), F_DUPFD_CLOEXEC, 0);
            file_.reset(own < 0 ? nullptr : fdopen(own, "rb"));
            if (!file_) throw std::bad_alloc();
        }
        const Context png = opened();
        check(spng_get_ihdr(png.get(), &header_));
        // spng_get_trns() reads everything before the pixels and reports any damage there.
        spng_trns transparency{};
        const int result = spng_get_trns(png.get(), &transparency);
        if (result != SPNG_ECHUNKAVAIL) check(result);
        expansion_ = &expansionOf(header_, result == SPNG_OK);
        image_.width = image_.full_width = static_cast<int>(header_.width);
        image_.height = image_.full_height = static_cast<int>(header_.height);
        for (const char channel : expansion_->channels)
            image_.channels.emplace_back(1, channel);
        image_.straight_alpha = true;
        image_.description = descriptionIn(png.get());
    }

    const StoredImage& image() const override { return image_; }
    void read(int begin, int end, float* samples) override { readAs(begin, end, samples); }
    void read(int begin, int end, std::uint8_t* samples) override { readAs(begin, end, samples); }

  private:
    Context opened() const {
        Context png = newContext(0);
        // Limit the size of texts, since compressed texts may be huge even in a small file. The
        // limit does not apply to pixels.
        constexpr std::size_t kMost = std::size_t{1} << 26U;
        check(spng_set_chunk_limits(png.get(), kMost, kMost));
        if (file_) {
            std::rewind(file_.get());
            check(spng_set_png_file(png.get(), file_.get()));
        } else {
            check(spng_set_png_buffer(png.get(), bytes_.data(), bytes_.size()));
        }
        return png;
    }

    template <class To>
    void readAs(int begin, int end, To* samples) const {
        if (expansion_->sixteen_bits)
            readFrom<std::uint16_t>(begin, end, samples);
        else
            readFrom<std::uint8_t>(begin, end, samples);
    }

    template <class From, class To>
    void readFrom(int begin, int end, To* samples) const {
        const Context png = opened();
        check(spng_decode_image(png.get(), nullptr, 0, expansion_->format,
                                SPNG_DECODE_PROGRESSIVE | SPNG_DECODE_TRNS));
        const std::size_t width = header_.width, channels = expansion_->channels.size();
        const auto first = static_cast<std::size_t>(begin), last = static_cast<std::size_t>(end);
        const auto convert = [&](const From* from, std::size_t row) {
            convertSamples(from, width, channels, first, last,
                           samples + row * width * (last - first));
        };
        // An interlaced picture stores a row in several passes, and the row is complete only after
        // the last pass.
        const bool interlaced = header_.interlace_method != SPNG_INTERLACE_NONE;
        std::vector<From> rows(width * channels * (interlaced ? header_.height : 1));
        spng_row_info row{};
        while (more(spng_get_row_info(png.get(), &row))) {
            From* const at = rows.data() + (interlaced ? row.row_num * width * channels : 0);
            more(spng_decode_row(png.get(), at, width * channels * sizeof(From)));
            if (!interlaced) convert(at, row.row_num);
        }
        check(spng_decode_chunks(png.get()));  // also checks the checksum of the pixels
        for (std::size_t y = 0; interlaced && y < header_.height; ++y)
            convert(rows.data() + y * width * channels, y);
    }

    File file_;  // open if `bytes_` is empty, so that only the needed parts of the file are read
    std::span<const std::uint8_t> bytes_;
    spng_ihdr header_{};
    const Expansion* expansion_ = nullptr;
    StoredImage image_;
};

}  // namespace

std::unique_ptr<ImageDecoder> pngDecoder(const std::string& path,
                                         std::span<const std::uint8_t> bytes) {
    return std::make_unique<PngDecoder>(path, bytes);
}

}  // namespace peeler
