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

/// Returns the name nearest to `text` by edit distance (Damerau & Levenshtein, adjacent
/// transpositions count one), ignoring case; empty if none is near enough.
std::string_view nearestName(std::string_view text, std::span<const std::string_view> names);

/// Returns the plural of an English noun: "mesh" becomes "meshes", "quantity" becomes "quantities".
std::string pluralOf(const std::string& noun);

/// Returns a hint for an unknown name: "did you mean 'a'?\nthe methods are: a, b". The first line
/// appears only if a name is near; at most 20 names are listed.
std::string choiceHint(std::string_view text, const std::string& plural,
                       std::span<const std::string_view> names);

/// Returns the index of the entry of `names` that contains `text` (each entry lists the names of
/// one item). Otherwise interprets `text` as an index, from 0; a name that looks like a number
/// wins. Returns nothing if it is neither.
std::optional<std::size_t> findNameOrIndex(std::string_view text,
                                           const std::vector<std::vector<std::string>>& names);

/// Like findNameOrIndex(), but throws Error (kUsage) with the list of names if there is no match.
/// `kind` is the kind of item ("camera") and `field` the setting that names it, both as in
/// messages.
std::size_t chooseFrom(const std::string& kind, const Text& field, const std::string& text,
                       const std::vector<std::vector<std::string>>& names);

}  // namespace peeler
