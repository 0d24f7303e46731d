// SPDX-License-Identifier: Apache-2.0
// What to say to a name that is not there.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/text.h>

namespace peeler {

/// The name nearest to `text` by edit distance (Damerau & Levenshtein, adjacent transpositions
/// count one), letters compared without case; empty if none is near enough to be what was meant.
std::string_view nearestName(std::string_view text, std::span<const std::string_view> names);

/// An English noun for several: "mesh" as "meshes", "quantity" as "quantities".
std::string pluralOf(const std::string& noun);

/// A hint for an unknown name: "did you mean 'a'?\nthe methods are: a, b". The first line is there
/// only if a name is near; at most 20 are listed.
std::string choiceHint(std::string_view text, const std::string& plural,
                       std::span<const std::string_view> names);

/// The index into `names` of the thing that `text` names (each entry lists the names of one thing),
/// or that `text` is the index of, from 0; a name that looks like a number wins. Nothing if it is
/// neither.
std::optional<std::size_t> findNameOrIndex(std::string_view text,
                                           const std::vector<std::vector<std::string>>& names);

/// Like findNameOrIndex(), but throws Error (kUsage) with the list of names for what is not there.
/// `kind` is what it is, "camera", and `field` what asks for it, as messages name it.
std::size_t chooseFrom(const std::string& kind, const Text& field, const std::string& text,
                       const std::vector<std::vector<std::string>>& names);

}  // namespace peeler
