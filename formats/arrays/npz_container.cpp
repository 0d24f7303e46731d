// SPDX-License-Identifier: Apache-2.0
// The .npz container: .npy and ZIP headers.
// .npy: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
// ZIP64: APPNOTE.TXT, sections 4.3 and 4.5.3.
#include <libdeflate.h>
#include <zlib.h>

#include <memory>
#include <new>
#include <utility>

#include "core/base/parallel.h"
#include "formats/arrays/array_containers.h"

namespace peeler {
namespace {

constexpr std::uint16_t kVersion = 45;  // the version of ZIP that introduced ZIP64
constexpr std::uint16_t kUtf8Names = 1U << 11U;
constexpr std::uint16_t kDate = (1U << 5U) | 1U;  // 1980-01-01
constexpr std::uint16_t kZip64Field = 1;
constexpr std::uint32_t kSeeZip64 = 0xFFFFFFFFU;

class HeaderFields {
  public:
    template <class T>
    HeaderFields& add(T number) {
        text_.append(reinterpret_cast<const char*>(&number), sizeof number);
        return *this;
    }
    HeaderFields& add(const std::string& text) {
        text_ += text;
        return *this;
    }
    std::string take() { return std::move(text_); }

  private:
    std::string text_;
};

/// A .npy file in the archive.
struct NpzEntry {
    std::string name;
    std::string header;        ///< header of the .npy file
    std::uint64_t offset = 0;  ///< offset of the local header in the archive
    std::uint64_t bytes = 0;   ///< size of the .npy file
    std::uint64_t stored = 0;  ///< size in the archive: of the .npy file, or of its DEFLATE stream
    std::uint32_t crc = 0;     ///< CRC-32 of the .npy file

    std::uint16_t method() const { return stored == bytes ? 0 : 8; }
};

std::string localHeader(const NpzEntry& entry) {
    return HeaderFields()
        .add(std::uint32_t{0x04034b50})
        .add(kVersion)
        .add(kUtf8Names)
        .add(entry.method())
        .add(std::uint16_t{0})  // time: midnight
        .add(kDate)
        .add(entry.crc)
        .add(kSeeZip64)
        .add(kSeeZip64)
        .add(static_cast<std::uint16_t>(entry.name.size()))
        .add(std::uint16_t{20})
        .add(entry.name)
        .add(kZip64Field)
        .add(std::uint16_t{16})
        .add(entry.bytes)
        .add(entry.stored)
        .take();
}

/// Returns a .npy header as a stored DEFLATE block (RFC 1951, section 3.2.4). The block ends at a
/// byte boundary, so the DEFLATE stream of the data can follow.
std::string headerBlock(const std::string& header) {
    const auto size = static_cast<std::uint16_t>(header.size());
    return HeaderFields()
        .add(std::uint8_t{0})  // BFINAL = 0, BTYPE = 00 (stored)
        .add(size)
        .add(static_cast<std::uint16_t>(~size))
        .add(header)
        .take();
}

/// The level of libdeflate. Higher levels gain little on floats.
constexpr int kLevel = 4;
/// Arrays and texts with fewer bytes are stored, so that npzText() need not decompress.
constexpr std::uint64_t kLeastCompressed = 4096;

/// Compresses an array's data to a DEFLATE stream. Leaves `packed` empty if that saves nothing.
void deflate(const ByteBuffer& values, ByteBuffer& packed) {
    if (values.size() < kLeastCompressed) return;
    const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
        libdeflate_alloc_compressor(kLevel), libdeflate_free_compressor);
    if (!compressor) throw std::bad_alloc();
    packed.resize(libdeflate_deflate_compress_bound(compressor.get(), values.size()));
    const std::size_t size = libdeflate_deflate_compress(
        compressor.get(), values.data(), values.size(), packed.data(), packed.size());
    if (size == 0 || size + headerBlock("").size() >= values.size()) return packed.clear();
    packed.resize(size);
}

class NpzContainer final : public ArrayContainer {
  public:
    NpzContainer(std::vector<NamedArray> arrays, const ArrayTexts& texts) {
        for (NamedArray& array : arrays)
            add(std::move(array));
        for (const auto& [name, text] : texts)
            add({name, NumberType::kUint8, {text.size()}}, text);
        add({"arrays_version", NumberType::kInt64, {}}, HeaderFields().add(kArraysVersion).take());
    }

    std::uint64_t fileBytes() const override { return end_ + directory(entries_, end_).size(); }
    bool hasChecksums() const override { return true; }
    void finish(AtomicFile& file, std::span<const std::uint32_t> crcs) const override {
        const std::vector<NpzEntry> entries = checked(crcs);
        for (const NpzEntry& entry : entries)
            file.writeAt(entry.offset, asBytes(localHeader(entry) + entry.header));
        file.writeAt(end_, asBytes(directory(entries, end_)));
    }
    bool canCompress() const override { return true; }
    void compress(AtomicFile& file, std::span<const std::uint32_t> crcs,
                  std::span<ByteBuffer> values) const override {
        std::vector<NpzEntry> entries = checked(crcs);
        std::vector<ByteBuffer> packed(entries.size());
        parallelFor(entries.size(), [&](std::size_t i) { deflate(values[i], packed[i]); });
        std::uint64_t end = 0;
        const auto append = [&](std::span<const std::byte> bytes) {
            file.writeAt(end, bytes);
            end += bytes.size();
        };
        for (std::size_t i = 0; i < entries.size(); ++i) {
            NpzEntry& entry = entries[i];
            const bool smaller = !packed[i].empty();
            const std::string header = smaller ? headerBlock(entry.header) : entry.header;
            const ByteBuffer& data = smaller ? packed[i] : values[i];
            entry.offset = end;
            entry.stored = header.size() + data.size();
            append(asBytes(localHeader(entry) + header));
            append(data);
            values[i] = packed[i] = {};
        }
        file.writeAt(end, asBytes(directory(entries, end)));
    }

  private:
    void add(NamedArray array, std::string value = {}) {
        NpzEntry entry{array.name + ".npy", npyHeader(array), end_};
        entry.bytes = entry.stored = entry.header.size() + array.bytes();
        const std::uint64_t numbers = end_ + localHeader(entry).size() + entry.header.size();
        end_ = numbers + array.bytes();
        entries_.push_back(std::move(entry));
        arrays_.push_back({std::move(array), numbers, std::move(value)});
    }
    /// Returns the entries with the CRC-32 of their .npy files, calculated from those of the data.
    std::vector<NpzEntry> checked(std::span<const std::uint32_t> crcs) const {
        std::vector<NpzEntry> entries = entries_;
        for (std::size_t i = 0; i < entries.size(); ++i) {
            NpzEntry& entry = entries[i];
            const std::uint32_t header =
                libdeflate_crc32(0, entry.header.data(), entry.header.size());
            const auto size = static_cast<z_off_t>(entry.bytes - entry.header.size());
            entry.crc = static_cast<std::uint32_t>(crc32_combine(header, crcs[i], size));
        }
        return entries;
    }
    static std::string directory(std::span<const NpzEntry> entries, std::uint64_t start);

    std::vector<NpzEntry> entries_;
    std::uint64_t end_ = 0;
};

std::string NpzContainer::directory(std::span<const NpzEntry> entries, std::uint64_t start) {
    HeaderFields fields;
    for (const NpzEntry& entry : entries) {
        fields.add(std::uint32_t{0x02014b50})
            .add(kVersion)
            .add(kVersion)
            .add(kUtf8Names)
            .add(entry.method())
            .add(std::uint16_t{0})
            .add(kDate)
            .add(entry.crc)
            .add(kSeeZip64)
            .add(kSeeZip64)
            .add(static_cast<std::uint16_t>(entry.name.size()))
            .add(std::uint16_t{28})
            .add(std::uint16_t{0})  // length of the comment
            .add(std::uint16_t{0})  // number of the disk
            .add(std::uint16_t{0})  // internal attributes
            .add(std::uint32_t{0})
            .add(kSeeZip64)
            .add(entry.name)
            .add(kZip64Field)
            .add(std::uint16_t{24})
            .add(entry.bytes)
            .add(entry.stored)
            .add(entry.offset);
    }
    const std::string list = fields.take();
    const std::uint64_t count = entries.size();
    return HeaderFields()
        .add(list)
        .add(std::uint32_t{0x06064b50})  // ZIP64 end of central directory record
        .add(std::uint64_t{44})
        .add(kVersion)
        .add(kVersion)
        .add(std::uint32_t{0})
        .add(std::uint32_t{0})
        .add(count)
        .add(count)
        .add(static_cast<std::uint64_t>(list.size()))
        .add(start)
        .add(std::uint32_t{0x07064b50})  // ZIP64 end of central directory locator
        .add(std::uint32_t{0})
        .add(start + list.size())
        .add(std::uint32_t{1})
        .add(std::uint32_t{0x06054b50})  // end of central directory record
        .add(std::uint16_t{0})
        .add(std::uint16_t{0})
        .add(static_cast<std::uint16_t>(count))
        .add(static_cast<std::uint16_t>(count))
        .add(kSeeZip64)
        .add(kSeeZip64)
        .add(std::uint16_t{0})
        .take();
}

}  // namespace

std::string npyHeader(const NamedArray& array) {
    std::string shape;
    for (const std::uint64_t n : array.shape)
        shape += std::to_string(n) + ", ";
    if (array.shape.size() > 1) shape.resize(shape.size() - 2);
    if (array.shape.size() == 1) shape.pop_back();
    std::string text = "{'descr': '" + std::string(infoOf(array.type).numpy) +
                       "', 'fortran_order': False, 'shape': (" + shape + "), }";
    // The data must begin at a multiple of 64 bytes.
    constexpr std::size_t kAlignment = 64, kPreamble = 10;
    const std::size_t end = kPreamble + text.size() + 1;
    text.append((kAlignment - end % kAlignment) % kAlignment, ' ');
    text += '\n';
    return HeaderFields()
        .add(std::string("\x93NUMPY\x01\x00", 8))
        .add(static_cast<std::uint16_t>(text.size()))
        .add(text)
        .take();
}

std::unique_ptr<ArrayContainer> makeNpz(std::vector<NamedArray> arrays, const ArrayTexts& texts) {
    return std::make_unique<NpzContainer>(std::move(arrays), texts);
}

}  // namespace peeler
