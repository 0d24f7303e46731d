// SPDX-License-Identifier: Apache-2.0
// PLY 1.0 reader (G. Turk, "The PLY Polygon File Format", 1994): the header, and the data after it,
// text or binary in either byte order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace peeler {

/// A scalar type.
struct PlyType {
    std::string_view name, other_name;
    std::size_t size;
    /// Decodes a value stored in the machine's byte order.
    double (*value)(const std::uint8_t* bytes);
    /// Maximum value of an integer type; 1 for floating point.
    double greatest;
};

struct PlyField {
    std::string name;
    /// Type of the list's length; null if the property is a scalar.
    const PlyType* count = nullptr;
    const PlyType* type = nullptr;
};

struct PlyElement {
    std::string name;
    std::uint64_t rows = 0;
    std::vector<PlyField> properties;
};

/// A sequential reader of the values after a header. Throws Error (kInput) without `where`, which
/// the caller adds, if a value is malformed or the data ends early.
class PlyNumbers {
  public:
    virtual ~PlyNumbers() = default;
    virtual double next(const PlyType& type) = 0;
    virtual void skip(const PlyType& type, std::uint64_t count) = 0;
    /// Returns the maximum number of an element's rows that the remaining data can hold.
    virtual std::uint64_t most(const PlyElement& element) const = 0;
    /// Returns the maximum number of values of this type that the remaining data can hold.
    virtual std::uint64_t most(const PlyType& type) const = 0;
    virtual std::size_t left() const = 0;

    std::uint64_t length(const PlyField& list);
    void skip(const PlyField& property);
};

/// Throws the Error (kInput) for a file whose data ends early.
[[noreturn]] void failPlyEndsEarly();

/// A PLY header, parsed on construction; the file must outlive it. Throws Error (kInput) with the
/// file's name and the line.
class PlyFile {
  public:
    PlyFile(std::span<const std::uint8_t> file, const std::string& where);

    const std::vector<PlyElement>& elements() const { return elements_; }
    /// Returns the text of each comment, without the word `comment`.
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
