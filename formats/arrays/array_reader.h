// SPDX-License-Identifier: Apache-2.0
// Reads arrays of numbers that NumPy has written: .npy, and .npz, which holds several of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace peeler {

/// The most bytes that are read of what a .npy file says before its numbers.
inline constexpr std::size_t kMostNpyHeader = std::size_t{1} << 16;

/// How an array stores a number.
struct ArrayNumber {
    std::string_view type;  ///< numpy's, without the byte order: "f8"
    std::size_t size;       ///< bytes
    bool floating;
    double (*decode)(const std::uint8_t* bytes, bool swapped);
};

/// The numbers of a type by numpy's name, without the byte order; null if they are not decoded
/// here.
const ArrayNumber* arrayNumber(std::string_view type);

/// An array of numbers; the file that they lie in has to stay.
struct NumberArray {
    std::vector<std::uint64_t> shape;
    const ArrayNumber* number = nullptr;
    bool swapped = false;  ///< big-endian
    bool columns = false;  ///< Fortran order: the first index changes fastest
    std::span<const std::uint8_t> bytes;

    /// How many numbers there are.
    std::uint64_t count() const { return bytes.size() / number->size; }
    /// A number by its index in C order (the last index changes fastest), whatever the file's; of
    /// 64-bit integers the nearest.
    double at(std::uint64_t index) const;
};

/// Returns a shape as NumPy prints it: "(3, 4)", "(7,)".
std::string shapeText(const std::vector<std::uint64_t>& shape);

/// The array of a .npy file (numpy.lib.format 1 to 3), of numbers of any common type in either byte
/// order and C or Fortran order. Nothing if it is no .npy, or an array of anything else; pickles
/// are never opened. `where` is what messages name. Throws Error (kInput) if the file is damaged or
/// has another size than it says.
std::optional<NumberArray> npyArray(std::span<const std::uint8_t> file, const std::string& where);

/// The text of a .npy file that holds one: a string of numpy's, bytes, or "true" or "false".
/// Nothing of anything else.
std::optional<std::string> npyText(std::span<const std::uint8_t> file);

/// The arrays of a .npz as numpy.savez and savez_compressed write it: ZIP (PKWARE APPNOTE 6.3, with
/// ZIP64), stored or packed by DEFLATE. The file's bytes have to stay.
class NpzArchive {
  public:
    struct Member {
        std::string name;  ///< with ".npy"
        std::uint16_t flags = 0, method = 0;
        std::uint32_t crc = 0;
        std::uint64_t packed = 0, size = 0, offset = 0;  ///< bytes; `size` is what unpacking makes
    };

    /// Reads the directory. `where` is the file's name. Throws Error (kInput).
    NpzArchive(std::span<const std::uint8_t> file, std::string where);

    const std::vector<Member>& members() const { return members_; }
    /// The array of this name; null if there is none.
    const Member* find(std::string_view array) const;
    /// What messages name for a member: "file.npz, points.npy".
    std::string placeOf(const Member& member) const { return where_ + ", " + member.name; }
    /// The .npy file that a member is: in the archive itself, or unpacked into `storage`. Sizes
    /// that cannot be are refused before memory is taken for them. Throws Error (kInput).
    std::span<const std::uint8_t> contents(const Member& member,
                                           std::vector<std::uint8_t>& storage) const;

  private:
    std::span<const std::uint8_t> file_;
    std::string where_;
    std::vector<Member> members_;
};

}  // namespace peeler
