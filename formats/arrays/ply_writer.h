// SPDX-License-Identifier: Apache-2.0
// Point clouds: binary PLY, row after row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "formats/arrays/number_type.h"
#include "formats/file/atomic_file.h"

namespace peeler {

/// One number of every point. Names that readers know: x y z, nx ny nz, red green blue alpha
/// (uchar, sRGB, straight alpha).
struct PlyProperty {
    std::string name;  ///< without white space
    NumberType type = NumberType::kFloat;
};

/// Writes a PLY 1.0 file (G. Turk, "The PLY Polygon File Format", 1994), binary_little_endian, with
/// one element `vertex`. How many points there will be need not be known: the header is filled in
/// by finish(). Nothing is kept in memory.
class PlyWriter {
  public:
    /// Creates the hidden file. Throws Error (kOutput); (kInternal) if a property has a type that
    /// PLY lacks, or a name or comment breaks the header.
    PlyWriter(const std::string& path, std::vector<PlyProperty> properties,
              std::vector<std::string> comments = {});

    /// Bytes of a point: its properties packed in their order.
    std::size_t pointSize() const { return point_size_; }
    /// Whole points. Throws Error (kOutput).
    void append(std::span<const std::byte> points);
    std::uint64_t points() const { return points_; }
    void finish();

  private:
    std::string header() const;

    AtomicFile file_;
    std::vector<PlyProperty> properties_;
    std::vector<std::string> comments_;
    std::size_t point_size_ = 0;
    std::uint64_t points_ = 0;
};

}  // namespace peeler
