// SPDX-License-Identifier: Apache-2.0
// .npz as numpy and zipfile read it.
#include "formats/arrays/table_writers.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler {
namespace {

/// {"name": [dtype, shape, values]} of every array; the checksums are verified on the way.
constexpr const char* kRead = R"(
import json, sys, zipfile, numpy
assert zipfile.ZipFile(sys.argv[1]).testzip() is None
a = numpy.load(sys.argv[1], allow_pickle=False)
print(json.dumps({k: [str(a[k].dtype), list(a[k].shape), a[k].flatten().tolist()] for k in a}))
)";

TEST(NpzWriter, NumpyReadsArraysThatGrewSideBySide) {
    PEELER_REQUIRE_PYTHON("numpy");
    const test::ScratchDir scratch;
    const std::string path = scratch / "a.npz";
    NpzWriter writer(path, {{"N.X", NumberType::kFloat, {3, 2}},
                            {"splits", NumberType::kInt64, {4}},
                            {"one", NumberType::kDouble, {}},
                            {"none", NumberType::kUint32, {0, 4}},
                            {"bytes", NumberType::kUint8, {2}},
                            {"half", NumberType::kHalf, {1}},
                            {"int", NumberType::kInt32, {1}}});
    const float first[] = {1, 2.5F}, second[] = {-3, 4, 5, 6};
    const std::int64_t splits[] = {0, 1, -(std::int64_t{1} << 40), 7};
    const double one = 0.1;
    const std::uint8_t bytes[] = {255, 7};
    const std::uint16_t half = 0x3C00;
    const std::int32_t number = -5;
    writer.append(0, asBytes(first));
    writer.append(1, asBytes(splits));
    writer.append(0, asBytes(second));
    writer.append(2, asBytes(std::span(&one, 1)));
    writer.append(4, asBytes(bytes));
    writer.append(5, asBytes(std::span(&half, 1)));
    writer.append(6, asBytes(std::span(&number, 1)));
    writer.finish();

    const auto read = test::runPython(kRead, {path});
    ASSERT_EQ(read.exit_code, 0) << read.err;
    EXPECT_EQ(nlohmann::json::parse(read.out), nlohmann::json::parse(R"({
        "N.X": ["float32", [3, 2], [1, 2.5, -3, 4, 5, 6]],
        "splits": ["int64", [4], [0, 1, -1099511627776, 7]],
        "one": ["float64", [], [0.1]],
        "none": ["uint32", [0, 4], []],
        "bytes": ["uint8", [2], [255, 7]],
        "half": ["float16", [1], [1.0]],
        "int": ["int32", [1], [-5]],
        "arrays_version": ["int64", [], [2]]})"));
}

TEST(NpzWriter, RefusesWhatDoesNotFitTheShapes) {
    const test::ScratchDir scratch;
    const std::string path = scratch / "a.npz";
    const float numbers[] = {1, 2};
    {
        NpzWriter writer(path, {{"a", NumberType::kFloat, {3}}});
        writer.append(0, asBytes(numbers));
        EXPECT_THROW(writer.append(0, asBytes(numbers)), Error);
        EXPECT_THROW(writer.finish(), Error);
    }
    EXPECT_THROW(NpzWriter(path, {{"a"}, {"a"}}), Error);
    EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

}  // namespace
}  // namespace peeler
