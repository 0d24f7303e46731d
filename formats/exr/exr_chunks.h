// SPDX-License-Identifier: Apache-2.0
// The container of a scan-line OpenEXR file, flat or deep: writes headers, offset tables, and
// chunks in any order; and unpacks chunks that are read.
//
// OpenEXR's own multi-part writer compresses part after part and wants them written that way; this
// one takes finished chunks of any part in any order, so bands can stream through all parts at
// once. Layout: https://openexr.com/en/latest/OpenEXRFileLayout.html
#pragma once

#include <OpenEXR/ImfCompression.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfPixelType.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include <peeler/layered_image.h>
#include "formats/exr/exr_layout.h"
#include "formats/file/atomic_file.h"
#include "formats/file/byte_buffer.h"

struct libdeflate_compressor;

namespace peeler {

/// A level of libdeflate; higher ones gain little on float pixels.
inline constexpr int kDefaultZipLevel = 4;

/// Bytes of pixels, before packing, that a writer packs at once: this bounds its memory.
inline constexpr std::size_t kExrBytesInFlight = 16U << 20;
inline constexpr std::size_t kExrCopiesInFlight = 3;  ///< copies of them: raw, filtered, packed

/// Rows that are compressed together: 16 for ZIP, else 1.
inline int exrRowsPerChunk(Imf::Compression compression) {
    return compression == Imf::ZIP_COMPRESSION ? kExrRowsPerChunk : 1;
}

/// OpenEXR's name for one of exrCompressions(), "" being the default of flat or deep images. Throws
/// Error (kUsage).
Imf::Compression exrCompressionOf(const std::string& name, bool deep);

/// OpenEXR's name for a type.
Imf::PixelType exrPixelType(PixelType type);

/// Compresses chunks: ZIP, ZIPS, RLE or not at all. Keeps its buffers; one for each thread.
class ExrChunkPacker {
  public:
    /// `level` as libdeflate's: 1 fastest, 12 smallest. Throws Error (kMemory).
    explicit ExrChunkPacker(int level, Imf::Compression compression = Imf::ZIP_COMPRESSION);
    ~ExrChunkPacker();
    ExrChunkPacker(const ExrChunkPacker&) = delete;
    ExrChunkPacker& operator=(const ExrChunkPacker&) = delete;

    /// The caller's room for the pixels of the next chunk, `bytes` of them, contents undefined.
    std::span<std::byte> raw(std::size_t bytes);
    /// Packs raw() into `out`: even and odd bytes apart, then differences, then zlib or run
    /// lengths; `out` is raw() as it is where that is no larger.
    void pack(ByteBuffer& out);
    std::size_t bytesKept() const { return raw_.capacity() + filtered_.capacity(); }

  private:
    void filter();

    Imf::Compression compression_;
    libdeflate_compressor* compressor_;
    ByteBuffer raw_, filtered_;
};

/// Keeps packers for the threads that need one next.
class ExrPackerPool {
  public:
    ExrPackerPool(int level, Imf::Compression compression)
        : level_(level), compression_(compression) {}

    /// Calls use(packer) with one that nobody else has.
    template <class Use>
    void with(Use&& use) {
        std::unique_ptr<ExrChunkPacker> packer = take();
        use(*packer);
        const std::lock_guard lock(mutex_);
        idle_.push_back(std::move(packer));
    }
    /// Bytes that the idle packers keep.
    std::size_t bytesKept() const;
    void clear() { idle_.clear(); }

  private:
    std::unique_ptr<ExrChunkPacker> take();

    int level_;
    Imf::Compression compression_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<ExrChunkPacker>> idle_;
};

/// A packed row of deep samples.
struct ExrDeepChunk {
    ByteBuffer counts;         ///< for each pixel, samples in it and to the left of it
    ByteBuffer samples;        ///< channel after channel
    std::size_t unpacked = 0;  ///< bytes of the samples before packing
};

/// Assembles the file. Single-part if there is one header, else multi-part. A part is deep if its
/// header's type says so.
class ExrOutput {
  public:
    /// Writes magic number, headers (chunk counts are filled in) and room for the offset tables.
    /// `headers` need names, types and channels; they share what OpenEXR wants shared. Throws Error
    /// (kOutput), also if a chunk could pass the format's 2 GiB, or a header is invalid.
    ExrOutput(AtomicFile& file, std::vector<Imf::Header> headers);

    int chunkCount(std::size_t part) const { return headers_[part].chunkCount(); }
    /// Adds a packed chunk of a flat part. Every chunk is to be added exactly once.
    void append(std::size_t part, int chunk, std::span<const std::byte> packed);
    /// Likewise for a deep part. Throws Error (kOutput) if a row has more than OpenEXR's 2 GiB.
    void append(std::size_t part, int chunk, const ExrDeepChunk& packed);
    /// Replaces the value of an attribute of a part; the new value has to take as many bytes.
    void setAttribute(std::size_t part, const char* name, const Imf::Attribute& value);
    /// Fills in the offset tables and each part's hash (exr_integrity.h), and reads headers and
    /// tables back with OpenEXR. Throws Error (kInternal) if a chunk is missing; (kOutput) if the
    /// file reads back differently.
    void finish();

  private:
    static std::string headerBytes(const Imf::Header& header);
    std::string beginChunk(std::size_t part, int chunk);
    void writeChunk(std::initializer_list<std::span<const std::byte>> pieces);
    void writeTables();
    void writeHashes();
    void readBack();

    AtomicFile& file_;
    std::vector<Imf::Header> headers_;
    std::vector<std::size_t> first_offset_;  ///< of each part, in offsets_
    std::vector<std::uint64_t> offsets_;     ///< of all parts, as in the file; 0 = not written
    std::vector<std::uint64_t> hashes_;      ///< of the chunks, likewise
    std::size_t chunk_ = 0;                  ///< the one that is being written, in offsets_
    std::string start_;                      ///< magic number and version
    std::uint64_t table_position_ = 0;
    bool headers_changed_ = false;
};

/// The most bytes that `packed` bytes can become; a size in a file is held against it before memory
/// is allocated by that size. 0 for a compression that deep data cannot have.
std::uint64_t exrMostUnpacked(const std::string& compression, std::uint64_t packed);

/// Unpacks a chunk of "none", "rle", "zips" or "zip" (ExrInputPart::compression) into `out`, which
/// has the size that it must have; a chunk of that size is not packed. Returns false if it does not
/// unpack to exactly that size.
bool exrUnpack(const std::string& compression, std::span<const std::byte> packed,
               std::span<std::byte> out);

/// Likewise for a chunk that is known to be packed, even if that has not made it smaller.
bool exrUnpackAlways(const std::string& compression, std::span<const std::byte> packed,
                     std::span<std::byte> out);

/// Unpacks what zlib has packed. Returns false if it does not come to exactly that size.
bool exrInflate(std::span<const std::byte> packed, std::span<std::byte> out);

}  // namespace peeler
