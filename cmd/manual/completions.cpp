// SPDX-License-Identifier: Apache-2.0
#include "cmd/manual/completions.h"

#include <algorithm>
#include <map>
#include <ranges>
#include <sstream>

#include "cmd/manual/manual_page.h"

namespace peeler::cmd {

namespace {

/// The first line of every completion file.
constexpr const char* kHead = "# Generated from the options of peeler, like peeler --help.\n";

constexpr const char* kBashBegin = R"(
_peeler() {
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} verb=${COMP_WORDS[1]}
    local words= files= list= ending
    COMPREPLY=()
    # --option=value is three words, because COMP_WORDBREAKS has a "=".
    if [[ $word == = ]]; then
        word=
    elif [[ $before == = ]]; then
        before=${COMP_WORDS[COMP_CWORD - 2]}
    fi
    ((COMP_CWORD > 1)) || verb=
    case $verb in
)";

constexpr const char* kBashEnd = R"(    esac
    [[ $list && $word == *,* ]] && list=${word%,*}, || list=
    mapfile -t COMPREPLY < <(compgen -P "$list" -W "$words" -- "${word#"$list"}")
    [[ $files ]] || return 0
    compopt -o filenames 2> /dev/null
    for ending in $files; do
        mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -f -X "!*${ending#any}" -- "$word")
    done
    [[ $files == any ]] ||
        mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -d -- "$word")
}
complete -F _peeler peeler
)";

constexpr const char* kFishBegin = R"(
function __peeler_verb
    set -l words (commandline -opc)
    test "$words[2]" = "$argv[1]"
end
function __peeler_files
    set -l word (commandline -ct | string replace -r -- '^--[^=]*=' '')
    string match -r -- "^.*(?:/|$argv[1])\$" (complete -C "__fish_command_without_completions $word")
end
complete -c peeler -f
)";

std::string joined(const std::vector<std::string>& words, const char* between) {
    std::string text;
    for (const std::string& word : words)
        text += (text.empty() ? "" : between) + word;
    return text;
}

/// Returns `text` with a backslash before each character that is in `characters`.
std::string escaped(const std::string& text, std::string_view characters) {
    std::string out;
    for (const char c : text) {
        if (characters.find(c) != std::string_view::npos) out += '\\';
        out += c;
    }
    return out;
}

/// Returns the beginning of a help text, short enough for one line of a list.
std::string brief(const std::string& help) {
    std::size_t end = help.size();
    for (const char* mark : {"; ", ": ", " (default", ". It "})
        end = std::min(end, help.find(mark));
    return help.substr(0, help.ends_with(':') ? std::min(end, help.size() - 1) : end);
}

std::vector<std::string> namesOf(const std::vector<ChoiceDescription>& choices) {
    std::vector<std::string> names;
    for (const ChoiceDescription& choice : choices)
        names.push_back(choice.name);
    return names;
}

bool isNamed(const OptionDescription& option) {
    return !option.names.empty();
}

/// Returns bash assignments that describe how to complete an option's value.
std::string bashValue(const OptionDescription& option) {
    std::string text;
    if (const auto words = namesOf(valuesOf(option)); !words.empty())
        text += " words='" + joined(words, " ") + '\'';
    if (option.is_file)
        text += " files='" + (option.endings.empty() ? "any" : joined(option.endings, " ")) + '\'';
    return text + (option.takes_list ? " list=yes" : "");
}

std::string bashCase(const CommandDescription& command, const std::vector<std::string>& verbs) {
    std::vector<std::string> options;
    // Keys: assignments from bashValue(). Values: patterns of option names.
    std::map<std::string, std::string> names;
    std::string arguments = verbs.empty() ? "" : " words='" + joined(verbs, " ") + '\'';
    for (const OptionDescription& option : command.options) {
        options.insert(options.end(), option.names.begin(), option.names.end());
        if (!isNamed(option)) {
            arguments += bashValue(option);
        } else if (!option.value_name.empty()) {
            std::string& listed = names[bashValue(option)];
            listed += (listed.empty() ? "" : " | ") + joined(option.names, " | ");
        }
    }
    std::string text = "        case $before in\n";
    for (const auto& [value, listed] : names)
        text.append("        " + listed).append(")" + value).append(" ;;\n");
    return text + "        *) if [[ $word == -* ]]; then words='" + joined(options, " ") +
           "'; else" + (arguments.empty() ? " :" : arguments) +
           "; fi ;;\n        esac\n        ;;\n";
}

/// Returns the text in single quotes, for bash and zsh.
std::string shellQuoted(const std::string& text) {
    std::string out = "'";
    for (const char c : text)
        out += c == '\'' ? "'\\''" : std::string(1, c);
    return out + '\'';
}

/// Returns zsh's _arguments spec for an option's value or a positional argument: ":message:action".
std::string zshValue(const OptionDescription& option) {
    const std::vector<ChoiceDescription> values = valuesOf(option);
    std::vector<std::string> patterns;
    for (const std::string& ending : option.endings)
        patterns.push_back('*' + ending);
    const std::string files =
        patterns.empty() ? "_files" : "_files -g \"" + joined(patterns, " ") + '"';
    const std::string words = joined(namesOf(values), " ");
    std::string action = " ";
    if (option.is_file) {
        action = values.empty() ? files : "{compadd - " + words + "; " + files + '}';
    } else if (option.takes_list) {
        action = "_sequence compadd - " + words;
    } else if (!values.empty()) {
        action = "((";
        for (const ChoiceDescription& value : values) {
            action += ' ' + value.name;
            if (!value.summary.empty())
                action += "\\:\"" + escaped(brief(value.summary), "\\\"$`:") + '"';
        }
        action += "))";
    }
    return ':' + escaped(option.value_name, ":") + ':' + action;
}

std::string zshOption(const OptionDescription& option) {
    if (!isNamed(option)) return shellQuoted((option.repeated ? "*" : "") + zshValue(option));
    std::vector<std::string> names = option.names;
    std::string text = '[' + escaped(brief(option.help), "[]\\") + ']';
    if (!option.value_name.empty()) {
        text += zshValue(option);
        for (std::string& name : names)
            name += name.starts_with("--") ? '=' : '+';
    }
    const std::string before = option.repeated ? "*" : "";
    if (names.size() == 1) return shellQuoted(before + names.front() + text);
    // Excludes all names of the option once one of them is given. By default, zsh would still offer
    // the other names.
    const std::string once = option.repeated ? "*" : '(' + joined(option.names, " ") + ')';
    return shellQuoted(once) + '{' + joined(names, ",") + '}' + shellQuoted(text);
}

std::string zshArguments(const CommandDescription& command) {
    std::string text;
    for (const OptionDescription& option : command.options)
        text += " \\\n            " + zshOption(option);
    return text;
}

/// Returns the text in fish's single quotes, in which a backslash escapes.
std::string fishQuoted(const std::string& text) {
    return '\'' + escaped(text, "\\'") + '\'';
}

/// Returns the arguments of fish's `complete` command for an option's value.
std::string fishValue(const OptionDescription& option) {
    if (option.is_file && option.endings.empty()) return " -F";
    std::string words;
    const std::vector<ChoiceDescription> values = valuesOf(option);
    if (option.takes_list) {
        words = "(__fish_append , " + joined(namesOf(values), " ") + ") ";
    } else {
        for (const ChoiceDescription& value : values) {
            words += value.name;
            if (!value.summary.empty()) words += "\\t" + fishQuoted(brief(value.summary));
            words += ' ';
        }
    }
    if (option.is_file) {
        std::vector<std::string> patterns;
        for (const std::string& ending : option.endings)
            patterns.push_back(escaped(ending, "."));
        words += "(__peeler_files " + fishQuoted(joined(patterns, "|")) + ") ";
    }
    if (words.empty()) return "";
    words.pop_back();
    return " -a " + fishQuoted(words);
}

std::string fishLines(const CommandDescription& command, const std::string& verb) {
    std::string text;
    for (const OptionDescription& option : command.options) {
        text += "complete -c peeler -n " + fishQuoted("__peeler_verb " + verb);
        for (const std::string& name : option.names)
            text += (name.starts_with("--") ? " -l " : " -s ") +
                    name.substr(name.find_first_not_of('-'));
        if (isNamed(option)) text += " -d " + fishQuoted(brief(option.help));
        if (isNamed(option) && !option.value_name.empty())
            text += option.is_file && option.endings.empty() ? " -r" : " -x";
        text += fishValue(option) + '\n';
    }
    return text;
}

}  // namespace

std::vector<ChoiceDescription> valuesOf(const OptionDescription& option) {
    std::vector<ChoiceDescription> values;
    for (const ChoiceDescription& choice : option.choices)
        if (!choice.name.empty()) values.push_back(choice);
    std::istringstream alternatives(option.value_name);
    for (std::string word; std::getline(alternatives, word, '|');)
        if (word[0] >= 'a' && word[0] <= 'z') values.push_back({word, ""});
    return values;
}

std::string bashCompletions(const CommandDescription& program) {
    std::vector<std::string> verbs;
    std::string text = std::string(kHead) + kBashBegin;
    for (const CommandDescription& verb : program.verbs) {
        text += "    " + verb.name + ")\n" + bashCase(verb, {});
        verbs.push_back(verb.name);
    }
    return text + "    '')\n" + bashCase(program, verbs) + kBashEnd;
}

std::string zshCompletions(const CommandDescription& program) {
    std::string verbs, cases;
    for (const CommandDescription& verb : program.verbs) {
        verbs +=
            "            " + shellQuoted(verb.name + ':' + escaped(verb.summary, ":\\")) + '\n';
        cases += "        " + verb.name + ")\n            _arguments -s" + zshArguments(verb) +
                 "\n            ;;\n";
    }
    return std::string("#compdef peeler\n") + kHead +
           "\n_peeler() {\n    local context state state_descr line\n    typeset -A opt_args\n"
           "    _arguments -C" +
           zshArguments(program) +
           " \\\n            '1:verb:->verb' \\\n            '*::argument:->argument' && return\n"
           "    case $state in\n    verb)\n        local -a verbs=(\n" +
           verbs +
           "        )\n        _describe verb verbs\n        ;;\n    argument)\n        case "
           "$words[1] in\n" +
           cases + "        esac\n        ;;\n    esac\n}\n\n_peeler \"$@\"\n";
}

std::string fishCompletions(const CommandDescription& program) {
    std::string text = std::string(kHead) + kFishBegin + fishLines(program, "''");
    for (const CommandDescription& verb : program.verbs) {
        text += "complete -c peeler -n \"__peeler_verb ''\" -a " + verb.name + " -d " +
                fishQuoted(verb.summary) + '\n';
    }
    for (const CommandDescription& verb : program.verbs)
        text += fishLines(verb, verb.name);
    return text;
}

}  // namespace peeler::cmd
