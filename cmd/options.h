// SPDX-License-Identifier: Apache-2.0
// How a verb declares its options to CLI11: the value's parser, its name in the help, its group.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "cmd/choices.h"
#include "core/error.h"

namespace peeler::cmd {

/// `text` broken into lines that fit beside the option names.
std::string wrapped(const std::string& text);

/// Adds an option whose text `parse` turns into a value of `target`'s type. An Error (kUsage) that
/// parse throws gets the option and its text as `where`.
template <class T, class Parse>
CLI::Option* addValue(CLI::App& app, const std::string& name, const std::string& value_name,
                      T& target, Parse parse, const std::string& help) {
    // "-o,--output" is shown as --output, "SCENE" as it is.
    const std::size_t long_name = name.find("--");
    const std::string shown = long_name == std::string::npos ? name : name.substr(long_name);
    const std::function<void(const std::string&)> assign = [&target, parse,
                                                            shown](const std::string& text) {
        try {
            target = parse(text);
        } catch (const Error& error) {
            throw Error(error.kind(), error.what(), shown + " " + text, error.hint());
        }
    };
    return app.add_option_function<std::string>(name, assign, wrapped(help))
        ->option_text(value_name.empty() ? " " : value_name)  // "" would show CLI11's own
        ->take_last();
}

/// Adds an option that may be given several times; `take` gets the text of each. An Error (kUsage)
/// that it throws gets the option and its text as `where`, unless it has one.
template <class Take>
CLI::Option* addRepeated(CLI::App& app, const std::string& name, const std::string& value_name,
                         Take take, const std::string& help) {
    const std::function<void(const std::vector<std::string>&)> assign =
        [take, name](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
                try {
                    take(text);
                } catch (const Error& error) {
                    const std::string where = error.where().empty()
                                                  ? std::string(name).append(" ").append(text)
                                                  : error.where();
                    throw Error(error.kind(), error.what(), where, error.hint());
                }
            }
        };
    return app.add_option_function<std::vector<std::string>>(name, assign, wrapped(help))
        ->option_text(value_name)
        ->expected(1)
        ->take_all();
}

/// Adds a positional argument of one or more files.
CLI::Option* addFiles(CLI::App& app, const std::string& name,
                      std::vector<std::filesystem::path>& files, const std::string& help);

/// Adds an option with a table of names; the help lists them, the first as the default.
template <class T>
CLI::Option* addChoice(CLI::App& app, const std::string& name, T& target,
                       std::span<const Choice<T>> choices, const std::string& kind,
                       const std::string& help) {
    std::string list;
    for (const auto& choice : choices) {
        list += '\n' + std::string(choice.name) + (list.empty() ? " (default): " : ": ") +
                std::string(choice.summary);
    }
    return addValue(
        app, name, "NAME", target,
        [choices, kind](const std::string& text) { return choose(kind, choices, text); },
        help + list);
}

}  // namespace peeler::cmd
