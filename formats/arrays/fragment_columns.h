// SPDX-License-Identifier: Apache-2.0
// Columns of fragment tables other than colour and Z. They are made from a file's channels, with
// the names, index base and signs of hit tables (formats/rays/hit_columns.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <peeler/layered_image.h>
#include "formats/arrays/table_writers.h"

namespace peeler {

NumberType numberTypeOf(PixelType type);

/// Returns the components [first, first + count) of every fragment, copied to `storage`.
std::span<const std::byte> componentsOf(const FragmentArray& array, std::size_t first,
                                        std::size_t count, std::vector<std::byte>& storage);

/// The conversion from channel values to column values.
enum class ColumnUse : std::uint8_t {
    kCopy,
    kIndex,  ///< index + 1 becomes index, and 0 becomes 0xFFFFFFFF (no index)
    /// Like kIndex, but the index of glTF's default material, which no file lists, also becomes
    /// 0xFFFFFFFF.
    kMaterial,
    kSign,  ///< any number becomes its sign, −1 or 1
    /// Normals that face the viewer become normals on the front of the surface, by the channel
    /// `facing`.
    kFront,
};

struct FragmentColumn {
    std::string name;
    /// Source channels, one per component.
    std::vector<std::string> channels;
    NumberType type = NumberType::kFloat;
    ColumnUse use = ColumnUse::kCopy;
    /// Property names in point clouds, one per component; empty if points do not store the column.
    std::vector<std::string> properties{};

    std::size_t components() const { return channels.size(); }
    std::size_t bytes() const { return components() * infoOf(type).size; }
};

/// Returns the columns that all bands of a picture have: known columns in the order of the table in
/// the .cpp, then unknown channels under their own names. Normals are on the front if the picture
/// has `facing`; otherwise they face the viewer and are named `viewer_normals`.
std::vector<FragmentColumn> fragmentColumns(const LayeredImage& band);

/// A reader of one column of a band. The band and the column must outlive the reader.
class FragmentColumnReader {
  public:
    /// `default_material` is the `id.material` of glTF's default material, or 0 if
    /// the file lists no materials.
    FragmentColumnReader(const LayeredImage& band, const FragmentColumn& column,
                         std::uint32_t default_material);

    /// Stores the column's values for a fragment at `out`. Returns the end of the values.
    std::byte* put(std::size_t fragment, std::byte* out) const;

  private:
    const FragmentColumn* column_;
    std::uint32_t default_material_;
    std::vector<FragmentChannel> channels_;
    FragmentChannel facing_{};
};

}  // namespace peeler
