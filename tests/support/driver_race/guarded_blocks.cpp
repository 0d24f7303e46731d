// SPDX-License-Identifier: Apache-2.0
// Preloaded library that guards freed blocks. Each block of certain sizes gets its own page. When
// the block is freed, its page becomes inaccessible and is never reused, so a driver that uses the
// block afterwards crashes at once. PEELER_GUARDED_SIZES lists the sizes in bytes, such as 112,120
// (default: none).
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

extern "C" {
// The C library's own functions.
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void __libc_free(void* block);
}

namespace {

constexpr std::size_t kPage = 4096, kRegion = std::size_t{1} << 38;
constexpr int kHow = MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE;

struct Settings {
    std::array<std::size_t, 8> sizes{};
    std::byte* region = nullptr;

    Settings() {
        const char* text = std::getenv("PEELER_GUARDED_SIZES");
        for (std::size_t i = 0; text && *text && i < sizes.size(); ++i) {
            char* end = nullptr;
            sizes[i] = std::strtoul(text, &end, 10);
            text = *end == ',' ? end + 1 : end;
        }
        void* const reserved = mmap(nullptr, kRegion, PROT_NONE, kHow, -1, 0);
        if (reserved != MAP_FAILED) region = static_cast<std::byte*>(reserved);
    }
};

const Settings& settings() {
    static const Settings only;
    return only;
}

std::atomic<std::size_t> used{0};  ///< bytes of the region in use

/// Returns a new guarded block of zeros. Returns null if the size is not guarded or the region is
/// full; the caller then uses the C library's function.
void* guarded(std::size_t size) {
    const Settings& s = settings();
    if (size == 0 || !s.region || std::find(s.sizes.begin(), s.sizes.end(), size) == s.sizes.end())
        return nullptr;
    const std::size_t at = used.fetch_add(kPage);
    if (at >= kRegion || mprotect(s.region + at, kPage, PROT_READ | PROT_WRITE) != 0)
        return nullptr;
    std::memcpy(s.region + at, &size, sizeof size);  // for realloc()
    constexpr std::size_t kAlignment = alignof(std::max_align_t);
    return s.region + at + kPage - (size + kAlignment - 1) / kAlignment * kAlignment;
}

/// Returns the page of a guarded block; null for other blocks.
std::byte* pageOf(void* block) {
    std::byte* const region = settings().region;
    auto* const at = static_cast<std::byte*>(block);
    if (!region || at < region || at >= region + kRegion) return nullptr;
    return at - (at - region) % static_cast<std::ptrdiff_t>(kPage);
}

}  // namespace

extern "C" {

void* malloc(std::size_t size) noexcept {
    void* const block = guarded(size);
    return block ? block : __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
    std::size_t all = 0;
    void* const block = __builtin_mul_overflow(count, size, &all) ? nullptr : guarded(all);
    return block ? block : __libc_calloc(count, size);
}

void free(void* block) noexcept {
    std::byte* const page = pageOf(block);
    if (!page) return __libc_free(block);
    const int before = errno;
    // Map the page again, so that the kernel merges adjacent pages into one mapping. The kernel
    // allows some 65,000 mappings.
    mmap(page, kPage, PROT_NONE, kHow | MAP_FIXED, -1, 0);
    errno = before;
}

void* realloc(void* block, std::size_t size) noexcept {
    std::byte* const page = pageOf(block);
    if (!page) return __libc_realloc(block, size);
    std::size_t before = 0;
    std::memcpy(&before, page, sizeof before);
    void* const moved = malloc(size);
    if (moved) std::memcpy(moved, block, std::min(before, size));
    if (moved) free(block);
    return moved;
}

}  // extern "C"
