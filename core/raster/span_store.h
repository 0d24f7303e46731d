// SPDX-License-Identifier: Apache-2.0
// What triangles cover, row by row, and the planes that they lie in.
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

/// Neighbouring rays of one row that hit the same triangle.
struct Span {
    std::uint32_t triangle = 0;         ///< HitTriangles' number of it
    std::uint16_t first = 0, last = 0;  ///< columns, from the crop's first on
};

/// What is known of a triangle that is hit: planar depth (PixelRays) at the ray of pixel (x, y) of
/// the picture is along_x · x + along_y · y + at_origin.
struct HitTriangle {
    double along_x = 0, along_y = 0, at_origin = 0;
    float nearest = 0, farthest = 0;  ///< Z of its corners; no hit is beyond them
    std::uint32_t key = 0;
};

inline constexpr std::size_t kAddressBytes = sizeof(std::uintptr_t);

/// Memory that is handed out in pieces, never moves, and is taken back all at once. Several threads
/// may ask, each for blocks of its own. It asks the system for large pages, of which few have to be
/// found where there would be many small ones.
class BlockPool {
  public:
    static constexpr std::size_t kBlockBytes = 256 << 10;

    /// A block of kBlockBytes; null if there are `limit` bytes already.
    std::byte* take();
    /// Takes all blocks back, and keeps them for what comes next.
    void reuse();
    void free();

    /// Most bytes from now on. Less than are held frees them, so nothing may be in use.
    void setLimit(std::uint64_t bytes);
    /// Of the blocks that are in use.
    std::uint64_t bytes() const { return next_ * kBlockBytes; }

  private:
    struct Free {
        void operator()(std::byte* page) const;
    };

    std::mutex mutex_;
    std::vector<std::unique_ptr<std::byte, Free>> pages_;
    std::size_t next_ = 0;  // those before it are in use
    std::uint64_t limit_ = ~std::uint64_t{0};
};

/// Spans of the rows of a section as one thread finds them: chunks of a row's spans, each of which
/// ends in the address of the next one.
class SpanWriter {
  public:
    /// Forgets everything: the pool's blocks have been taken back.
    void begin(std::size_t rows);

    /// False if the pool has no more memory.
    bool add(BlockPool& pool, std::size_t row, const Span& span) {
        Span*& at = next_[row];
        if ((reinterpret_cast<std::uintptr_t>(at) & (kChunkBytes - 1)) == kLinkOffset &&
            !extend(pool, row))
            return false;
        *at++ = span;
        return true;
    }

    /// Calls use(spans) with the spans of a row, some at a time.
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
    /// Chunks of a row lie anywhere, so no processor sees which one comes next.
    static void prefetch(const Span* chunk) {
        constexpr std::size_t kCacheLine = 64;
        if (!chunk) return;
        for (std::size_t at = 0; at < kChunkBytes; at += kCacheLine)
            __builtin_prefetch(reinterpret_cast<const std::byte*>(chunk) + at);
    }

    std::vector<Span*> first_, next_;  // of each row
    std::byte* free_ = nullptr;        // of the block at hand
    std::size_t left_ = 0;
};

/// The triangles that are hit, by number. Numbers go by blocks of kBlock of the scene's triangles,
/// and so have the order of the keys, whichever threads find them.
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

/// What one thread writes to.
class SectionWriter {
  public:
    void begin(std::size_t rows) {
        spans.begin(rows);
        free_ = nullptr;
        left_ = 0;
    }
    /// Room for the triangles of a block; null if the pool has no more memory.
    HitTriangle* room(BlockPool& pool);
    /// How many of them are used.
    void keep(std::size_t triangles) {
        free_ += triangles;
        left_ -= triangles;
    }

    SpanWriter spans;

  private:
    HitTriangle* free_ = nullptr;
    std::size_t left_ = 0;
};

/// The spans and the triangles of some rows of a picture.
class SpanStore {
  public:
    /// Forgets what it holds and makes room for these rows. `limit`: most bytes.
    void begin(std::size_t rows, std::size_t blocks, std::uint64_t limit);

    /// Calls use(writer) with a writer that no other thread has meanwhile.
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

    /// Calls use(spans) with the spans of a row, some at a time.
    template <class Use>
    void forEachSpan(std::size_t row, Use&& use) const {
        for (const auto& writer : writers_)
            writer->spans.forEach(row, use);
    }

    /// Says that it holds not everything, for want of memory.
    void overflow() { overflowed_ = true; }
    bool overflowed() const { return overflowed_; }

    std::uint64_t bytes() const;
    /// Gives the memory back.
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
