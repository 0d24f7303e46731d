// SPDX-License-Identifier: Apache-2.0
// PLY 1.0 (G. Turk, "The PLY Polygon File Format", 1994): the header, and the numbers behind it,
// text or binary of either byte order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace peeler {

/// A type by its old and its new name, and how a number of it is read.
struct PlyType {
    std::string_view name, other_name;
    std::size_t size;                            ///< bytes
    double (*value)(const std::uint8_t* bytes);  ///< in the machine's byte order
    double greatest;                             ///< of integers; 1 of floating point
};

struct PlyField {
    std::string name;
    const PlyType* count = nullptr;  ///< of the length of a list; null = it is a number
    const PlyType* type = nullptr;
};

struct PlyElement {
    std::string name;
    std::uint64_t rows = 0;
    std::vector<PlyField> properties;
};

/// The numbers behind a header, one after the other. Throws Error (kInput) without `where`, which
/// the caller knows, if they are none or end early.
class PlyNumbers {
  public:
    virtual ~PlyNumbers() = default;
    virtual double next(const PlyType& type) = 0;
    virtual void skip(const PlyType& type, std::uint64_t count) = 0;
    /// How many rows of an element there can be at most.
    virtual std::uint64_t most(const PlyElement& element) const = 0;
    /// How many numbers of a type there can be at most.
    virtual std::uint64_t most(const PlyType& type) const = 0;
    /// How many bytes from the end of the file it is.
    virtual std::size_t left() const = 0;

    /// Reads how long a list is.
    std::uint64_t length(const PlyField& list);
    /// Reads what is not wanted.
    void skip(const PlyField& property);
};

/// The file that ends before its data does.
[[noreturn]] void failPlyEndsEarly();

/// The header of a file, read when it is made, which must outlive it. Throws Error (kInput) with
/// the name of the file and the line.
class PlyFile {
  public:
    PlyFile(std::span<const std::uint8_t> file, const std::string& where);

    const std::vector<PlyElement>& elements() const { return elements_; }
    /// Without the word `comment`.
    const std::vector<std::string>& comments() const { return comments_; }
    bool isText() const { return format_ == "ascii"; }
    std::unique_ptr<PlyNumbers> numbers() const;

  private:
    [[noreturn]] void fail(const std::string& what) const;
    bool readLine();
    std::uint64_t rows(std::string_view word) const;
    const PlyType& type(std::string_view name) const;

    std::string_view text_;
    const std::string& where_;
    std::size_t at_ = 0, line_ = 0;
    char line_end_ = '\n';
    std::string format_;
    std::vector<PlyElement> elements_;
    std::vector<std::string> comments_;
};

}  // namespace peeler
