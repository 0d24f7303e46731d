// SPDX-License-Identifier: Apache-2.0
// Byte-by-byte checks of OpenEXR files, without the OpenEXR library. Headers, offset tables and
// chunks must make up the whole file.
#include "formats/exr/exr_integrity.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <string_view>

#include <peeler/error.h>
#include "formats/exr/exr_files.h"
#include "formats/file/content_hash.h"
#include "formats/file/regular_file.h"
#include "formats/image/exr_headers.h"

namespace peeler {
namespace {

// Two strings in the record of the hash attribute that do not overlap. A flipped bit may change the
// attribute's name, or make the previous attribute overlap this record. One of the strings stays
// intact and shows that the file had a hash.
constexpr std::string_view kRecordBegin("peeler:pixelHash\0string\0", 24);
constexpr std::string_view kRecordEnd("\x16\0\0\0xxh64:", 10);
constexpr std::string_view kValueBegin = kRecordEnd.substr(4);
constexpr std::size_t kDigits = 16;
constexpr std::string_view kZeros = "0000000000000000";

constexpr std::size_t kBlock = std::size_t{1} << 20;

/// The bytes of a file, read block by block.
class FileBytes {
  public:
    explicit FileBytes(const std::string& path) : file_(path), path_(path) { file_.check(); }

    const RegularFile& file() const { return file_; }
    const std::string& path() const { return path_; }
    std::uint64_t size() const { return file_.size(); }

    /// Returns `wanted` bytes from `place` on. Returns fewer at the end of the file, and at most
    /// kBlock.
    std::span<const char> at(std::uint64_t place, std::uint64_t wanted) {
        if (place >= size()) return {};
        const auto count = static_cast<std::size_t>(
            std::min({wanted, size() - place, static_cast<std::uint64_t>(kBlock)}));
        if (place < begin_ || place + count > begin_ + block_.size()) {
            block_.resize(static_cast<std::size_t>(
                std::min(size() - place, static_cast<std::uint64_t>(kBlock))));
            begin_ = place;
            if (file_.readSome(place, block_) < block_.size())
                throw Error(ErrorKind::kInput, "the file cannot be read to its end", path_);
        }
        return std::span(block_).subspan(static_cast<std::size_t>(place - begin_), count);
    }

    template <class T>
    std::optional<T> number(std::uint64_t place) {
        const std::span<const char> bytes = at(place, sizeof(T));
        if (bytes.size() < sizeof(T)) return {};
        T value;
        std::memcpy(&value, bytes.data(), sizeof(T));
        return value;
    }

    template <class Take>
    void forEachBlock(std::uint64_t begin, std::uint64_t end, Take&& take) {
        for (std::span<const char> block; begin < end; begin += block.size()) {
            block = at(begin, end - begin);
            take(block);
        }
    }

    void addTo(ContentHasher& hash, std::uint64_t begin, std::uint64_t end) {
        forEachBlock(begin, end,
                     [&](std::span<const char> block) { hash.add(std::as_bytes(block)); });
    }

  private:
    RegularFile file_;
    std::string path_;
    std::vector<char> block_;
    std::uint64_t begin_ = 0;
};

struct PartHeader {
    std::uint64_t begin = 0, end = 0;  ///< range of the header's bytes, including the terminating 0
    /// Values of the attributes `name`, `type` and the hash attribute.
    std::string name, type, hash;
    std::uint64_t digits = 0;  ///< offset of the hash's digits
    std::int32_t chunks = 0;   ///< value of the attribute chunkCount
    bool ends = false;         ///< whether the header has the last required attribute
};

struct Headers {
    bool multi_part = false;
    std::vector<PartHeader> parts;
    std::uint64_t end = 0;  ///< end of the headers, where the offset tables begin
};

/// Reads the header of the next part.
PartHeader readPart(FileBytes& file, ExrHeaders& headers) {
    PartHeader part;
    part.begin = headers.place();
    ExrHeaders::Attribute attribute;
    while (headers.nextAttribute(attribute)) {
        const auto text = [&] {
            const std::span<const char> value =
                file.at(attribute.place, std::min(attribute.size, std::uint64_t{255}));
            return std::string(value.begin(), value.end());
        };
        if (attribute.name == "name") part.name = text();
        if (attribute.name == "type") part.type = text();
        if (attribute.name == "chunkCount" && attribute.size == sizeof(std::int32_t))
            part.chunks = file.number<std::int32_t>(attribute.place).value_or(0);
        if (attribute.name == kPixelHash && attribute.size == kValueBegin.size() + kDigits) {
            part.hash = text();
            part.digits = attribute.place + kValueBegin.size();
        }
        part.ends = part.ends || attribute.name == "screenWindowWidth";
    }
    part.end = headers.place();
    // Attributes are sorted by name. If a damaged size ends the header too early, the last required
    // attribute is missing.
    if (!part.ends)
        throw Error(ErrorKind::kInput, "the file's headers are incomplete", file.path(),
                    "the file may be damaged or cut off; write it again");
    return part;
}

Headers readHeaders(FileBytes& file) {
    ExrHeaders walk(file.file(), file.path());
    Headers headers;
    headers.multi_part = walk.multiPart();
    while (walk.nextPart())
        headers.parts.push_back(readPart(file, walk));
    headers.end = walk.place();
    return headers;
}

bool hasHash(FileBytes& file, const Headers& headers) {
    bool found = false;
    std::string last;  // end of the previous block, then the current block
    file.forEachBlock(ExrHeaders::kBegin, headers.end, [&](std::span<const char> block) {
        last.append(block.data(), block.size());
        found = found || last.find(kRecordBegin) != std::string::npos ||
                last.find(kRecordEnd) != std::string::npos;
        last.erase(0, last.size() - std::min(last.size(), kRecordBegin.size()));
    });
    return found;
}

/// Returns the size of the chunk at `place`, or 0 if the file ends too early.
std::uint64_t chunkBytes(FileBytes& file, const Headers& headers, const PartHeader& part,
                         std::uint64_t place) {
    const std::uint64_t row = place + (headers.multi_part ? sizeof(std::int32_t) : 0);
    const std::uint64_t sizes = row + sizeof(std::int32_t);
    std::uint64_t end = 0;
    if (part.type == "deepscanline") {
        const auto counts = file.number<std::uint64_t>(sizes);
        const auto samples = file.number<std::uint64_t>(sizes + 8);
        if (!counts || !samples || *counts > file.size() || *samples > file.size()) return 0;
        end = sizes + 24 + *counts + *samples;
    } else {
        const auto packed = file.number<std::int32_t>(sizes);
        if (!packed || *packed < 0) return 0;
        end = sizes + 4 + static_cast<std::uint64_t>(*packed);
    }
    return end <= file.size() ? end - place : 0;
}

/// The chunks of all parts: the offsets in the tables, the hash of each chunk, and the index of its
/// part.
struct Chunks {
    std::vector<std::uint64_t> offsets, hashes;
    std::vector<std::size_t> part;
};

/// Returns the chunks, or no value if tables and chunks do not fill the rest of the file without
/// gaps.
std::optional<Chunks> readChunks(FileBytes& file, const Headers& headers) {
    Chunks chunks;
    std::uint64_t place = headers.end;
    for (std::size_t part = 0; part < headers.parts.size(); ++part) {
        const std::int64_t count = headers.parts[part].chunks;
        for (std::int64_t chunk = 0; chunk < count; ++chunk, place += sizeof(std::uint64_t)) {
            const auto offset = file.number<std::uint64_t>(place);
            if (!offset) return {};
            chunks.offsets.push_back(*offset);
            chunks.part.push_back(part);
        }
    }
    std::vector<std::size_t> order(chunks.offsets.size());  // indices of the chunks in file order
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, {}, [&](std::size_t chunk) { return chunks.offsets[chunk]; });
    chunks.hashes.resize(order.size());
    for (const std::size_t chunk : order) {
        const PartHeader& part = headers.parts[chunks.part[chunk]];
        const std::uint64_t bytes =
            chunks.offsets[chunk] == place ? chunkBytes(file, headers, part, place) : 0;
        if (bytes == 0) return {};
        ContentHasher hash;
        file.addTo(hash, place, place + bytes);
        chunks.hashes[chunk] = hash.value();
        place += bytes;
    }
    if (place != file.size()) return {};
    return chunks;
}

ExrIntegrity proveFile(const std::string& path) {
    FileBytes file(path);
    const Headers headers = readHeaders(file);
    if (!hasHash(file, headers)) return {ExrIntegrity::kNone, {}};
    const std::optional<Chunks> chunks = readChunks(file, headers);
    if (!chunks) return {ExrIntegrity::kChanged, path};
    std::size_t first = 0;  // index of the part's first chunk
    for (const PartHeader& part : headers.parts) {
        const auto count = static_cast<std::size_t>(std::max(part.chunks, 0));
        ContentHasher hash;
        file.addTo(hash, 0, ExrHeaders::kBegin);
        if (part.digits != 0) {
            file.addTo(hash, part.begin, part.digits);
            hash.add(std::as_bytes(std::span(kZeros)));
            file.addTo(hash, part.digits + kDigits, part.end);
        }
        hash.add(std::as_bytes(std::span(chunks->offsets).subspan(first, count)));
        hash.add(std::as_bytes(std::span(chunks->hashes).subspan(first, count)));
        if (part.hash != pixelHashText(hash.value()))
            return {ExrIntegrity::kChanged, part.name.empty() ? path : path + ": " + part.name};
        first += count;
    }
    return {ExrIntegrity::kProven, {}};
}

}  // namespace

std::string pixelHashText(std::uint64_t hash) {
    return std::string(kValueBegin) + hexText(hash);
}

std::string pixelHashRecord(std::uint64_t hash) {
    return std::string(kRecordBegin) + std::string(kRecordEnd) + hexText(hash);
}

std::string ExrIntegrity::problem() const {
    if (state != kChanged) return "";
    return "the content does not match the attribute " + std::string(kPixelHash) +
           ": the file has changed since peeler wrote it";
}

ExrIntegrity exrIntegrity(const std::string& path) {
    ExrIntegrity worst;
    for (const std::string& file : exrFilesOf(path)) {
        const ExrIntegrity found = proveFile(file);
        if (found.state > worst.state) worst = found;
    }
    return worst;
}

void requireUnchanged(const std::string& path) {
    const ExrIntegrity proof = exrIntegrity(path);
    if (proof.state != ExrIntegrity::kChanged) return;
    throw Error(
        ErrorKind::kInput, proof.problem(), proof.where,
        "make the file again; if you trust the program that changed it, erase the attribute");
}

}  // namespace peeler
