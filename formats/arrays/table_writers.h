// SPDX-License-Identifier: Apache-2.0
// Writes tables of numbers as point clouds (binary PLY) and as planes of arrays. Points go straight
// to their places in the file, from any thread.
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
    NamedArray array(std::string name, const Column& column,
                     std::vector<std::uint64_t> pixels) const;
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
