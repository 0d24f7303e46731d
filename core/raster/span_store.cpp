// SPDX-License-Identifier: Apache-2.0
#include "core/raster/span_store.h"

#include <sys/mman.h>

#include <new>

namespace peeler {
namespace {

constexpr std::size_t kPageBytes = 2 << 20;  // size of large pages on x86-64 and most ARM systems
constexpr std::size_t kPageBlocks = kPageBytes / BlockPool::kBlockBytes;

}  // namespace

void BlockPool::Free::operator()(std::byte* page) const {
    ::operator delete (page, std::align_val_t{kPageBytes});
}

std::byte* BlockPool::take() {
    const std::lock_guard lock(mutex_);
    if (bytes() + kBlockBytes > limit_) return nullptr;
    if (next_ == pages_.size() * kPageBlocks) {
        pages_.emplace_back(
            static_cast<std::byte*>(::operator new (kPageBytes, std::align_val_t{kPageBytes})));
        madvise(pages_.back().get(), kPageBytes, MADV_HUGEPAGE);  // only a hint
    }
    std::byte* const block = pages_[next_ / kPageBlocks].get() + next_ % kPageBlocks * kBlockBytes;
    ++next_;
    return block;
}

void BlockPool::reuse() {
    next_ = 0;
}

void BlockPool::free() {
    next_ = 0;
    pages_.clear();
}

void BlockPool::setLimit(std::uint64_t bytes) {
    limit_ = bytes;
    const std::uint64_t most = bytes / kPageBytes;
    if (pages_.size() <= most) return;
    next_ = std::min<std::size_t>(next_, most * kPageBlocks);
    pages_.resize(most);
}

void SpanWriter::begin(std::size_t rows) {
    first_.assign(rows, nullptr);
    // A row without chunks is marked like a row whose chunk is full, so add() extends it.
    next_.assign(rows, reinterpret_cast<Span*>(kLinkOffset));
    free_ = nullptr;
    left_ = 0;
}

bool SpanWriter::extend(BlockPool& pool, std::size_t row) {
    if (left_ == 0) {
        free_ = pool.take();
        if (!free_) return false;
        left_ = BlockPool::kBlockBytes;
    }
    auto* const chunk = reinterpret_cast<Span*>(free_);
    free_ += kChunkBytes;
    left_ -= kChunkBytes;
    if (first_[row])
        *reinterpret_cast<Span**>(next_[row]) = chunk;
    else
        first_[row] = chunk;
    next_[row] = chunk;
    return true;
}

HitTriangle* SectionWriter::room(BlockPool& pool) {
    if (left_ < HitTriangles::kBlock) {
        free_ = reinterpret_cast<HitTriangle*>(pool.take());
        if (!free_) return nullptr;
        left_ = BlockPool::kBlockBytes / sizeof(HitTriangle);
    }
    return free_;
}

void SpanStore::begin(std::size_t rows, std::size_t blocks, std::uint64_t limit) {
    pool_.reuse();
    pool_.setLimit(limit);
    triangles_.begin(blocks);
    overflowed_ = false;
    rows_ = rows;
    idle_.clear();
    for (const auto& writer : writers_) {
        writer->begin(rows);
        idle_.push_back(writer.get());
    }
}

SectionWriter& SpanStore::takeWriter() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) {
        idle_.push_back(writers_.emplace_back(std::make_unique<SectionWriter>()).get());
        idle_.back()->begin(rows_);
    }
    SectionWriter& writer = *idle_.back();
    idle_.pop_back();
    return writer;
}

std::uint64_t SpanStore::bytes() const {
    std::uint64_t sum = pool_.bytes() + triangles_.bytes();
    for (const auto& writer : writers_)
        sum += writer->spans.bytes();
    return sum;
}

void SpanStore::free() {
    pool_.free();
    triangles_.begin(0);
    writers_.clear();
    idle_.clear();
    rows_ = 0;
}

}  // namespace peeler
