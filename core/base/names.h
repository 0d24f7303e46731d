// SPDX-License-Identifier: Apache-2.0
// Lookup of names, with hints for unknown ones.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/text.h>

namespace peeler {

/// Returns the name nearest to `text` by edit distance (Damerau & Levenshtein: swapping neighbours
/// is one edit). Ignores case. Returns an empty string if no name is near enough.
std::string_view nearestName(std::string_view text, std::span<const std::string_view> names);

/// Returns the plural of an English noun: "mesh" becomes "meshes", "quantity" becomes "quantities",
/// "kind of mask" becomes "kinds of mask".
std::string pluralOf(const std::string& noun);

/// Returns a hint for an unknown name: "did you mean 'a'?\nthe methods are: a, b". The first line
/// appears only if a name is near. The list has at most 20 names.
std::string choiceHint(std::string_view text, const std::string& plural,
                       std::span<const std::string_view> names);

/// Returns the index of the item with the name `text`, or of the item with the number `text` (from
/// 0); nullopt if there is no such item. Each entry of `names` lists the names of one item. If
/// `text` is both a name and a number, the name takes precedence.
std::optional<std::size_t> findNameOrIndex(std::string_view text,
                                           const std::vector<std::vector<std::string>>& names);

/// Like findNameOrIndex(), but throws Error (kUsage) with the list of names if no item matches. The
/// message contains the kind of item, `kind` ("camera"), and the setting that selects it, `field`.
std::size_t chooseFrom(const std::string& kind, const Text& field, const std::string& text,
                       const std::vector<std::vector<std::string>>& names);

}  // namespace peeler
