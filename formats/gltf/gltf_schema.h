// SPDX-License-Identifier: Apache-2.0
// Table of the properties that peeler reads, from the glTF 2.0 JSON schema, and its checker.
#pragma once

#include <cstddef>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>

#include <peeler/text.h>
#include "formats/file/json_text.h"

namespace peeler {

/// Checks that every property that peeler uses has the type and range that glTF 2.0 requires, and
/// that every index is valid for its array. Converts integers written like 2.0. Throws Error
/// (kInput) with the JSON pointer of the first violation as `where`.
void checkGltfSchema(nlohmann::json& gltf);

/// The hint for files that violate the specification.
inline constexpr const char* kValidatorHint = "check the file with the Khronos glTF validator";

/// Throws Error (kInput). `where` is a JSON pointer, or the path for errors about the whole file.
[[noreturn]] void failGltf(const Text& what, const Text& where, const Text& hint = kValidatorHint);

/// The required type of a member.
enum class SchemaKind {
    kBool,
    kString,      ///< `of` lists the allowed values, separated by spaces; "" allows any
    kStrings,     ///< array of strings
    kNumber,      ///< a number that is finite as a 32-bit float
    kPositive,    ///< a number above zero
    kNumbers,     ///< array with `max` numbers
    kNumberList,  ///< array with any number of numbers
    kInteger,     ///< integer from `min` to `max`
    kEnum,        ///< integer; `of` lists the allowed values
    kIndex,       ///< index into an array; `of` is the array's path from the root
    kIndices,     ///< array of indices
    kIndexMap,    ///< object whose members are indices
    kIndexMaps,   ///< array of objects whose members are indices
    kIntegerMap,  ///< object whose members are integers from `min` to `max`
    kObject,      ///< object; the rows of owner `of` check its members
    kObjects,     ///< array of objects
    /// Object of extensions; the rows of owners "name" and "owner/name" check each extension.
    kExtensions,
};

// 2^53: the limit of exact integers in JSON numbers.
inline constexpr double kAnySize = 9007199254740992.0;
inline constexpr double kIntMax = std::numeric_limits<int>::max();

/// A member of an object, and its requirements. `owner` is the kind of object, such as "node".
struct SchemaRow {
    const char* owner;
    const char* name;
    SchemaKind kind;
    const char* of = "";
    bool required = false;
    double min = 0;
    double max = kAnySize;
};

/// Returns the table (gltf_schema_rows.cpp), from glTF 2.0 §5 and the extensions. The table has no
/// rows for names and extras, which peeler does not need, so invalid names and extras are accepted.
std::span<const SchemaRow> schemaRows();

}  // namespace peeler
