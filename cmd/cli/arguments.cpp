// SPDX-License-Identifier: Apache-2.0
// Wrapper around CLI11, which converts CLI11's errors.
#include "cmd/cli/arguments.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iterator>
#include <sstream>
#include <string_view>
#include <utility>

#include <peeler/error.h>
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::cmd {

namespace {

using Texts = std::vector<std::string>;

Texts namesOf(const CLI::Option& option) {
    Texts names;
    for (const std::string& name : option.get_snames())
        names.push_back("-" + name);
    for (const std::string& name : option.get_lnames())
        names.push_back("--" + name);
    return names;
}

/// A formatter of --help that lists the names of an option as "-o, --output". CLI11's formatter
/// also shows the value of a flag's opposite: "--no-refine{false}".
class HelpFormatter : public CLI::Formatter {
  public:
    std::string make_option_name(const CLI::Option* option, bool is_positional) const override {
        if (is_positional) return option->get_name(true);
        std::string text;
        for (const std::string& name : namesOf(*option))
            text += (text.empty() ? "" : ", ") + name;
        return text;
    }
};

/// Returns an option's help, line by line. Choices without a summary share one line.
std::string helpLines(const OptionDescription& option) {
    std::string text = option.help;
    const char* between = "\n";
    for (const ChoiceDescription& choice : option.choices) {
        const bool bare = choice.summary.empty();
        text += between + choice.name + (choice.is_default ? " (default)" : "") +
                (bare || choice.name.empty() ? "" : ": ") + choice.summary;
        between = bare ? ", " : "\n";
    }
    return wrapped(text);
}

void complete(OptionDescription& description, const CLI::Option& option) {
    description.names = namesOf(option);
    if (option.get_positional())
        description.value_name = option.get_name(true);
    else if (option.get_items_expected_max() > 0)
        description.value_name = option.get_option_text();
    description.group = option.get_group();
    description.required = option.get_required();
    if (description.help.empty()) description.help = option.get_description();
}

/// Throws Error (kUsage) for an empty value. Unset variables in scripts often cause empty values.
void refuseEmpty(const std::string& name, bool is_file) {
    refuse(is_file ? "the name is empty" : "the value is empty", name,
           "give one; a variable in your script may be unset");
}

/// Returns a hint if an argument begins with a dash and names an existing file, else "".
std::string dashHint(const Texts& arguments) {
    for (const std::string& argument : arguments)
        if (argument.size() > 1 && argument.starts_with('-') && isSeen(argument))
            return "if you mean a file of this name, write ./" + argument + "\n";
    return "";
}

std::string helpHint(const CLI::App& app) {
    const auto chosen = app.get_subcommands();
    return "see peeler " + (chosen.empty() ? "" : chosen.front()->get_name() + " ") + "--help";
}

/// Returns a command that makes a picture of the first argument that names a scene or an EXR file,
/// or "" if no argument does.
std::string commandFor(const Texts& arguments) {
    for (const std::string& argument : arguments) {
        const std::string extension = lowerExtension(argument);
        if (extension.empty()) continue;
        const std::string picture =
            std::filesystem::path(argument).filename().replace_extension(".png").string();
        const char* const verb =
            (sceneExtensions() + ' ').find(extension + ' ') != std::string::npos ? "render"
            : extension == ".exr"                                                ? "flatten"
                                                                                 : nullptr;
        if (!verb) continue;
        std::string command = "peeler ";
        return command.append(verb).append(" ").append(argument).append(" -o ").append(picture);
    }
    return "";
}

/// Throws Error (kUsage) if a verb's output is given more than once. If other options are repeated,
/// the last text counts, so that scripts can append to a command.
void refuseOutputs(const CLI::App& verb) {
    const CLI::Option* const option = verb.get_option_no_throw("--output");
    if (!option || option->count() < 2) return;
    const Texts given = option->results();
    refuse("a run has one output", "--output " + given.front() + ", --output " + given[1],
           "leave one of them out, or run peeler once for each");
}

/// Returns an error, with the nearest known name, for the first argument that CLI11 did not
/// recognise.
Error unplaced(const CLI::App& app, std::string hint) {
    const auto chosen = app.get_subcommands();
    const CLI::App& verb = chosen.empty() ? app : *chosen.front();
    const auto rest = verb.remaining();
    const std::string argument = rest.empty() ? std::string() : rest.front();
    const bool is_option = argument.starts_with('-');

    Texts names;
    if (is_option) {
        for (const CLI::Option* option : verb.get_options()) {
            for (const auto& name : option->get_lnames())
                names.push_back("--" + name);
        }
    } else if (chosen.empty()) {
        for (const CLI::App* known : app.get_subcommands({}))
            names.push_back(known->get_name());
    }
    const std::vector<std::string_view> views(names.begin(), names.end());
    const std::string_view nearest = nearestName(argument.substr(0, argument.find('=')), views);
    const std::string command = chosen.empty() ? commandFor(rest) : "";
    if (!command.empty()) {
        return Error(ErrorKind::kUsage, "no verb given", argument,
                     command + " makes a picture\nsee peeler --help");
    }
    if (hint.empty() && !nearest.empty()) hint = "did you mean '" + std::string(nearest) + "'?\n";
    hint += helpHint(app);
    const char* what = is_option        ? "unknown option"
                       : chosen.empty() ? "unknown verb"
                                        : "unexpected argument";
    return Error(ErrorKind::kUsage, what, argument, hint);
}

/// Returns the first argument that gives a flag a value other than true or false, or "" if there is
/// none.
std::string flagWithValue(const CLI::App& app, const Texts& arguments) {
    const auto chosen = app.get_subcommands();
    const CLI::App& verb = chosen.empty() ? app : *chosen.front();
    for (const std::string& argument : arguments) {
        const std::size_t equals = argument.find('=');
        if (equals == std::string::npos) continue;
        const CLI::Option* const option = verb.get_option_no_throw(argument.substr(0, equals));
        const std::string value = argument.substr(equals + 1);
        if (option && option->get_items_expected_max() == 0 && value != "true" && value != "false")
            return argument;
    }
    return "";
}

/// Removes the "all" that follows --help. Returns whether it was present.
bool takeAll(Texts& arguments) {
    for (std::size_t i = 0; i + 1 < arguments.size(); ++i) {
        if (arguments[i] != "--help" && arguments[i] != "-h") continue;
        if (arguments[i + 1] != "all") continue;
        arguments.erase(arguments.begin() + static_cast<std::ptrdiff_t>(i) + 1);
        return true;
    }
    return false;
}

/// Hides all options in a verb's help except those in `common`.
void showOnly(CLI::App& verb, std::string_view common) {
    std::istringstream words{std::string(common)};
    const Texts names(std::istream_iterator<std::string>(words), {});
    std::size_t count = 0;
    for (CLI::Option* option : verb.get_options()) {
        if (option->get_positional()) continue;
        ++count;
        const Texts& known = option->get_lnames();
        const bool shown = std::ranges::any_of(names, [&](const std::string& name) {
            return std::ranges::find(known, name) != known.end();
        });
        option->group(shown ? "Options" : "");
    }
    verb.footer("`peeler " + verb.get_name() + " --help all` shows all " + std::to_string(count) +
                " options.");
}

}  // namespace

std::string wrapped(const std::string& text, std::size_t columns) {
    std::string out;
    std::size_t column = 0;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find_first_of(" \n", at), text.size());
        const std::size_t word = end - at;
        if (column > 0 && column + 1 + word > columns) {
            out += '\n';
            column = 0;
        } else if (column > 0) {
            out += ' ';
            ++column;
        }
        out.append(text, at, word);
        column += word;
        if (end < text.size() && text[end] == '\n') {
            out += '\n';
            column = 0;
        }
        at = end + 1;
    }
    return out;
}

Option Option::group(const std::string& heading) {
    option_->group(heading);
    return *this;
}

Option Option::required(bool is_required) {
    option_->required(is_required);
    return *this;
}

Option Option::description(const std::string& help) {
    description_->help = help;
    return *this;
}

Option Option::oneOf(std::vector<ChoiceDescription> choices) {
    description_->choices = std::move(choices);
    return *this;
}

Option Option::someOf(std::vector<ChoiceDescription> choices) {
    description_->takes_list = true;
    return oneOf(std::move(choices));
}

Option Option::files(const std::string& endings) {
    description_->is_file = true;
    std::istringstream words(endings);
    description_->endings = Texts(std::istream_iterator<std::string>(words), {});
    return *this;
}

std::string Option::name() const {
    return option_->get_name();
}

std::string Option::group() const {
    return option_->get_group();
}

Option VerbOptions::described(CLI::Option& option, const std::string& help) const {
    return Option(option, (*descriptions_)[&option]).description(help);
}

Option VerbOptions::addText(const std::string& name, const std::string& value_name,
                            const Take& take, const std::string& help) {
    // "--output" for "-o,--output", for messages.
    const std::size_t long_name = name.find("--");
    const std::string shown = long_name == std::string::npos ? name : name.substr(long_name);
    const Take assign = [take, shown, verb = *this](const std::string& text) {
        if (text.empty()) refuseEmpty(shown, verb.isFile(shown));
        try {
            take(text);
        } catch (const Error& error) {
            throw error.at(shown + " " + text);
        }
    };
    return described(*app_->add_option_function<std::string>(name, assign)
                          // " " because CLI11 replaces "" by its own text
                          ->option_text(value_name.empty() ? " " : value_name)
                          ->take_last(),
                     help);
}

Option VerbOptions::addRepeated(const std::string& name, const std::string& value_name,
                                const Take& take, const std::string& help) {
    const std::function<void(const Texts&)> assign = [take, name,
                                                      verb = *this](const Texts& texts) {
        for (const std::string& text : texts) {
            if (text.empty()) refuseEmpty(name, verb.isFile(name));
            try {
                take(text);
            } catch (const Error& error) {
                throw error.at(error.where().empty() ? Text(name) + " " + text : error.whereText());
            }
        }
    };
    CLI::Option* const option = app_->add_option_function<Texts>(name, assign)
                                    ->option_text(value_name)
                                    ->expected(1)
                                    ->take_all();
    (*descriptions_)[option].repeated = true;
    return described(*option, help);
}

Option VerbOptions::addFlag(const std::string& name, bool& target, const std::string& help) {
    return described(*app_->add_flag(name, target), help);
}

Option VerbOptions::addFiles(const std::string& name, std::vector<std::filesystem::path>& files,
                             const std::string& help) {
    const std::function<void(const Texts&)> assign = [&files, name](const Texts& texts) {
        if (std::ranges::count(texts, "") > 0) refuseEmpty(name, true);
        files.assign(texts.begin(), texts.end());
    };
    CLI::Option* const option =
        app_->add_option_function<Texts>(name, assign)->option_text(" ")->required();
    (*descriptions_)[option].repeated = true;
    return described(*option, help).files("");
}

void VerbOptions::footer(const std::string& text) {
    app_->footer(text);
}

Option VerbOptions::option(const std::string& name) const {
    CLI::Option* const option = app_->get_option(name);
    return Option(*option, (*descriptions_)[option]);
}

bool VerbOptions::isFile(const std::string& name) const {
    return (*descriptions_)[app_->get_option(name)].is_file;
}

bool VerbOptions::knows(const std::string& name) const {
    return app_->get_option_no_throw(name) != nullptr;
}

bool VerbOptions::given(const std::string& name) const {
    const CLI::Option* found = app_->get_option_no_throw(name);
    return found && found->count() > 0;
}

std::string VerbOptions::value(const std::string& name) const {
    return given(name) ? app_->get_option(name)->results().back() : "";
}

std::vector<Option> VerbOptions::given() const {
    std::vector<Option> options;
    for (CLI::Option* option : app_->get_options()) {
        if (option->count() > 0) options.emplace_back(*option, (*descriptions_)[option]);
    }
    return options;
}

std::vector<GivenOption> VerbOptions::givenTexts() const {
    std::vector<GivenOption> given;
    for (CLI::Option* const option : app_->get_options()) {
        if (option->get_positional()) continue;
        for (const std::string& text : option->results())
            given.push_back(
                {option->get_name(), text, option->get_group(), (*descriptions_)[option].is_file});
    }
    return given;
}

std::vector<std::string> VerbOptions::positionals() const {
    std::vector<std::string> texts;
    for (const CLI::Option* const option : app_->get_options())
        if (option->get_positional())
            std::ranges::copy(option->results(), std::back_inserter(texts));
    return texts;
}

std::string VerbOptions::verb() const {
    return app_->get_name();
}

ArgumentParser::ArgumentParser() : app_(std::make_unique<CLI::App>()) {}

ArgumentParser::ArgumentParser(const VerbHelp& help, const std::string& footer)
    : app_(std::make_unique<CLI::App>(std::string(help.summary), "peeler")) {
    helps_[""] = help;
    app_->set_version_flag("-V,--version", "", "print the version and exit");
    app_->set_help_flag("-h,--help", "print help and exit; --help all shows every option");
    app_->formatter(std::make_shared<HelpFormatter>());
    app_->get_formatter()->column_width(30);
    app_->get_formatter()->label("SUBCOMMAND", "VERB");
    app_->require_subcommand(0, 1);
    app_->footer(footer);
}

ArgumentParser::~ArgumentParser() = default;

VerbOptions ArgumentParser::addVerb(const std::string& name, const VerbHelp& help) {
    CLI::App* verb = app_->add_subcommand(name, std::string(help.summary));
    verb->group(std::string(help.purpose));
    verb->footer("");  // without this, CLI11 prints the program's footer for the verb
    helps_[name] = help;
    return {*verb, descriptions_};
}

Asked ArgumentParser::parse(const std::vector<std::string>& given) {
    Texts arguments = given;
    help_of_all_ = takeAll(arguments);
    // CLI11 would take the next argument as the value of "--report=".
    for (const std::string& argument : arguments)
        if (argument.starts_with("--") && argument.find('=') == argument.size() - 1)
            refuseEmpty(argument.substr(0, argument.size() - 1), false);
    try {
        app_->parse(Texts(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::CallForHelp&) {
        return Asked::kHelp;
    } catch (const CLI::CallForVersion&) {
        return Asked::kVersion;
    } catch (const CLI::ExtrasError&) {
        throw unplaced(*app_, dashHint(arguments));
    } catch (const CLI::ArgumentMismatch&) {
        throw Error(ErrorKind::kUsage, "the option needs a value", arguments.back(),
                    helpHint(*app_));
    } catch (const CLI::ConversionError&) {
        throw Error(ErrorKind::kUsage, "the option takes no value", flagWithValue(*app_, arguments),
                    helpHint(*app_));
    } catch (const CLI::ParseError& error) {
        const std::string_view examples = helps_[verb()].examples;
        const std::string example(examples.substr(0, examples.find('\n')));
        const bool misses = error.get_name() == "RequiredError" && !example.empty();
        throw Error(ErrorKind::kUsage, error.what(), "",
                    dashHint(arguments) + (misses ? "for example: " + example + '\n' : "") +
                        helpHint(*app_));
    }
    if (!verb().empty()) refuseOutputs(*app_->get_subcommand(verb()));
    return verb().empty() ? Asked::kNothing : Asked::kVerb;
}

std::string ArgumentParser::verb() const {
    const auto chosen = app_->get_subcommands();
    return chosen.empty() ? "" : chosen.front()->get_name();
}

std::string ArgumentParser::help() const {
    for (const auto& [option, description] : descriptions_)
        option->description(helpLines(description));
    const auto found = helps_.find(verb());
    if (found == helps_.end()) return app_->help();
    const bool is_short = !help_of_all_ && !found->second.common.empty();
    if (is_short) showOnly(*app_->get_subcommand(verb()), found->second.common);
    std::string text = app_->help();
    if (found->second.examples.empty()) return text;
    std::istringstream examples{std::string(found->second.examples)};
    std::string shown = "\nExamples:\n", line;
    for (int i = 0; (i < 2 || !is_short) && std::getline(examples, line); ++i)
        shown += "  " + line + '\n';
    return text.insert(text.find('\n') + 1, shown + '\n');
}

CommandDescription ArgumentParser::describe() const {
    return describe(*app_);
}

CommandDescription ArgumentParser::describe(const CLI::App& app) const {
    const auto help = helps_.find(&app == app_.get() ? "" : app.get_name());
    CommandDescription command{app.get_name(),
                               app.get_description(),
                               std::string(help == helps_.end() ? "" : help->second.examples),
                               app.get_footer(),
                               {},
                               {}};
    for (const CLI::Option* option : app.get_options()) {
        const auto known = descriptions_.find(option);
        command.options.push_back(known == descriptions_.end() ? OptionDescription()
                                                               : known->second);
        complete(command.options.back(), *option);
    }
    for (const CLI::App* verb : app.get_subcommands({}))
        command.verbs.push_back(describe(*verb));
    return command;
}

}  // namespace peeler::cmd
