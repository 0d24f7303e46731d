// SPDX-License-Identifier: Apache-2.0
#include "cmd/parsed_verb.h"

#include <CLI/CLI.hpp>
#include <string_view>

#include "cmd/choices.h"
#include "core/error.h"

namespace peeler::cmd {

namespace {

/// The arguments that CLI11 could not place, as an error with the nearest name.
Error unplaced(const CLI::App& app) {
    const auto chosen = app.get_subcommands();
    const CLI::App& verb = chosen.empty() ? app : *chosen.front();
    const auto rest = verb.remaining();
    const std::string argument = rest.empty() ? std::string() : rest.front();
    const bool is_option = argument.starts_with('-');

    std::vector<std::string> names;
    if (is_option) {
        for (const CLI::Option* option : verb.get_options()) {
            for (const auto& name : option->get_lnames())
                names.push_back("--" + name);
        }
    } else if (chosen.empty()) {
        for (const Verb& known : verbs())
            names.emplace_back(known.name);
    }
    const std::vector<std::string_view> views(names.begin(), names.end());
    const std::string_view nearest = nearestName(argument.substr(0, argument.find('=')), views);
    std::string hint = nearest.empty() ? "" : "did you mean '" + std::string(nearest) + "'?\n";
    hint += "see peeler " + (chosen.empty() ? "" : verb.get_name() + " ") + "--help";
    const char* what = is_option        ? "unknown option"
                       : chosen.empty() ? "unknown verb"
                                        : "one argument too many";
    return Error(ErrorKind::kUsage, what, argument, hint);
}

}  // namespace

void parseArguments(CLI::App& app, const std::vector<std::string>& arguments) {
    try {
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::CallForHelp&) {
        throw;
    } catch (const CLI::CallForVersion&) {
        throw;
    } catch (const CLI::ExtrasError&) {
        throw unplaced(app);
    } catch (const CLI::ParseError& error) {
        const auto chosen = app.get_subcommands();
        throw Error(
            ErrorKind::kUsage, error.what(), "",
            "see peeler " + (chosen.empty() ? "" : chosen.front()->get_name() + " ") + "--help");
    }
}

ParsedVerb::ParsedVerb(const Verb& verb, const std::vector<std::string>& arguments)
    : app_(std::make_unique<CLI::App>()) {
    CLI::App* sub = app_->add_subcommand(std::string(verb.name));
    action_ = verb.declare(*sub);
    std::vector<std::string> all{std::string(verb.name)};
    all.insert(all.end(), arguments.begin(), arguments.end());
    try {
        parseArguments(*app_, all);
    } catch (const CLI::Success&) {
        throw Error(ErrorKind::kUsage, "there is nothing to do", "--help", "leave it out");
    }
}

ParsedVerb::~ParsedVerb() = default;

bool ParsedVerb::knows(const std::string& option) const {
    return app_->get_subcommands({}).front()->get_option_no_throw(option) != nullptr;
}

bool ParsedVerb::has(const std::string& option) const {
    const auto* found = app_->get_subcommands({}).front()->get_option_no_throw(option);
    return found && found->count() > 0;
}

std::string ParsedVerb::value(const std::string& option) const {
    return has(option) ? app_->get_subcommands({}).front()->get_option(option)->results().back()
                       : "";
}

}  // namespace peeler::cmd
