// SPDX-License-Identifier: Apache-2.0
// Writes tables of numbers: arrays for numpy (.npz), all of them growing at once, and point clouds
// (binary PLY), and lists of numbers as planes. Numbers and points go straight to their places in
// the file, from any thread.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/output_options.h>
#include "formats/file/atomic_file.h"
#include "formats/file/byte_buffer.h"

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
    std::size_t size;        ///< bytes
    std::string_view numpy;  ///< the dtype string of .npy headers
    std::string_view ply;    ///< "" = PLY has no such type
};

inline constexpr NumberTypeInfo kNumberTypes[] = {
    {1, "|u1", "uchar"}, {4, "<i4", "int"},   {4, "<u4", "uint"},   {8, "<i8", ""},
    {2, "<f2", ""},      {4, "<f4", "float"}, {8, "<f8", "double"},
};

inline constexpr const NumberTypeInfo& infoOf(NumberType type) {
    return kNumberTypes[static_cast<std::size_t>(type)];
}

// Numbers are written as they lie in memory.
static_assert(std::endian::native == std::endian::little);

/// The dialect of our arrays and points, in every .npz as `arrays_version` and in every .ply as a
/// comment; formats/README.md, "Arrays and points", says what changed from one to the next. The
/// first one stands in no file.
inline constexpr std::int64_t kArraysVersion = 2;

/// An array, C order. An empty shape is one number.
struct NpzArray {
    std::string name;  ///< the key in numpy's mapping
    NumberType type = NumberType::kFloat;
    std::vector<std::uint64_t> shape{};

    std::uint64_t bytes() const;
};

/// The header of a .npy file that has this array and nothing else, which begins behind it.
std::string npyHeader(const NpzArray& array);

/// Writes a ZIP archive of .npy files (numpy.lib.format 1.0; PKWARE APPNOTE 6.3), not compressed as
/// numpy.savez does it, always with ZIP64 fields, dated 1980 so that the same arrays make the same
/// bytes. Shapes are given at the start, so every number has its place in the file, and is written
/// once. None is kept in memory. numpy.load(path) reads the file without pickle. The last array of
/// every file is `arrays_version`, int64.
class NpzWriter {
  public:
    /// Creates the hidden file. Throws Error (kOutput); (kInternal) if two arrays have one name, or
    /// there are more than 65535.
    NpzWriter(const std::string& path, std::vector<NpzArray> arrays);

    /// The size of the file that holds these arrays, to the byte.
    static std::uint64_t fileBytes(std::vector<NpzArray> arrays);

    /// Adds the next numbers of the array with this index, as they lie in memory. Not for several
    /// threads at once. Throws like writeAt().
    void append(std::size_t array, std::span<const std::byte> numbers);
    /// Writes numbers of the array with this index, as they lie in memory, from its byte `first`
    /// on, in whatever order, and from several threads at once. Throws Error (kOutput);
    /// (kInternal) if the array has no such bytes, or has them already.
    void writeAt(std::size_t array, std::uint64_t first, std::span<const std::byte> numbers);
    /// Writes headers and directory, and commits the file. Throws Error (kOutput); (kInternal) if
    /// an array is not full.
    void finish() { close().commit(); }
    /// The same without the commit, for commitAll().
    AtomicFile& close();

  private:
    /// Bytes that follow one another, and are written.
    struct Piece {
        std::uint64_t end = 0;
        std::uint32_t crc = 0;
    };
    struct Entry {
        NpzArray array;
        std::string header;          ///< of the .npy file
        std::uint64_t offset = 0;    ///< of the local header
        std::uint64_t numbers = 0;   ///< offset of the first number
        std::uint64_t appended = 0;  ///< bytes
        /// By where they begin in the array; pieces that meet have become one.
        std::map<std::uint64_t, Piece> written{};
        std::uint32_t crc = 0;  ///< of header and numbers, once all are written

        std::string fileName() const { return array.name + ".npy"; }
        std::uint64_t bytes() const { return header.size() + array.bytes(); }
    };

    /// The arrays in their places, `arrays_version` behind them.
    static std::vector<Entry> entriesOf(std::vector<NpzArray> arrays, const std::string& path);
    static std::string localHeader(const Entry& entry);
    static std::uint64_t endOf(const std::vector<Entry>& entries);  ///< of the last array
    static std::string directory(const std::vector<Entry>& entries);
    [[noreturn]] void fail(const char* what, const Entry& entry) const;
    /// Notes that a piece is written.
    void add(Entry& entry, std::uint64_t first, Piece piece) const;

    AtomicFile file_;
    std::vector<Entry> entries_;
    std::mutex mutex_;  ///< of the file and of what is written
};

/// The numbers of an array as bytes.
template <class Range>
std::span<const std::byte> asBytes(const Range& numbers) {
    return std::as_bytes(std::span(numbers));
}

/// Text that a file of NpzWriter holds as an array of uint8 with this name; "" if the file is not
/// there, not whole, by somebody else, or has no such array. Of the file no more is read.
std::string npzText(const std::string& path, std::string_view array);

/// Lists of fragments, a pixel each, as planes: the k-th of a list goes to plane k. What a pixel
/// lacks is DenseSettings::fill in arrays of half and float; 0xFFFFFFFF in those of uint32 (no
/// index), and 0 in those of int32.
class DensePlanes {
  public:
    /// Numbers of every fragment: so many of this type.
    struct Column {
        NumberType type = NumberType::kFloat;
        std::size_t components = 1;
    };

    /// `layers`: how many planes, in place of those of the settings.
    DensePlanes(const DenseSettings& settings, std::uint32_t layers)
        : settings_(settings), layers_(layers) {}

    /// How they are stored: what is half or float as the settings say.
    NumberType typeOf(NumberType type) const;
    /// The array of a column: (`pixels`…, planes), and `components` behind it if there are several.
    NpzArray array(std::string name, const Column& column, std::vector<std::uint64_t> pixels) const;
    /// Bytes of a pixel in that array.
    std::size_t pixelBytes(const Column& column) const;

    /// Makes `out` the planes of pixels that follow one another. Pixel p has the fragments from
    /// offsets[p] up to offsets[p + 1]; `numbers` are those of all of them, from the first one on.
    void fill(const Column& column, std::span<const std::uint32_t> offsets,
              std::span<const std::byte> numbers, ByteBuffer& out) const;

    /// Calls use(first, last) for ranges of pixels that are all of `offsets` together, on all
    /// threads. Of one range neither the pixels, of so many bytes each, nor the fragments take more
    /// than a few MB, unless it is a single pixel.
    static void forEachRange(std::span<const std::uint32_t> offsets, std::size_t pixel_bytes,
                             const std::function<void(std::size_t, std::size_t)>& use);
    /// What forEachRange() has its caller keep, on all threads.
    static std::uint64_t rangeBytes();

  private:
    DenseSettings settings_;
    std::uint32_t layers_;
};

/// A property of every point. Names that readers know: x y z, nx ny nz, red green blue alpha
/// (uchar, sRGB, straight alpha).
struct PlyProperty {
    std::string name;  ///< without white space
    NumberType type = NumberType::kFloat;
};

/// Writes a PLY 1.0 file (G. Turk, "The PLY Polygon File Format", 1994), binary_little_endian, with
/// one element `vertex`. How many points there will be need not be known: the header is filled in
/// by finish(). No point is kept in memory.
class PlyWriter {
  public:
    /// Creates the hidden file. Throws Error (kOutput); (kInternal) if a property has a type that
    /// PLY lacks, or a name or comment breaks the header.
    PlyWriter(const std::string& path, std::vector<PlyProperty> properties,
              std::vector<std::string> comments = {});

    /// The size of the file of so many points, to the byte.
    static std::uint64_t fileBytes(std::span<const PlyProperty> properties,
                                   std::span<const std::string> comments, std::uint64_t points);

    /// Bytes of a point: its properties packed in their order.
    std::size_t pointSize() const { return point_size_; }
    /// Adds whole points, pointSize() bytes each. Throws Error (kOutput). Not for several threads
    /// at once, nor together with writeAt().
    void append(std::span<const std::byte> points);
    /// Writes whole points to their place, the first being the point of that index, in whatever
    /// order and from several threads at once. Every point has to be written once.
    void writeAt(std::uint64_t first, std::span<const std::byte> points);
    /// Throws Error (kOutput); (kInternal) if there are other points than were written.
    void finish();

  private:
    static std::string header(std::span<const PlyProperty> properties,
                              std::span<const std::string> comments, std::uint64_t points);
    void checkWhole(std::span<const std::byte> points) const;

    AtomicFile file_;
    std::vector<PlyProperty> properties_;
    std::vector<std::string> comments_;
    std::size_t point_size_ = 0;
    std::uint64_t header_size_ = 0;
    std::uint64_t points_ = 0;
    std::mutex mutex_;  ///< of the file and of how many points there are
};

}  // namespace peeler
