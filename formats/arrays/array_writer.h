// SPDX-License-Identifier: Apache-2.0
// Writers of named arrays, as .npz and .safetensors. Any thread may write any part of any array
// directly to its offset in the file.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/file/atomic_file.h"
#include "formats/file/byte_buffer.h"
#include "formats/file/size_forecast.h"

namespace peeler {

enum class NumberType : std::uint8_t {
    kUint8,
    kInt32,
    kUint32,
    kInt64,
    kHalf,
    kFloat,
    kDouble,
};

struct NumberTypeInfo {
    std::size_t size;              ///< size of an element, in bytes
    std::string_view numpy;        ///< dtype in .npy headers
    std::string_view safetensors;  ///< dtype in .safetensors headers
    std::string_view ply;          ///< type in PLY headers; "" if PLY has no such type
};

inline constexpr NumberTypeInfo kNumberTypes[] = {
    {1, "|u1", "U8", "uchar"},   {4, "<i4", "I32", "int"}, {4, "<u4", "U32", "uint"},
    {8, "<i8", "I64", ""},       {2, "<f2", "F16", ""},    {4, "<f4", "F32", "float"},
    {8, "<f8", "F64", "double"},
};

inline constexpr const NumberTypeInfo& infoOf(NumberType type) {
    return kNumberTypes[static_cast<std::size_t>(type)];
}

// Values are copied to the file without conversion, and files are little-endian.
static_assert(std::endian::native == std::endian::little);

/// The version of peeler's array and point format, stored as `arrays_version` in every file of
/// arrays and as a comment in every .ply; formats/README.md, "Arrays and points", lists the
/// changes. Version 1 is never stored.
inline constexpr std::int64_t kArraysVersion = 2;

/// An array in C order. An empty shape means a scalar.
struct NamedArray {
    std::string name;
    NumberType type = NumberType::kFloat;
    std::vector<std::uint64_t> shape{};

    std::uint64_t bytes() const;
};

/// Returns the .npy header for this array; the data follows it.
std::string npyHeader(const NamedArray& array);

/// Texts to be stored in a file of arrays, by name. Empty texts are left out. A .npz stores each
/// text as an array of uint8, a .safetensors in `__metadata__`.
using ArrayTexts = std::map<std::string, std::string>;

class ArrayContainer;

/// A writer of array files; the extension chooses the container (kArrayContainers). Adds an int64
/// array `arrays_version`. Shapes are fixed at construction, so each value goes directly to its
/// final offset in the file, unless the file is compressed. The same arrays produce the same bytes.
class ArrayWriter {
  public:
    /// Creates the hidden file. Throws Error (kOutput); (kUsage) if no container has the extension;
    /// (kInternal) if two arrays share a name, or there are more than 65535. With `compress`, keeps
    /// all arrays in memory, and deflates each array that becomes smaller; throws Error (kUsage) if
    /// the container cannot be compressed.
    ArrayWriter(const std::string& path, std::vector<NamedArray> arrays, ArrayTexts texts = {},
                bool compress = false);
    ~ArrayWriter();

    /// Returns the exact size of the file if it is uncompressed, and an upper bound if it is
    /// compressed.
    static std::uint64_t fileBytes(const std::string& path, std::vector<NamedArray> arrays,
                                   ArrayTexts texts = {});
    static SizeForecast forecast(const std::string& path, std::vector<NamedArray> arrays,
                                 ArrayTexts texts, bool compress);
    /// Returns the memory for writing a compressed file: the values and their compressed form.
    static std::uint64_t compressionBytes(const SizeForecast& forecast);

    /// Appends values, in memory representation, to the array with this index. Must not be called
    /// by several threads at once. Throws like writeAt().
    void append(std::size_t array, std::span<const std::byte> numbers);
    /// Writes values, in memory representation, to the array with this index, `first` bytes from
    /// its start. Ranges may be written in any order, by several threads at once. Throws Error
    /// (kOutput) if writing fails, Error (kInternal) if the range exceeds the array or overlaps a
    /// range that has been written.
    void writeAt(std::size_t array, std::uint64_t first, std::span<const std::byte> numbers);
    /// Writes the container's headers and commits the file. Throws Error (kOutput) if writing
    /// fails, Error (kInternal) if an array is incomplete.
    void finish() { close().commit(); }
    /// Does everything that finish() does except the commit. Returns the file for commitAll().
    AtomicFile& close();

  private:
    /// A contiguous range of written bytes. Its first byte is its key in Progress::pieces.
    struct Piece {
        std::uint64_t end = 0;
        std::uint32_t crc = 0;
    };
    /// The written ranges of an array; adjacent ranges are merged.
    struct Progress {
        std::uint64_t appended = 0;  ///< number of bytes appended so far
        std::map<std::uint64_t, Piece> pieces{};
    };

    [[noreturn]] void fail(const char* what, std::size_t array) const;
    void add(std::size_t array, std::uint64_t first, Piece piece);

    std::unique_ptr<ArrayContainer> container_;
    AtomicFile file_;
    std::vector<Progress> progress_;
    std::vector<ByteBuffer> values_;  ///< values of each array; empty unless the file is compressed
    std::mutex mutex_;                ///< guards the file and the progress
};

/// Returns the extensions of the containers in lower case, with the dot.
std::span<const std::string_view> arrayExtensions();
/// Whether the path ends in one of arrayExtensions(), in upper or lower case.
bool isArrayName(const std::string& path);

/// Returns the text stored under this name by ArrayWriter. Returns "" if there is no such text, or
/// if the file is missing, incomplete or written by another program. Reads only the necessary parts
/// of the file.
std::string arrayText(const std::string& path, const std::string& name);

template <class Range>
std::span<const std::byte> asBytes(const Range& numbers) {
    return std::as_bytes(std::span(numbers));
}

}  // namespace peeler
