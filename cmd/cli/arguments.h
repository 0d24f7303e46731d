// SPDX-License-Identifier: Apache-2.0
// Option declaration and argument parsing, on top of CLI11. CLI11 is slow to compile, so only
// arguments.cpp includes it.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cmd/cli/errors.h"
#include "cmd/session/choices.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace peeler::cmd {

struct ChoiceDescription {
    std::string name;  ///< "" = `summary` is a heading for the choices that follow
    std::string summary;
    bool is_default = false;
};

/// An option's description for --help, the manual and shell completions.
struct OptionDescription {
    std::vector<std::string> names;  ///< "-o", "--output"; empty for positional arguments
    std::string value_name;          ///< also for positional arguments; "" for a flag
    std::string group;
    std::string help;  ///< not wrapped; without the choices
    std::vector<ChoiceDescription> choices;
    bool takes_list = false;  ///< whether the option accepts several choices, separated by commas
    bool required = false;
    bool repeated = false;
    bool is_file = false;
    std::vector<std::string> endings;  ///< accepted file extensions: ".glb"; empty = any
};

struct CommandDescription {
    std::string name, summary, examples;
    std::string footer;  ///< text at the end of the help, already wrapped
    std::vector<OptionDescription> options;
    std::vector<CommandDescription> verbs;
};

/// Returns the descriptions of a table's rows, which have a name and a summary.
template <class Rows>
std::vector<ChoiceDescription> describeChoices(const Rows& rows, bool first_is_default = false) {
    std::vector<ChoiceDescription> choices;
    for (const auto& row : rows) {
        choices.push_back(
            {std::string(row.name), std::string(row.summary), first_is_default && choices.empty()});
    }
    return choices;
}

/// Returns `text`, wrapped. The default width leaves room for the option names.
std::string wrapped(const std::string& text, std::size_t columns = 66);

/// A handle to an option of a verb. Copies refer to the same option. The ArgumentParser must
/// outlive all copies.
class Option {
  public:
    Option(CLI::Option& option, OptionDescription& description)
        : option_(&option), description_(&description) {}

    /// Sets the heading under which the help lists the option.
    Option group(const std::string& heading);
    Option required(bool is_required = true);
    /// Replaces the option's help text, but not the choices.
    Option description(const std::string& help);
    /// Sets the names that the option accepts, which the help lists.
    Option oneOf(std::vector<ChoiceDescription> choices);
    /// Sets the names that the option accepts as a comma-separated list.
    Option someOf(std::vector<ChoiceDescription> choices);
    /// Marks the option's value as a file name. `endings` are the accepted extensions, separated by
    /// spaces (".gltf .glb"); "" = any.
    Option files(const std::string& endings);

    std::string name() const;  ///< returns "--output" for "-o,--output"
    std::string group() const;

  private:
    CLI::Option* option_;
    OptionDescription* description_;
};

/// An occurrence of an option or positional argument on the command line.
struct GivenOption {
    std::string name;  ///< "--output"
    std::string text;  ///< "true" for a flag
    std::string group;
    bool is_file = false;
};

/// A handle to the options of one verb: declares the options and, after parsing, returns those
/// given on the command line. Copies refer to the same verb. The ArgumentParser must outlive all
/// copies.
///
/// A name is "-o,--output", "SCENE" for a positional argument, or "--refine,!--no-refine" for a
/// flag and its opposite. `value_name` is the value's name in the help; lower-case alternatives
/// ("NAME|INDEX|all") are literal. The help text is wrapped automatically. Targets, and everything
/// that callbacks refer to, must outlive the parse. Callbacks may throw Error (kUsage), which the
/// parse passes on. Empty texts are refused before a callback is called.
class VerbOptions {
  public:
    using Take = std::function<void(const std::string&)>;

    using Descriptions = std::map<CLI::Option*, OptionDescription, std::less<>>;

    VerbOptions(CLI::App& app, Descriptions& descriptions)
        : app_(&app), descriptions_(&descriptions) {}

    /// Adds an option. Calls `take` with the option's text, or with the last text if the option is
    /// repeated. An Error that `take` throws gets the option and its text as `where`.
    Option addText(const std::string& name, const std::string& value_name, const Take& take,
                   const std::string& help);

    /// Adds an option that may be repeated. Calls `take` with each text. An Error that `take`
    /// throws gets the option and its text as `where` unless it already has a `where`.
    Option addRepeated(const std::string& name, const std::string& value_name, const Take& take,
                       const std::string& help);

    Option addFlag(const std::string& name, bool& target, const std::string& help);

    /// Adds a required positional argument that takes one or more files.
    Option addFiles(const std::string& name, std::vector<std::filesystem::path>& files,
                    const std::string& help);

    /// Sets the text at the end of the help. Keeps the text's line breaks.
    void footer(const std::string& text);

    /// Returns the declared option with this name ("--output").
    Option option(const std::string& name) const;
    bool knows(const std::string& name) const;
    bool given(const std::string& name) const;
    /// Returns an option's text: the last if the option is repeated, "" if it is not given.
    std::string value(const std::string& name) const;
    /// Returns the given options in declaration order.
    std::vector<Option> given() const;
    /// Returns all occurrences of the given options, in the order in which the options were
    /// declared.
    std::vector<GivenOption> givenTexts() const;
    std::vector<std::string> positionals() const;
    std::string verb() const;

  private:
    Option described(CLI::Option& option, const std::string& help) const;
    bool isFile(const std::string& name) const;

    CLI::App* app_;
    Descriptions* descriptions_;
};

/// Adds an option. Converts the option's text by `parse` and stores the value in `target`.
/// Otherwise like addText().
template <class T, class Parse>
Option addValue(VerbOptions& verb, const std::string& name, const std::string& value_name,
                T& target, Parse parse, const std::string& help) {
    return verb.addText(
        name, value_name, [&target, parse](const std::string& text) { target = parse(text); },
        help);
}

/// Adds an option that takes a file or folder; `target` may be a std::optional.
template <class T>
Option addFile(VerbOptions& verb, const std::string& name, const std::string& value_name, T& target,
               const std::string& help) {
    return addValue(
               verb, name, value_name, target,
               [](const std::string& text) { return std::filesystem::path(text); }, help)
        .files("");
}

/// Adds an option with a table of names. The help lists the names; the first is the default. `kind`
/// is the noun for the names in error messages.
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

/// The parts of a verb's help text other than its options. The views must refer to literals.
struct VerbHelp {
    std::string_view summary;
    /// The heading under which the program's help lists the verb.
    std::string_view purpose = "Verbs";
    std::string_view examples{};  ///< example commands, one per line
    /// Options in the short help, separated by spaces: "output size"; empty = all.
    std::string_view common{};
};

enum class Asked { kVerb, kHelp, kVersion, kNothing };

/// A parser of the program's arguments: a verb and its options.
class ArgumentParser {
  public:
    /// Constructs a parser for a verb's arguments from a source other than the command line. The
    /// parser has no --version, and skips an extra argument that equals the verb's name.
    ArgumentParser();
    /// Constructs the parser of the command line. The program's help begins with `help` and ends
    /// with `footer`.
    ArgumentParser(const VerbHelp& help, const std::string& footer);
    ~ArgumentParser();
    ArgumentParser(const ArgumentParser&) = delete;
    ArgumentParser& operator=(const ArgumentParser&) = delete;

    /// Adds a verb with the option --help.
    VerbOptions addVerb(const std::string& name, const VerbHelp& help);

    /// Parses the arguments and sets the targets of the options given. Must be called only once.
    /// Throws Error (kUsage) if a name is unknown (with the nearest known name) or a required
    /// option is missing. Passes on exceptions from callbacks.
    Asked parse(const std::vector<std::string>& given);

    /// Returns the verb in the parsed arguments, or "" without a verb.
    std::string verb() const;
    /// Returns the help of the verb in the arguments or, without a verb, of the program. The help
    /// of a verb lists its common options, or all options if the arguments contain "--help all".
    std::string help() const;
    CommandDescription describe() const;

  private:
    CommandDescription describe(const CLI::App& app) const;

    std::unique_ptr<CLI::App> app_;
    std::map<std::string, VerbHelp> helps_;  ///< by verb name; "" = the program
    bool help_of_all_ = false;
    VerbOptions::Descriptions descriptions_;
};

}  // namespace peeler::cmd
