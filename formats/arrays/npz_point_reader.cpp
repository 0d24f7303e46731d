// SPDX-License-Identifier: Apache-2.0
// Finds the array of points in a .npz, unpacks it and reads its numbers.
// ZIP: APPNOTE.TXT 6.3, sections 4.3 and 4.5.3.
// .npy: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>

#include "core/base/error.h"
#include "formats/arrays/point_reader.h"

namespace peeler {
namespace {

using ByteSpan = std::span<const std::uint8_t>;

constexpr std::size_t kMostNpyHeader = std::size_t{1} << 16;
// The most bytes that DEFLATE makes of one: two bits can stand for 258 bytes.
constexpr std::uint64_t kMostInflation = 1032;

[[noreturn]] void damaged(const std::string& what, const std::string& where) {
    throw Error(ErrorKind::kInput, "the archive is damaged: " + what, where,
                "is it a .npz, and whole?");
}

/// Little-endian numbers at places of the file.
class ArchiveFields {
  public:
    ArchiveFields(ByteSpan bytes, const std::string& where) : bytes_(bytes), where_(where) {}

    template <class T>
    T at(std::uint64_t offset) const {
        T value;
        std::memcpy(&value, part(offset, sizeof value).data(), sizeof value);
        return value;
    }
    ByteSpan part(std::uint64_t offset, std::uint64_t size) const {
        if (offset > bytes_.size() || size > bytes_.size() - offset)
            damaged("something lies beyond its end", where_);
        return bytes_.subspan(offset, size);
    }
    std::uint64_t size() const { return bytes_.size(); }

  private:
    static_assert(std::endian::native == std::endian::little);
    ByteSpan bytes_;
    const std::string& where_;
};

struct Member {
    std::string name;
    std::uint16_t flags = 0, method = 0;
    std::uint32_t crc = 0;
    std::uint64_t packed = 0, size = 0, offset = 0;
};

struct Directory {
    std::uint64_t offset = 0, entries = 0;
};

Directory directoryOf(const ArchiveFields& file, const std::string& where) {
    constexpr std::uint64_t kEnd = 22, kMostComment = 65535, kLocator = 20;
    for (std::uint64_t back = kEnd; back <= std::min(file.size(), kEnd + kMostComment); ++back) {
        const std::uint64_t end = file.size() - back;
        if (file.at<std::uint32_t>(end) != 0x06054B50) continue;
        Directory found{file.at<std::uint32_t>(end + 16), file.at<std::uint16_t>(end + 10)};
        if (end >= kLocator && file.at<std::uint32_t>(end - kLocator) == 0x07064B50) {
            const auto end64 = file.at<std::uint64_t>(end - kLocator + 8);
            if (file.at<std::uint32_t>(end64) != 0x06064B50) damaged("no ZIP64 directory", where);
            found = {file.at<std::uint64_t>(end64 + 48), file.at<std::uint64_t>(end64 + 32)};
        }
        return found;
    }
    damaged("there is no directory", where);
}

/// Takes sizes and offsets that do not fit 32 bits from an extra field, where they stand in this
/// order (section 4.5.3).
void takeZip64(const ArchiveFields& file, std::uint64_t extra, std::uint64_t size, Member& member) {
    const std::uint64_t end = extra + size;
    while (end - extra >= 4) {
        const auto id = file.at<std::uint16_t>(extra), length = file.at<std::uint16_t>(extra + 2);
        extra += 4;
        if (length > end - extra) return;
        if (id == 1) {
            std::uint64_t at = extra;
            for (std::uint64_t* value : {&member.size, &member.packed, &member.offset}) {
                if (*value != 0xFFFFFFFF || at + 8 > extra + length) continue;
                *value = file.at<std::uint64_t>(at);
                at += 8;
            }
        }
        extra += length;
    }
}

std::vector<Member> membersOf(const ArchiveFields& file, const std::string& where) {
    constexpr std::uint64_t kEntry = 46;
    const Directory directory = directoryOf(file, where);
    if (directory.entries > file.size() / kEntry) damaged("an impossible directory", where);
    std::vector<Member> members;
    std::uint64_t at = directory.offset;
    for (std::uint64_t i = 0; i < directory.entries; ++i) {
        if (file.at<std::uint32_t>(at) != 0x02014B50) damaged("its directory is broken", where);
        const auto name = file.at<std::uint16_t>(at + 28), extra = file.at<std::uint16_t>(at + 30),
                   comment = file.at<std::uint16_t>(at + 32);
        const ByteSpan text = file.part(at + kEntry, name);
        Member member{std::string(text.begin(), text.end()), file.at<std::uint16_t>(at + 8),
                      file.at<std::uint16_t>(at + 10),       file.at<std::uint32_t>(at + 16),
                      file.at<std::uint32_t>(at + 20),       file.at<std::uint32_t>(at + 24),
                      file.at<std::uint32_t>(at + 42)};
        file.part(at + kEntry + name, extra);
        takeZip64(file, at + kEntry + name, extra, member);
        members.push_back(std::move(member));
        at += kEntry + name + extra + comment;
    }
    return members;
}

/// The bytes of a member, in the file itself or unpacked into `storage`.
ByteSpan contentsOf(const ArchiveFields& file, const Member& member,
                    std::vector<std::uint8_t>& storage, const std::string& where) {
    constexpr std::uint64_t kLocal = 30;
    if (member.flags & 1U) throw Error(ErrorKind::kInput, "the array is encrypted", where);
    if (file.at<std::uint32_t>(member.offset) != 0x04034B50) damaged("no array there", where);
    const std::uint64_t names = std::uint64_t{file.at<std::uint16_t>(member.offset + 26)} +
                                file.at<std::uint16_t>(member.offset + 28);
    ByteSpan bytes = file.part(member.offset + kLocal + names, member.packed);
    if (member.method == 0) {
        if (member.size != member.packed) damaged("sizes contradict each other", where);
    } else if (member.method == 8) {
        if (member.size > kMostInflation * member.packed) damaged("an impossible size", where);
        storage.resize(member.size);
        const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)> inflate(
            libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
        if (!inflate) throw std::bad_alloc();
        if (libdeflate_deflate_decompress(inflate.get(), bytes.data(), bytes.size(), storage.data(),
                                          storage.size(), nullptr) != LIBDEFLATE_SUCCESS)
            damaged("an array cannot be unpacked", where);
        bytes = storage;
    } else {
        throw Error(ErrorKind::kInput, "the array is packed in another way than DEFLATE", where);
    }
    if (libdeflate_crc32(0, bytes.data(), bytes.size()) != member.crc)
        damaged("a checksum does not fit", where);
    return bytes;
}

/// What a .npy header says of an array of points.
struct Points {
    std::uint64_t count = 0;
    bool is_double = false, swapped = false, columns = false;  ///< column by column
    ByteSpan numbers;
};

/// The text behind a key of the header's dictionary, "" if it has no such key.
std::string_view after(std::string_view header, std::string_view key) {
    const std::size_t at = header.find(key);
    if (at == std::string_view::npos) return {};
    header.remove_prefix(at + key.size());
    header.remove_prefix(std::min(header.find_first_not_of(": "), header.size()));
    return header;
}

/// The n of a shape that is "(n, 3)".
std::optional<std::uint64_t> rowsOfShape(std::string_view shape) {
    if (!shape.starts_with('(')) return {};
    std::uint64_t rows = 0;
    const char* const end = shape.data() + shape.size();
    const auto parsed = std::from_chars(shape.data() + 1, end, rows);
    if (parsed.ec != std::errc()) return {};
    const std::string_view rest(parsed.ptr, static_cast<std::size_t>(end - parsed.ptr));
    if (!rest.starts_with(", 3)") && !rest.starts_with(",3)")) return {};
    return rows;
}

/// The points of a .npy file; nothing if the array is of another shape or type.
std::optional<Points> pointsIn(ByteSpan file, const std::string& where) {
    constexpr std::string_view kMagic = "\x93NUMPY";
    const ArchiveFields fields(file, where);
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    if (!text.starts_with(kMagic)) return {};
    const bool short_header = fields.at<std::uint8_t>(6) == 1;
    const std::size_t begin = short_header ? 10 : 12;
    const std::size_t length =
        short_header ? fields.at<std::uint16_t>(8) : fields.at<std::uint32_t>(8);
    if (length > kMostNpyHeader) damaged("an array's header is too long", where);
    fields.part(begin, length);
    const std::string_view header = text.substr(begin, length);
    const std::string_view type = after(header, "'descr'"),
                           order = after(header, "'fortran_order'");
    const std::optional<std::uint64_t> rows = rowsOfShape(after(header, "'shape'"));
    Points points;
    points.swapped = type.starts_with("'>");
    points.is_double = type.substr(0, 5).ends_with("f8'");
    points.columns = order.starts_with("True");
    const bool is_float = type.starts_with("'<f4'") || type.starts_with("'<f8'") ||
                          type.starts_with("'>f4'") || type.starts_with("'>f8'");
    if (!rows || !is_float) return {};
    points.count = *rows;
    points.numbers = file.subspan(begin + length);
    const std::uint64_t row = 3 * (points.is_double ? sizeof(double) : sizeof(float));
    if (points.numbers.size() % row != 0 || points.count != points.numbers.size() / row)
        damaged("an array has another size than its header says", where);
    return points;
}

template <class T>
T numberAt(const Points& points, std::uint64_t index) {
    std::array<std::uint8_t, sizeof(T)> bytes;
    std::copy_n(points.numbers.begin() + std::ptrdiff_t(index * sizeof(T)), sizeof(T),
                bytes.begin());
    if (points.swapped) std::ranges::reverse(bytes);
    return std::bit_cast<T>(bytes);
}

std::vector<glm::dvec3> positionsIn(const Points& points, const std::string& where) {
    if (points.count > kMostPoints)
        throw Error(ErrorKind::kInput, "there are more points than are taken at once", where);
    std::vector<glm::dvec3> positions(points.count);
    for (std::uint64_t i = 0; i < points.count; ++i) {
        for (std::uint64_t axis = 0; axis < 3; ++axis) {
            const std::uint64_t index = points.columns ? axis * points.count + i : i * 3 + axis;
            positions[i][static_cast<int>(axis)] =
                points.is_double ? numberAt<double>(points, index)
                                 : static_cast<double>(numberAt<float>(points, index));
        }
    }
    return positions;
}

}  // namespace

std::vector<glm::dvec3> npzPoints(std::span<const std::uint8_t> file, const std::string& where) {
    constexpr const char* kHint = "numpy.savez(path, points=array), array of shape (n, 3)";
    constexpr std::uint64_t kMostMember = kMostPoints * 3 * sizeof(double) + kMostNpyHeader;
    const ArchiveFields fields(file, where);
    std::vector<Member> members = membersOf(fields, where);
    // Ours have them under the second name, if the picture had the channel.
    auto named = std::ranges::find(members, "points.npy", &Member::name);
    if (named == members.end()) named = std::ranges::find(members, "positions.npy", &Member::name);
    const bool is_named = named != members.end();
    // Other arrays of ours are vectors, too: they are no points.
    if (!is_named && std::ranges::find(members, "ray_splits.npy", &Member::name) != members.end())
        throw Error(ErrorKind::kInput, "rows of rays without the array positions are no points",
                    where, "extract writes it of the channel position, and rays a .ply of points");
    if (is_named) members = {*named};
    std::vector<glm::dvec3> found;
    std::string name;
    for (const Member& member : members) {
        const std::string inside = (where + ", ").append(member.name);
        if (member.size > kMostMember) {
            if (!is_named) continue;
            throw Error(ErrorKind::kInput, "there are more points than are taken at once", inside);
        }
        std::vector<std::uint8_t> storage;
        const ByteSpan contents = contentsOf(fields, member, storage, inside);
        const std::optional<Points> points = pointsIn(contents, inside);
        if (!points) {
            if (!is_named) continue;
            throw Error(ErrorKind::kInput, "the array is not n points of 32- or 64-bit floats",
                        inside, kHint);
        }
        if (!name.empty())
            throw Error(ErrorKind::kInput, "several arrays could be the points",
                        (where + ", ").append(name).append(" and ").append(member.name),
                        "name one of them \"points\"");
        found = positionsIn(*points, inside);
        name = member.name;
    }
    if (name.empty()) throw Error(ErrorKind::kInput, "no array of it is points", where, kHint);
    return found;
}

}  // namespace peeler
