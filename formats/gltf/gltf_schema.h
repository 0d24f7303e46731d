// SPDX-License-Identifier: Apache-2.0
// The parts of the glTF 2.0 JSON schema that we read, as a table, and its check.
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

/// Checks that every property we use has the type that glTF 2.0 gives it, lies in its range, and
/// that every index points into its array. Whole numbers written as 2.0 become integers. Throws
/// Error(kInput) whose `where` is the JSON pointer of the first offender.
void checkGltfSchema(nlohmann::json& gltf);

/// What to try where a file breaks the specification.
inline constexpr const char* kValidatorHint = "check the file with the Khronos glTF validator";

/// Throws Error(kInput); `where` is a JSON pointer, or a path if it is about the whole file.
[[noreturn]] void failGltf(const Text& what, const Text& where, const Text& hint = kValidatorHint);

/// What a member of an object must be.
enum class SchemaKind {
    kBool,
    kString,      ///< `of` lists the allowed values, separated by spaces; empty = any
    kStrings,     ///< array
    kNumber,      ///< finite as a 32-bit float
    kPositive,    ///< a number above zero
    kNumbers,     ///< array of `max` numbers
    kNumberList,  ///< array of any number of them
    kInteger,     ///< min … max
    kEnum,        ///< integer; `of` lists the allowed values
    kIndex,       ///< into the array at the path `of` from the root
    kIndices,     ///< array of such
    kIndexMap,    ///< object with such values
    kIndexMaps,   ///< array of such objects
    kIntegerMap,  ///< object with values that are integers, min … max
    kObject,      ///< `of` is the name of the rows
    kObjects,     ///< array of such
    kExtensions,  ///< object; members named like rows, or like rows of "owner/name", are checked
};

inline constexpr double kAnySize = 9007199254740992.0;  // 2^53: what JSON numbers hold exactly
inline constexpr double kIntMax = std::numeric_limits<int>::max();

/// One member of the objects called `owner`.
struct SchemaRow {
    const char* owner;
    const char* name;
    SchemaKind kind;
    const char* of = "";
    bool required = false;
    double min = 0;
    double max = kAnySize;
};

/// The table (gltf_schema_rows.cpp), from glTF 2.0 §5 and the extensions. Names and extras are
/// never needed, so a wrong one is no reason to refuse a file.
std::span<const SchemaRow> schemaRows();

}  // namespace peeler
