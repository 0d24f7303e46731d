// SPDX-License-Identifier: Apache-2.0
// The options of verbs: how they are declared, and how arguments are read by them. CLI11 does the
// work; it takes long to compile, so arguments.cpp alone includes it.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "cmd/cli/errors.h"
#include "cmd/session/choices.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace peeler::cmd {

/// A value that an option knows by name.
struct ChoiceDescription {
    std::string name;  ///< "": the summary is a line about those that follow
    std::string summary;
    bool is_default = false;
};

/// What --help, the manual and the completions of shells tell of an option.
struct OptionDescription {
    std::vector<std::string> names;  ///< "-o", "--output"; none of an argument that needs no name
    std::string value_name;          ///< what the argument is called, too; "" of a flag
    std::string group;
    std::string help;  ///< not broken into lines, without the choices
    std::vector<ChoiceDescription> choices;
    bool takes_list = false;  ///< several choices, with commas between
    bool required = false;
    bool repeated = false;
    bool is_file = false;
    std::vector<std::string> endings;  ///< of the files that it means: ".glb"; none: any
};

/// The same of a verb, or of the program.
struct CommandDescription {
    std::string name, summary, examples;
    std::string footer;  ///< broken into lines
    std::vector<OptionDescription> options;
    std::vector<CommandDescription> verbs;
};

/// Returns the choices of a table whose rows have a name and a summary.
template <class Rows>
std::vector<ChoiceDescription> describeChoices(const Rows& rows, bool first_is_default = false) {
    std::vector<ChoiceDescription> choices;
    for (const auto& row : rows) {
        choices.push_back(
            {std::string(row.name), std::string(row.summary), first_is_default && choices.empty()});
    }
    return choices;
}

/// `text` broken into lines, by default such that they fit beside the names of options.
std::string wrapped(const std::string& text, std::size_t columns = 66);

/// One option of a verb. A copy stands for the same option; none outlives the ArgumentParser.
class Option {
  public:
    Option(CLI::Option& option, OptionDescription& description)
        : option_(&option), description_(&description) {}

    /// The heading under which the help lists it.
    Option group(const std::string& heading);
    /// Whether arguments that lack it are wrong.
    Option required(bool is_required = true);
    /// Replaces its help, but for its choices.
    Option description(const std::string& help);
    /// The names that it takes, which its help lists.
    Option oneOf(std::vector<ChoiceDescription> choices);
    /// The same, where several may be given with commas between.
    Option someOf(std::vector<ChoiceDescription> choices);
    /// Its value is a file: endings with spaces between (".gltf .glb"), or "" for any.
    Option files(const std::string& endings);

    std::string name() const;  ///< "--output" of "-o,--output"
    std::string group() const;

  private:
    CLI::Option* option_;
    OptionDescription* description_;
};

/// The options of one verb: declares them, and says which are given once arguments are parsed. A
/// copy stands for the same verb; none outlives the ArgumentParser.
///
/// A name is "-o,--output", "SCENE" of an argument that needs no name, or "--refine,!--no-refine"
/// of a flag and its opposite. `value_name` is what the help calls the value; help is broken into
/// lines. Of alternatives ("NAME|INDEX|all") those in lower case are meant as they stand. Targets,
/// and what callbacks refer to, must outlive the parse. Callbacks throw Error (kUsage), which the
/// parse passes on. An empty text is refused before they are called.
class VerbOptions {
  public:
    using Take = std::function<void(const std::string&)>;

    using Descriptions = std::map<CLI::Option*, OptionDescription, std::less<>>;

    VerbOptions(CLI::App& app, Descriptions& descriptions)
        : app_(&app), descriptions_(&descriptions) {}

    /// An option; `take` gets its text, the last one if it is given several times. An Error that it
    /// throws gets the option and its text as `where`.
    Option addText(const std::string& name, const std::string& value_name, const Take& take,
                   const std::string& help);

    /// An option that may be given several times; `take` gets the text of each. An Error that it
    /// throws gets the option and its text as `where`, unless it has one.
    Option addRepeated(const std::string& name, const std::string& value_name, const Take& take,
                       const std::string& help);

    /// An option without a value.
    Option addFlag(const std::string& name, bool& target, const std::string& help);

    /// An argument of one or more files, which is required.
    Option addFiles(const std::string& name, std::vector<std::filesystem::path>& files,
                    const std::string& help);

    /// What the help ends with, in lines of its own.
    void footer(const std::string& text);

    /// The option with this name ("--output"), which must have been declared.
    Option option(const std::string& name) const;
    bool knows(const std::string& name) const;
    bool given(const std::string& name) const;
    /// The text of an option, the last one if it is given several times; "" if it is not given.
    std::string value(const std::string& name) const;
    /// The options that are given, in the order in which they are declared.
    std::vector<Option> given() const;

  private:
    Option described(CLI::Option& option, const std::string& help) const;
    bool isFile(const std::string& name) const;

    CLI::App* app_;
    Descriptions* descriptions_;
};

/// Adds an option whose text `parse` turns into a value of `target`'s type; else as addText().
template <class T, class Parse>
Option addValue(VerbOptions& verb, const std::string& name, const std::string& value_name,
                T& target, Parse parse, const std::string& help) {
    return verb.addText(
        name, value_name, [&target, parse](const std::string& text) { target = parse(text); },
        help);
}

/// Adds an option that is a file, or a folder; `target` may be optional.
template <class T>
Option addFile(VerbOptions& verb, const std::string& name, const std::string& value_name, T& target,
               const std::string& help) {
    return addValue(
               verb, name, value_name, target,
               [](const std::string& text) { return std::filesystem::path(text); }, help)
        .files("");
}

/// Adds an option with a table of names; the help lists them, the first as the default. `kind` is
/// what the error for an unknown one calls them.
template <class T>
Option addChoice(VerbOptions& verb, const std::string& name, T& target,
                 std::span<const Choice<T>> choices, const std::string& kind,
                 const std::string& help) {
    return addValue(
               verb, name, "NAME", target,
               [choices, kind](const std::string& text) { return choose(kind, choices, text); },
               help)
        .oneOf(describeChoices(choices, true));
}

/// What arguments ask for.
enum class Asked { kVerb, kHelp, kVersion, kNothing };

/// Reads the arguments of the program: a verb, and what its options take.
class ArgumentParser {
  public:
    /// For arguments of a verb that are no command line: without --version, and without the limit
    /// to one verb, so that its name among its own arguments is passed over.
    ArgumentParser();
    /// For the command line; `summary` and `footer` begin and end the help of the program.
    ArgumentParser(const std::string& summary, const std::string& footer);
    ~ArgumentParser();
    ArgumentParser(const ArgumentParser&) = delete;
    ArgumentParser& operator=(const ArgumentParser&) = delete;

    /// A verb that has --help and no other option yet. Its help begins with the summary and the
    /// examples, commands of a line each.
    VerbOptions addVerb(const std::string& name, const std::string& summary,
                        const std::string& examples = "");

    /// Sets the targets of the options that are given; to be called once. Throws Error (kUsage) for
    /// what is unknown, with the nearest name, for what is missing, and what callbacks throw.
    Asked parse(const std::vector<std::string>& arguments);

    /// The verb among the parsed arguments; "" if there is none.
    std::string verb() const;
    /// The help of that verb, else of the program.
    std::string help() const;
    /// What that help is made of, of the program and of all its verbs.
    CommandDescription describe() const;

  private:
    CommandDescription describe(const CLI::App& app) const;

    std::unique_ptr<CLI::App> app_;
    std::map<std::string, std::string> examples_;  ///< by verb
    VerbOptions::Descriptions descriptions_;
};

}  // namespace peeler::cmd
