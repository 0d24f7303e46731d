// SPDX-License-Identifier: Apache-2.0
// Scan-line OpenEXR container, flat or deep: writes headers, offset tables, and chunks in any
// order; unpacks chunks of input files.
//
// OpenEXR's own multi-part writer requires part after part; this one accepts finished chunks of any
// part in any order, so bands can stream through all parts at once. Layout:
// https://openexr.com/en/latest/OpenEXRFileLayout.html
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

/// Bytes of unpacked pixels that a writer packs at once; bounds its memory.
inline constexpr std::size_t kExrBytesInFlight = 16U << 20;
inline constexpr std::size_t kExrCopiesInFlight = 3;  ///< their copies: raw, filtered, packed

/// Returns the rows per chunk: 16 for ZIP, else 1.
inline int exrRowsPerChunk(Imf::Compression compression) {
    return compression == Imf::ZIP_COMPRESSION ? kExrRowsPerChunk : 1;
}

/// Returns OpenEXR's value for one of exrCompressions(); "" is the default of flat or deep images.
/// Throws Error (kUsage).
Imf::Compression exrCompressionOf(const std::string& name, bool deep);

/// Returns OpenEXR's value for a pixel type.
Imf::PixelType exrPixelType(PixelType type);

/// A chunk compressor: ZIP, ZIPS, RLE or none. Keeps its buffers; use one per thread.
class ExrChunkPacker {
  public:
    /// `level` is libdeflate's: 1 fastest, 12 smallest. Throws Error (kMemory).
    explicit ExrChunkPacker(int level, Imf::Compression compression = Imf::ZIP_COMPRESSION);
    ~ExrChunkPacker();
    ExrChunkPacker(const ExrChunkPacker&) = delete;
    ExrChunkPacker& operator=(const ExrChunkPacker&) = delete;

    /// Returns the buffer for the next chunk's pixels, `bytes` long, contents undefined.
    std::span<std::byte> raw(std::size_t bytes);
    /// Packs raw() into `out`: splits even and odd bytes, takes differences, then applies zlib or
    /// run-length encoding. If that is not smaller, `out` is a copy of raw().
    void pack(ByteBuffer& out);
    std::size_t bytesKept() const { return raw_.capacity() + filtered_.capacity(); }

  private:
    void filter();

    Imf::Compression compression_;
    libdeflate_compressor* compressor_;
    ByteBuffer raw_, filtered_;
};

/// A pool of packers, reused between threads.
class ExrPackerPool {
  public:
    ExrPackerPool(int level, Imf::Compression compression)
        : level_(level), compression_(compression) {}

    /// Calls use(packer) with a packer that no other thread has.
    template <class Use>
    void with(Use&& use) {
        std::unique_ptr<ExrChunkPacker> packer = take();
        use(*packer);
        const std::lock_guard lock(mutex_);
        idle_.push_back(std::move(packer));
    }
    /// Returns the bytes kept by idle packers.
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
    ByteBuffer counts;         ///< per pixel: the running sum of samples along the row
    ByteBuffer samples;        ///< channel after channel
    std::size_t unpacked = 0;  ///< bytes of the samples before packing
};

/// An OpenEXR file being assembled: single-part for one header, else multi-part. A part is deep if
/// its header's type is.
class ExrOutput {
  public:
    /// Writes magic number, headers (filling in chunk counts) and room for the offset tables.
    /// `headers` need names, types and channels, and equal values for the attributes that OpenEXR
    /// requires to be shared. Throws Error (kOutput), also if a chunk could exceed the format's 2
    /// GiB, or a header is invalid.
    ExrOutput(AtomicFile& file, std::vector<Imf::Header> headers);

    int chunkCount(std::size_t part) const { return headers_[part].chunkCount(); }
    /// Appends a packed chunk of a flat part. Every chunk must be appended exactly once.
    void append(std::size_t part, int chunk, std::span<const std::byte> packed);
    /// Appends a packed chunk of a deep part. Throws Error (kOutput) if a row exceeds OpenEXR's 2
    /// GiB.
    void append(std::size_t part, int chunk, const ExrDeepChunk& packed);
    /// Replaces an attribute's value in a part; the new value must have the same size.
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
    std::vector<std::size_t> first_offset_;  ///< of each part, as an index into offsets_
    std::vector<std::uint64_t> offsets_;     ///< of all parts, in file order; 0 = not written
    std::vector<std::uint64_t> hashes_;      ///< of the chunks, in the same order
    std::size_t chunk_ = 0;                  ///< the one being written, as an index into offsets_
    std::string start_;                      ///< magic number and version
    std::uint64_t table_position_ = 0;
    bool headers_changed_ = false;
};

/// Returns the maximum unpacked size of `packed` bytes, to check a file's sizes before allocating.
/// 0 for a compression that deep data cannot have.
std::uint64_t exrMostUnpacked(const std::string& compression, std::uint64_t packed);

/// Unpacks a chunk of "none", "rle", "zips" or "zip" (ExrInputPart::compression) into `out`, which
/// has the expected size; a chunk of that size is not packed. Returns false if it does not unpack
/// to exactly that size.
bool exrUnpack(const std::string& compression, std::span<const std::byte> packed,
               std::span<std::byte> out);

/// Like exrUnpack(), for a chunk that is always packed, even if that has not made it smaller.
bool exrUnpackAlways(const std::string& compression, std::span<const std::byte> packed,
                     std::span<std::byte> out);

/// Unpacks zlib data. Returns false if it does not unpack to exactly that size.
bool exrInflate(std::span<const std::byte> packed, std::span<std::byte> out);

}  // namespace peeler
