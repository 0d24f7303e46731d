// SPDX-License-Identifier: Apache-2.0
// Tests the lines of a job file: the jobs parsed from them, and every kind of error.
#include "cmd/batch/batch_jobs.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include <peeler/error.h>

namespace peeler::cmd {
namespace {

using Strings = std::vector<std::string>;

TEST(BatchJobs, BecomeCommandLines) {
    const auto jobs = readJobs("jobs", R"({"verb": "render", "args": ["a.glb", "-o", "a.exr"]}

{"id": "b", "verb": "rays", "args": ["b.glb", "-o", "b.npz", "--threads", "1"], )"
                                       R"("options": {"direction": ["0,0,1", "-1,0,0"], )"
                                       R"("resolution": 32, "double": true, "quiet": false}}
)");
    ASSERT_EQ(jobs.size(), 2U);
    EXPECT_EQ(jobs[0].line, 1U);
    EXPECT_EQ(jobs[0].arguments, (Strings{"a.glb", "-o", "a.exr"}));
    EXPECT_TRUE(jobs[0].wants_json && jobs[0].wants_threads && jobs[0].wants_memory);
    EXPECT_EQ(jobs[1].line, 3U);
    EXPECT_EQ(jobs[1].id, "b");
    EXPECT_EQ(jobs[1].arguments,
              (Strings{"b.glb", "-o", "b.npz", "--threads", "1", "--direction=0,0,1",
                       "--direction=-1,0,0", "--double", "--resolution=32"}));
    EXPECT_FALSE(jobs[1].wants_threads) << "it has its own";
    EXPECT_TRUE(readJobs("jobs", "\n \r\n").empty());
}

TEST(BatchJobs, AreKnownByTheirContents) {
    const auto hash = [](const std::string& line) { return readJobs("jobs", line).at(0).hash; };
    const std::string job = hash(R"({"verb": "render", "args": ["a.glb", "-o", "a.exr"]})");
    EXPECT_EQ(hash(R"({"args":["a.glb","-o","a.exr"], "id": "x", "verb":"render"})"), job);
    EXPECT_NE(hash(R"({"verb": "render", "args": ["b.glb", "-o", "a.exr"]})"), job);
}

TEST(BatchJobs, OfOneSeriesShareItsName) {
    const auto part = [](const std::string& frames) {
        return R"({"verb": "render", "args": ["a.glb", "-o", "####.exr", "--frames", ")" + frames +
               "\"]}\n";
    };
    EXPECT_EQ(readJobs("jobs", part("1-5") + part("6-10")).size(), 2U);
    EXPECT_THROW(readJobs("jobs", part("1-5") + part("1-5")), Error);
}

TEST(BatchJobs, ThatWriteShardsKeepTheirName) {
    const auto part = [](const std::string& more) {
        return R"({"verb": "render", "args": ["a.glb", "-o", "s{chunk}-%06d.tar", "--frames", )"
               R"("1-9")" +
               more + "]}\n";
    };
    const auto jobs =
        readJobs("jobs", part(R"(, "--chunk", "1/10")") + part(R"(, "--chunk", "2/10")"));
    EXPECT_EQ(jobs.at(1).outputs, std::vector<std::filesystem::path>{"s02-%06d.tar"});
    EXPECT_THROW(readJobs("jobs", part("") + part("")), Error);
}

TEST(BatchJobs, ThatAreWrongAreNamedByTheirLine) {
    const std::string outputs = R"("args": ["a.glb", "-o", "x.exr"])";
    const struct {
        std::string line;
        std::string said;
    } cases[] = {
        {"render a.glb -o x.exr", "not JSON"},
        {"[]", "expected an object"},
        {R"({"verb": "render", "scene": "a.glb"})", "unknown key 'scene'"},
        {R"({"verb": "render", "verb": "rays"})", "duplicate key"},
        {R"({"args": []})", "a key is missing"},
        {R"({"verb": 3})", "line 3: verb"},
        {R"({"verb": "rendr"})", "unknown verb 'rendr'"},
        {R"({"verb": "batch", "args": ["-"]})", "a batch cannot run a batch"},
        {R"({"verb": "devices"})", "writes no file"},
        {R"({"verb": "render", "args": "a.glb"})", "expected an array"},
        {R"({"verb": "render", "args": [1]})", "line 3: args"},
        {R"({"verb": "render", "args": ["a\u0000.glb"]})", "null character"},
        {R"({"verb": "render", "args": ["--help"]})", "cannot print help"},
        {R"({"verb": "render", )" + outputs + R"(, "options": []})", "expected an object"},
        {R"({"verb": "render", )" + outputs + R"(, "options": {"--size": 3}})", "dashes"},
        {R"({"verb": "render", )" + outputs + R"(, "options": {"size": null}})", "options/size"},
        {R"({"verb": "render", )" + outputs + R"(, "options": {"size": [[3]]}})",
         "arrays cannot be nested"},
        {R"({"verb": "render", )" + outputs + R"(, "options": {"size": "big"}})", "--size big"},
        {R"({"verb": "render", )" + outputs + R"(, "options": {"sise": "64"}})", "'--size'"},
        {R"({"verb": "render", "args": ["a.glb"]})", "--output"},
        {R"({"verb": "extract", "args": ["a.exr"]})", "no output is given"},
        {R"({"id": "", "verb": "render", )" + outputs + "}", "the id is empty"},
        {R"({"id": "a", "verb": "render", )" + outputs + "}\n" +
             R"({"id": "a", "verb": "render", "args": ["b.glb", "-o", "y.exr"]})",
         "line 3 already has this id"},
        {R"({"verb": "render", )" + outputs + "}\n" + R"({"verb": "rays", )" + outputs + "}",
         "line 3 already writes this output"},
    };
    for (const auto& row : cases) {
        const std::string good = R"({"verb": "render", "args": ["good.glb", "-o", "good.exr"]})";
        try {
            readJobs("jobs", good + "\n\n" + row.line);
            ADD_FAILURE() << row.line;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage) << row.line;
            const bool two = row.line.find('\n') != std::string::npos;
            EXPECT_TRUE(error.where().starts_with(two ? "jobs, line 4" : "jobs, line 3"))
                << error.where();
            const std::string said = error.what() + (": " + error.where()) + '|' + error.hint();
            EXPECT_NE(said.find(row.said), std::string::npos) << said << "\nlacks " << row.said;
        }
    }
}

}  // namespace
}  // namespace peeler::cmd
