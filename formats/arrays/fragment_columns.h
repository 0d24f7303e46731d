// SPDX-License-Identifier: Apache-2.0
// What tables of fragments have besides colour and Z: columns with the names, the index base and
// the signs that hits have (formats/rays/hit_columns.h), made of a file's channels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <peeler/layered_image.h>
#include "formats/arrays/table_writers.h"

namespace peeler {

/// The type of arrays whose numbers are those of fragments.
NumberType numberTypeOf(PixelType type);

/// `count` components of every fragment, from `first` on, in `storage`.
std::span<const std::byte> componentsOf(const FragmentArray& array, std::size_t first,
                                        std::size_t count, std::vector<std::byte>& storage);

/// How the numbers of a column follow from those of its channels.
enum class ColumnUse : std::uint8_t {
    kCopy,
    kIndex,     ///< index + 1 becomes the index, 0 becomes 0xFFFFFFFF: nothing
    kMaterial,  ///< likewise, and glTF's default material, which is in no file, is nothing, too
    kSign,      ///< −1 or 1, whatever the type
    kFront,     ///< toward the viewer becomes on the front, by the channel `facing`
};

struct FragmentColumn {
    std::string name;                   ///< of the array
    std::vector<std::string> channels;  ///< of the file, one a component
    NumberType type = NumberType::kFloat;
    ColumnUse use = ColumnUse::kCopy;
    /// Of a point, one a component; empty = points do not have it.
    std::vector<std::string> properties{};

    std::size_t components() const { return channels.size(); }
    std::size_t bytes() const { return components() * infoOf(type).size; }
};

/// The columns that all bands of a picture have, in the order of the table behind them, then those
/// of channels that it does not know, by their own names. Normals are on the front if the picture
/// has `facing`, else toward the viewer, and then called `viewer_normals`.
std::vector<FragmentColumn> fragmentColumns(const LayeredImage& band);

/// Reads columns of a band, which must outlive it.
class FragmentColumnReader {
  public:
    /// `default_material`: the value of `id.material` that stands for glTF's default one; 0 = none.
    FragmentColumnReader(const LayeredImage& band, const FragmentColumn& column,
                         std::uint32_t default_material);

    /// Stores the numbers of a fragment, and returns the end of them.
    std::byte* put(std::size_t fragment, std::byte* out) const;

  private:
    const FragmentColumn* column_;
    std::uint32_t default_material_;
    std::vector<FragmentChannel> channels_;
    FragmentChannel facing_{};
};

}  // namespace peeler
