// SPDX-License-Identifier: Apache-2.0
// Dense planes filled from fragment lists.
#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "core/base/parallel.h"
#include "formats/arrays/table_writers.h"

namespace peeler {
namespace {

/// Limits of a range: the bytes of its planes in the widest array, and its number of fragments.
constexpr std::size_t kRangeBytes = std::size_t{1} << 20, kRangeFragments = std::size_t{1} << 15;

bool isFloating(NumberType type) {
    return type == NumberType::kHalf || type == NumberType::kFloat;
}

/// Stores a number as half or float. Returns the end of the output. Halves are rounded to nearest,
/// ties to even; values beyond half's range become infinite.
std::byte* putNumber(float number, NumberType type, std::byte* out) {
    return type == NumberType::kHalf ? storeNumber(imath_float_to_half(number), out)
                                     : storeNumber(number, out);
}

/// Converts `count` numbers of type half or float. Returns the end of the output.
std::byte* convertNumbers(const std::byte* from, NumberType type, std::size_t count,
                          NumberType wanted, std::byte* out) {
    const std::size_t size = infoOf(type).size;
    if (type == wanted) return std::copy_n(from, count * size, out);
    for (std::size_t i = 0; i < count; ++i, from += size) {
        float number = 0;
        if (type == NumberType::kHalf) {
            std::uint16_t bits = 0;
            std::memcpy(&bits, from, sizeof bits);
            number = imath_half_to_float(bits);
        } else {
            std::memcpy(&number, from, sizeof number);
        }
        out = putNumber(number, wanted, out);
    }
    return out;
}

/// Returns the bytes of one component in a plane that has no fragment for the pixel.
std::array<std::byte, 8> nothingOf(NumberType type, double fill) {
    std::array<std::byte, 8> bytes{};  // int32 components stay 0
    if (isFloating(type)) putNumber(static_cast<float>(fill), type, bytes.data());
    if (type == NumberType::kUint32) storeNumber(std::uint32_t{0xFFFFFFFFU}, bytes.data());
    return bytes;
}

}  // namespace

NumberType DensePlanes::typeOf(NumberType type) const {
    if (!isFloating(type)) return type;
    return settings_.type == PixelType::kHalf ? NumberType::kHalf : NumberType::kFloat;
}

NamedArray DensePlanes::array(std::string name, const Column& column,
                              std::vector<std::uint64_t> pixels) const {
    NamedArray array{std::move(name), typeOf(column.type), std::move(pixels)};
    array.shape.push_back(layers_);
    if (column.components > 1) array.shape.push_back(column.components);
    return array;
}

std::size_t DensePlanes::pixelBytes(const Column& column) const {
    return layers_ * column.components * infoOf(typeOf(column.type)).size;
}

void DensePlanes::fill(const Column& column, std::span<const std::uint32_t> offsets,
                       std::span<const std::byte> numbers, ByteBuffer& out) const {
    const NumberType wanted = typeOf(column.type);
    const std::size_t number = infoOf(wanted).size, fragment = column.components * number;
    const std::size_t stored = column.components * infoOf(column.type).size;
    const bool repeats = settings_.repeat_last && isFloating(wanted);
    const auto nothing =
        nothingOf(wanted, repeats ? std::numeric_limits<double>::quiet_NaN() : settings_.fill);
    const std::size_t pixels = offsets.size() - 1;
    out.resize(pixels * pixelBytes(column));
    std::byte* to = out.data();
    for (std::size_t p = 0; p < pixels; ++p) {
        const std::size_t count =
            std::min<std::size_t>(offsets[p + 1] - offsets[p], std::size_t{layers_});
        const std::byte* from = numbers.data() + (offsets[p] - offsets.front()) * stored;
        if (isFloating(wanted)) {
            to = convertNumbers(from, column.type, count * column.components, wanted, to);
        } else if (count != 0) {
            std::memcpy(to, from, count * stored);
            to += count * stored;
        }
        const std::byte* const last = repeats && count != 0 ? to - fragment : nullptr;
        for (std::size_t k = count; k < layers_; ++k, to += fragment) {
            if (last) {
                std::memcpy(to, last, fragment);
                continue;
            }
            for (std::size_t c = 0; c < column.components; ++c)
                std::memcpy(to + c * number, nothing.data(), number);
        }
    }
}

void DensePlanes::forEachRange(std::span<const std::uint32_t> offsets, std::size_t pixel_bytes,
                               const std::function<void(std::size_t, std::size_t)>& use) {
    const std::size_t pixels = offsets.size() - 1;
    const std::size_t most =
        std::max<std::size_t>(1, kRangeBytes / std::max<std::size_t>(1, pixel_bytes));
    std::vector<std::size_t> ends{0};
    while (ends.back() < pixels) {
        const std::size_t first = ends.back();
        std::size_t last = first + 1;
        while (last < pixels && last - first < most &&
               offsets[last + 1] - offsets[first] <= kRangeFragments)
            ++last;
        ends.push_back(last);
    }
    parallelFor(ends.size() - 1, [&](std::size_t i) { use(ends[i], ends[i + 1]); });
}

std::uint64_t DensePlanes::rangeBytes() {
    // Before conversion, a fragment's values take at most 16 bytes.
    return static_cast<std::uint64_t>(threadCount()) * (kRangeBytes + 16 * kRangeFragments);
}

}  // namespace peeler
