// SPDX-License-Identifier: Apache-2.0
// PNG encoder (ISO/IEC 15948) that compresses in parallel.
//
// Deflate takes most of the time, so the rows are divided into pieces that are compressed in
// parallel. The dictionary of a piece is the end of the previous piece. The pieces are joined into
// one stream, as in pigz: zlib's Z_SYNC_FLUSH makes each piece end on a byte boundary.
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "core/base/parallel.h"
#include "formats/image/image_codecs.h"

namespace peeler {
namespace {

// The division into pieces depends only on the picture, so that the bytes do not depend on the
// number of threads.
constexpr std::size_t kPieceBytes = 128 << 10, kPiecesAtOnce = 32;
constexpr std::size_t kDictionaryBytes = 32 << 10;  // size of deflate's window

using PngBytes = std::vector<std::uint8_t>;

void appendBigEndian(std::uint32_t value, PngBytes& bytes) {
    for (const int shift : {24, 16, 8, 0})
        bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

void appendText(std::string_view text, PngBytes& bytes) {
    bytes.insert(bytes.end(), text.begin(), text.end());
}

PngBytes chunkOf(std::string_view type, std::span<const std::uint8_t> data) {
    PngBytes chunk;
    chunk.reserve(data.size() + 12);
    appendBigEndian(static_cast<std::uint32_t>(data.size()), chunk);
    appendText(type, chunk);
    chunk.insert(chunk.end(), data.begin(), data.end());
    const auto sum = crc32_z(0, chunk.data() + 4, chunk.size() - 4);
    appendBigEndian(static_cast<std::uint32_t>(sum), chunk);
    return chunk;
}

/// Applies filter 4 of §9.4 (Paeth): the difference from the left, upper or upper left neighbour,
/// whichever is nearest to left + up − upper left. `above` is null for the first row.
void filterByPaeth(const std::uint8_t* row, const std::uint8_t* above, std::size_t row_bytes,
                   std::size_t pixel_bytes, std::uint8_t* out) {
    *out++ = 4;
    // 16 bits suffice for all values, and compilers compute twice as many at a time as of 32 bits.
    const auto distance = [](int from, int to) {
        const auto difference = static_cast<std::int16_t>(from - to);
        return static_cast<std::int16_t>(difference < 0 ? -difference : difference);
    };
    const auto filtered = [&](std::size_t i, std::int16_t left, std::int16_t up,
                              std::int16_t corner) {
        const std::int16_t to_left = distance(up, corner), to_up = distance(left, corner);
        const std::int16_t to_corner = distance(left + up, 2 * corner);
        const std::int16_t nearest = to_up <= to_corner ? up : corner;
        const std::int16_t predicted = to_left <= std::min(to_up, to_corner) ? left : nearest;
        out[i] = static_cast<std::uint8_t>(row[i] - predicted);
    };
    for (std::size_t i = 0; i < std::min(pixel_bytes, row_bytes); ++i)
        filtered(i, 0, above ? above[i] : 0, 0);
    if (above) {
        for (std::size_t i = pixel_bytes; i < row_bytes; ++i)
            filtered(i, row[i - pixel_bytes], above[i], above[i - pixel_bytes]);
    } else {
        for (std::size_t i = pixel_bytes; i < row_bytes; ++i)
            out[i] = static_cast<std::uint8_t>(row[i] - row[i - pixel_bytes]);
    }
}

/// A piece of the stream that is compressed separately.
struct Piece {
    std::size_t begin = 0, end = 0;  ///< range of the piece's uncompressed bytes
    PngBytes compressed{};
    uLong checksum = 0;  ///< Adler-32 of the uncompressed bytes
};

/// Compresses a piece of `bytes`. The bytes before the piece are the dictionary.
void deflatePiece(const PngBytes& bytes, bool last, Piece& piece) {
    z_stream stream{};
    // The fastest combination of filter, strategy and level that makes files no larger than libpng
    // at level 6, where libpng tries every filter for every row.
    if (deflateInit2(&stream, 6, Z_DEFLATED, -15, 8, Z_FILTERED) != Z_OK) throw std::bad_alloc();
    const std::size_t known = std::min(piece.begin, kDictionaryBytes);
    deflateSetDictionary(&stream, bytes.data() + piece.begin - known, static_cast<uInt>(known));
    const std::size_t size = piece.end - piece.begin;
    // deflateBound() does not include the empty block that a flush adds.
    piece.compressed.resize(deflateBound(&stream, static_cast<uLong>(size)) + 16);
    stream.next_in = const_cast<Bytef*>(bytes.data() + piece.begin);
    stream.avail_in = static_cast<uInt>(size);
    stream.next_out = piece.compressed.data();
    stream.avail_out = static_cast<uInt>(piece.compressed.size());
    const int result = deflate(&stream, last ? Z_FINISH : Z_SYNC_FLUSH);
    piece.compressed.resize(piece.compressed.size() - stream.avail_out);
    const bool whole = stream.avail_in == 0 && result == (last ? Z_STREAM_END : Z_OK);
    deflateEnd(&stream);
    if (!whole) throw std::runtime_error("PNG: deflate stopped halfway");
    piece.checksum = adler32_z(adler32(0, nullptr, 0), bytes.data() + piece.begin, size);
}

class PngEncoder final : public ImageEncoder {
  public:
    bool keepsAlpha() const override { return true; }

    void open(const ImageToEncode& image, EncodedFile& file) override {
        // The colour types for 1, 2, 3 and 4 channels.
        constexpr std::uint8_t kColorTypes[] = {0, 4, 2, 6};
        file_ = &file;
        wide_ = image.bits == 16;
        height_ = static_cast<std::size_t>(image.height);
        pixel_bytes_ = static_cast<std::size_t>(image.channels * image.bits / 8);
        row_bytes_ = static_cast<std::size_t>(image.width) * pixel_bytes_;
        piece_rows_ = std::max<std::size_t>(1, kPieceBytes / (row_bytes_ + 1));
        write(PngBytes{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'});
        PngBytes header;
        appendBigEndian(static_cast<std::uint32_t>(image.width), header);
        appendBigEndian(static_cast<std::uint32_t>(image.height), header);
        const auto type = kColorTypes[image.channels - 1];
        header.insert(header.end(), {static_cast<std::uint8_t>(image.bits), type, 0, 0, 0});
        write(chunkOf("IHDR", header));
        if (image.srgb) writeSrgb();
        writeText("Software", image.software);
        writeText("Description", image.description);
    }

    void writeRows(int begin, int end, const void* samples) override {
        const auto* const bytes = static_cast<const std::uint8_t*>(samples);
        const std::size_t count = static_cast<std::size_t>(end - begin) * row_bytes_;
        const std::size_t from = rows_.size();
        rows_.insert(rows_.end(), bytes, bytes + count);
        if (wide_ && std::endian::native == std::endian::little) {
            for (std::size_t i = from; i < rows_.size(); i += 2)
                std::swap(rows_[i], rows_[i + 1]);
        }
        while (waiting() >= piece_rows_ * kPiecesAtOnce)
            compress(piece_rows_ * kPiecesAtOnce);
    }

    void close() override {
        if (compressed_rows_ + waiting() != height_)
            throw std::runtime_error("PNG: rows are missing");
        compress(waiting());
        write(chunkOf("IEND", {}));
    }

  private:
    /// Writes sRGB, and also gAMA and cHRM for readers that do not know sRGB (§11.3.2.5).
    void writeSrgb() {
        PngBytes primaries, gamma;
        for (const std::uint32_t value :
             {31270U, 32900U, 64000U, 33000U, 30000U, 60000U, 15000U, 6000U})
            appendBigEndian(value, primaries);
        appendBigEndian(45455, gamma);
        constexpr std::array<std::uint8_t, 1> kAbsoluteColorimetric = {3};
        write(chunkOf("cHRM", primaries));
        write(chunkOf("gAMA", gamma));
        write(chunkOf("sRGB", kAbsoluteColorimetric));
    }

    void writeText(std::string_view keyword, const std::string& text) {
        if (text.empty()) return;
        PngBytes data;
        appendText(keyword, data);
        data.push_back(0);
        appendText(text, data);
        write(chunkOf("tEXt", data));
    }

    /// Returns the number of rows waiting to be compressed. rows_ also holds the last compressed
    /// row.
    std::size_t waiting() const {
        return row_bytes_ == 0 ? 0 : rows_.size() / row_bytes_ - (compressed_rows_ > 0 ? 1 : 0);
    }

    /// Compresses and writes the first `count` of the waiting rows.
    void compress(std::size_t count) {
        if (count == 0) return;
        const bool last = compressed_rows_ + count == height_;
        const std::size_t before = compressed_rows_ > 0 ? 1 : 0, line = row_bytes_ + 1;
        PngBytes filtered = std::move(dictionary_);
        const std::size_t known = filtered.size();
        filtered.resize(known + count * line);
        parallelFor(count, [&](std::size_t i) {
            const std::uint8_t* const row = rows_.data() + (before + i) * row_bytes_;
            filterByPaeth(row, before + i > 0 ? row - row_bytes_ : nullptr, row_bytes_,
                          pixel_bytes_, filtered.data() + known + i * line);
        });
        std::vector<Piece> pieces;
        for (std::size_t row = 0; row < count; row += piece_rows_) {
            const std::size_t end = std::min(row + piece_rows_, count);
            pieces.push_back({known + row * line, known + end * line});
        }
        parallelFor(pieces.size(), [&](std::size_t i) {
            deflatePiece(filtered, last && i + 1 == pieces.size(), pieces[i]);
        });
        for (std::size_t i = 0; i < pieces.size(); ++i)
            writePiece(pieces[i], last && i + 1 == pieces.size());
        compressed_rows_ += count;
        rows_.erase(rows_.begin(),
                    rows_.begin() + static_cast<std::ptrdiff_t>((before + count - 1) * row_bytes_));
        const std::size_t kept = std::min(filtered.size(), kDictionaryBytes);
        dictionary_.assign(filtered.end() - static_cast<std::ptrdiff_t>(kept), filtered.end());
    }

    void writePiece(const Piece& piece, bool last) {
        PngBytes data;
        if (checksum_ == 0) {
            data = {0x78, 0x9C};  // header of RFC 1950 §2.2: window of 32 KB, default level
            checksum_ = adler32(0, nullptr, 0);
        }
        data.insert(data.end(), piece.compressed.begin(), piece.compressed.end());
        checksum_ = adler32_combine(checksum_, piece.checksum,
                                    static_cast<z_off_t>(piece.end - piece.begin));
        if (last) appendBigEndian(static_cast<std::uint32_t>(checksum_), data);
        write(chunkOf("IDAT", data));
    }

    void write(const PngBytes& bytes) {
        const std::size_t written =
            file_->writeAt(offset_, std::as_bytes(std::span(bytes.data(), bytes.size())));
        offset_ += written;
        if (written != bytes.size()) throw std::runtime_error("PNG: stream error");
    }

    EncodedFile* file_ = nullptr;
    std::uint64_t offset_ = 0;
    bool wide_ = false;
    std::size_t height_ = 0, pixel_bytes_ = 0, row_bytes_ = 0, piece_rows_ = 1;
    std::size_t compressed_rows_ = 0;
    PngBytes rows_;        // the last compressed row, then all waiting rows
    PngBytes dictionary_;  // the end of the compressed data
    uLong checksum_ = 0;
};

}  // namespace

std::unique_ptr<ImageEncoder> pngEncoder() {
    return std::make_unique<PngEncoder>();
}

std::uint64_t pngEncoderBytes(std::uint64_t picture) {
    // The factor 4 is for waiting rows, newly arrived rows, filtered data and compressed data.
    return 4 * std::min<std::uint64_t>(picture, kPieceBytes * kPiecesAtOnce);
}

}  // namespace peeler
