// SPDX-License-Identifier: Apache-2.0
#include "formats/arrays/array_file.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include <peeler/error.h>
#include "core/base/printable.h"
#include "formats/arrays/safetensors.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"

namespace peeler {
namespace {

constexpr std::string_view kZip = "PK\x03\x04", kNpy = ".npy";

/// Whether a ZIP archive begins with a .npy file (PKWARE APPNOTE 6.3, section 4.3.7).
bool isNpz(std::string_view begin) {
    constexpr std::size_t kLocal = 30, kNameLength = 26;
    if (!begin.starts_with(kZip) || begin.size() < kLocal) return false;
    const auto byte = [&](std::size_t at) { return static_cast<std::uint8_t>(begin[at]); };
    const std::size_t length = byte(kNameLength) | std::size_t{byte(kNameLength + 1)} << 8U;
    return begin.substr(kLocal, length).ends_with(kNpy);
}

std::vector<double> decodedValues(const NumberArray& array) {
    std::vector<double> values(array.count());
    for (std::uint64_t i = 0; i < values.size(); ++i)
        values[i] = array.at(i);
    return values;
}

}  // namespace

bool ArrayFile::recognises(std::string_view begin, std::uint64_t size) {
    return isSafetensors(begin, size) || isNpz(begin);
}

ArrayFile::ArrayFile(std::span<const std::uint8_t> file, std::string where,
                     const std::function<void(std::uint64_t bytes)>& allow)
    : where_(std::move(where)) {
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    is_npz_ = text.starts_with(kZip);
    if (is_npz_)
        readNpz(file, allow);
    else
        readTensors(file);
}

void ArrayFile::readNpz(std::span<const std::uint8_t> file,
                        const std::function<void(std::uint64_t bytes)>& allow) {
    const NpzArchive archive(file, where_);
    for (const NpzArchive::Member& member : archive.members()) {
        if (!member.name.ends_with(kNpy)) continue;
        const std::string inside = archive.placeOf(member);
        const auto [place, is_new] =
            members_.try_emplace(member.name.substr(0, member.name.size() - kNpy.size()));
        if (!is_new) throw Error(ErrorKind::kInput, "two arrays have the same name", inside);
        Member& found = place->second;
        if (member.method != 0) allow(member.size);
        const std::span<const std::uint8_t> bytes = archive.contents(member, found.storage);
        found.numbers = npyArray(bytes, inside);
        if (!found.numbers) found.text = npyText(bytes);
    }
}

void ArrayFile::readTensors(std::span<const std::uint8_t> file) {
    const SafetensorsHeader header = readSafetensors(file, where_);
    for (const SafetensorsArray& array : header.arrays) {
        Member& found = members_[array.name];
        if (!array.number) continue;
        found.numbers = NumberArray{array.shape, array.number, false, false,
                                    file.subspan(array.offset, array.bytes)};
    }
    for (const auto& [name, text] : header.metadata) {
        const auto [place, is_new] = members_.try_emplace(name);
        if (!is_new)
            throw Error(ErrorKind::kInput, "an array and a text have the same name", placeOf(name));
        place->second.text = text;
    }
}

std::string ArrayFile::placeOf(const std::string& name) const {
    return where_ + (is_npz_ ? ", " + printable(name) + std::string(kNpy) : ": " + printable(name));
}

std::vector<std::string> ArrayFile::unused() const {
    std::vector<std::string> names;
    for (const auto& [name, member] : members_)
        if (!member.is_used) names.push_back(name);
    return names;
}

ArrayFile::Member* ArrayFile::use(const std::string& name) {
    const auto found = members_.find(name);
    if (found == members_.end()) return nullptr;
    found->second.is_used = true;
    return &found->second;
}

std::optional<NumberArray> ArrayFile::array(const std::string& name) {
    const Member* const member = use(name);
    if (!member) return {};
    if (!member->numbers)
        throw Error(ErrorKind::kInput,
                    "expected an array of integers, or of floats of 32 or 64 bits", placeOf(name));
    return member->numbers;
}

std::optional<std::vector<double>> ArrayFile::numbers(const std::string& name, std::size_t count) {
    const Member* const member = use(name);
    if (!member) return {};
    std::vector<double> values;
    if (member->text) {
        const nlohmann::json json = parseJsonOrNull(*member->text);
        for (const nlohmann::json& value : json.is_array() ? json : nlohmann::json::array({json})) {
            if (value.is_number()) values.push_back(value.get<double>());
            if (value.is_boolean()) values.push_back(value.get<bool>() ? 1 : 0);
        }
    } else if (member->numbers && member->numbers->count() == count) {
        values = decodedValues(*member->numbers);
    }
    if (values.size() != count)
        throw Error(
            ErrorKind::kInput,
            count == 1 ? "expected a number" : "expected " + std::to_string(count) + " numbers",
            placeOf(name));
    return values;
}

std::optional<std::string> ArrayFile::text(const std::string& name) {
    const Member* const member = use(name);
    if (!member) return {};
    if (!member->text) throw Error(ErrorKind::kInput, "expected a string", placeOf(name));
    return member->text;
}

}  // namespace peeler
