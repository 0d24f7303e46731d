// SPDX-License-Identifier: Apache-2.0
// CLI11 set up from the table of verbs.
#include "cmd/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <string_view>

#include "cmd/errors.h"
#include "cmd/parsed_verb.h"
#include "cmd/verbs.h"
#include "core/error.h"

namespace peeler::cmd {

namespace {

constexpr const char* kFooter =
    "`peeler VERB --help` explains one verb.\n\n"
    "Exit codes: 0 done, 1 internal error (compare: beyond a threshold), 2 usage,\n"
    "3 input unreadable or invalid, 4 output not written, 5 no usable GL device,\n"
    "6 incomplete under --strict, 33 out of memory or over --memory, 128 + n ended by signal n.";

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
        // The options of all verbs take longer to declare than some take to run.
        if (std::ranges::find(arguments, verb.name) != arguments.end())
            actions[sub] = verb.declare(*sub);
    }
    app.footer(kFooter);  // last: verbs would inherit it

    try {
        parseArguments(app, arguments);
    } catch (const CLI::CallForHelp&) {
        console.result(app.help());
        return 0;
    } catch (const CLI::CallForVersion&) {
        console.result("peeler " PEELER_VERSION "\n");
        return 0;
    }
    const auto chosen = app.get_subcommands();
    if (chosen.empty()) {
        console.machineLine(app.help());
        throw Error(ErrorKind::kUsage, "no verb given");
    }
    return actions.at(chosen.front())(console);
}

/// Wrong arguments are told to the scheduler, too, though nobody has read them yet.
bool schedulerReads(const std::vector<std::string>& arguments) {
    constexpr std::string_view kTwoWords[] = {"--progress", "openjd"};
    const auto end = arguments.end();
    return std::search(arguments.begin(), end, std::begin(kTwoWords), std::end(kTwoWords)) != end ||
           std::find(arguments.begin(), end, "--progress=openjd") != end;
}

}  // namespace

int runCommandLine(const std::vector<std::string>& arguments, Console& console) {
    // Open Job Description, "How Jobs Are Run".
    if (schedulerReads(arguments)) console.setFailurePrefix("openjd_fail: ");
    return runReported(console, [&] { return dispatch(arguments, console); });
}

}  // namespace peeler::cmd
