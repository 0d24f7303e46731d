// SPDX-License-Identifier: Apache-2.0
// Writes files of named arrays, all of them growing at once: .npz and .safetensors. Numbers go
// straight to their places in the file, from any thread.
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
    std::size_t size;              ///< bytes
    std::string_view numpy;        ///< the dtype string of .npy headers
    std::string_view safetensors;  ///< the dtype of their headers
    std::string_view ply;          ///< "" = PLY has no such type
};

inline constexpr NumberTypeInfo kNumberTypes[] = {
    {1, "|u1", "U8", "uchar"},   {4, "<i4", "I32", "int"}, {4, "<u4", "U32", "uint"},
    {8, "<i8", "I64", ""},       {2, "<f2", "F16", ""},    {4, "<f4", "F32", "float"},
    {8, "<f8", "F64", "double"},
};

inline constexpr const NumberTypeInfo& infoOf(NumberType type) {
    return kNumberTypes[static_cast<std::size_t>(type)];
}

// Numbers are written as they lie in memory.
static_assert(std::endian::native == std::endian::little);

/// The dialect of our arrays and points, in every file of arrays as `arrays_version` and in every
/// .ply as a comment; formats/README.md, "Arrays and points", says what changed from one to the
/// next. The first one stands in no file.
inline constexpr std::int64_t kArraysVersion = 2;

/// An array, C order. An empty shape is one number.
struct NamedArray {
    std::string name;
    NumberType type = NumberType::kFloat;
    std::vector<std::uint64_t> shape{};

    std::uint64_t bytes() const;
};

/// The header of a .npy file that has this array and nothing else, which begins behind it.
std::string npyHeader(const NamedArray& array);

/// Texts of a file of arrays by their names; empty ones are left out. A .npz has each as an array
/// of uint8, a .safetensors in `__metadata__`.
using ArrayTexts = std::map<std::string, std::string>;

class ArrayContainer;

/// Writes arrays to a file whose extension says the container (kArrayContainers); its last array is
/// `arrays_version`, int64. Shapes are given at the start, so every number has its place in the
/// file, and is written once. None is kept in memory. The same arrays make the same bytes.
class ArrayWriter {
  public:
    /// Creates the hidden file. Throws Error (kOutput); (kUsage) if no container has the extension;
    /// (kInternal) if two arrays have one name, or there are more than 65535.
    ArrayWriter(const std::string& path, std::vector<NamedArray> arrays, ArrayTexts texts = {});
    ~ArrayWriter();

    /// The size of the file that holds these arrays, to the byte.
    static std::uint64_t fileBytes(const std::string& path, std::vector<NamedArray> arrays,
                                   ArrayTexts texts = {});

    /// Adds the next numbers of the array with this index, as they lie in memory. Not for several
    /// threads at once. Throws like writeAt().
    void append(std::size_t array, std::span<const std::byte> numbers);
    /// Writes numbers of the array with this index, as they lie in memory, from its byte `first`
    /// on, in whatever order, and from several threads at once. Throws Error (kOutput);
    /// (kInternal) if the array has no such bytes, or has them already.
    void writeAt(std::size_t array, std::uint64_t first, std::span<const std::byte> numbers);
    /// Writes what the container has besides numbers, and commits the file. Throws Error (kOutput);
    /// (kInternal) if an array is not full.
    void finish() { close().commit(); }
    /// The same without the commit, for commitAll().
    AtomicFile& close();

  private:
    /// Bytes that follow one another, and are written.
    struct Piece {
        std::uint64_t end = 0;
        std::uint32_t crc = 0;
    };
    /// What is written of an array: pieces by where they begin; those that meet have become one.
    struct Progress {
        std::uint64_t appended = 0;  ///< bytes
        std::map<std::uint64_t, Piece> pieces{};
    };

    [[noreturn]] void fail(const char* what, std::size_t array) const;
    /// Notes that a piece is written.
    void add(std::size_t array, std::uint64_t first, Piece piece);

    std::unique_ptr<ArrayContainer> container_;
    AtomicFile file_;
    std::vector<Progress> progress_;
    std::mutex mutex_;  ///< of the file and of what is written
};

/// The extensions of the containers, lower case with their dots.
std::span<const std::string_view> arrayExtensions();
/// Whether the path ends in one of them, upper or lower case.
bool isArrayName(const std::string& path);

/// Text that a file of ArrayWriter holds by this name; "" if the file is not there, not whole, by
/// somebody else, or has no such text. Of the file no more is read.
std::string arrayText(const std::string& path, const std::string& name);

/// The numbers of an array as bytes.
template <class Range>
std::span<const std::byte> asBytes(const Range& numbers) {
    return std::as_bytes(std::span(numbers));
}

}  // namespace peeler
