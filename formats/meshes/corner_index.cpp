// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <random>
#include <utility>

#include <peeler/error.h>
#include "formats/meshes/mesh_parts.h"

namespace peeler {
namespace {

/// Returns numbers that differ in every process, so that no file can be crafted to make all corners
/// collide.
std::array<std::uint64_t, 2> secretNumbers() {
    std::random_device device;
    const auto number = [&] { return std::uint64_t{device()} << 32U | device() | 1U; };
    return {number(), number()};
}

}  // namespace

CornerIndex::CornerIndex(std::function<void(std::uint64_t bytes)> allow)
    : allow_(std::move(allow)) {
    static const std::array<std::uint64_t, 2> secret = secretNumbers();
    secret_ = secret;
}

void CornerIndex::reserve(std::size_t keys) {
    if (keys > limit_) growTo(std::bit_ceil(2 * keys));
}

void CornerIndex::growTo(std::size_t size) {
    size = std::max(size, std::size_t{64});
    if (size / 2 >= kNone)
        throw Error(ErrorKind::kInput, "there are more than 2^31 vertices", "", "split the scene");
    allow_(size * sizeof(std::uint32_t) + size / 2 * sizeof(Key));
    std::vector<std::uint32_t>(size, kNone).swap(slots_);
    mask_ = size - 1;
    limit_ = size / 2;
    keys_.reserve(limit_);
    for (std::size_t number = 0; number < keys_.size(); ++number) {
        std::size_t slot = hash(keys_[number]) & mask_;
        while (slots_[slot] != kNone)
            slot = (slot + 1) & mask_;
        slots_[slot] = static_cast<std::uint32_t>(number);
    }
}

}  // namespace peeler
