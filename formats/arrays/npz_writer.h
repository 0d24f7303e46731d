// SPDX-License-Identifier: Apache-2.0
// Arrays for numpy: .npz, all of them growing at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "formats/arrays/number_type.h"
#include "formats/file/atomic_file.h"

namespace peeler {

/// An array, C order. An empty shape is one number.
struct NpzArray {
    std::string name;  ///< the key in numpy's mapping
    NumberType type = NumberType::kFloat;
    std::vector<std::uint64_t> shape{};

    std::uint64_t bytes() const;
};

/// Writes a ZIP archive of .npy files (numpy.lib.format 1.0; PKWARE APPNOTE 6.3), not compressed as
/// numpy.savez does it, always with ZIP64 fields, dated 1980 so that the same arrays make the same
/// bytes. Shapes are said first, so every array has its place in the file and they can be filled
/// side by side, each front to back. Nothing is kept in memory. numpy.load(path) reads it without
/// pickle.
class NpzWriter {
  public:
    /// Creates the hidden file. Throws Error (kOutput); (kInternal) if two arrays have one name, or
    /// there are more than 65535.
    NpzWriter(const std::string& path, std::vector<NpzArray> arrays);

    std::size_t size() const { return entries_.size(); }
    /// The next numbers of the array with this index, as they lie in memory. Throws Error
    /// (kOutput); (kInternal) if there are too many.
    void append(std::size_t array, std::span<const std::byte> numbers);
    /// Throws Error (kInternal) if an array is not full.
    void finish();

  private:
    struct Entry {
        NpzArray array;
        std::string header;         ///< of the .npy file
        std::uint64_t offset = 0;   ///< of the local header
        std::uint64_t written = 0;  ///< bytes of the numbers
        std::uint32_t crc = 0;      ///< of header and numbers so far

        std::string fileName() const { return array.name + ".npy"; }
        std::uint64_t bytes() const { return header.size() + array.bytes(); }
    };

    std::string localHeader(const Entry& entry) const;
    std::string directory(std::uint64_t start) const;

    AtomicFile file_;
    std::vector<Entry> entries_;
    std::uint64_t end_ = 0;  ///< of the last array
};

/// The numbers of an array as bytes.
template <class Range>
std::span<const std::byte> asBytes(const Range& numbers) {
    return std::as_bytes(std::span(numbers));
}

}  // namespace peeler
