// SPDX-License-Identifier: Apache-2.0
// Tables of named choices, and the error for an unknown name.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/error.h>
#include "core/base/names.h"

namespace peeler::cmd {

/// A row of a table: the name on the command line, the value, and the summary for --help.
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

/// Throws Error (kUsage), because `text` is not one of `names`. `kind` is the noun in the message,
/// such as "method".
[[noreturn]] void refuseName(const std::string& kind, std::string_view text,
                             std::span<const std::string_view> names);

/// Returns the names in a comma-separated list, in the list's order. Throws like refuseName() if
/// the list contains other names.
std::vector<std::string_view> listedNames(const std::string& kind, std::string_view list,
                                          std::span<const std::string_view> names);

/// Returns the value of a name. Throws like refuseName() if the name is unknown.
template <class T>
T choose(const std::string& kind, std::span<const Choice<T>> choices, std::string_view text) {
    for (const auto& choice : choices) {
        if (choice.name == text) return choice.value;
    }
    refuseName(kind, text, choiceNames(choices));
}

/// Returns the name of a value. Throws Error (kInternal) if the table lacks the value.
template <class T>
std::string_view nameOf(std::span<const Choice<T>> choices, T value) {
    for (const auto& choice : choices) {
        if (choice.value == value) return choice.name;
    }
    throw Error(ErrorKind::kInternal, "a choice without a name");
}

}  // namespace peeler::cmd
