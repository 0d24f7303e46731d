// SPDX-License-Identifier: Apache-2.0
#include "formats/arrays/ply_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <peeler/error.h>
#include "formats/file/text_words.h"

namespace peeler {
namespace {

constexpr std::size_t kMostHeader = std::size_t{1} << 20;

template <class T>
double valueOf(const std::uint8_t* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
}

template <class T>
constexpr PlyType plyType(std::string_view name, std::string_view other_name) {
    return {name, other_name, sizeof(T), valueOf<T>,
            std::is_integral_v<T> ? static_cast<double>(std::numeric_limits<T>::max()) : 1};
}

constexpr PlyType kTypes[] = {
    plyType<std::int8_t>("char", "int8"),    plyType<std::uint8_t>("uchar", "uint8"),
    plyType<std::int16_t>("short", "int16"), plyType<std::uint16_t>("ushort", "uint16"),
    plyType<std::int32_t>("int", "int32"),   plyType<std::uint32_t>("uint", "uint32"),
    plyType<float>("float", "float32"),      plyType<double>("double", "float64"),
};

class BinaryNumbers final : public PlyNumbers {
  public:
    BinaryNumbers(std::span<const std::uint8_t> data, bool swapped)
        : data_(data), swapped_(swapped) {}

    double next(const PlyType& type) override {
        if (data_.size() < type.size) failPlyEndsEarly();
        const std::uint8_t* const from = data_.data();
        data_ = data_.subspan(type.size);
        if (!swapped_) return type.value(from);
        std::array<std::uint8_t, 8> bytes{};
        std::reverse_copy(from, from + type.size, bytes.begin());
        return type.value(bytes.data());
    }
    void skip(const PlyType& type, std::uint64_t count) override {
        if (count > most(type)) failPlyEndsEarly();
        data_ = data_.subspan(count * type.size);
    }
    std::uint64_t most(const PlyElement& element) const override {
        std::size_t row = 0;
        for (const PlyField& property : element.properties)
            row += property.count ? property.count->size : property.type->size;
        return data_.size() / row;
    }
    std::uint64_t most(const PlyType& type) const override { return data_.size() / type.size; }
    std::size_t left() const override { return data_.size(); }

  private:
    static_assert(std::endian::native == std::endian::little);
    std::span<const std::uint8_t> data_;
    bool swapped_;
};

class TextNumbers final : public PlyNumbers {
  public:
    explicit TextNumbers(std::string_view text) : text_(text) {}

    double next(const PlyType&) override {
        const std::string_view word = takeWord(text_);
        if (word.empty()) failPlyEndsEarly();
        const auto value = numberIn<double>(word);
        if (!value)
            throw Error(ErrorKind::kInput,
                        "expected a number, not \"" + std::string(word.substr(0, 32)) + "\"");
        return *value;
    }
    void skip(const PlyType& type, std::uint64_t count) override {
        for (; count > 0; --count)
            next(type);
    }
    /// A value takes at least two characters: a digit and a blank.
    std::uint64_t most(const PlyElement& element) const override {
        return (text_.size() + 1) / (2 * element.properties.size());
    }
    std::uint64_t most(const PlyType&) const override { return (text_.size() + 1) / 2; }
    std::size_t left() const override { return text_.size(); }

  private:
    std::string_view text_;
};

std::vector<std::string_view> wordsOf(std::string_view line) {
    std::vector<std::string_view> words;
    for (std::string_view word = takeWord(line); !word.empty(); word = takeWord(line))
        words.push_back(word);
    return words;
}

}  // namespace

void failPlyEndsEarly() {
    throw Error(ErrorKind::kInput, "the file ends before its data does");
}

std::uint64_t PlyNumbers::length(const PlyField& list) {
    const double count = next(*list.count);
    if (!(count >= 0) || count != std::floor(count) || count > 4294967295.0)
        throw Error(ErrorKind::kInput, "a list has an impossible length");
    const auto length = static_cast<std::uint64_t>(count);
    if (length > most(*list.type)) failPlyEndsEarly();
    return length;
}

void PlyNumbers::skip(const PlyField& property) {
    skip(*property.type, property.count ? length(property) : 1);
}

PlyFile::PlyFile(std::span<const std::uint8_t> file, const std::string& where)
    : text_(reinterpret_cast<const char*>(file.data()), file.size()), where_(where) {
    // A single CR ends lines in Turk's original files (1994) and in files of classic Mac OS.
    if (const std::size_t first = text_.find_first_of("\r\n"); first != text_.npos)
        line_end_ = text_.substr(first).starts_with("\r\n") ? '\n' : text_[first];
    while (readLine()) {
    }
    if (format_.empty()) fail("its format is missing");
}

std::unique_ptr<PlyNumbers> PlyFile::numbers() const {
    if (isText()) return std::make_unique<TextNumbers>(text_.substr(at_));
    const std::string_view data = text_.substr(at_);
    return std::make_unique<BinaryNumbers>(
        std::span(reinterpret_cast<const std::uint8_t*>(data.data()), data.size()),
        format_ == "binary_big_endian");
}

void PlyFile::fail(const std::string& what) const {
    throw Error(ErrorKind::kInput, "the header is damaged: " + what,
                where_ + ":" + std::to_string(line_), "check that it is a complete PLY file");
}

/// Reads a line of the header. Returns false after the last line.
bool PlyFile::readLine() {
    ++line_;
    const std::size_t end = text_.find(line_end_, at_);
    if (end > kMostHeader) fail("there is no end_header");  // `end` is npos if the line has no end
    const std::string_view line = text_.substr(at_, end - at_);
    const std::vector<std::string_view> words = wordsOf(line);
    at_ = end + 1;
    if (words.empty() || words[0] == "obj_info") return true;
    if (words[0] == "comment") {
        comments_.emplace_back(trimmed(trimmed(line).substr(words[0].size())));
        return true;
    }
    if (words[0] == "end_header") return false;
    if (words[0] == "ply" && line_ == 1) return true;
    if (words[0] == "format" && words.size() == 3) {
        format_ = words[1];
        if (!isText() && format_ != "binary_little_endian" && format_ != "binary_big_endian")
            fail("an unknown format");
    } else if (words[0] == "element" && words.size() == 3) {
        elements_.push_back({std::string(words[1]), rows(words[2]), {}});
    } else if (words[0] == "property" && !elements_.empty() && words.size() == 3) {
        elements_.back().properties.push_back({std::string(words[2]), nullptr, &type(words[1])});
    } else if (words[0] == "property" && !elements_.empty() && words.size() == 5 &&
               words[1] == "list") {
        elements_.back().properties.push_back(
            {std::string(words[4]), &type(words[2]), &type(words[3])});
    } else {
        fail("an unknown line");
    }
    return true;
}

std::uint64_t PlyFile::rows(std::string_view word) const {
    const auto value = numberIn<std::uint64_t>(word);
    if (!value) fail("expected the number of elements");
    return *value;
}

const PlyType& PlyFile::type(std::string_view name) const {
    for (const PlyType& row : kTypes)
        if (row.name == name || row.other_name == name) return row;
    fail("an unknown type of numbers");
}

}  // namespace peeler
