// SPDX-License-Identifier: Apache-2.0
// Readers of numbers from JSON camera files, with the place of each error.
#include <algorithm>
#include <cmath>

#include "formats/cameras/camera_formats.h"
#include "formats/file/json_text.h"

namespace peeler {
namespace {

std::string placeIn(const std::string& file, const std::string& pointer) {
    return pointer.empty() ? file : file + ", " + pointer;
}

/// Returns the number. Throws Error (kInput) if `value` is not a finite number.
double finiteNumber(const nlohmann::json& value, const std::string& where) {
    if (!value.is_number()) refuseCamera("expected a number, not " + shownJson(value), where);
    const auto number = value.get<double>();
    if (!std::isfinite(number)) refuseCamera("the number is not finite", where);
    return number;
}

}  // namespace

CameraObject::CameraObject(const nlohmann::json& value, std::string file, std::string pointer)
    : value_(value), file_(std::move(file)), pointer_(std::move(pointer)) {
    if (!value_.is_object())
        refuseCamera("expected an object, not " + shownJson(value_), placeIn(file_, pointer_));
}

std::string CameraObject::where() const {
    return placeIn(file_, pointer_);
}

std::string CameraObject::where(std::string_view key) const {
    return placeIn(file_, childPointer(pointer_, key));
}

const nlohmann::json* CameraObject::find(const char* key) const {
    const auto found = value_.find(key);
    return found == value_.end() || found->is_null() ? nullptr : &*found;
}

std::optional<double> CameraObject::number(const char* key) const {
    const nlohmann::json* const value = find(key);
    if (!value) return {};
    return finiteNumber(*value, where(key));
}

std::vector<double> CameraObject::list(const nlohmann::json& value, const std::string& pointer,
                                       std::size_t count) const {
    if (!value.is_array() || value.size() != count)
        refuseCamera("expected a list of " + std::to_string(count) + ", not " + shownJson(value),
                     placeIn(file_, pointer));
    std::vector<double> numbers;
    numbers.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        numbers.push_back(value[i].is_number() ? value[i].get<double>() : NAN);
        // Build the place only on failure, because this takes longer than reading the number.
        if (!std::isfinite(numbers.back()))
            finiteNumber(value[i], placeIn(file_, childPointer(pointer, i)));
    }
    return numbers;
}

std::optional<std::vector<double>> CameraObject::numbers(const char* key, std::size_t count) const {
    const nlohmann::json* const value = find(key);
    if (!value) return {};
    return list(*value, childPointer(pointer_, key), count);
}

std::optional<std::vector<double>> CameraObject::rows(const char* key, std::size_t count,
                                                      std::size_t columns) const {
    const nlohmann::json* const value = find(key);
    if (!value) return {};
    if (!value->is_array() || value->size() != count)
        refuseCamera("expected " + std::to_string(count) + " rows of " + std::to_string(columns) +
                         " numbers, not " + shownJson(*value),
                     where(key));
    std::vector<double> numbers;
    const std::string pointer = childPointer(pointer_, key);
    for (std::size_t i = 0; i < count; ++i) {
        const std::vector<double> row = list((*value)[i], childPointer(pointer, i), columns);
        numbers.insert(numbers.end(), row.begin(), row.end());
    }
    return numbers;
}

std::optional<glm::dmat4> CameraObject::matrix(const char* key) const {
    const nlohmann::json* const value = find(key);
    if (!value) return {};
    const std::size_t count = value->is_array() && value->size() == 3 ? 3 : 4;
    return matrixOfRows(*rows(key, count, 4), where(key));
}

std::optional<std::string> CameraObject::text(const char* key) const {
    const nlohmann::json* const value = find(key);
    if (!value) return {};
    if (!value->is_string())
        refuseCamera("expected a string, not " + shownJson(*value), where(key));
    return value->get<std::string>();
}

void CameraObject::missing(const char* key) const {
    refuseCamera("\"" + std::string(key) + "\" is missing", where());
}

void warnOfOthers(const CameraObject& object, std::span<const std::string_view> known,
                  ReadWarnings& warnings) {
    for (const auto& [key, value] : object.value().items())
        if (std::ranges::find(known, key) == known.end())
            warnings.warn("The key \"" + key + "\" is unknown and ignored.", object.where(key));
}

}  // namespace peeler
