// SPDX-License-Identifier: Apache-2.0
// Reads the points of a PLY file: its header line by line, then numbers, as text or binary.
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <memory>
#include <string_view>

#include "core/base/error.h"
#include "formats/arrays/point_reader.h"

namespace peeler {
namespace {

constexpr std::size_t kMostPlyHeader = std::size_t{1} << 20;

/// A type by its old and its new name, and how a number of it is read.
struct PlyType {
    std::string_view name, other_name;
    std::size_t size;
    double (*value)(const std::uint8_t* bytes);  ///< in the machine's byte order
};

template <class T>
double valueOf(const std::uint8_t* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
}

constexpr PlyType kPlyTypes[] = {
    {"char", "int8", 1, valueOf<std::int8_t>},    {"uchar", "uint8", 1, valueOf<std::uint8_t>},
    {"short", "int16", 2, valueOf<std::int16_t>}, {"ushort", "uint16", 2, valueOf<std::uint16_t>},
    {"int", "int32", 4, valueOf<std::int32_t>},   {"uint", "uint32", 4, valueOf<std::uint32_t>},
    {"float", "float32", 4, valueOf<float>},      {"double", "float64", 8, valueOf<double>},
};

struct Property {
    const PlyType* count = nullptr;  ///< of the length of a list; null = it is a number
    const PlyType* type = nullptr;
    int axis = -1;  ///< 0–2 for x, y, z; −1 = none of them
};

struct Element {
    std::string name;
    std::uint64_t rows = 0;
    std::vector<Property> properties;
};

/// The numbers behind a header, one after the other. Errors say what is wrong; the caller adds
/// where.
class Numbers {
  public:
    virtual ~Numbers() = default;
    virtual double next(const PlyType& type) = 0;
    virtual void skip(const PlyType& type, std::uint64_t count) = 0;
    /// How many rows of an element there can be at most.
    virtual std::uint64_t most(const Element& element) const = 0;
};

[[noreturn]] void endsEarly() {
    throw Error(ErrorKind::kInput, "the file ends before its data does");
}

class BinaryNumbers final : public Numbers {
  public:
    BinaryNumbers(std::span<const std::uint8_t> data, bool swapped)
        : data_(data), swapped_(swapped) {}

    double next(const PlyType& type) override {
        std::array<std::uint8_t, 8> bytes{};
        if (data_.size() < type.size) endsEarly();
        std::copy_n(data_.begin(), type.size, bytes.begin());
        if (swapped_) std::reverse(bytes.begin(), bytes.begin() + std::ptrdiff_t(type.size));
        data_ = data_.subspan(type.size);
        return type.value(bytes.data());
    }
    void skip(const PlyType& type, std::uint64_t count) override {
        if (count > data_.size() / type.size) endsEarly();
        data_ = data_.subspan(count * type.size);
    }
    std::uint64_t most(const Element& element) const override {
        std::size_t row = 0;
        for (const Property& property : element.properties)
            row += property.count ? property.count->size : property.type->size;
        return data_.size() / row;
    }

  private:
    static_assert(std::endian::native == std::endian::little);
    std::span<const std::uint8_t> data_;
    bool swapped_;
};

class TextNumbers final : public Numbers {
  public:
    explicit TextNumbers(std::string_view text) : text_(text) {}

    double next(const PlyType&) override {
        constexpr std::string_view kBlank = " \t\r\n\v\f";
        text_.remove_prefix(std::min(text_.find_first_not_of(kBlank), text_.size()));
        if (text_.empty()) endsEarly();
        std::string_view word = text_.substr(0, text_.find_first_of(kBlank));
        text_.remove_prefix(word.size());
        if (word.starts_with('+')) word.remove_prefix(1);
        double value = 0;
        const char* const end = word.data() + word.size();
        const auto parsed = std::from_chars(word.data(), end, value);
        if (parsed.ec != std::errc() || parsed.ptr != end)
            throw Error(ErrorKind::kInput,
                        "expected a number, not \"" + std::string(word.substr(0, 32)) + "\"");
        return value;
    }
    void skip(const PlyType& type, std::uint64_t count) override {
        for (; count > 0; --count)
            next(type);
    }
    /// A number takes at least a digit and a blank.
    std::uint64_t most(const Element& element) const override {
        return (text_.size() + 1) / (2 * element.properties.size());
    }

  private:
    std::string_view text_;
};

/// Reads a header line by line.
class Header {
  public:
    Header(std::span<const std::uint8_t> file, const std::string& where)
        : text_(reinterpret_cast<const char*>(file.data()), file.size()), where_(where) {
        while (readLine()) {
        }
        if (format_.empty()) fail("it does not say its format");
    }

    const std::vector<Element>& elements() const { return elements_; }
    std::size_t size() const { return at_; }
    std::unique_ptr<Numbers> numbers(std::span<const std::uint8_t> file) const {
        if (format_ == "ascii") return std::make_unique<TextNumbers>(text_.substr(at_));
        const bool big = format_ == "binary_big_endian";
        return std::make_unique<BinaryNumbers>(file.subspan(at_), big);
    }

  private:
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kInput, "the header is damaged: " + what,
                    where_ + ":" + std::to_string(line_), "is it a PLY file, and whole?");
    }

    /// Reads a line; false if it was the last one of the header.
    bool readLine() {
        ++line_;
        const std::size_t end = text_.find('\n', at_);
        if (end > kMostPlyHeader) fail("there is no end_header");  // or this line has no end
        const std::vector<std::string_view> words = wordsOf(text_.substr(at_, end - at_));
        at_ = end + 1;
        if (words.empty() || words[0] == "comment" || words[0] == "obj_info") return true;
        if (words[0] == "end_header") return false;
        if (words[0] == "ply" && line_ == 1) return true;
        if (words[0] == "format" && words.size() == 3) {
            format_ = words[1];
            if (format_ != "ascii" && format_ != "binary_little_endian" &&
                format_ != "binary_big_endian")
                fail("an unknown format");
        } else if (words[0] == "element" && words.size() == 3) {
            elements_.push_back({std::string(words[1]), rows(words[2]), {}});
        } else if (words[0] == "property" && !elements_.empty() && words.size() == 3) {
            const int axis = words[2].size() == 1 ? words[2][0] - 'x' : -1;
            elements_.back().properties.push_back(
                {nullptr, &type(words[1]), axis >= 0 && axis < 3 ? axis : -1});
        } else if (words[0] == "property" && !elements_.empty() && words.size() == 5 &&
                   words[1] == "list") {
            elements_.back().properties.push_back({&type(words[2]), &type(words[3]), -1});
        } else {
            fail("a line that means nothing");
        }
        return true;
    }

    static std::vector<std::string_view> wordsOf(std::string_view line) {
        constexpr std::string_view kBlank = " \t\r";
        std::vector<std::string_view> words;
        for (std::size_t at = line.find_first_not_of(kBlank); at != std::string_view::npos;) {
            const std::size_t end = std::min(line.find_first_of(kBlank, at), line.size());
            words.push_back(line.substr(at, end - at));
            at = line.find_first_not_of(kBlank, end);
        }
        return words;
    }
    std::uint64_t rows(std::string_view word) const {
        std::uint64_t value = 0;
        const auto parsed = std::from_chars(word.data(), word.data() + word.size(), value);
        if (parsed.ec != std::errc() || parsed.ptr != word.data() + word.size())
            fail("expected how many there are of the element");
        return value;
    }
    const PlyType& type(std::string_view name) const {
        for (const PlyType& row : kPlyTypes)
            if (row.name == name || row.other_name == name) return row;
        fail("an unknown type of numbers");
    }

    std::string_view text_;
    const std::string& where_;
    std::size_t at_ = 0, line_ = 0;
    std::string format_;
    std::vector<Element> elements_;
};

/// Reads one row; the coordinates among its numbers go to `point`.
void readRow(const Element& element, Numbers& numbers, glm::dvec3& point) {
    for (const Property& property : element.properties) {
        if (property.count) {
            const double count = numbers.next(*property.count);
            if (!(count >= 0) || count != std::floor(count) || count > 4294967295.0)
                throw Error(ErrorKind::kInput, "a list has an impossible length");
            numbers.skip(*property.type, static_cast<std::uint64_t>(count));
        } else if (property.axis >= 0) {
            point[property.axis] = numbers.next(*property.type);
        } else {
            numbers.skip(*property.type, 1);
        }
    }
}

void checkCoordinates(const Element& vertex, const std::string& where) {
    for (int axis = 0; axis < 3; ++axis) {
        if (std::ranges::count(vertex.properties, axis, &Property::axis) != 1)
            throw Error(ErrorKind::kInput, "the vertices do not have one x, y and z each", where);
    }
}

}  // namespace

std::vector<glm::dvec3> plyPoints(std::span<const std::uint8_t> file, const std::string& where,
                                  const AllowBytes& allow) {
    const Header header(file, where);
    const std::unique_ptr<Numbers> numbers = header.numbers(file);
    std::vector<glm::dvec3> points;
    for (const Element& element : header.elements()) {
        const bool is_vertex = element.name == "vertex";
        if (is_vertex) checkCoordinates(element, where);
        if (element.properties.empty()) continue;
        std::uint64_t row = 0;
        try {
            // This is checked before anything is allocated.
            if (element.rows > numbers->most(element)) endsEarly();
            if (is_vertex && element.rows > kMostPoints)
                throw Error(ErrorKind::kInput, "there are more points than are taken at once");
            if (is_vertex) {
                allow(element.rows * sizeof(glm::dvec3));
                points.resize(element.rows);
            }
            glm::dvec3 none;
            for (; row < element.rows; ++row)
                readRow(element, *numbers, is_vertex ? points[row] : none);
        } catch (const Error& error) {
            throw Error(error.kind(), error.what(),
                        where + ", " + element.name + " " + std::to_string(row), error.hint());
        }
        if (is_vertex) return points;
    }
    throw Error(ErrorKind::kInput, "there are no vertices in it", where);
}

}  // namespace peeler
