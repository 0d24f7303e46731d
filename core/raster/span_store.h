// SPDX-License-Identifier: Apache-2.0
// Storage for the row spans of triangles, and for the planes of the triangles.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace peeler {

/// A run of neighbouring rays in a row that hit the same triangle.
struct Span {
    std::uint32_t triangle = 0;         ///< index into HitTriangles
    std::uint16_t first = 0, last = 0;  ///< columns, counted from the crop's first column
};

/// A hit triangle's key and depth. At the ray of pixel (x, y) of the picture, planar depth
/// (PixelRays) is along_x · x + along_y · y + at_origin.
struct HitTriangle {
    double along_x = 0, along_y = 0, at_origin = 0;
    /// Minimum and maximum Z of the corners; hits are clamped to this range.
    float nearest = 0, farthest = 0;
    std::uint32_t key = 0;
};

inline constexpr std::size_t kAddressBytes = sizeof(std::uintptr_t);

/// An arena allocator. Its blocks never move, and all blocks are freed together. Several threads
/// may take blocks at the same time. Requests large pages from the system, since mapping small
/// pages takes longer.
class BlockPool {
  public:
    static constexpr std::size_t kBlockBytes = 256 << 10;

    /// Returns a block of kBlockBytes; null if the limit leaves no room for it.
    std::byte* take();
    /// Takes back all blocks and keeps them for reuse.
    void reuse();
    void free();

    /// Sets the limit in bytes, and frees pages beyond it. No block may be in use.
    void setLimit(std::uint64_t bytes);
    /// Returns the bytes of the blocks in use.
    std::uint64_t bytes() const { return next_ * kBlockBytes; }

  private:
    struct Free {
        void operator()(std::byte* page) const;
    };

    std::mutex mutex_;
    std::vector<std::unique_ptr<std::byte, Free>> pages_;
    std::size_t next_ = 0;  // number of blocks in use
    std::uint64_t limit_ = ~std::uint64_t{0};
};

/// The spans that one thread has found in a section. Each row has a linked list of chunks. `first_`
/// points to the row's first chunk, and `next_` to the end of its spans. The last element of a
/// chunk is the address of the next chunk.
class SpanWriter {
  public:
    /// Discards all spans and prepares for this number of rows. Must be called only after
    /// BlockPool::reuse().
    void begin(std::size_t rows);

    /// Appends a span to a row. Returns false if the pool has no more memory.
    bool add(BlockPool& pool, std::size_t row, const Span& span) {
        Span*& at = next_[row];
        if ((reinterpret_cast<std::uintptr_t>(at) & (kChunkBytes - 1)) == kLinkOffset &&
            !extend(pool, row))
            return false;
        *at++ = span;
        return true;
    }

    /// Calls use(spans) with the spans of a row, a chunk at a time.
    template <class Use>
    void forEach(std::size_t row, Use&& use) const {
        if (row >= first_.size()) return;
        const Span* const end = next_[row];
        prefetch(first_[row]);
        for (const Span* chunk = first_[row]; chunk;) {
            const bool last = end >= chunk && end <= chunk + kChunkSpans;
            const Span* const next =
                last ? nullptr : *reinterpret_cast<Span* const*>(chunk + kChunkSpans);
            prefetch(next);
            use(std::span<const Span>(chunk,
                                      last ? static_cast<std::size_t>(end - chunk) : kChunkSpans));
            chunk = next;
        }
    }

    std::uint64_t bytes() const { return (first_.capacity() + next_.capacity()) * kAddressBytes; }

  private:
    static constexpr std::size_t kChunkBytes = 512, kLinkOffset = kChunkBytes - kAddressBytes;
    static constexpr std::size_t kChunkSpans = kLinkOffset / sizeof(Span);
    static_assert(sizeof(Span) == kAddressBytes, "a chunk's last place holds an address");

    bool extend(BlockPool& pool, std::size_t row);
    /// Prefetches a chunk. The chunks of a row are scattered, so the hardware prefetcher cannot
    /// predict the next one.
    static void prefetch(const Span* chunk) {
        constexpr std::size_t kCacheLine = 64;
        if (!chunk) return;
        for (std::size_t at = 0; at < kChunkBytes; at += kCacheLine)
            __builtin_prefetch(reinterpret_cast<const std::byte*>(chunk) + at);
    }

    std::vector<Span*> first_, next_;  // for each row: the first chunk, and the end of the spans
    std::byte* free_ = nullptr;        // unused part of the current block
    std::size_t left_ = 0;
};

/// The hit triangles by index. Each block of kBlock triangles of the scene has its own range of
/// indices. So indices are in key order, whichever thread finds a triangle.
class HitTriangles {
  public:
    static constexpr std::uint32_t kBlockBits = 11, kBlock = 1U << kBlockBits;

    void begin(std::size_t blocks) { blocks_.assign(blocks, nullptr); }
    void place(std::size_t block, const HitTriangle* triangles) { blocks_[block] = triangles; }

    const HitTriangle& operator[](std::uint32_t number) const {
        return blocks_[number >> kBlockBits][number & (kBlock - 1)];
    }
    std::uint64_t bytes() const { return blocks_.capacity() * kAddressBytes; }

  private:
    std::vector<const HitTriangle*> blocks_;
};

/// The spans and hit triangles that one thread has found.
class SectionWriter {
  public:
    void begin(std::size_t rows) {
        spans.begin(rows);
        free_ = nullptr;
        left_ = 0;
    }
    /// Returns space for the triangles of a block; null if the pool has no more memory.
    HitTriangle* room(BlockPool& pool);
    /// Keeps the first `triangles` triangles in the space from room().
    void keep(std::size_t triangles) {
        free_ += triangles;
        left_ -= triangles;
    }

    SpanWriter spans;

  private:
    HitTriangle* free_ = nullptr;
    std::size_t left_ = 0;
};

/// The spans and hit triangles of some rows of a picture.
class SpanStore {
  public:
    /// Clears the store and makes room for these rows. `limit`: the maximum bytes of spans and
    /// triangles.
    void begin(std::size_t rows, std::size_t blocks, std::uint64_t limit);

    /// Calls use(writer) with a writer that no other thread uses at the same time.
    template <class Use>
    void write(Use&& use) {
        SectionWriter& writer = takeWriter();
        use(writer);
        const std::lock_guard lock(mutex_);
        idle_.push_back(&writer);
    }

    BlockPool& pool() { return pool_; }
    HitTriangles& triangles() { return triangles_; }
    const HitTriangles& triangles() const { return triangles_; }

    /// Calls use(spans) with the spans of a row, a chunk at a time.
    template <class Use>
    void forEachSpan(std::size_t row, Use&& use) const {
        for (const auto& writer : writers_)
            writer->spans.forEach(row, use);
    }

    /// Marks the contents as incomplete, because memory ran out.
    void overflow() { overflowed_ = true; }
    bool overflowed() const { return overflowed_; }

    std::uint64_t bytes() const;
    void free();

  private:
    SectionWriter& takeWriter();

    BlockPool pool_;
    HitTriangles triangles_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<SectionWriter>> writers_;
    std::vector<SectionWriter*> idle_;
    std::size_t rows_ = 0;
    std::atomic<bool> overflowed_{false};
};

}  // namespace peeler
