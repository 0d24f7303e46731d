// SPDX-License-Identifier: Apache-2.0
// Columns of fragment tables besides colour and Z, made from a file's channels, with the names,
// index base and signs of hit tables (formats/rays/hit_columns.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <peeler/layered_image.h>
#include "formats/arrays/table_writers.h"

namespace peeler {

/// Returns the array type for a channel type.
NumberType numberTypeOf(PixelType type);

/// Returns `count` components of every fragment, starting at component `first`; uses `storage` if
/// they have to be gathered.
std::span<const std::byte> componentsOf(const FragmentArray& array, std::size_t first,
                                        std::size_t count, std::vector<std::byte>& storage);

/// The conversion from channel values to column values.
enum class ColumnUse : std::uint8_t {
    kCopy,
    kIndex,     ///< index + 1 becomes the index, 0 becomes 0xFFFFFFFF (none)
    kMaterial,  ///< as kIndex; glTF's default material, absent from files, is also none
    kSign,      ///< −1 or 1, of any type
    kFront,     ///< flips viewer-facing normals to the front, by the channel `facing`
};

struct FragmentColumn {
    std::string name;                   ///< of the array
    std::vector<std::string> channels;  ///< of the file, one per component
    NumberType type = NumberType::kFloat;
    ColumnUse use = ColumnUse::kCopy;
    /// Point properties, one per component; empty = not stored in points.
    std::vector<std::string> properties{};

    std::size_t components() const { return channels.size(); }
    std::size_t bytes() const { return components() * infoOf(type).size; }
};

/// Returns the columns common to all bands of a picture, in the order of the table in the .cpp,
/// then those of unknown channels, under their own names. Normals are on the front if the picture
/// has `facing`, else toward the viewer, and then named `viewer_normals`.
std::vector<FragmentColumn> fragmentColumns(const LayeredImage& band);

/// A reader of one column of a band, which must outlive it.
class FragmentColumnReader {
  public:
    /// `default_material`: the `id.material` of glTF's default material; 0 = none.
    FragmentColumnReader(const LayeredImage& band, const FragmentColumn& column,
                         std::uint32_t default_material);

    /// Stores the values of a fragment. Returns the end of them.
    std::byte* put(std::size_t fragment, std::byte* out) const;

  private:
    const FragmentColumn* column_;
    std::uint32_t default_material_;
    std::vector<FragmentChannel> channels_;
    FragmentChannel facing_{};
};

}  // namespace peeler
