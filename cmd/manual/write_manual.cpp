// SPDX-License-Identifier: Apache-2.0
// Build tool that writes the manual pages, the shell completions and the options as JSON, for
// installation: write_manual SHARE.
#include <array>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>

#include "cmd/cli/command_line.h"
#include "cmd/manual/completions.h"
#include "cmd/manual/description.h"
#include "cmd/manual/manual_page.h"

namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, const std::string& text) {
    fs::create_directories(path.parent_path());
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw std::runtime_error("cannot write " + path.string());
}

/// Returns the date in SOURCE_DATE_EPOCH, which makes builds reproducible
/// (reproducible-builds.org/specs/source-date-epoch), or "" if it is not set.
std::string buildDate() {
    const char* const variable = std::getenv("SOURCE_DATE_EPOCH");
    if (!variable || !*variable) return "";
    const auto seconds = static_cast<std::time_t>(std::stoll(variable));
    std::tm utc{};
    std::array<char, 16> date{};
    if (!gmtime_r(&seconds, &utc)) throw std::runtime_error("SOURCE_DATE_EPOCH is not a date");
    std::strftime(date.data(), date.size(), "%Y-%m-%d", &utc);
    return date.data();
}

void writeAll(const fs::path& share) {
    using namespace peeler::cmd;
    const CommandDescription program = describeCommandLine();
    const std::string date = buildDate();
    const fs::path pages = share / "man" / "man1";
    write(pages / (pageName(program, program) + ".1"), manualPage(program, program, date));
    for (const CommandDescription& verb : program.verbs)
        write(pages / (pageName(program, verb) + ".1"), manualPage(program, verb, date));
    write(share / "bash-completion" / "completions" / "peeler", bashCompletions(program));
    write(share / "zsh" / "vendor-completions" / "_peeler", zshCompletions(program));
    write(share / "fish" / "vendor_completions.d" / "peeler.fish", fishCompletions(program));
    write(share / "peeler" / "verbs.json", describeAsJson(program));
}

}  // namespace

int main(int argc, char** argv) {
    try {
        if (argc != 2) throw std::runtime_error("usage: write_manual FOLDER");
        writeAll(argv[1]);
        return 0;
    } catch (const std::exception& error) {
        std::cerr << "write_manual: " << error.what() << '\n';
        return 1;
    }
}
