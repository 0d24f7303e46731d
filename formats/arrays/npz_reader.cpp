// SPDX-License-Identifier: Apache-2.0
// .npz reader: directory and decompression.
// ZIP: APPNOTE.TXT 6.3, sections 4.3 and 4.5.3.
#include <libdeflate.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>

#include <peeler/error.h>
#include "formats/arrays/array_reader.h"

namespace peeler {
namespace {

using ByteSpan = std::span<const std::uint8_t>;
using Member = NpzArchive::Member;

// The maximum expansion ratio of DEFLATE: two bits encode at most 258 bytes.
constexpr std::uint64_t kMostInflation = 1032;

/// The place in an archive, and the archive's format, for messages.
struct ArchivePlace {
    const std::string& where;
    const char* kind;
};

[[noreturn]] void damaged(const std::string& what, const ArchivePlace& place) {
    throw Error(ErrorKind::kInput, "the archive is damaged: " + what, place.where,
                "check that it is a complete " + std::string(place.kind) + " file");
}

class ArchiveFields {
  public:
    ArchiveFields(ByteSpan bytes, const ArchivePlace& place) : bytes_(bytes), place_(place) {}

    template <class T>
    T at(std::uint64_t offset) const {
        T value;
        std::memcpy(&value, part(offset, sizeof value).data(), sizeof value);
        return value;
    }
    ByteSpan part(std::uint64_t offset, std::uint64_t size) const {
        if (offset > bytes_.size() || size > bytes_.size() - offset)
            damaged("data lies beyond its end", place_);
        return bytes_.subspan(offset, size);
    }
    std::uint64_t size() const { return bytes_.size(); }

  private:
    static_assert(std::endian::native == std::endian::little);
    ByteSpan bytes_;
    ArchivePlace place_;
};

struct Directory {
    std::uint64_t offset = 0, entries = 0;
};

Directory directoryOf(const ArchiveFields& file, const ArchivePlace& place) {
    constexpr std::uint64_t kEnd = 22, kMostComment = 65535, kLocator = 20;
    for (std::uint64_t back = kEnd; back <= std::min(file.size(), kEnd + kMostComment); ++back) {
        const std::uint64_t end = file.size() - back;
        if (file.at<std::uint32_t>(end) != 0x06054B50) continue;
        Directory found{file.at<std::uint32_t>(end + 16), file.at<std::uint16_t>(end + 10)};
        if (end >= kLocator && file.at<std::uint32_t>(end - kLocator) == 0x07064B50) {
            const auto end64 = file.at<std::uint64_t>(end - kLocator + 8);
            if (file.at<std::uint32_t>(end64) != 0x06064B50) damaged("no ZIP64 directory", place);
            found = {file.at<std::uint64_t>(end64 + 48), file.at<std::uint64_t>(end64 + 32)};
        }
        return found;
    }
    damaged("there is no directory", place);
}

/// Reads from a member's extra field the sizes and the offset that do not fit into 32 bits (section
/// 4.5.3).
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

std::vector<Member> membersOf(const ArchiveFields& file, const ArchivePlace& place) {
    constexpr std::uint64_t kEntry = 46;
    const Directory directory = directoryOf(file, place);
    if (directory.entries > file.size() / kEntry) damaged("an impossible directory", place);
    std::vector<Member> members;
    std::uint64_t at = directory.offset;
    for (std::uint64_t i = 0; i < directory.entries; ++i) {
        if (file.at<std::uint32_t>(at) != 0x02014B50) damaged("its directory is broken", place);
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

}  // namespace

NpzArchive::NpzArchive(ByteSpan file, std::string where, const char* kind)
    : file_(file), where_(std::move(where)), kind_(kind) {
    const ArchivePlace place{where_, kind_};
    members_ = membersOf(ArchiveFields(file_, place), place);
}

const Member* NpzArchive::find(std::string_view array) const {
    const auto found = std::ranges::find_if(members_, [&](const Member& member) {
        return member.name.size() == array.size() + 4 && member.name.starts_with(array) &&
               member.name.ends_with(".npy");
    });
    return found == members_.end() ? nullptr : &*found;
}

ByteSpan NpzArchive::contents(const Member& member, std::vector<std::uint8_t>& storage) const {
    constexpr std::uint64_t kLocal = 30;
    const std::string where = placeOf(member);
    const ArchivePlace place{where, kind_};
    const ArchiveFields file(file_, place);
    if (member.flags & 1U) throw Error(ErrorKind::kInput, "the array is encrypted", where);
    if (file.at<std::uint32_t>(member.offset) != 0x04034B50) damaged("an array is missing", place);
    const std::uint64_t names = std::uint64_t{file.at<std::uint16_t>(member.offset + 26)} +
                                file.at<std::uint16_t>(member.offset + 28);
    ByteSpan bytes = file.part(member.offset + kLocal + names, member.packed);
    if (member.method == 0) {
        if (member.size != member.packed) damaged("sizes contradict each other", place);
    } else if (member.method == 8) {
        if (member.size > kMostInflation * member.packed) damaged("an impossible size", place);
        storage.resize(member.size);
        const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)> inflate(
            libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
        if (!inflate) throw std::bad_alloc();
        if (libdeflate_deflate_decompress(inflate.get(), bytes.data(), bytes.size(), storage.data(),
                                          storage.size(), nullptr) != LIBDEFLATE_SUCCESS)
            damaged("an array cannot be decompressed", place);
        bytes = storage;
    } else {
        throw Error(ErrorKind::kInput, "the array is compressed by a method other than DEFLATE",
                    where, "write it again with numpy.savez or numpy.savez_compressed");
    }
    if (libdeflate_crc32(0, bytes.data(), bytes.size()) != member.crc)
        damaged("a checksum does not match", place);
    return bytes;
}

}  // namespace peeler
