// SPDX-License-Identifier: Apache-2.0
// NumPy array readers: .npy, and .npz archives of several arrays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace peeler {

/// The maximum size of a .npy header, in bytes.
inline constexpr std::size_t kMostNpyHeader = std::size_t{1} << 16;

struct ArrayNumber {
    std::string_view type;  ///< numpy's name of the type, without the byte order: "f8"
    std::size_t size;       ///< size of an element, in bytes
    bool floating;
    double (*decode)(const std::uint8_t* bytes, bool swapped);
};

/// Returns the element type with this numpy name (without the byte order), or null if it cannot be
/// decoded.
const ArrayNumber* arrayNumber(std::string_view type);

/// An array of numbers as a view of the file's bytes, which must outlive it.
struct NumberArray {
    std::vector<std::uint64_t> shape;
    const ArrayNumber* number = nullptr;
    bool swapped = false;  ///< whether the elements are big-endian
    bool columns = false;  ///< whether the array has Fortran order: the first index changes fastest
    std::span<const std::uint8_t> bytes;

    /// Returns the number of elements.
    std::uint64_t count() const { return bytes.size() / number->size; }
    /// Returns the element with this index in C order (the last index changes fastest), for either
    /// storage order. Rounds 64-bit integers to the nearest double.
    double at(std::uint64_t index) const;
};

/// Returns a shape as NumPy prints it: "(3, 4)", "(7,)".
std::string shapeText(const std::vector<std::uint64_t>& shape);

/// Returns the array of a .npy file (numpy.lib.format 1 to 3), with numbers of any common type in
/// either byte order and in C or Fortran order. Returns nothing if the file is not a .npy, or if
/// its elements are not numbers. Never unpickles objects. `where` names the file in messages.
/// Throws Error (kInput) if the file is damaged or its size contradicts its header.
std::optional<NumberArray> npyArray(std::span<const std::uint8_t> file, const std::string& where);

/// Returns the text of a .npy file that holds a numpy string, bytes, or a Boolean ("true" or
/// "false"); nothing otherwise.
std::optional<std::string> npyText(std::span<const std::uint8_t> file);

/// A .npz archive as written by numpy.savez and savez_compressed: ZIP (PKWARE APPNOTE 6.3, with
/// ZIP64), with members stored or compressed by DEFLATE. The file's bytes must outlive this object.
class NpzArchive {
  public:
    struct Member {
        std::string name;  ///< file name in the archive, with ".npy"
        std::uint16_t flags = 0, method = 0;
        std::uint32_t crc = 0;
        /// Size in the archive, size when uncompressed, and position, in bytes.
        std::uint64_t packed = 0, size = 0, offset = 0;
    };

    /// Reads the directory. `where` is the file's name; `kind` names its format in a hint. Throws
    /// Error (kInput) if the archive is damaged.
    NpzArchive(std::span<const std::uint8_t> file, std::string where, const char* kind = ".npz");

    const std::vector<Member>& members() const { return members_; }
    /// Returns the array with this name, or null if the archive lacks it.
    const Member* find(std::string_view array) const;
    /// Returns the place that messages give for a member: "file.npz, points.npy".
    std::string placeOf(const Member& member) const { return where_ + ", " + member.name; }
    /// Returns the bytes of a member's .npy file: a view of the archive if the member is stored,
    /// otherwise uncompressed into `storage`. Rejects impossible sizes before allocating. Throws
    /// Error (kInput).
    std::span<const std::uint8_t> contents(const Member& member,
                                           std::vector<std::uint8_t>& storage) const;

  private:
    std::span<const std::uint8_t> file_;
    std::string where_;
    const char* kind_;
    std::vector<Member> members_;
};

}  // namespace peeler
