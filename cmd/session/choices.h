// SPDX-License-Identifier: Apache-2.0
// Named choices of the command line: tables of them, and what to say to a name that is in none.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/error.h>
#include "core/base/names.h"

namespace peeler::cmd {

/// One row: the name on the command line, what it stands for, a few words for --help.
template <class T>
struct Choice {
    std::string_view name;
    T value;
    std::string_view summary;
};

template <class T>
std::vector<std::string_view> choiceNames(std::span<const Choice<T>> choices) {
    std::vector<std::string_view> names;
    for (const auto& choice : choices)
        names.push_back(choice.name);
    return names;
}

/// Throws Error (kUsage) for a name that is not among `names`. `kind` is what it names: "method".
[[noreturn]] void refuseName(const std::string& kind, std::string_view text,
                             std::span<const std::string_view> names);

/// The names of a list with commas between, in its order. Throws like refuseName() for one that is
/// not among `names`.
std::vector<std::string_view> listedNames(const std::string& kind, std::string_view list,
                                          std::span<const std::string_view> names);

/// The value with this name. Throws like refuseName() for an unknown one.
template <class T>
T choose(const std::string& kind, std::span<const Choice<T>> choices, std::string_view text) {
    for (const auto& choice : choices) {
        if (choice.name == text) return choice.value;
    }
    refuseName(kind, text, choiceNames(choices));
}

/// The name with this value. Throws Error (kInternal) if the table lacks it.
template <class T>
std::string_view nameOf(std::span<const Choice<T>> choices, T value) {
    for (const auto& choice : choices) {
        if (choice.value == value) return choice.name;
    }
    throw Error(ErrorKind::kInternal, "a choice without a name");
}

}  // namespace peeler::cmd
