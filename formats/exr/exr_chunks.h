// SPDX-License-Identifier: Apache-2.0
// Scan-line OpenEXR container, flat or deep: headers, offset tables and chunks; unpacking of input
// chunks.
//
// OpenEXR's own multi-part writer requires one part to be finished before the next. This container
// accepts chunks of any part in any order, so that bands can stream through all parts at once.
// Layout: https://openexr.com/en/latest/OpenEXRFileLayout.html
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

/// The compression level for libdeflate. Higher levels gain little on float pixels.
inline constexpr int kDefaultZipLevel = 4;

/// The size of the batches of chunks that a writer packs at once, in bytes of unpacked pixels.
/// Limits the writer's memory.
inline constexpr std::size_t kExrBytesInFlight = 16U << 20;
/// The number of copies of a batch in memory: raw, filtered, packed.
inline constexpr std::size_t kExrCopiesInFlight = 3;

/// Returns the rows per chunk: 16 for ZIP, 1 for the other compressions that peeler writes.
inline int exrRowsPerChunk(Imf::Compression compression) {
    return compression == Imf::ZIP_COMPRESSION ? kExrRowsPerChunk : 1;
}

/// Returns OpenEXR's value for the name of a compression (exrCompressions()). "" means the default
/// of deep images if `deep` is true, else the default of flat images. Throws Error (kUsage).
Imf::Compression exrCompressionOf(const std::string& name, bool deep);

/// Returns OpenEXR's value for a pixel type.
Imf::PixelType exrPixelType(PixelType type);

/// A chunk compressor: ZIP, ZIPS, RLE or none. It reuses its buffers, so each thread needs its own
/// compressor.
class ExrChunkPacker {
  public:
    /// `level` is a level of libdeflate: 1 fastest, 12 smallest. Throws Error (kMemory).
    explicit ExrChunkPacker(int level, Imf::Compression compression = Imf::ZIP_COMPRESSION);
    ~ExrChunkPacker();
    ExrChunkPacker(const ExrChunkPacker&) = delete;
    ExrChunkPacker& operator=(const ExrChunkPacker&) = delete;

    /// Returns the buffer for the next chunk's pixels, `bytes` long, with undefined contents.
    std::span<std::byte> raw(std::size_t bytes);
    /// Packs raw() into `out`: separates even and odd bytes, takes differences, then applies zlib
    /// or run-length encoding. If the result is not smaller, `out` is a copy of raw().
    void pack(ByteBuffer& out);
    std::size_t bytesKept() const { return raw_.capacity() + filtered_.capacity(); }

  private:
    void filter();

    Imf::Compression compression_;
    libdeflate_compressor* compressor_;
    ByteBuffer raw_, filtered_;
};

/// A pool of packers that threads share.
class ExrPackerPool {
  public:
    ExrPackerPool(int level, Imf::Compression compression)
        : level_(level), compression_(compression) {}

    /// Calls use(packer) with a packer that no other thread is using.
    template <class Use>
    void with(Use&& use) {
        std::unique_ptr<ExrChunkPacker> packer = take();
        use(*packer);
        const std::lock_guard lock(mutex_);
        idle_.push_back(std::move(packer));
    }
    /// Returns the bytes that idle packers hold.
    std::size_t bytesKept() const;
    void clear() { idle_.clear(); }

  private:
    std::unique_ptr<ExrChunkPacker> take();

    int level_;
    Imf::Compression compression_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<ExrChunkPacker>> idle_;
};

/// A packed row of deep samples: one chunk of the file.
struct ExrDeepChunk {
    ByteBuffer counts;         ///< running sums of the sample counts, one per pixel
    ByteBuffer samples;        ///< the samples, channel by channel
    std::size_t unpacked = 0;  ///< size of the unpacked samples, in bytes
};

/// An OpenEXR file being assembled: single-part if there is one header, else multi-part. The type
/// in a part's header decides whether the part is deep.
class ExrOutput {
  public:
    /// Writes the magic number, the headers (with their chunk counts filled in) and space for the
    /// offset tables. `headers` need names, types and channels; attributes that all parts must
    /// share need equal values. Throws Error (kOutput) if writing fails, if a chunk could exceed
    /// the format's limit of 2 GiB, or if a header is invalid.
    ExrOutput(AtomicFile& file, std::vector<Imf::Header> headers);

    int chunkCount(std::size_t part) const { return headers_[part].chunkCount(); }
    /// Appends a packed chunk of a flat part. Every chunk must be appended exactly once.
    void append(std::size_t part, int chunk, std::span<const std::byte> packed);
    /// Appends a packed chunk of a deep part. Throws Error (kOutput) if the row exceeds the
    /// format's limit of 2 GiB.
    void append(std::size_t part, int chunk, const ExrDeepChunk& packed);
    /// Replaces an attribute's value in a part's header. The new value must have the same size.
    void setAttribute(std::size_t part, const char* name, const Imf::Attribute& value);
    /// Fills in the offset tables and each part's hash (exr_integrity.h), then reads headers and
    /// tables with OpenEXR to check them. Throws Error (kInternal) if a chunk is missing, Error
    /// (kOutput) if OpenEXR reads different headers or tables.
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
    std::vector<std::size_t> first_offset_;  ///< index into offsets_ of each part's first chunk
    /// Offsets of the chunks of all parts, in the order of the offset tables; 0 for chunks that are
    /// not yet written.
    std::vector<std::uint64_t> offsets_;
    std::vector<std::uint64_t> hashes_;  ///< hashes of the chunks, in the order of offsets_
    std::size_t chunk_ = 0;              ///< index into offsets_ of the chunk being written
    std::string start_;                  ///< the file's first bytes: magic number and version
    std::uint64_t table_position_ = 0;
    bool headers_changed_ = false;
};

/// Returns the maximum unpacked size of `packed` bytes, or 0 if deep data cannot have this
/// compression. Serves to check the sizes in a file before memory is allocated.
std::uint64_t exrMostUnpacked(const std::string& compression, std::uint64_t packed);

/// Unpacks a chunk with compression "none", "rle", "zips" or "zip" (ExrInputPart::compression) into
/// `out`, which must have the unpacked size. Copies a chunk that already has the unpacked size.
/// Returns false if the chunk does not fill `out` exactly.
bool exrUnpack(const std::string& compression, std::span<const std::byte> packed,
               std::span<std::byte> out);

/// Unpacks like exrUnpack(), but never takes a chunk for unpacked because of its size.
bool exrUnpackAlways(const std::string& compression, std::span<const std::byte> packed,
                     std::span<std::byte> out);

/// Unpacks zlib data into `out`. Returns false if the data does not fill it exactly.
bool exrInflate(std::span<const std::byte> packed, std::span<std::byte> out);

}  // namespace peeler
