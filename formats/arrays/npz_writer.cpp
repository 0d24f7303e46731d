// SPDX-License-Identifier: Apache-2.0
// Writes the headers of a .npz, and numbers to their places.
// .npy: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
// ZIP64: APPNOTE.TXT, sections 4.3 and 4.5.3.
#include "formats/arrays/table_writers.h"

#include <libdeflate.h>
#include <zlib.h>

#include <iterator>
#include <set>
#include <utility>

#include <peeler/error.h>

namespace peeler {
namespace {

constexpr std::uint16_t kVersion = 45;  // ZIP64
constexpr std::uint16_t kUtf8Names = 1U << 11U;
constexpr std::uint16_t kDate = (1U << 5U) | 1U;  // 1980-01-01
constexpr std::uint16_t kZip64Field = 1;
constexpr std::uint32_t kSeeZip64 = 0xFFFFFFFFU;
constexpr std::size_t kMaxEntries = 65535;

/// Numbers of a ZIP header, one after the other, little endian.
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

}  // namespace

std::string npyHeader(const NpzArray& array) {
    std::string shape;
    for (const std::uint64_t n : array.shape)
        shape += std::to_string(n) + ", ";
    if (array.shape.size() > 1) shape.resize(shape.size() - 2);  // "(3,)" but "(3, 4)"
    if (array.shape.size() == 1) shape.pop_back();
    std::string text = "{'descr': '" + std::string(infoOf(array.type).numpy) +
                       "', 'fortran_order': False, 'shape': (" + shape + "), }";
    // The numbers have to begin at a multiple of 64 bytes.
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

std::uint64_t NpzArray::bytes() const {
    std::uint64_t count = infoOf(type).size;
    for (const std::uint64_t n : shape)
        count *= n;
    return count;
}

std::vector<NpzWriter::Entry> NpzWriter::entriesOf(std::vector<NpzArray> arrays,
                                                   const std::string& path) {
    arrays.push_back({"arrays_version", NumberType::kInt64, {}});
    std::set<std::string> names;
    std::vector<Entry> entries;
    std::uint64_t end = 0;
    for (NpzArray& array : arrays) {
        if (!names.insert(array.name).second || names.size() > kMaxEntries) {
            throw Error(ErrorKind::kInternal, "two arrays have one name, or there are too many",
                        path + ": " + array.name);
        }
        Entry& entry = entries.emplace_back();
        entry.array = std::move(array);
        entry.header = npyHeader(entry.array);
        entry.offset = end;
        entry.numbers = end + localHeader(entry).size() + entry.header.size();
        end = endOf(entries);
    }
    return entries;
}

std::uint64_t NpzWriter::endOf(const std::vector<Entry>& entries) {
    const Entry& last = entries.back();
    return last.numbers + last.array.bytes();
}

std::uint64_t NpzWriter::fileBytes(std::vector<NpzArray> arrays) {
    const std::vector<Entry> entries = entriesOf(std::move(arrays), "");
    return endOf(entries) + directory(entries).size();
}

NpzWriter::NpzWriter(const std::string& path, std::vector<NpzArray> arrays)
    : file_(path), entries_(entriesOf(std::move(arrays), path)) {
    append(entries_.size() - 1, std::as_bytes(std::span(&kArraysVersion, 1)));
}

void NpzWriter::fail(const char* what, const Entry& entry) const {
    throw Error(ErrorKind::kInternal, what, file_.path() + ": " + entry.array.name);
}

void NpzWriter::append(std::size_t array, std::span<const std::byte> numbers) {
    const std::uint64_t first = entries_[array].appended;
    entries_[array].appended += numbers.size();
    writeAt(array, first, numbers);
}

void NpzWriter::writeAt(std::size_t array, std::uint64_t first,
                        std::span<const std::byte> numbers) {
    Entry& entry = entries_[array];
    const std::uint64_t all = entry.array.bytes();
    if (first > all || numbers.size() > all - first)
        fail("more numbers than the array holds", entry);
    if (numbers.empty()) return;
    // The checksum is the caller's thread's work; the file takes one piece at a time.
    const Piece piece{first + numbers.size(), libdeflate_crc32(0, numbers.data(), numbers.size())};
    const std::lock_guard lock(mutex_);
    add(entry, first, piece);
    file_.writeAt(entry.numbers + first, numbers);
}

void NpzWriter::add(Entry& entry, std::uint64_t first, Piece piece) const {
    auto after = entry.written.upper_bound(first);
    const auto before = after == entry.written.begin() ? entry.written.end() : std::prev(after);
    if ((before != entry.written.end() && before->second.end > first) ||
        (after != entry.written.end() && after->first < piece.end))
        fail("numbers are written twice", entry);
    const auto joined = [](const Piece& a, const Piece& b, std::uint64_t begin_of_b) {
        const auto size = static_cast<z_off_t>(b.end - begin_of_b);
        return Piece{b.end, static_cast<std::uint32_t>(crc32_combine(a.crc, b.crc, size))};
    };
    if (after != entry.written.end() && after->first == piece.end) {
        piece = joined(piece, after->second, after->first);
        after = entry.written.erase(after);
    }
    if (before != entry.written.end() && before->second.end == first)
        before->second = joined(before->second, piece, first);
    else
        entry.written.emplace_hint(after, first, piece);
}

AtomicFile& NpzWriter::close() {
    for (Entry& entry : entries_) {
        // An array without numbers has no piece.
        const auto piece = entry.written.extract(0);
        const Piece whole = piece ? piece.mapped() : Piece{};
        if (whole.end != entry.array.bytes()) fail("numbers are missing", entry);
        const std::uint32_t header = libdeflate_crc32(0, entry.header.data(), entry.header.size());
        entry.crc = static_cast<std::uint32_t>(
            crc32_combine(header, whole.crc, static_cast<z_off_t>(whole.end)));
        // The headers are written only now, when the checksum is known.
        file_.writeAt(entry.offset, asBytes(localHeader(entry) + entry.header));
    }
    file_.writeAt(endOf(entries_), asBytes(directory(entries_)));
    return file_;
}

std::string NpzWriter::localHeader(const Entry& entry) {
    const std::string name = entry.fileName();
    return HeaderFields()
        .add(std::uint32_t{0x04034b50})
        .add(kVersion)
        .add(kUtf8Names)
        .add(std::uint16_t{0})  // stored
        .add(std::uint16_t{0})  // midnight
        .add(kDate)
        .add(entry.crc)
        .add(kSeeZip64)
        .add(kSeeZip64)
        .add(static_cast<std::uint16_t>(name.size()))
        .add(std::uint16_t{20})
        .add(name)
        .add(kZip64Field)
        .add(std::uint16_t{16})
        .add(entry.bytes())
        .add(entry.bytes())
        .take();
}

std::string NpzWriter::directory(const std::vector<Entry>& entries) {
    const std::uint64_t start = endOf(entries);
    HeaderFields fields;
    for (const Entry& entry : entries) {
        const std::string name = entry.fileName();
        fields.add(std::uint32_t{0x02014b50})
            .add(kVersion)
            .add(kVersion)
            .add(kUtf8Names)
            .add(std::uint16_t{0})
            .add(std::uint16_t{0})
            .add(kDate)
            .add(entry.crc)
            .add(kSeeZip64)
            .add(kSeeZip64)
            .add(static_cast<std::uint16_t>(name.size()))
            .add(std::uint16_t{28})
            .add(std::uint16_t{0})  // no comment
            .add(std::uint16_t{0})  // disk
            .add(std::uint16_t{0})  // attributes
            .add(std::uint32_t{0})
            .add(kSeeZip64)
            .add(name)
            .add(kZip64Field)
            .add(std::uint16_t{24})
            .add(entry.bytes())
            .add(entry.bytes())
            .add(entry.offset);
    }
    const std::string list = fields.take();
    const std::uint64_t count = entries.size();
    return HeaderFields()
        .add(list)
        .add(std::uint32_t{0x06064b50})  // ZIP64 end of central directory
        .add(std::uint64_t{44})
        .add(kVersion)
        .add(kVersion)
        .add(std::uint32_t{0})
        .add(std::uint32_t{0})
        .add(count)
        .add(count)
        .add(static_cast<std::uint64_t>(list.size()))
        .add(start)
        .add(std::uint32_t{0x07064b50})  // locator of that record
        .add(std::uint32_t{0})
        .add(start + list.size())
        .add(std::uint32_t{1})
        .add(std::uint32_t{0x06054b50})  // end of central directory
        .add(std::uint16_t{0})
        .add(std::uint16_t{0})
        .add(static_cast<std::uint16_t>(count))
        .add(static_cast<std::uint16_t>(count))
        .add(kSeeZip64)
        .add(kSeeZip64)
        .add(std::uint16_t{0})
        .take();
}

}  // namespace peeler
