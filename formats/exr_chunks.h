// SPDX-License-Identifier: Apache-2.0
// The container of a scan-line OpenEXR file: headers, offset tables, ZIP chunks in any order.
//
// OpenEXR's own multi-part writer compresses part after part and wants them written that way; this
// one takes finished chunks of any part in any order, so bands can stream through all parts at
// once. Layout: https://openexr.com/en/latest/OpenEXRFileLayout.html
#pragma once

#include <OpenEXR/ImfHeader.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/atomic_file.h"

struct libdeflate_compressor;

namespace peeler {

inline constexpr int kExrRowsPerChunk = 16;  ///< of ZIP compression

/// Compresses chunks. Keeps its buffers; one for each thread.
class ExrChunkPacker {
  public:
    /// `level` as libdeflate's: 1 fastest, 12 smallest. Throws Error (kMemory).
    explicit ExrChunkPacker(int level);
    ~ExrChunkPacker();
    ExrChunkPacker(const ExrChunkPacker&) = delete;
    ExrChunkPacker& operator=(const ExrChunkPacker&) = delete;

    /// The caller's room for the pixels of the next chunk, `bytes` of them, contents undefined.
    std::span<std::byte> raw(std::size_t bytes);
    /// Packs raw() into `out`: bytes apart, differences, zlib; or as it is where that does not
    /// shrink it.
    void pack(std::vector<std::byte>& out);
    std::size_t bytesKept() const { return raw_.capacity() + filtered_.capacity(); }

  private:
    libdeflate_compressor* compressor_;
    std::vector<std::byte> raw_, filtered_;
};

/// Assembles the file. Single-part if there is one header, else multi-part.
class ExrFile {
  public:
    /// Writes magic number, headers (chunk counts are filled in) and room for the offset tables.
    /// `headers` need names, types and channels; they share what OpenEXR wants shared. Throws Error
    /// (kOutput), also if a chunk could pass the format's 2 GiB, or a header is invalid.
    ExrFile(AtomicFile& file, std::vector<Imf::Header> headers);

    int chunkCount(std::size_t part) const { return headers_[part].chunkCount(); }
    /// Adds a packed chunk; each exactly once.
    void append(std::size_t part, int chunk, std::span<const std::byte> packed);
    /// Fills in the offset tables and reads headers and tables back with OpenEXR.
    /// Throws Error (kInternal) if a chunk is missing.
    void finish();

  private:
    AtomicFile& file_;
    std::vector<Imf::Header> headers_;
    std::vector<std::size_t> first_offset_;  ///< of each part, in offsets_
    std::vector<std::uint64_t> offsets_;     ///< of all parts, as in the file; 0 = not written
    std::uint64_t table_position_ = 0;
};

}  // namespace peeler
