// SPDX-License-Identifier: Apache-2.0
// Correction of vertex data to the ranges that shading expects (glTF 2.0 §3.7.2.1).
#include <algorithm>
#include <cmath>
#include <iterator>

#include "formats/gltf/gltf_parts.h"

namespace peeler {
namespace {

/// The accepted deviation of a length from 1: twice the error of a component stored as a signed
/// byte.
constexpr double kStorageError = 0.02;

bool isOne(double length) {
    return std::abs(length - 1) <= kStorageError;
}

template <class Vector>
bool scaleDirections(std::vector<Vector>& directions) {
    bool other = false;
    for (Vector& direction : directions) {
        const glm::dvec3 given(direction);
        const double length = glm::length(given);
        if (isOne(length)) continue;
        other = true;
        for (int i = 0; i < 3 && length > 0; ++i)
            direction[i] = static_cast<float>(given[i] / length);
    }
    return other;
}

}  // namespace

bool clampColors(std::vector<glm::vec4>& colors) {
    constexpr float kRounding = 1e-4F;
    bool beyond = false;
    for (glm::vec4& color : colors) {
        const glm::vec4 cut = glm::abs(color - glm::clamp(color, 0.0F, 1.0F));
        beyond = beyond || glm::any(glm::greaterThan(cut, glm::vec4(kRounding)));
        color = glm::clamp(color, 0.0F, 1.0F);
    }
    return beyond;
}

bool scaleToUnit(std::vector<glm::vec3>& normals) {
    return scaleDirections(normals);
}

bool scaleToUnit(std::vector<glm::vec4>& tangents) {
    return scaleDirections(tangents);
}

bool makeSigns(std::vector<glm::vec4>& tangents) {
    bool other = false;
    for (glm::vec4& tangent : tangents) {
        if (isOne(std::abs(double{tangent.w}))) continue;
        other = true;
        tangent.w = tangent.w < 0 ? -1.0F : 1.0F;
    }
    return other;
}

bool addUpToOne(const std::vector<JointSet>& sets) {
    for (std::size_t vertex = 0; !sets.empty() && vertex < sets[0].weights.size(); ++vertex) {
        double sum = 0, least = 0;
        for (const JointSet& set : sets)
            for (int i = 0; i < 4; ++i) {
                sum += double{set.weights[vertex][i]};
                least = std::min(least, double{set.weights[vertex][i]});
            }
        if (!isOne(sum) || least < 0) return false;
    }
    return true;
}

bool isAttributeName(std::string_view name) {
    constexpr std::string_view kNumbered[] = {"TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"};
    constexpr std::size_t kMostDigits = 9;
    if (name.starts_with('_') || name == "POSITION" || name == "NORMAL" || name == "TANGENT")
        return true;
    const std::size_t end = name.find_last_not_of("0123456789") + 1;
    return end < name.size() && name.size() - end <= kMostDigits &&
           std::ranges::find(kNumbered, name.substr(0, end)) != std::end(kNumbered);
}

}  // namespace peeler
