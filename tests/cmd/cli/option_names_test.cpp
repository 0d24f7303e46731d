// SPDX-License-Identifier: Apache-2.0
// Tests the mapping from API parameters to options, and its use in messages.
#include <gtest/gtest.h>

#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <peeler/error.h>
#include <peeler/memory_budget.h>
#include <peeler/text.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/command_line.h"
#include "cmd/cli/console.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/option_names.h"

namespace peeler::cmd {
namespace {

class AllVerbs {
  public:
    AllVerbs() {
        for (const Verb& verb : verbs()) {
            const auto at =
                options_.emplace(verb.name, parser_.addVerb(std::string(verb.name), {})).first;
            actions_.push_back(verb.declare(at->second));
        }
    }

    /// Whether `words` are "peeler VERB …" with options of that verb, or an option of any verb.
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
    /// Whether the verb has the option. If `verb` is empty, whether any verb has the option.
    bool knows(const std::string& verb, const std::string& option) const {
        for (const auto& [name, options] : options_)
            if ((verb.empty() || name == verb) && options.knows(option)) return true;
        return false;
    }

    ArgumentParser parser_;
    std::map<std::string, VerbOptions, std::less<>> options_;
    std::vector<VerbAction> actions_;  ///< the actions own the variables that options set
};

TEST(OptionNames, AreOptionsAndVerbsThatExist) {
    const AllVerbs all;
    for (int i = 0; i < static_cast<int>(Parameter::kCount); ++i) {
        const auto parameter = static_cast<Parameter>(i);
        EXPECT_TRUE(all.understand(std::string(optionOf(parameter)))) << nameOf(parameter);
    }
    for (const char* nothing : {"", "devices", "peeler", "peeler dance", "--no-such-option",
                                "peeler render --max-fragments", "--layers --no-such-option"}) {
        EXPECT_FALSE(all.understand(nothing)) << nothing;
    }
}

TEST(OptionNames, ReplaceParametersAlone) {
    EXPECT_EQ(inOptions("give a lower " + Parameter::kResolution + ", a larger " +
                        Parameter::kSpacing + " or smaller " + Parameter::kBounds),
              "give a lower --resolution, a larger --spacing or smaller --bounds");
    // A file name that looks like a parameter must stay.
    EXPECT_EQ(inOptions("`size`.glb: leave " + Parameter::kSize + " out"),
              "`size`.glb: leave --size out");
}

TEST(OptionNames, AreReportedWithErrors) {
    std::ostringstream out, err;
    Console console(out, err, false);
    const auto work = []() -> int {
        throw Error(ErrorKind::kMemory, "no " + Parameter::kSize + " fits `size`",
                    MemoryBudget(std::uint64_t{512} << 20).where(), "raise " + Parameter::kMemory);
    };
    EXPECT_EQ(runReported(console, work), 33);
    EXPECT_EQ(err.str(),
              "peeler: error: no --size fits `size`: --memory 512M\n"
              "peeler: hint: raise --memory\n");
}

}  // namespace
}  // namespace peeler::cmd
