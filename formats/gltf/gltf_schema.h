// SPDX-License-Identifier: Apache-2.0
// The parts of the glTF 2.0 JSON schema that we read, as a table, and its check.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace peeler {

/// Checks that every property we use has the type that glTF 2.0 gives it, lies in its range, and
/// that every index points into its array. Whole numbers written as 2.0 become integers.
/// Throws Error(kInput) whose `where` is the JSON pointer of the first offender.
void checkGltfSchema(nlohmann::json& gltf);

/// What to try where a file breaks the specification.
inline constexpr const char* kValidatorHint = "check the file with the Khronos glTF validator";

/// Throws Error(kInput); `where` is a JSON pointer, or a path if it is about the whole file.
[[noreturn]] void failGltf(const std::string& what, const std::string& where,
                           const char* hint = kValidatorHint);

/// JSON pointers (RFC 6901) of the child of a value.
std::string childPointer(const std::string& parent, std::string_view key);
std::string childPointer(const std::string& parent, std::size_t index);

}  // namespace peeler
