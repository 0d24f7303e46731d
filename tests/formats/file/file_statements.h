// SPDX-License-Identifier: Apache-2.0
// Tests of the tables in formats/README.md, "Supported content". Each item of a table names a kind
// of content and the result of reading it: read, warned or refused.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "formats/gltf/gltf_builder.h"
#include "support/test_support.h"

namespace peeler::test {

/// A test case: the smallest file with one kind of content, and the expected result.
struct Statement {
    std::string says;     ///< the content: an item of a list in formats/README.md
    std::string becomes;  ///< the result: "read", "warned" or "refused"
    std::string name;
    std::string bytes;
    std::map<std::string, std::string> beside{};  ///< other files in the same folder, by name
};

/// Reads a file and returns its warnings. Throws Error (kInput) if the file is rejected.
using ReadStatement =
    std::function<std::vector<Text>(const std::filesystem::path& file, bool strict)>;

/// Returns a map from Statement::says to Statement::becomes: the text and the result of each list
/// item below "### FORMAT" in formats/README.md. The line "Read:", "Warned:" or "Refused:" before a
/// list states the result of its items.
inline std::map<std::string, std::string> statementItems(const std::string& format) {
    const std::map<std::string, std::string> outcomes = {
        {"Read:", "read"}, {"Warned:", "warned"}, {"Refused:", "refused"}};
    std::istringstream text(bytesOf(sourceDir() / "formats/README.md"));
    std::vector<std::pair<std::string, std::string>> items;
    std::string outcome;
    bool inside = false;
    for (std::string line; std::getline(text, line);) {
        if (line.starts_with('#')) inside = line == "### " + format;
        if (!inside) continue;
        if (const auto found = outcomes.find(line); found != outcomes.end())
            outcome = found->second;
        else if (line.starts_with("- "))
            items.emplace_back(line.substr(2), outcome);
        else if (line.starts_with("  ") && !items.empty())
            items.back().first += line.substr(1);
    }
    return {items.begin(), items.end()};
}

/// Returns the result for a file: "read", "warned" or "refused". Expects an error with --strict if
/// the result is not "read".
inline std::string outcomeOf(const std::filesystem::path& file, const ReadStatement& read) {
    std::string outcome;
    try {
        outcome = read(file, false).empty() ? "read" : "warned";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
        outcome = "refused";
    }
    bool refused = false;
    try {
        EXPECT_TRUE(read(file, true).empty());
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
        refused = true;
    }
    EXPECT_EQ(refused, outcome != "read") << "strict";
    return outcome;
}

/// Expects every case to have its result, and every list item in the README to have a case.
inline void expectStatements(const std::string& format, const std::vector<Statement>& statements,
                             const ReadStatement& read) {
    std::map<std::string, std::string> tested;
    for (const Statement& statement : statements) {
        SCOPED_TRACE(format + ", case " + std::to_string(&statement - statements.data()) + ": " +
                     statement.says);
        const ScratchDir folder;
        for (const auto& [name, bytes] : statement.beside)
            writeFile(folder / name, bytes);
        writeFile(folder / statement.name, statement.bytes);
        EXPECT_EQ(outcomeOf(folder / statement.name, read), statement.becomes);
        tested.emplace(statement.says, statement.becomes);
    }
    EXPECT_EQ(tested, statementItems(format)) << "formats/README.md, ### " << format;
}

}  // namespace peeler::test
