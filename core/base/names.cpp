// SPDX-License-Identifier: Apache-2.0
// Edit distance, and hints for unknown names.
#include "core/base/names.h"

#include <algorithm>
#include <charconv>
#include <system_error>

#include <peeler/error.h>
#include "core/base/printable.h"

namespace peeler {
namespace {

std::string lower(std::string_view text) {
    std::string out(text);
    for (char& c : out) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
    }
    return out;
}

/// Returns the "optimal string alignment" distance: insertions, deletions, replacements and swaps
/// of adjacent characters.
std::size_t editDistance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before, last(b.size() + 1), now(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j)
        last[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        now[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replaced = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
            now[j] = std::min({replaced, last[j] + 1, now[j - 1] + 1});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
                now[j] = std::min(now[j], before[j - 2] + 1);
            }
        }
        before = last;
        last = now;
    }
    return last[b.size()];
}

}  // namespace

std::string_view nearestName(std::string_view text, std::span<const std::string_view> names) {
    // Limits the size of the distance table, since names may come from files.
    constexpr std::size_t kLongest = 200;
    const std::string wanted = lower(text.substr(0, kLongest));
    std::string_view best;
    std::size_t best_distance = 0;
    for (const std::string_view name : names) {
        const std::string candidate = lower(name.substr(0, kLongest));
        if (candidate.empty() || wanted.empty()) continue;
        // A prefix of two or more characters is a plausible abbreviation.
        const bool begins = wanted.size() >= 2 && candidate.starts_with(wanted);
        const std::size_t distance = begins ? 1 : editDistance(wanted, candidate);
        const std::size_t allowed =
            std::max<std::size_t>(1, std::max(wanted.size(), candidate.size()) / 3);
        if (distance > allowed || (!best.empty() && distance >= best_distance)) continue;
        best = name;
        best_distance = distance;
    }
    return best;
}

std::string pluralOf(const std::string& noun) {
    if (const std::size_t of = noun.find(" of "); of != std::string::npos)
        return pluralOf(noun.substr(0, of)) + noun.substr(of);
    if (noun.ends_with('y') && !noun.ends_with("ay") && !noun.ends_with("ey"))
        return noun.substr(0, noun.size() - 1) + "ies";
    const bool hisses = noun.ends_with('s') || noun.ends_with('x') || noun.ends_with("sh");
    return noun + (hisses ? "es" : "s");
}

std::string choiceHint(std::string_view text, const std::string& plural,
                       std::span<const std::string_view> names) {
    if (names.empty()) return "there are no " + plural;
    constexpr std::size_t kShown = 20;
    std::string hint;
    if (const std::string_view nearest = nearestName(text, names); !nearest.empty()) {
        hint = "did you mean '" + printable(nearest) + "'?\n";
    }
    hint += "the " + plural + " are: ";
    for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i) {
        hint += (i == 0 ? "" : ", ") + printable(names[i]);
    }
    if (names.size() > kShown) hint += " and " + std::to_string(names.size() - kShown) + " more";
    return hint;
}

std::optional<std::size_t> findNameOrIndex(std::string_view text,
                                           const std::vector<std::vector<std::string>>& names) {
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (!text.empty() && std::find(names[i].begin(), names[i].end(), text) != names[i].end())
            return i;
    }
    std::size_t index = 0;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), index);
    if (failure == std::errc() && end == text.data() + text.size() && index < names.size())
        return index;
    return std::nullopt;
}

std::size_t chooseFrom(const std::string& kind, const Text& field, const std::string& text,
                       const std::vector<std::vector<std::string>>& names) {
    if (const auto found = findNameOrIndex(text, names)) return *found;
    std::vector<std::string_view> listed;
    for (const auto& alternatives : names)
        listed.emplace_back(alternatives.front());
    const bool none = names.empty();
    throw Error(ErrorKind::kUsage, "unknown " + kind, field + " " + text,
                none ? "the scene has no " + kind + "; leave " + field + " out"
                     : choiceHint(text, pluralOf(kind), listed) + "; or give an index from 0 to " +
                           std::to_string(names.size() - 1));
}

}  // namespace peeler
