// SPDX-License-Identifier: Apache-2.0
#include "formats/arrays/safetensors.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include <peeler/error.h>
#include "core/base/printable.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"

namespace peeler {
namespace {

constexpr std::uint64_t kLengthBytes = 8, kMostTensorAxes = 32;
constexpr const char* kTensorMetadata = "__metadata__";

[[noreturn]] void damagedTensors(const std::string& what, const std::string& where) {
    throw Error(ErrorKind::kInput, "the file of arrays is damaged: " + what, where,
                "check that it is a complete .safetensors file");
}

/// An element type. `numpy` is empty if the type cannot be decoded.
struct TensorType {
    std::string_view name;
    std::size_t size;
    std::string_view numpy{};
};
constexpr TensorType kTensorTypes[] = {
    {"F64", 8, "f8"}, {"F32", 4, "f4"}, {"F16", 2},      {"BF16", 2},      {"I64", 8, "i8"},
    {"I32", 4, "i4"}, {"I16", 2, "i2"}, {"I8", 1, "i1"}, {"U64", 8, "u8"}, {"U32", 4, "u4"},
    {"U16", 2, "u2"}, {"U8", 1, "u1"},  {"BOOL", 1},     {"F8_E4M3", 1},   {"F8_E5M2", 1},
};

/// Returns the size of an array in bytes; on overflow, the largest value.
std::uint64_t tensorBytes(std::size_t size, const std::vector<std::uint64_t>& shape) {
    constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
    if (std::ranges::find(shape, 0U) != shape.end()) return 0;
    std::uint64_t bytes = size;
    for (const std::uint64_t n : shape) {
        if (bytes > kMost / n) return kMost;
        bytes *= n;
    }
    return bytes;
}

SafetensorsArray tensorOf(const std::string& name, const nlohmann::json& json,
                          const std::string& where) {
    SafetensorsArray array;
    array.name = name;
    array.type = json.at("dtype").get<std::string>();
    array.shape = json.at("shape").get<std::vector<std::uint64_t>>();
    const auto place = json.at("data_offsets").get<std::array<std::uint64_t, 2>>();
    const std::string inside = where + ": " + printable(name);
    if (array.shape.size() > kMostTensorAxes) damagedTensors("an array has too many axes", inside);
    if (place[0] > place[1]) damagedTensors("an array ends before it begins", inside);
    array.offset = place[0];
    array.bytes = place[1] - place[0];
    const auto* const type = std::ranges::find(kTensorTypes, array.type, &TensorType::name);
    if (type == std::end(kTensorTypes)) return array;
    if (tensorBytes(type->size, array.shape) != array.bytes)
        damagedTensors("an array's size contradicts its shape", inside);
    if (!type->numpy.empty()) array.number = arrayNumber(type->numpy);
    return array;
}

SafetensorsHeader parsedHeader(std::string_view text, std::uint64_t file_bytes,
                               const std::string& where) {
    SafetensorsHeader header;
    const std::uint64_t data = kLengthBytes + text.size();
    try {
        const nlohmann::json json = parseJson(text, where);
        for (const auto& [name, value] : json.items()) {
            if (name == kTensorMetadata)
                header.metadata = value.get<std::map<std::string, std::string>>();
            else
                header.arrays.push_back(tensorOf(name, value, where));
        }
    } catch (const nlohmann::json::exception& problem) {
        damagedTensors("its header is invalid: " + printable(problem.what()), where);
    }
    std::ranges::stable_sort(header.arrays, {}, [](const SafetensorsArray& array) {
        return std::pair(array.offset, array.bytes);
    });
    std::uint64_t end = 0;
    for (SafetensorsArray& array : header.arrays) {
        if (array.offset != end)
            damagedTensors("arrays overlap, or there is a gap before one",
                           where + ": " + printable(array.name));
        end += array.bytes;
        array.offset += data;
    }
    if (end != file_bytes - data)
        damagedTensors(end > file_bytes - data ? "it ends early" : "data follows its arrays",
                       where);
    return header;
}

std::uint64_t headerLength(std::string_view begin, std::uint64_t size, const std::string& where) {
    if (!isSafetensors(begin, size)) damagedTensors("its header has an implausible size", where);
    std::uint64_t length = 0;
    std::memcpy(&length, begin.data(), sizeof length);
    return length;
}

}  // namespace

const SafetensorsArray* SafetensorsHeader::find(std::string_view name) const {
    const auto found = std::ranges::find(arrays, name, &SafetensorsArray::name);
    return found == arrays.end() ? nullptr : &*found;
}

std::string SafetensorsHeader::text(const std::string& name) const {
    const auto found = metadata.find(name);
    return found == metadata.end() ? "" : found->second;
}

SafetensorsHeader readSafetensors(const RegularFile& file, const std::string& where) {
    file.check();
    std::string text(kLengthBytes + 1, '\0');
    text.resize(file.readSome(0, text));
    text.resize(headerLength(text, file.size(), where));
    if (!file.read(kLengthBytes, text)) damagedTensors("it ends early", where);
    return parsedHeader(text, file.size(), where);
}

SafetensorsHeader readSafetensors(std::span<const std::uint8_t> file, const std::string& where) {
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    return parsedHeader(text.substr(kLengthBytes, headerLength(text, file.size(), where)),
                        file.size(), where);
}

}  // namespace peeler
