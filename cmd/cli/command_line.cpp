// SPDX-License-Identifier: Apache-2.0
#include "cmd/cli/command_line.h"

#include <algorithm>
#include <map>
#include <string>
#include <string_view>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"

#ifndef PEELER_COMMIT
#define PEELER_COMMIT ""  // empty outside a git clone
#endif

namespace peeler::cmd {

namespace {

VerbHelp programHelp() {
    return {
        .summary = "Render every layer of a glTF, PLY, STL, OBJ or 3MF scene, without a display",
        .examples =
            "peeler render model.glb -o picture.png\n"
            "peeler render model.glb -o layers.exr --size 1920x1080\n"
            "peeler view layers.exr -o layers.html"};
}

std::string programFooter() {
    std::string codes;
    for (const ExitCode& row : exitCodes()) {
        codes += (codes.empty() ? "Exit codes: " : ", ") + std::string(row.code) + ' ' +
                 std::string(row.meaning);
    }
    return "`peeler VERB --help` shows the options that most people need, --help all shows all of "
           "them.\n\n" +
           wrapped(codes + '.', 88);
}

VerbOptions addTo(ArgumentParser& parser, const Verb& verb) {
    return parser.addVerb(std::string(verb.name),
                          {verb.summary, verb.purpose, verb.examples, verb.common});
}

/// Replaces "help" and "help VERB" by the equivalent options. Drops "help" before an unknown verb.
std::vector<std::string> withoutHelpVerb(std::vector<std::string> arguments) {
    if (arguments.empty() || arguments.front() != "help") return arguments;
    arguments.erase(arguments.begin());
    const auto is_named = [&](const Verb& verb) { return verb.name == arguments.front(); };
    if (arguments.empty() || std::ranges::any_of(verbs(), is_named))
        arguments.insert(arguments.begin() + (arguments.empty() ? 0 : 1), "--help");
    return arguments;
}

/// Runs `work`. If a usage error has no hint, adds the hint "see peeler VERB --help".
template <class Work>
auto hintingAt(const ArgumentParser& parser, const Work& work) {
    try {
        return work();
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kUsage || !error.hint().empty() || parser.verb().empty())
            throw;
        throw Error(error.kind(), error.whatText(), error.whereText(),
                    "see peeler " + parser.verb() + " --help");
    }
}

int dispatch(const std::vector<std::string>& given, Console& console) {
    const std::vector<std::string> arguments = withoutHelpVerb(given);
    ArgumentParser parser(programHelp(), programFooter());
    std::map<std::string, VerbAction> actions;
    for (const Verb& verb : verbs()) {
        const std::string name(verb.name);
        VerbOptions options = addTo(parser, verb);
        // Declares only the options of verbs that occur in the arguments, because declaring all
        // options takes longer than some verbs run.
        if (std::ranges::find(arguments, name) != arguments.end())
            actions[name] = verb.declare(options);
    }

    switch (hintingAt(parser, [&] { return parser.parse(arguments); })) {
        case Asked::kHelp:
            console.text(parser.help());
            return 0;
        case Asked::kVersion:
            console.text("peeler " PEELER_VERSION PEELER_COMMIT "\n");
            return 0;
        case Asked::kNothing:
            console.machineLine(parser.help());
            throw Error(ErrorKind::kUsage, "no verb given");
        case Asked::kVerb:
            break;
    }
    Session session(console);
    return hintingAt(parser, [&] { return actions.at(parser.verb())(session); });
}

/// Whether a scheduler reads stderr (--progress openjd). Searches the unparsed arguments, because
/// the scheduler must get parse errors, too.
bool schedulerReads(const std::vector<std::string>& arguments) {
    constexpr std::string_view kTwoWords[] = {"--progress", "openjd"};
    const auto end = arguments.end();
    return std::search(arguments.begin(), end, std::begin(kTwoWords), std::end(kTwoWords)) != end ||
           std::find(arguments.begin(), end, "--progress=openjd") != end;
}

}  // namespace

CommandDescription describeCommandLine() {
    ArgumentParser parser(programHelp(), programFooter());
    std::vector<VerbAction> actions;  // own the options' storage
    for (const Verb& verb : verbs()) {
        VerbOptions options = addTo(parser, verb);
        actions.push_back(verb.declare(options));
    }
    return parser.describe();
}

int runCommandLine(const std::vector<std::string>& arguments, Console& console) {
    // Errors for schedulers begin with this prefix (Open Job Description, "How Jobs Are Run").
    if (schedulerReads(arguments)) console.setFailurePrefix("openjd_fail: ");
    return runReported(console, [&] { return dispatch(arguments, console); });
}

}  // namespace peeler::cmd
