// SPDX-License-Identifier: Apache-2.0
// Input files of named arrays and settings, in either container: .npz as numpy.savez writes it, or
// .safetensors.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/arrays/array_reader.h"

namespace peeler {

/// The arrays and settings of a file. The file's bytes must outlive this object. Settings are
/// numbers and texts: entries of `__metadata__` in a .safetensors, arrays in a .npz.
class ArrayFile {
  public:
    /// Whether a file that has this size and begins with these bytes looks like an array file.
    static bool recognises(std::string_view begin, std::uint64_t size);

    /// `where` is the file's name, for messages. Calls `allow` with the size of each compressed
    /// member of a .npz before uncompressing the member. Throws Error (kInput), and anything
    /// `allow` throws.
    ArrayFile(std::span<const std::uint8_t> file, std::string where,
              const std::function<void(std::uint64_t bytes)>& allow);
    ArrayFile(const ArrayFile&) = delete;
    ArrayFile& operator=(const ArrayFile&) = delete;

    /// Returns the names of the arrays and settings that have not been requested so far.
    std::vector<std::string> unused() const;
    /// Returns an entry's place in the file for messages: "file.npz, points.npy",
    /// "file.safetensors: points".
    std::string placeOf(const std::string& name) const;

    /// Returns an array, or nothing if it is missing. Throws Error (kInput) if its element type
    /// cannot be decoded.
    std::optional<NumberArray> array(const std::string& name);
    /// Returns a setting of `count` numbers, or nothing if it is missing. A Boolean becomes 1 or 0.
    std::optional<std::vector<double>> numbers(const std::string& name, std::size_t count);
    std::optional<std::string> text(const std::string& name);

  private:
    struct Member {
        std::optional<NumberArray> numbers;
        std::optional<std::string> text;
        std::vector<std::uint8_t> storage;
        bool is_used = false;
    };

    void readNpz(std::span<const std::uint8_t> file,
                 const std::function<void(std::uint64_t bytes)>& allow);
    void readTensors(std::span<const std::uint8_t> file);
    Member* use(const std::string& name);

    std::string where_;
    bool is_npz_ = false;
    std::map<std::string, Member> members_;
};

}  // namespace peeler
