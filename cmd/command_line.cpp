// SPDX-License-Identifier: Apache-2.0
// CLI11 set up from the table of verbs, its errors turned into ours.
#include "cmd/command_line.h"

#include <CLI/CLI.hpp>
#include <map>

#include "cmd/choices.h"
#include "cmd/errors.h"
#include "cmd/verbs.h"
#include "core/error.h"

namespace peeler::cmd {

namespace {

constexpr const char* kFooter =
    "`peeler VERB --help` explains one verb.\n\n"
    "Exit codes: 0 done, 1 internal error (compare: beyond a threshold), 2 usage,\n"
    "3 input unreadable or invalid, 4 output not written, 5 no usable GL device,\n"
    "6 incomplete under --strict, 33 out of memory or over --memory, 128 + n ended by signal n.";

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

int dispatch(const std::vector<std::string>& arguments, Console& console) {
    CLI::App app("Every layer of a glTF scene, headless.", "peeler");
    app.set_version_flag("--version", "peeler " PEELER_VERSION, "Print the version and exit");
    app.set_help_flag("-h,--help", "Print this help and exit");
    app.get_formatter()->column_width(30);
    app.get_formatter()->label("SUBCOMMAND", "VERB");
    app.require_subcommand(0, 1);
    std::map<const CLI::App*, VerbAction> actions;
    for (const Verb& verb : verbs()) {
        CLI::App* sub = app.add_subcommand(std::string(verb.name), std::string(verb.summary));
        sub->group("Verbs");
        actions[sub] = verb.declare(*sub);
    }
    app.footer(kFooter);  // last: verbs would inherit it

    try {
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::CallForHelp&) {
        console.result(app.help());
        return 0;
    } catch (const CLI::CallForVersion&) {
        console.result("peeler " PEELER_VERSION "\n");
        return 0;
    } catch (const CLI::ExtrasError&) {
        throw unplaced(app);
    } catch (const CLI::ParseError& error) {
        const auto chosen = app.get_subcommands();
        throw Error(
            ErrorKind::kUsage, error.what(), "",
            "see peeler " + (chosen.empty() ? "" : chosen.front()->get_name() + " ") + "--help");
    }
    const auto chosen = app.get_subcommands();
    if (chosen.empty()) {
        console.machineLine(app.help());
        throw Error(ErrorKind::kUsage, "no verb given");
    }
    return actions.at(chosen.front())(console);
}

}  // namespace

int runCommandLine(const std::vector<std::string>& arguments, Console& console) {
    return runReported(console, [&] { return dispatch(arguments, console); });
}

}  // namespace peeler::cmd
