// SPDX-License-Identifier: Apache-2.0
// Table writers: binary PLY point clouds and dense planes of arrays. Any thread may write points
// directly to their offset in the file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include <peeler/output_options.h>
#include "formats/arrays/array_writer.h"
#include "formats/file/atomic_file.h"
#include "formats/file/byte_buffer.h"

namespace peeler {

/// Per-pixel fragment lists stored as planes: plane k holds the k-th fragment of every list. Where
/// a list is shorter, half and float arrays hold DenseSettings::fill or repeat the last fragment
/// (repeat_last), uint32 arrays hold 0xFFFFFFFF (no index), and int32 arrays hold 0.
class DensePlanes {
  public:
    /// The type of a fragment's values, and their number.
    struct Column {
        NumberType type = NumberType::kFloat;
        std::size_t components = 1;
    };

    /// `layers` is the number of planes; DenseSettings::layers is ignored.
    DensePlanes(const DenseSettings& settings, std::uint32_t layers)
        : settings_(settings), layers_(layers) {}

    /// Returns the type in which a column is stored: DenseSettings::type for half and float
    /// columns, else the column's own type.
    NumberType typeOf(NumberType type) const;
    /// Returns a column's array, of shape (`pixels`…, planes), or (`pixels`…, planes, components)
    /// if the column has several components.
    NamedArray array(std::string name, const Column& column,
                     std::vector<std::uint64_t> pixels) const;
    /// Returns the bytes that the column takes per pixel.
    std::size_t pixelBytes(const Column& column) const;

    /// Fills `out` with the planes' values for consecutive pixels. Pixel p has the fragments from
    /// offsets[p] up to offsets[p + 1]. `numbers` holds the values of these pixels' fragments, from
    /// offsets[0] on.
    void fill(const Column& column, std::span<const std::uint32_t> offsets,
              std::span<const std::byte> numbers, ByteBuffer& out) const;

    /// Calls use(first, last), on all threads, for ranges of pixels that together cover the pixels
    /// of `offsets`. Neither the pixels of a range (`pixel_bytes` each) nor its fragments take more
    /// than a few MB, unless the range is a single pixel.
    static void forEachRange(std::span<const std::uint32_t> offsets, std::size_t pixel_bytes,
                             const std::function<void(std::size_t, std::size_t)>& use);
    /// Returns the bytes that all threads of forEachRange() together need for their ranges.
    static std::uint64_t rangeBytes();

  private:
    DenseSettings settings_;
    std::uint32_t layers_;
};

/// A property of every point. Other programs know the names x y z, nx ny nz, red green blue alpha
/// (uchar, sRGB, straight alpha).
struct PlyProperty {
    std::string name;  ///< without white space
    NumberType type = NumberType::kFloat;
};

/// A streaming writer of PLY 1.0 files (G. Turk, "The PLY Polygon File Format", 1994),
/// binary_little_endian, with one element `vertex`. The number of points need not be known in
/// advance, since finish() fills in the header. Points are not kept in memory.
class PlyWriter {
  public:
    /// Creates the hidden file. Throws Error (kOutput) if that fails, Error (kInternal) if a
    /// property has a type that PLY lacks, or a name or comment breaks the header.
    PlyWriter(const std::string& path, std::vector<PlyProperty> properties,
              std::vector<std::string> comments = {});

    static std::uint64_t fileBytes(std::span<const PlyProperty> properties,
                                   std::span<const std::string> comments, std::uint64_t points);

    /// Returns the size of a point in bytes: the sum of its properties, without padding.
    std::size_t pointSize() const { return point_size_; }
    /// Appends whole points, pointSize() bytes each. Throws Error (kOutput). Must not be called by
    /// several threads at once, nor together with writeAt().
    void append(std::span<const std::byte> points);
    /// Writes whole points, beginning at the point with the index `first`. Points may be written in
    /// any order and from several threads at once, but each exactly once.
    void writeAt(std::uint64_t first, std::span<const std::byte> points);
    /// Writes the final header and commits the file. Throws Error (kOutput) if writing fails, Error
    /// (kInternal) if points are missing.
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
    std::mutex mutex_;  ///< guards the file and the point count
};

}  // namespace peeler
