// SPDX-License-Identifier: Apache-2.0
// Manual pages with man(7) macros, for groff and mandoc.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <ranges>
#include <sstream>

#include "cmd/cli/errors.h"
#include "cmd/manual/manual_page.h"

namespace peeler::cmd {

namespace {

constexpr EnvironmentVariable kVariables[] = {
    {"SLURM_CPUS_PER_TASK, CUE_THREADS",
     "processors that the scheduler allows; CPU affinity and the cgroup's quota also apply"},
    {"SLURM_MEM_PER_NODE, SLURM_MEM_PER_CPU, SLURM_CPUS_ON_NODE, CUE_MEMORY",
     "memory that the scheduler allows; the cgroup's limit also applies"},
    {"CUDA_VISIBLE_DEVICES", "GPUs that may be used; the others are hidden"},
    {"LIBGL_ALWAYS_SOFTWARE, GALLIUM_DRIVER",
     "select a Mesa driver; --engine auto chooses gl if either is set"},
    {"LP_NUM_THREADS",
     "threads of Mesa's software rasteriser in addition to the calling one, unless --threads is "
     "given"},
    {"SOURCE_DATE_EPOCH",
     "date to store in files, in seconds since 1970; without it they have no date"},
    {"NO_COLOR", "if not empty, turns off colours in messages on a terminal"},
    {"TERM", "type of the terminal; dumb turns colours off"},
    {"LD_LIBRARY_PATH",
     "search path for libraries; the program that decodes Draco gets this variable and no other"},
    {"PEELER_SHADERS", "folder of shaders to use instead of the built-in ones"},
    {"PEELER_SAVE_SHADERS",
     "folder to save the shaders to as the driver gets them, for bug reports"},
    {"PEELER_CHECK_BARRIERS",
     "if not empty, aborts when a pass uses another pass's output without a barrier in between"},
};

constexpr std::string_view kSpecials = "\\-'\"`^~";
constexpr std::string_view kEscapes[] = {"\\e", "\\-", "\\(aq", "\\(dq", "\\(ga", "\\(ha", "\\(ti"};

std::string bold(std::string_view text) {
    return "\\fB" + roffText(text) + "\\fR";
}

std::string italic(std::string_view text) {
    return "\\fI" + roffText(text) + "\\fR";
}

/// Returns escaped text, wrapped. Protects dots with \&, because roff takes a dot at the start of a
/// line for a request, and adds space after a dot at the end of a line.
std::string filled(const std::string& roff) {
    std::string text;
    std::istringstream lines(wrapped(roff, 76));
    for (std::string line; std::getline(lines, line);) {
        const bool ends = std::string_view(".?!").find(line.back()) != std::string_view::npos;
        text += (line.starts_with('.') ? "\\&" : "") + line + (ends ? "\\&\n" : "\n");
    }
    return text;
}

std::string literal(const std::string& lines) {
    std::string text = ".RS 4\n.EX\n";
    std::istringstream stream(lines);
    for (std::string line; std::getline(stream, line);)
        text += roffText(line) + '\n';
    return text + ".EE\n.RE\n";
}

std::string tagged(const std::string& tag, const std::string& text) {
    return ".TP\n" + tag + '\n' + filled(roffText(text));
}

std::string valueText(const OptionDescription& option) {
    return italic(option.value_name) + (option.repeated ? "..." : "");
}

std::string optionText(const OptionDescription& option) {
    std::string tag;
    for (const std::string& name : option.names)
        tag += (tag.empty() ? "" : ", ") + bold(name);
    if (!option.value_name.empty()) tag += (tag.empty() ? "" : " ") + valueText(option);
    std::string text = tagged(tag, option.help);
    if (option.choices.empty()) return text;
    text += ".RS\n";
    std::string bare;  // choices without a summary
    for (const ChoiceDescription& choice : option.choices) {
        const std::string name = bold(choice.name) + (choice.is_default ? " (default)" : "");
        if (choice.summary.empty())
            bare += (bare.empty() ? "" : ", ") + name;
        else if (choice.name.empty())
            text += ".PP\n" + filled(roffText(choice.summary));
        else
            text += tagged(name, choice.summary);
    }
    return text + filled(bare) + ".RE\n";
}

bool isArgument(const OptionDescription& option) {
    return option.names.empty();
}

std::string synopsis(const CommandDescription& program, const CommandDescription& command) {
    std::string text = bold(program.name);
    if (&command == &program)
        return text + " [" + italic("OPTIONS") + "] " + italic("VERB") + " ...";
    text += ' ' + bold(command.name) + " [" + italic("OPTIONS") + ']';
    for (const OptionDescription& option : command.options)
        if (option.required && !isArgument(option))
            text += ' ' + bold(option.names.back()) + ' ' + valueText(option);
    for (const OptionDescription& option : command.options)
        if (isArgument(option)) text += ' ' + valueText(option);
    return text;
}

/// Returns the options as sections with the headings and order of --help.
std::string optionSections(const CommandDescription& command) {
    std::string arguments, text;
    std::vector<std::string> groups;
    for (const OptionDescription& option : command.options) {
        if (isArgument(option))
            arguments += optionText(option);
        else if (std::ranges::find(groups, option.group) == groups.end())
            groups.push_back(option.group);
    }
    for (const std::string& group : groups) {
        text += text.empty() ? ".SH OPTIONS\n" : ".SS " + roffText(group) + '\n';
        for (const OptionDescription& option : command.options)
            if (!isArgument(option) && option.group == group) text += optionText(option);
    }
    return (arguments.empty() ? "" : ".SH ARGUMENTS\n" + arguments) + text;
}

/// Returns the text at the end of the help as roff. The text consists of paragraphs and indented
/// lines. An indented line with a gap of two spaces is a term and its meaning; indented lines after
/// it continue the meaning. Other indented lines are kept verbatim.
std::string notes(const std::string& footer) {
    std::string text, paragraph, row, meaning, fixed;
    const auto flush = [&] {
        if (!row.empty()) text += tagged(bold(row), meaning);
        if (!fixed.empty()) text += ".PP\n" + literal(fixed);
        if (!paragraph.empty()) text += ".PP\n" + filled(roffText(paragraph));
        for (std::string* part : {&paragraph, &row, &meaning, &fixed})
            part->clear();
    };
    std::istringstream lines(footer);
    for (std::string line; std::getline(lines, line);) {
        const std::size_t first = line.find_first_not_of(' ');
        const std::size_t gap = line.find("  ", std::min(first, line.size()));
        if (first == std::string::npos || first == 0) {
            if (line.empty() || paragraph.empty()) flush();
            paragraph += line + ' ';
        } else if (gap != std::string::npos) {
            flush();
            row = line.substr(first, gap - first);
            meaning = line.substr(line.find_first_not_of(' ', gap));
        } else if (!row.empty()) {
            meaning += line.substr(first - 1);
        } else {
            if (fixed.empty()) flush();
            fixed += line.substr(2) + '\n';
        }
    }
    flush();
    return text;
}

std::string examplesOf(const CommandDescription& program, const CommandDescription& command) {
    if (&command != &program) return command.examples;
    std::string text = command.examples + '\n';
    for (const CommandDescription& verb : program.verbs)
        text += verb.examples.substr(0, verb.examples.find('\n')) + '\n';
    return text;
}

std::string seeAlso(const CommandDescription& program, const CommandDescription& command) {
    std::vector<const CommandDescription*> others;
    if (&command != &program) others.push_back(&program);
    for (const CommandDescription& verb : program.verbs)
        if (&verb != &command) others.push_back(&verb);
    std::string text;
    for (const CommandDescription* other : others)
        text += ".BR " + roffText(pageName(program, *other)) +
                (other == others.back() ? " (1)\n" : " (1),\n");
    return text;
}

}  // namespace

std::span<const EnvironmentVariable> environmentVariables() {
    return kVariables;
}

std::string roffText(std::string_view text) {
    std::string roff = text.starts_with('.') ? "\\&" : "";
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        if (const std::size_t special = kSpecials.find(text[i]);
            special != std::string_view::npos) {
            roff += kEscapes[special];
        } else if (byte < 0x80) {
            roff += text[i];
        } else {
            // Decodes UTF-8: a non-ASCII character becomes \[u....].
            const int more = byte >= 0xF0 ? 3 : byte >= 0xE0 ? 2 : 1;
            std::uint32_t code = byte & (0x3FU >> more);
            for (int k = 0; k < more && i + 1 < text.size(); ++k)
                code = code << 6U | (static_cast<unsigned char>(text[++i]) & 0x3FU);
            std::array<char, 16> name{};
            std::snprintf(name.data(), name.size(), "\\[u%04X]", code);
            roff += name.data();
        }
    }
    return roff;
}

std::string pageName(const CommandDescription& program, const CommandDescription& command) {
    return &command == &program ? program.name : program.name + '-' + command.name;
}

std::string manualPage(const CommandDescription& program, const CommandDescription& command,
                       const std::string& date) {
    const bool whole = &command == &program;
    const std::string name = pageName(program, command);
    std::string title = name, summary = command.summary;
    for (char& c : title)
        if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
    if (summary.ends_with('.')) summary.pop_back();
    std::string page =
        ".\\\" Generated from the options of peeler, like peeler --help.\n.TH " + roffText(title) +
        " 1 \"" + date + "\" \"peeler " PEELER_VERSION "\" \"peeler\"\n.nh\n.ad l\n.SH NAME\n" +
        filled(roffText(name) + " \\- " + roffText(summary)) + ".SH SYNOPSIS\n" +
        filled(synopsis(program, command)) + ".SH DESCRIPTION\n" + filled(roffText(summary + '.'));
    if (!whole) page += notes(command.footer);
    page += optionSections(command);
    if (whole) {
        page += ".SH VERBS\n";
        for (const CommandDescription& verb : program.verbs)
            page += tagged(bold(verb.name), verb.summary);
    }
    page += ".SH EXAMPLES\n" + literal(examplesOf(program, command)) + ".SH EXIT STATUS\n";
    for (const ExitCode& row : exitCodes())
        page += tagged(bold(row.code), std::string(row.meaning));
    if (whole) {
        page += ".SH ENVIRONMENT\n";
        for (const EnvironmentVariable& row : environmentVariables())
            page += tagged(bold(row.names), std::string(row.meaning));
    }
    return page + ".SH SEE ALSO\n" + seeAlso(program, command);
}

}  // namespace peeler::cmd
