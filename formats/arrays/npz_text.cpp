// SPDX-License-Identifier: Apache-2.0
// Reader of one text in a .npz by ArrayWriter. Reads only the directory, which is written last, and
// the text. ZIP64: APPNOTE.TXT, sections 4.3 and 4.5.3.
#include <libdeflate.h>

#include <cstring>
#include <vector>

#include "formats/arrays/array_containers.h"
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

/// The sizes of the records at the end of every .npz by ArrayWriter: the ZIP64 end record, its
/// locator and the classic end record.
constexpr std::uint64_t kEnd64 = 56, kLocatorBytes = 20, kEndBytes = 22;
constexpr std::uint64_t kEndRecords = kEnd64 + kLocatorBytes + kEndBytes;
constexpr std::uint64_t kEntryBytes = 46, kZip64Bytes = 28, kLocalBytes = 30, kLocalZip64Bytes = 20;
constexpr std::uint64_t kMostDirectory = std::uint64_t{1} << 24, kMostText = std::uint64_t{1} << 20;

template <class T>
T zipNumber(const std::string& bytes, std::uint64_t at) {
    T number{};
    if (at + sizeof number <= bytes.size()) std::memcpy(&number, bytes.data() + at, sizeof number);
    return number;
}

/// Returns bytes of a file, or "" if some of them cannot be read.
std::string zipBytes(const RegularFile& file, std::uint64_t at, std::uint64_t size) {
    std::string bytes(size, '\0');
    return file.read(at, bytes) ? bytes : "";
}

/// An array's entry in the directory: offset, and size including the .npy header.
struct ZipEntry {
    std::uint64_t offset = 0, bytes = 0;
    std::uint32_t crc = 0;
};

ZipEntry findZipEntry(const std::string& directory, const std::string& name) {
    for (std::uint64_t at = 0; at + kEntryBytes <= directory.size();) {
        const std::uint64_t length = zipNumber<std::uint16_t>(directory, at + 28);
        const std::uint64_t zip64 = at + kEntryBytes + length;
        if (zipNumber<std::uint32_t>(directory, at) != 0x02014b50 ||
            zipNumber<std::uint16_t>(directory, at + 30) != kZip64Bytes)
            return {};
        if (directory.compare(at + kEntryBytes, length, name) == 0) {
            return {zipNumber<std::uint64_t>(directory, zip64 + 20),
                    zipNumber<std::uint64_t>(directory, zip64 + 4),
                    zipNumber<std::uint32_t>(directory, at + 16)};
        }
        at = zip64 + kZip64Bytes;
    }
    return {};
}

}  // namespace

std::string npzText(const std::string& path, const std::string& text) {
    const RegularFile file(path);
    if (!file.isOpen() || file.size() < kEndRecords) return "";
    const std::uint64_t end = file.size() - kEndRecords;
    const std::string records = zipBytes(file, end, kEndRecords);
    const auto length = zipNumber<std::uint64_t>(records, 40);
    const auto start = zipNumber<std::uint64_t>(records, 48);
    if (zipNumber<std::uint32_t>(records, 0) != 0x06064b50 ||
        zipNumber<std::uint32_t>(records, kEnd64) != 0x07064b50 ||
        zipNumber<std::uint32_t>(records, kEnd64 + kLocatorBytes) != 0x06054b50 ||
        length > kMostDirectory || start > end || end - start != length)
        return "";
    const std::string name = text + ".npy";
    const ZipEntry found = findZipEntry(zipBytes(file, start, length), name);
    const std::uint64_t local = kLocalBytes + name.size() + kLocalZip64Bytes;
    if (found.bytes == 0 || found.bytes > kMostText || found.offset > start) return "";
    const std::string npy = zipBytes(file, found.offset + local, found.bytes);
    if (libdeflate_crc32(0, npy.data(), npy.size()) != found.crc) return "";
    constexpr std::uint64_t kPreamble = 10;
    const std::uint64_t header = kPreamble + zipNumber<std::uint16_t>(npy, 8);
    if (!npy.starts_with("\x93NUMPY\x01") || npy.find("'|u1'") > header || header > npy.size())
        return "";
    return npy.substr(header);
}

}  // namespace peeler
