// SPDX-License-Identifier: Apache-2.0
// .npy reader: header and values.
// https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <limits>

#include <peeler/error.h>
#include "formats/arrays/array_reader.h"

namespace peeler {
namespace {

template <class T>
double decodeNumber(const std::uint8_t* bytes, bool swapped) {
    std::array<std::uint8_t, sizeof(T)> own;
    std::memcpy(own.data(), bytes, sizeof(T));
    if (swapped) std::ranges::reverse(own);
    return static_cast<double>(std::bit_cast<T>(own));
}

static_assert(std::endian::native == std::endian::little);

constexpr ArrayNumber kArrayNumbers[] = {
    {"f8", 8, true, decodeNumber<double>},         {"f4", 4, true, decodeNumber<float>},
    {"i8", 8, false, decodeNumber<std::int64_t>},  {"i4", 4, false, decodeNumber<std::int32_t>},
    {"i2", 2, false, decodeNumber<std::int16_t>},  {"i1", 1, false, decodeNumber<std::int8_t>},
    {"u8", 8, false, decodeNumber<std::uint64_t>}, {"u4", 4, false, decodeNumber<std::uint32_t>},
    {"u2", 2, false, decodeNumber<std::uint16_t>}, {"u1", 1, false, decodeNumber<std::uint8_t>},
};

[[noreturn]] void damagedArray(const std::string& what, const std::string& where) {
    throw Error(ErrorKind::kInput, "the array is damaged: " + what, where,
                "check that it is a complete NumPy file");
}

/// Returns the text after a key of the header's dictionary, or "" if the key is missing.
std::string_view after(std::string_view header, std::string_view key) {
    const std::size_t at = header.find(key);
    if (at == std::string_view::npos) return {};
    header.remove_prefix(at + key.size());
    header.remove_prefix(std::min(header.find_first_not_of(": "), header.size()));
    return header;
}

/// Returns the numbers in a tuple: "(2, 3)", "(2,)" or "()".
std::optional<std::vector<std::uint64_t>> shapeOf(std::string_view text) {
    constexpr std::size_t kMostAxes = 32;  // numpy's limit
    if (!text.starts_with('(')) return {};
    text.remove_prefix(1);
    std::vector<std::uint64_t> shape;
    while (true) {
        text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
        if (text.starts_with(')')) return shape;
        std::uint64_t size = 0;
        const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), size);
        if (failure != std::errc() || shape.size() == kMostAxes) return {};
        shape.push_back(size);
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
        if (text.starts_with(','))
            text.remove_prefix(1);
        else if (!text.starts_with(')'))
            return {};
    }
}

/// Returns the size of an array in bytes, or nothing on overflow.
std::optional<std::uint64_t> sizeOf(const NumberArray& array) {
    std::uint64_t bytes = array.number->size;
    for (const std::uint64_t size : array.shape) {
        if (size != 0 && bytes > std::numeric_limits<std::uint64_t>::max() / size) return {};
        bytes *= size;
    }
    return bytes;
}

struct NpyFile {
    std::string_view header;
    std::span<const std::uint8_t> bytes;
};

std::optional<NpyFile> npyFile(std::span<const std::uint8_t> file, const std::string& where) {
    constexpr std::string_view kMagic = "\x93NUMPY";
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    if (!text.starts_with(kMagic)) return {};
    const auto byteAt = [&](std::size_t place) {
        if (place >= file.size()) damagedArray("it ends early", where);
        return std::size_t{file[place]};
    };
    const bool short_header = byteAt(kMagic.size()) == 1;
    const std::size_t begin = short_header ? 10 : 12;
    std::size_t length = byteAt(8) | byteAt(9) << 8U;
    if (!short_header) length |= byteAt(10) << 16U | byteAt(11) << 24U;
    if (length > kMostNpyHeader) damagedArray("an array's header is too long", where);
    if (begin + length > file.size()) damagedArray("it ends early", where);
    return NpyFile{text.substr(begin, length), file.subspan(begin + length)};
}

/// Appends a UTF-32 character as UTF-8; ignores an invalid character.
void appendUtf8(std::uint32_t character, std::string& text) {
    if (character > 0x10FFFF || (character >= 0xD800 && character < 0xE000)) return;
    const auto add = [&](std::uint32_t byte) { text += static_cast<char>(byte); };
    if (character < 0x80) return add(character);
    const unsigned more = character < 0x800 ? 1 : character < 0x10000 ? 2 : 3;
    constexpr std::uint32_t kFirst[] = {0, 0xC0, 0xE0, 0xF0};
    add(kFirst[more] | (character >> (6 * more)));
    for (unsigned left = more; left-- > 0;)
        add(0x80 | ((character >> (6 * left)) & 0x3F));
}

}  // namespace

const ArrayNumber* arrayNumber(std::string_view type) {
    const auto* const number = std::ranges::find(kArrayNumbers, type, &ArrayNumber::type);
    return number == std::end(kArrayNumbers) ? nullptr : number;
}

double NumberArray::at(std::uint64_t index) const {
    if (columns) {
        std::uint64_t stored = 0, stride = count();
        for (std::size_t axis = shape.size(); axis-- > 0;) {
            stride /= shape[axis];
            stored += index % shape[axis] * stride;
            index /= shape[axis];
        }
        index = stored;
    }
    return number->decode(bytes.data() + index * number->size, swapped);
}

std::optional<NumberArray> npyArray(std::span<const std::uint8_t> file, const std::string& where) {
    const std::optional<NpyFile> npy = npyFile(file, where);
    if (!npy) return {};
    const std::string_view header = npy->header;
    const std::string_view type = after(header, "'descr'");
    const auto shape = shapeOf(after(header, "'shape'"));
    NumberArray array;
    const auto* const number = std::ranges::find_if(kArrayNumbers, [&](const ArrayNumber& row) {
        constexpr std::size_t kBegin = 2;  // after the quotation mark and the byte order
        const std::size_t end = kBegin + row.type.size();
        return type.starts_with('\'') && type.size() > end && type[end] == '\'' &&
               type.substr(kBegin).starts_with(row.type);
    });
    if (!shape || number == std::end(kArrayNumbers) || !std::strchr("<>|=", type[1])) return {};
    array.shape = *shape;
    array.number = number;
    array.swapped = type[1] == '>';
    array.columns = after(header, "'fortran_order'").starts_with("True");
    array.bytes = npy->bytes;
    if (sizeOf(array) != array.bytes.size())
        damagedArray("an array's size contradicts its header", where);
    return array;
}

std::string shapeText(const std::vector<std::uint64_t>& shape) {
    std::string text;
    for (const std::uint64_t n : shape)
        text += (text.empty() ? "" : ", ") + std::to_string(n);
    return '(' + text + (shape.size() == 1 ? ",)" : ")");
}

std::optional<std::string> npyText(std::span<const std::uint8_t> file) {
    const std::optional<NpyFile> npy = npyFile(file, "");
    if (!npy) return {};
    const std::string_view type = after(npy->header, "'descr'");
    const auto shape = shapeOf(after(npy->header, "'shape'"));
    constexpr std::size_t kKind = 2;  // after the quotation mark and the byte order
    if (type.size() <= kKind || !shape || !shape->empty()) return {};
    std::string text;
    if (type[kKind] == 'b' && npy->bytes.size() == 1) return npy->bytes[0] ? "true" : "false";
    if (type[kKind] == 'S') {
        text.assign(npy->bytes.begin(), npy->bytes.end());
    } else if (type[kKind] == 'U') {
        for (std::size_t i = 0; i + 4 <= npy->bytes.size(); i += 4) {
            std::array<std::uint8_t, 4> bytes;
            std::memcpy(bytes.data(), npy->bytes.data() + i, bytes.size());
            if (type[1] == '>') std::ranges::reverse(bytes);
            appendUtf8(std::bit_cast<std::uint32_t>(bytes), text);
        }
    } else {
        return {};
    }
    text.resize(text.find_last_not_of('\0') + 1);
    return text;
}

}  // namespace peeler
