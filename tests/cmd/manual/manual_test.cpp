// SPDX-License-Identifier: Apache-2.0
// Compares the manual and the shell completions with --help: they have the same options and
// choices.
#include "cmd/manual/completions.h"
#include "cmd/manual/manual_page.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "cmd/cli/command_line.h"
#include "cmd/cli/errors.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

using Names = std::set<std::string>;

const cmd::CommandDescription& program() {
    static const cmd::CommandDescription described = cmd::describeCommandLine();
    return described;
}

std::vector<const cmd::CommandDescription*> commands() {
    std::vector<const cmd::CommandDescription*> all{&program()};
    for (const cmd::CommandDescription& verb : program().verbs)
        all.push_back(&verb);
    return all;
}

std::string helpOf(const cmd::CommandDescription& command) {
    return &command == &program() ? runPeeler({"--help"}).out
                                  : runPeeler({command.name, "--help", "all"}).out;
}

std::string pageOf(const cmd::CommandDescription& command) {
    return cmd::manualPage(program(), command, "");
}

/// Returns the text of the pattern's first group for each match.
Names found(const std::string& text, const std::string& pattern) {
    const std::regex regex(pattern, std::regex::ECMAScript | std::regex::multiline);
    Names names;
    for (std::sregex_iterator at(text.begin(), text.end(), regex), end; at != end; ++at)
        names.insert((*at)[1]);
    return names;
}

/// Returns the options at the beginning of lines of --help, such as "  -o, --output FILE   the
/// file" and "  --legend, --no-legend".
Names optionsInHelp(const std::string& help) {
    Names names;
    for (const std::string& listed : found(help, "^  (-[^ ,\n]+(?:, -[^ ,\n]+)*)")) {
        for (const std::string& name : found(listed, "(-[-a-zA-Z]+)"))
            names.insert(name);
    }
    return names;
}

Names optionsOf(const cmd::CommandDescription& command) {
    Names names;
    for (const cmd::OptionDescription& option : command.options)
        names.insert(option.names.begin(), option.names.end());
    return names;
}

Names plain(const Names& roff) {
    Names names;
    for (const std::string& name : roff)
        names.insert(std::regex_replace(name, std::regex("\\\\-"), "-"));
    return names;
}

/// Returns the part of a script for a verb. The last part ('' in bash) is for the program.
std::string partOf(const std::string& script, const std::string& begin, const std::string& end) {
    const std::size_t from = script.find(begin);
    if (from == std::string::npos) return "";
    return script.substr(from, script.find(end, from + begin.size()) - from);
}

TEST(Description, HasTheOptionsOfTheHelp) {
    for (const auto* command : commands()) {
        const Names options = optionsInHelp(helpOf(*command));
        EXPECT_TRUE(options.contains("--help")) << command->name;
        EXPECT_EQ(optionsOf(*command), options) << command->name;
    }
    EXPECT_EQ(program().verbs.size(), cmd::verbs().size());
}

TEST(Description, HasTheChoicesOfTheHelp) {
    std::size_t count = 0;
    for (const cmd::CommandDescription& verb : program().verbs) {
        const std::string help = helpOf(verb);
        for (const cmd::OptionDescription& option : verb.options) {
            for (const cmd::ChoiceDescription& choice : option.choices) {
                const std::string name = choice.name + (choice.is_default ? " (default)" : "");
                const bool alone = choice.summary.empty() || choice.name.empty();
                EXPECT_TRUE(contains(help, alone ? name : name + ": ")) << verb.name << name;
                ++count;
            }
        }
    }
    EXPECT_GT(count, 200U);
}

TEST(Description, KnowsWhatBecomesOfValues) {
    const auto& verbs = program().verbs;
    const auto optionOf = [&](const std::string& verb, const std::string& name) {
        for (const cmd::CommandDescription& command : verbs)
            for (const cmd::OptionDescription& option : command.options)
                if (command.name == verb &&
                    (option.value_name == name ||
                     std::ranges::find(option.names, name) != option.names.end()))
                    return option;
        ADD_FAILURE() << verb << " has no " << name;
        return cmd::OptionDescription();
    };
    const auto scene = optionOf("render", "SCENE");
    EXPECT_TRUE(scene.is_file && scene.required && scene.repeated && scene.names.empty());
    EXPECT_EQ(scene.endings,
              (std::vector<std::string>{".gltf", ".glb", ".npz", ".safetensors", ".ply", ".stl",
                                        ".obj", ".3mf", ".spz", ".splat"}));
    const auto output = optionOf("render", "--output");
    EXPECT_EQ(output.names, (std::vector<std::string>{"-o", "--output"}));
    EXPECT_TRUE(output.is_file && output.required && !output.repeated);
    EXPECT_EQ(output.group, "Output");
    EXPECT_EQ(output.value_name, "FILE");
    EXPECT_FALSE(optionOf("rays", "--output").required);
    EXPECT_EQ(optionOf("render", "--json").value_name, "");
    EXPECT_TRUE(optionOf("render", "--include").repeated);
    EXPECT_TRUE(optionOf("render", "--channels").takes_list);
    EXPECT_EQ(cmd::valuesOf(optionOf("render", "--layers")).front().name, "all");
    EXPECT_EQ(cmd::valuesOf(optionOf("render", "--size")).size(), 0U);
    EXPECT_EQ(cmd::valuesOf(optionOf("bake", "--environment")).size(), 2U);
}

TEST(ManualPage, HasTheOptionsAndChoicesAndNoOthers) {
    for (const auto* command : commands()) {
        const std::string page = pageOf(*command);
        Names names, choices;
        for (const std::string& name :
             plain(found(partOf(page, ".SH OPTIONS", "\n.SH "), "\\\\fB(.*?)\\\\fR")))
            (name.starts_with("-") ? names : choices).insert(name);
        EXPECT_EQ(names, optionsInHelp(helpOf(*command))) << page;
        Names declared;
        for (const cmd::OptionDescription& option : command->options)
            for (const cmd::ChoiceDescription& choice : option.choices)
                if (!choice.name.empty()) declared.insert(choice.name);
        EXPECT_EQ(choices, declared) << page;
    }
}

TEST(ManualPage, HasTheSectionsThatReadersLookFor) {
    for (const auto* command : commands()) {
        const std::string page = pageOf(*command);
        std::size_t last = 0;
        for (const char* section :
             {"NAME", "SYNOPSIS", "OPTIONS", "EXAMPLES", "EXIT STATUS", "SEE ALSO"}) {
            const std::size_t at = page.find(std::string(".SH ") + section + '\n');
            ASSERT_NE(at, std::string::npos) << section << page;
            EXPECT_GT(at, last) << section;
            last = at;
        }
        EXPECT_EQ(contains(page, ".SH ENVIRONMENT"), command == &program());
        std::istringstream examples(command->examples);
        for (std::string line; std::getline(examples, line);)
            EXPECT_TRUE(contains(page, cmd::roffText(line) + '\n')) << line;
        for (const cmd::ExitCode& row : cmd::exitCodes())
            EXPECT_TRUE(contains(page, "\\fB" + std::string(row.code) + "\\fR\n")) << row.code;
    }
    const std::string render = pageOf(program().verbs.front());
    EXPECT_TRUE(contains(render,
                         "\\fBpeeler\\fR \\fBrender\\fR [\\fIOPTIONS\\fR] "
                         "\\fB\\-\\-output\\fR \\fIFILE\\fR\n\\fISCENE\\fR...") ||
                contains(render,
                         "\\fBpeeler\\fR \\fBrender\\fR [\\fIOPTIONS\\fR] "
                         "\\fB\\-\\-output\\fR \\fIFILE\\fR \\fISCENE\\fR..."))
        << render;
}

TEST(ManualPage, HasADateOnlyIfThereIsOne) {
    EXPECT_TRUE(contains(cmd::manualPage(program(), program(), "2001-09-09"),
                         ".TH PEELER 1 \"2001-09-09\" \"peeler "));
    EXPECT_TRUE(contains(pageOf(program()), ".TH PEELER 1 \"\" \"peeler "));
}

TEST(RoffText, ShowsWhatItIsGiven) {
    EXPECT_EQ(cmd::roffText("--no-mkdir"), "\\-\\-no\\-mkdir");
    EXPECT_EQ(cmd::roffText(".exr"), "\\&.exr");
    EXPECT_EQ(cmd::roffText("'a' \"b\" `c`"), "\\(aqa\\(aq \\(dqb\\(dq \\(gac\\(ga");
    EXPECT_EQ(cmd::roffText("a\\nb ~ ^"), "a\\enb \\(ti \\(ha");
    EXPECT_EQ(cmd::roffText("1, … 3 × 4, \xF0\x9D\x84\x9E"),
              "1, \\[u2026] 3 \\[u00D7] 4, \\[u1D11E]");
}

TEST(Completions, HaveTheOptionsAndNoOthers) {
    const std::string bash = cmd::bashCompletions(program()), zsh = cmd::zshCompletions(program()),
                      fish = cmd::fishCompletions(program());
    for (const auto* command : commands()) {
        const bool whole = command == &program();
        const Names options = optionsInHelp(helpOf(*command));

        const std::string in_bash =
            partOf(bash, "    " + (whole ? "''" : command->name) + ")\n", "\n        ;;\n");
        const Names listed = found(in_bash, "== -\\* \\]\\]; then words='(.*?)'");
        ASSERT_EQ(listed.size(), 1U) << in_bash;
        EXPECT_EQ(found(*listed.begin(), "(-[-a-zA-Z]+)"), options) << command->name;

        const std::string in_zsh =
            whole ? partOf(zsh, "_arguments -C", "case $state")
                  : partOf(zsh, "        " + command->name + ")\n", "\n            ;;\n");
        Names in_specs;
        for (const std::string& spec : found(in_zsh, "^ +'((?:\\(|\\*|-)[^\\[\n]*)\\["))
            for (const std::string& name : found(spec, "(-[-a-zA-Z]+)"))
                in_specs.insert(name);
        EXPECT_EQ(in_specs, options) << in_zsh;

        Names in_fish;
        const std::string line = "^complete -c peeler -n '__peeler_verb " +
                                 (whole ? "\\\\'\\\\'" : command->name) +
                                 "'((?: -[ls] [-a-zA-Z]+)+)";
        for (const std::string& words : found(fish, line)) {
            for (const std::string& name : found(words, " -l ([-a-z]+)"))
                in_fish.insert("--" + name);
            for (const std::string& name : found(words, " -s (\\w)"))
                in_fish.insert("-" + name);
        }
        EXPECT_EQ(in_fish, options) << command->name;
    }
}

TEST(Completions, HaveTheChoices) {
    const std::string bash = cmd::bashCompletions(program()), zsh = cmd::zshCompletions(program()),
                      fish = cmd::fishCompletions(program());
    for (const cmd::CommandDescription& verb : program().verbs) {
        const std::string in_bash = partOf(bash, "    " + verb.name + ")\n", "\n        ;;\n");
        const std::string in_zsh =
            partOf(zsh, "        " + verb.name + ")\n", "\n            ;;\n");
        for (const cmd::OptionDescription& option : verb.options) {
            if (option.names.empty()) continue;
            const std::string& name = option.names.back();
            const std::string in_fish =
                partOf(partOf(fish, "__peeler_verb " + verb.name + '\'', "__peeler_verb none"),
                       " -l " + name.substr(2) + ' ', "\n");
            for (const cmd::ChoiceDescription& value : cmd::valuesOf(option)) {
                const Names words = found(in_bash, ' ' + name + "(?: \\|[^)]*)?\\) words='(.*?)'");
                ASSERT_EQ(words.size(), 1U) << name;
                EXPECT_TRUE(contains(' ' + *words.begin() + ' ', ' ' + value.name + ' ')) << name;
                EXPECT_TRUE(contains(partOf(in_zsh, name + "=[", "\n"), value.name)) << name;
                EXPECT_TRUE(contains(in_fish, value.name)) << in_fish;
            }
        }
    }
}

TEST(ExitCodes, AreThoseOfTheErrorsAndOfTheDocument) {
    Names codes;
    for (const cmd::ExitCode& row : cmd::exitCodes())
        codes.emplace(row.code);
    for (const ErrorKind kind :
         {ErrorKind::kInternal, ErrorKind::kUsage, ErrorKind::kInput, ErrorKind::kOutput,
          ErrorKind::kDevice, ErrorKind::kIncomplete, ErrorKind::kMemory})
        EXPECT_TRUE(codes.contains(std::to_string(static_cast<int>(kind))));
    const std::string document = bytesOf(sourceDir() / "cmd" / "README.md");
    EXPECT_EQ(found(partOf(document, "## Exit codes", "\n## "), "^- (\\d[^:]*):"), codes);
}

TEST(EnvironmentVariables, AreThoseThatTheProductReads) {
    Names listed;
    for (const cmd::EnvironmentVariable& row : cmd::environmentVariables())
        for (const std::string& name : found(std::string(row.names), "([A-Z_]+)"))
            listed.insert(name);
    // A file that reads an environment variable contains its name as a string. Calls of setenv()
    // also contain names, so they are removed.
    const std::regex set("[^n]setenv\\([^;]*;");
    Names strings;
    for (const char* library : {"core", "formats", "cmd"}) {
        for (const auto& entry :
             std::filesystem::recursive_directory_iterator(sourceDir() / library)) {
            if (entry.path().extension() != ".cpp") continue;
            const std::string path = entry.path().string();
            if (contains(path, "cmd/manual/")) continue;
            const std::string text = bytesOf(entry.path());
            if (!contains(text, "getenv(")) continue;
            strings.merge(
                found(std::regex_replace(text, set, ""), "\"([A-Z]+(?:_[A-Z]+)+|TERM)\""));
        }
    }
    EXPECT_EQ(listed, strings);
}

}  // namespace
}  // namespace peeler::test
