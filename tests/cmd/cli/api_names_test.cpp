// SPDX-License-Identifier: Apache-2.0
// What the API's names are on the command line, and that messages say that.
#include <gtest/gtest.h>

#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <peeler/error.h>
#include <peeler/memory_budget.h>
#include "cmd/cli/api_names.h"
#include "cmd/cli/arguments.h"
#include "cmd/cli/command_line.h"
#include "cmd/cli/console.h"
#include "cmd/cli/errors.h"

namespace peeler::cmd {
namespace {

/// Every verb with its options.
class AllVerbs {
  public:
    AllVerbs() {
        for (const Verb& verb : verbs()) {
            const auto at =
                options_.emplace(verb.name, parser_.addVerb(std::string(verb.name), "")).first;
            actions_.push_back(verb.declare(at->second));
        }
    }

    /// Whether `words` are "peeler VERB …" or "--option …", and there are such a verb, which has
    /// all of these options, and such an option.
    bool understand(const std::string& words) const {
        std::istringstream stream(words);
        std::string verb, word;
        if (words.starts_with("peeler ")) stream >> word >> verb;
        if (!verb.empty() && !options_.contains(verb)) return false;
        bool names_something = !verb.empty();
        while (stream >> word) {
            if (!word.starts_with('-')) continue;
            if (!knows(verb, word)) return false;
            names_something = true;
        }
        return names_something;
    }

  private:
    /// Of one verb, or of any.
    bool knows(const std::string& verb, const std::string& option) const {
        for (const auto& [name, options] : options_)
            if ((verb.empty() || name == verb) && options.knows(option)) return true;
        return false;
    }

    ArgumentParser parser_;
    std::map<std::string, VerbOptions, std::less<>> options_;
    std::vector<VerbAction> actions_;  ///< own what the options refer to
};

TEST(ApiNames, StandForOptionsAndVerbsThatExist) {
    const AllVerbs all;
    for (const ApiName& row : apiNames())
        EXPECT_TRUE(all.understand(std::string(row.command_line))) << row.name;
    for (const char* nothing : {"", "devices", "peeler", "peeler dance", "--no-such-option",
                                "peeler render --max-fragments", "--layers --no-such-option"}) {
        EXPECT_FALSE(all.understand(nothing)) << nothing;
    }
}

TEST(ApiNames, AreSaidInOptions) {
    for (const ApiName& row : apiNames()) {
        const std::string name(row.name), said(row.command_line);
        EXPECT_EQ(inOptions("`" + name + "`"), said);
        EXPECT_EQ(inOptions("a `" + name + "` b ``" + name + "`."),
                  "a " + said + " b `" + said + ".");
        EXPECT_EQ(inOptions(name), name);
    }
    EXPECT_EQ(inOptions("give a lower `resolution`, a larger `spacing` or smaller `bounds`"),
              "give a lower --resolution, a larger --spacing or smaller --bounds");
}

TEST(ApiNames, LeaveOtherBackquotesAsTheyAre) {
    for (const char* text : {"", "`", "``", "a", "`a", "a`", "`a`", "`a`b`", "`memory", "memory`",
                             "`Memory`", "` memory`", "`memory 1G`"}) {
        EXPECT_EQ(inOptions(text), text);
    }
    EXPECT_EQ(inOptions("`a`memory`"), "`a--memory");
}

TEST(ApiNames, AreSaidInOptionsWhereErrorsAreReported) {
    std::ostringstream out, err;
    Console console(out, err, false);
    const auto work = []() -> int {
        throw Error(ErrorKind::kMemory, "no `size` fits",
                    MemoryBudget(std::uint64_t{512} << 20).where(), "raise `memory`");
    };
    EXPECT_EQ(runReported(console, work), 33);
    EXPECT_EQ(err.str(),
              "peeler: error: no --size fits: --memory 512M\npeeler: hint: raise --memory\n");
}

}  // namespace
}  // namespace peeler::cmd
