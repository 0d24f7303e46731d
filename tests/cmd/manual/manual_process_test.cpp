// SPDX-License-Identifier: Apache-2.0
// Tests the manual with the parsers of groff and mandoc, and the completions in bash, fish and zsh.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "cmd/cli/command_line.h"
#include "cmd/manual/completions.h"
#include "cmd/manual/manual_page.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

using Words = std::vector<std::string>;

void skipWithout(const std::string& program) {
    if (runCommand({"sh", "-c", "command -v " + program}).exit_code != 0)
        GTEST_SKIP() << "no " << program << " (examples/install_dependencies.sh test)";
}

const cmd::CommandDescription& described() {
    static const cmd::CommandDescription program = cmd::describeCommandLine();
    return program;
}

void store(const fs::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}

Words sorted(Words words) {
    std::ranges::sort(words);
    return words;
}

/// Command lines, each with the completions that the shell must offer.
using Offers = std::map<std::string, Words>;

/// Returns the options of each verb; with `with_values`, also the values of options that have
/// choices.
Offers everyOffer(bool with_values) {
    Offers offers;
    for (const cmd::CommandDescription& verb : described().verbs) {
        const std::string line = "peeler " + verb.name + ' ';
        for (const cmd::OptionDescription& option : verb.options) {
            for (const std::string& name : option.names)
                if (name.starts_with("--")) offers[line + "--"].push_back(name);
            if (!with_values || option.names.empty() || option.value_name.empty()) continue;
            Words& values = offers[line + option.names.back() + ' '];
            for (const cmd::ChoiceDescription& value : cmd::valuesOf(option))
                values.push_back(value.name);
        }
        std::ranges::sort(offers[line + "--"]);
    }
    for (auto& [line, words] : offers)
        words = sorted(words);
    return offers;
}

/// Completions in the folder of makeFiles(), for every shell.
const Offers kSome = {
    {"peeler re", {"render"}},
    {"peeler render --me", {"--memory", "--method"}},
    {"peeler render --method du", {"dual", "dual-max"}},
    {"peeler render ", {"a.glb", "b.gltf", "folder"}},
    {"peeler render --json ", {"a.glb", "b.gltf", "folder"}},
    {"peeler render -o ", {"folder", "x.exr"}},
    {"peeler rays --points ", {"folder"}},
    {"peeler flatten ", {"folder", "x.exr"}},
    {"peeler batch j", {"jobs.txt"}},
    {"peeler render --environment ", {"folder", "none", "studio", "x.exr"}},
    {"peeler render --size ", {}},
};

void makeFiles(const fs::path& folder) {
    for (const char* name : {"a.glb", "b.gltf", "jobs.txt", "x.exr"})
        store(folder / name, "");
    fs::create_directory(folder / "folder");
}

/// Parses groups of lines. A line "== LINE" comes before each group if `before`, otherwise after
/// it.
Offers offersIn(const std::string& text, bool before) {
    Offers offers;
    Words words;
    std::string name;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("== ")) {
            name = line.substr(3);
            Words& offered = offers[name];
            if (!before) offered = sorted(words);
            words.clear();
            continue;
        }
        line = line.substr(0, line.find('\t'));
        if (line.ends_with('/')) line.pop_back();
        if (line.empty() || line == "ready") continue;
        words.push_back(line);
        if (before) offers[name] = sorted(words);
    }
    return offers;
}

Offers askBash(const Offers& asked, const fs::path& folder, const fs::path& script) {
    store(script, cmd::bashCompletions(described()));
    // ask() passes the words of a line to the completion, as readline does. readline also splits
    // words at "=", so lines in `asked` have spaces around it.
    std::string program = "source " + script.string() +
                          "\nask() { COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); _peeler; "
                          "printf '%s\\n' \"${COMPREPLY[@]}\"; }\n";
    for (const auto& [line, words] : asked) {
        const std::size_t last = line.rfind(' ');
        program += "echo '== " + line + "'; ask " + line.substr(0, last) + " '" +
                   line.substr(last + 1) + "'\n";
    }
    const CommandResult result = runCommand({"bash", "--norc", "-c", program}, {}, folder);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return offersIn(result.out, true);
}

Offers askFish(const Offers& asked, const fs::path& folder, const fs::path& script) {
    store(script, cmd::fishCompletions(described()));
    std::string program = "source " + script.string() + '\n';
    for (const auto& [line, words] : asked)
        program += "echo '== " + line + "'; complete -C '" + line + "'\n";
    const CommandResult result = runCommand({"fish", "--no-config", "-c", program},
                                            {"HOME=" + folder.parent_path().string()}, folder);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    Offers offers = offersIn(result.out, true);
    // fish 4 also offers matches that do not start with the word. Removes these matches.
    for (auto& [line, words] : offers) {
        const std::string word = line.substr(line.rfind(' ') + 1);
        std::erase_if(words, [&](const std::string& offer) { return !offer.starts_with(word); });
    }
    return offers;
}

Offers askZsh(const Offers& asked, const fs::path& folder, const fs::path& completions) {
    fs::create_directory(completions);
    store(completions / "_peeler", cmd::zshCompletions(described()));
    Words command{"zsh", "-f",
                  (sourceDir() / "tests" / "cmd" / "manual" / "zsh_completions.zsh").string(),
                  completions.string(), completions.string() + ".hits"};
    for (const auto& [line, words] : asked)
        command.push_back(line);
    const CommandResult result = runCommand(command, {}, folder);
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    return offersIn(result.out, false);
}

void expectOffers(Offers offered, const Offers& asked) {
    EXPECT_EQ(offered.size(), asked.size());
    for (const auto& [line, words] : asked)
        EXPECT_EQ(offered[line], words) << line;
}

struct Completing : testing::Test {
    Completing() : folder(scratch / "files") { fs::create_directory(folder); }
    ScratchDir scratch;
    fs::path folder;
};

TEST_F(Completing, ByBashIsOfEveryOptionAndValue) {
    const Offers all = everyOffer(true);
    EXPECT_GT(all.size(), 200U);
    expectOffers(askBash(all, folder, scratch / "peeler"), all);
}

TEST_F(Completing, ByBashKnowsFilesAndWords) {
    makeFiles(folder);
    Offers some = kSome;
    some["peeler render --method = du"] = {"dual", "dual-max"};
    some["peeler render --output = x"] = {"x.exr"};
    some["peeler render --channels normal,ba"] = {"normal,barycentric", "normal,base-color"};
    expectOffers(askBash(some, folder, scratch / "peeler"), some);
}

TEST_F(Completing, ByFishIsOfEveryOptionAndValue) {
    skipWithout("fish");
    if (IsSkipped()) return;
    const Offers all = everyOffer(true);
    expectOffers(askFish(all, folder, scratch / "peeler.fish"), all);
}

TEST_F(Completing, ByFishKnowsFilesAndWords) {
    skipWithout("fish");
    if (IsSkipped()) return;
    makeFiles(folder);
    Offers some = kSome;
    some["peeler render --method=du"] = {"--method=dual", "--method=dual-max"};
    some["peeler render --output=x"] = {"--output=x.exr"};
    some["peeler render --channels normal,ba"] = {"normal,barycentric", "normal,base-color"};
    expectOffers(askFish(some, folder, scratch / "peeler.fish"), some);
}

TEST_F(Completing, ByZshIsOfEveryOption) {
    skipWithout("zsh");
    if (IsSkipped()) return;
    const Offers all = everyOffer(false);
    expectOffers(askZsh(all, folder, scratch / "zsh"), all);
}

TEST_F(Completing, ByZshKnowsFilesAndWords) {
    skipWithout("zsh");
    if (IsSkipped()) return;
    makeFiles(folder);
    Offers some = kSome;
    some["peeler render --method=du"] = {"dual", "dual-max"};
    some["peeler render --output=x"] = {"x.exr"};
    some["peeler render --channels normal,ba"] = {"barycentric", "base-color"};
    expectOffers(askZsh(some, folder, scratch / "zsh"), some);
}

/// Writes each page, with a date, to a file of its own. Returns the paths.
Words storePages(const ScratchDir& scratch) {
    Words files;
    const auto add = [&](const cmd::CommandDescription& command) {
        files.push_back((scratch / (cmd::pageName(described(), command) + ".1")).string());
        store(files.back(), cmd::manualPage(described(), command, "2001-09-09"));
    };
    add(described());
    for (const cmd::CommandDescription& verb : described().verbs)
        add(verb);
    return files;
}

TEST(Manual, HasNoWarningsOfGroff) {
    skipWithout("groff");
    if (IsSkipped()) return;
    const ScratchDir scratch;
    for (const std::string& file : storePages(scratch)) {
        const CommandResult result = runCommand({"groff", "-man", "-Tutf8", "-ww", "-z", file});
        EXPECT_EQ(result.exit_code, 0) << file;
        EXPECT_EQ(result.err, "") << file;
    }
}

TEST(Manual, HasNoFindingsOfMandoc) {
    skipWithout("mandoc");
    if (IsSkipped()) return;
    const ScratchDir scratch;
    Words command{"mandoc", "-Tlint"};
    for (const std::string& file : storePages(scratch))
        command.push_back(file);
    const CommandResult result = runCommand(command);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.out + result.err, "");
}

TEST(Manual, ReadsAsTheHelpDoes) {
    skipWithout("groff");
    if (IsSkipped()) return;
    const ScratchDir scratch;
    storePages(scratch);
    const CommandResult page = runCommand({"groff", "-man", "-Tutf8", "-P-cbou", "-rLL=300n",
                                           (scratch / "peeler-extract.1").string()});
    for (const char* line :
         {"-o, --output FILE", "#### or %04d becomes the layer", "origin + z * direction",
          "peeler extract layers.exr -o layer.####.png", "128 + n", "peeler-render(1)",
          "#rrggbb[aa] or #rgb[a] in sRGB"})
        EXPECT_TRUE(contains(page.out, line)) << line << '\n' << page.out;
}

TEST(Manual, IsWrittenByTheBuild) {
    const fs::path share = peelerBinary().parent_path() / "share";
    EXPECT_EQ(bytesOf(share / "bash-completion/completions/peeler"),
              cmd::bashCompletions(described()));
    EXPECT_EQ(bytesOf(share / "zsh/vendor-completions/_peeler"), cmd::zshCompletions(described()));
    EXPECT_EQ(bytesOf(share / "fish/vendor_completions.d/peeler.fish"),
              cmd::fishCompletions(described()));
    for (const cmd::CommandDescription& verb : described().verbs) {
        const std::string page =
            bytesOf(share / "man/man1" / (cmd::pageName(described(), verb) + ".1"));
        EXPECT_TRUE(contains(page, ".SH OPTIONS")) << verb.name;
    }
}

}  // namespace
}  // namespace peeler::test
