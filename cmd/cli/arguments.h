// SPDX-License-Identifier: Apache-2.0
// Option declaration and argument parsing, on top of CLI11. Only arguments.cpp includes CLI11,
// which is slow to compile.
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

/// A named value of an option.
struct ChoiceDescription {
    std::string name;  ///< "": the summary is a heading for the following choices
    std::string summary;
    bool is_default = false;
};

/// An option's description for --help, the manual and shell completions.
struct OptionDescription {
    std::vector<std::string> names;  ///< "-o", "--output"; empty for positional arguments
    std::string value_name;          ///< also the name of a positional argument; "" for a flag
    std::string group;
    std::string help;  ///< unwrapped, without the choices
    std::vector<ChoiceDescription> choices;
    bool takes_list = false;  ///< several choices, separated by commas
    bool required = false;
    bool repeated = false;
    bool is_file = false;
    std::vector<std::string> endings;  ///< file extensions: ".glb"; empty = any
};

/// The description of a verb or of the program.
struct CommandDescription {
    std::string name, summary, examples;
    std::string footer;  ///< wrapped
    std::vector<OptionDescription> options;
    std::vector<CommandDescription> verbs;
};

/// Returns the rows of a table of names and summaries, with API names in summaries translated.
template <class Rows>
std::vector<ChoiceDescription> describeChoices(const Rows& rows, bool first_is_default = false) {
    std::vector<ChoiceDescription> choices;
    for (const auto& row : rows) {
        choices.push_back(
            {std::string(row.name), std::string(row.summary), first_is_default && choices.empty()});
    }
    return choices;
}

/// Returns `text` wrapped, by default to fit beside the option names.
std::string wrapped(const std::string& text, std::size_t columns = 66);

/// A handle to an option of a verb. Copies refer to the same option. The ArgumentParser must
/// outlive all of them.
class Option {
  public:
    Option(CLI::Option& option, OptionDescription& description)
        : option_(&option), description_(&description) {}

    /// Sets the heading under which the help lists it.
    Option group(const std::string& heading);
    /// Sets whether the option is required.
    Option required(bool is_required = true);
    /// Replaces its help except the choices.
    Option description(const std::string& help);
    /// Sets the accepted names, which the help lists.
    Option oneOf(std::vector<ChoiceDescription> choices);
    /// Sets the accepted names of a comma-separated list.
    Option someOf(std::vector<ChoiceDescription> choices);
    /// Marks its value as a file: extensions separated by spaces (".gltf .glb"), or "" for any.
    Option files(const std::string& endings);

    std::string name() const;  ///< "--output" for "-o,--output"
    std::string group() const;

  private:
    CLI::Option* option_;
    OptionDescription* description_;
};

/// A handle to the options of one verb: declares them, and after parsing reports which are given.
/// Copies refer to the same verb. The ArgumentParser must outlive all of them.
///
/// A name is "-o,--output", "SCENE" for a positional argument, or "--refine,!--no-refine" for a
/// flag and its opposite. `value_name` is the value's name in the help; help is wrapped. Lower-case
/// alternatives ("NAME|INDEX|all") are literal. Targets, and everything callbacks refer to, must
/// outlive the parse. Callbacks may throw Error (kUsage), which the parse passes on. Empty text is
/// refused before they are called.
class VerbOptions {
  public:
    using Take = std::function<void(const std::string&)>;

    using Descriptions = std::map<CLI::Option*, OptionDescription, std::less<>>;

    VerbOptions(CLI::App& app, Descriptions& descriptions)
        : app_(&app), descriptions_(&descriptions) {}

    /// Adds an option. `take` gets its text, the last one if the option is repeated. An Error from
    /// `take` gets the option and its text as `where`.
    Option addText(const std::string& name, const std::string& value_name, const Take& take,
                   const std::string& help);

    /// Adds a repeatable option. `take` gets each text. An Error from `take` gets the option and
    /// its text as `where` unless it has one.
    Option addRepeated(const std::string& name, const std::string& value_name, const Take& take,
                       const std::string& help);

    /// Adds an option without a value.
    Option addFlag(const std::string& name, bool& target, const std::string& help);

    /// Adds a required positional argument of one or more files.
    Option addFiles(const std::string& name, std::vector<std::filesystem::path>& files,
                    const std::string& help);

    /// Sets the end of the help, with its own line breaks.
    void footer(const std::string& text);

    /// Returns the option with this name ("--output"), which must have been declared.
    Option option(const std::string& name) const;
    bool knows(const std::string& name) const;
    bool given(const std::string& name) const;
    /// Returns an option's text, the last one if it is repeated; "" if it is not given.
    std::string value(const std::string& name) const;
    /// Returns the given options in declaration order.
    std::vector<Option> given() const;

  private:
    Option described(CLI::Option& option, const std::string& help) const;
    bool isFile(const std::string& name) const;

    CLI::App* app_;
    Descriptions* descriptions_;
};

/// Adds an option whose text `parse` converts to `target`'s type; otherwise like addText().
template <class T, class Parse>
Option addValue(VerbOptions& verb, const std::string& name, const std::string& value_name,
                T& target, Parse parse, const std::string& help) {
    return verb.addText(
        name, value_name, [&target, parse](const std::string& text) { target = parse(text); },
        help);
}

/// Adds an option for a file or folder; `target` may be std::optional.
template <class T>
Option addFile(VerbOptions& verb, const std::string& name, const std::string& value_name, T& target,
               const std::string& help) {
    return addValue(
               verb, name, value_name, target,
               [](const std::string& text) { return std::filesystem::path(text); }, help)
        .files("");
}

/// Adds an option with a table of names; the help lists them, the first as the default. `kind` is
/// the noun in the error for an unknown name.
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

/// A verb's help besides its options.
struct VerbHelp {
    std::string summary;
    std::string purpose = "Verbs";  ///< heading above the verb in the program's help
    std::string examples{};         ///< one command per line
    std::string common{};           ///< options of the short help: "output size"; empty = all
};

/// The request made by the arguments.
enum class Asked { kVerb, kHelp, kVersion, kNothing };

/// The parser of the program's arguments: a verb and its options.
class ArgumentParser {
  public:
    /// Constructs a parser for a verb's arguments that do not come from a command line: without
    /// --version, and without the limit to one verb, so that the verb's name among its own
    /// arguments is skipped.
    ArgumentParser();
    /// Constructs the command line's parser. `help` begins and `footer` ends the program's help.
    ArgumentParser(const VerbHelp& help, const std::string& footer);
    ~ArgumentParser();
    ArgumentParser(const ArgumentParser&) = delete;
    ArgumentParser& operator=(const ArgumentParser&) = delete;

    /// Adds a verb with --help as its only option so far.
    VerbOptions addVerb(const std::string& name, VerbHelp help);

    /// Sets the targets of the given options. Must be called once. Throws Error (kUsage) if a name
    /// is unknown (with the nearest name) or a required option is missing. Passes on exceptions
    /// from callbacks.
    Asked parse(const std::vector<std::string>& given);

    /// Returns the verb among the parsed arguments; "" if there is none.
    std::string verb() const;
    /// Returns the help of that verb, else of the program. A verb's has its common options, and
    /// all of them if the arguments are "--help all".
    std::string help() const;
    /// Returns the description of the program and all its verbs.
    CommandDescription describe() const;

  private:
    CommandDescription describe(const CLI::App& app) const;

    std::unique_ptr<CLI::App> app_;
    std::map<std::string, VerbHelp> helps_;  ///< by verb; "" is the program
    bool help_of_all_ = false;
    VerbOptions::Descriptions descriptions_;
};

}  // namespace peeler::cmd
