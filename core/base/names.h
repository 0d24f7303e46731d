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

/// Returns the name nearest to `text` by edit distance (Damerau & Levenshtein: a transposition of
/// neighbours counts as one edit), ignoring case; empty if none is near enough.
std::string_view nearestName(std::string_view text, std::span<const std::string_view> names);

/// Returns the plural of an English noun: "mesh" becomes "meshes", "quantity" becomes "quantities".
std::string pluralOf(const std::string& noun);

/// Returns a hint for an unknown name: "did you mean 'a'?\nthe methods are: a, b". The first line
/// appears only if a name is near; at most 20 names are listed.
std::string choiceHint(std::string_view text, const std::string& plural,
                       std::span<const std::string_view> names);

/// Returns the index of the item that `text` refers to, by name or else by index from 0; nothing if
/// it is neither. Each entry of `names` lists the names of one item. A name that looks like a
/// number takes precedence over an index.
std::optional<std::size_t> findNameOrIndex(std::string_view text,
                                           const std::vector<std::vector<std::string>>& names);

/// Like findNameOrIndex(), but throws Error (kUsage) with the list of names if there is no match.
/// `kind` is the kind of item ("camera"), `field` the setting that chooses it, both as in messages.
std::size_t chooseFrom(const std::string& kind, const Text& field, const std::string& text,
                       const std::vector<std::vector<std::string>>& names);

}  // namespace peeler
