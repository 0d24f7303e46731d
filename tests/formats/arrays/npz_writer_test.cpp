// SPDX-License-Identifier: Apache-2.0
// .npz as numpy and zipfile read it.
#include "formats/arrays/table_writers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>

#include <peeler/error.h>
#include "core/base/parallel.h"
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

TEST(NpzWriter, PiecesComeInAnyOrderFromAnyThread) {
    const test::ScratchDir scratch;
    std::vector<std::uint32_t> numbers(10007);
    std::iota(numbers.begin(), numbers.end(), 7U);
    const auto write = [&](const std::string& name, auto&& fill) {
        NpzWriter writer(scratch / name, {{"a", NumberType::kUint32, {numbers.size()}},
                                          {"b", NumberType::kUint32, {numbers.size()}}});
        fill(writer);
        writer.finish();
        return test::bytesOf(scratch / name);
    };
    const std::string whole = write("whole.npz", [&](NpzWriter& writer) {
        writer.append(0, asBytes(numbers));
        writer.append(1, asBytes(numbers));
    });
    // Odd lengths; neighbours meet on either side, and in the middle.
    std::vector<std::size_t> ends{0, 1, 3, 4, 1000, 1001, 5000, 5013, 9999, numbers.size()};
    for (const std::uint32_t seed : {1U, 2U, 3U}) {
        std::vector<std::size_t> pieces(2 * (ends.size() - 1));
        std::iota(pieces.begin(), pieces.end(), std::size_t{0});
        std::shuffle(pieces.begin(), pieces.end(), std::mt19937(seed));
        const auto parts = write("parts.npz", [&](NpzWriter& writer) {
            parallelFor(pieces.size(), [&](std::size_t i) {
                const std::size_t piece = pieces[i] / 2, begin = ends[piece];
                const auto some = std::span(numbers).subspan(begin, ends[piece + 1] - begin);
                writer.writeAt(pieces[i] % 2, begin * sizeof numbers[0], asBytes(some));
            });
        });
        EXPECT_TRUE(parts == whole) << "seed " << seed;
    }
}

TEST(NpzWriter, EveryNumberIsWrittenOnce) {
    const test::ScratchDir scratch;
    const std::uint32_t numbers[] = {1, 2, 3, 4};
    const auto some = [&](std::size_t first, std::size_t count) {
        return std::as_bytes(std::span(numbers).subspan(first, count));
    };
    const std::vector<NpzArray> arrays{{"a", NumberType::kUint32, {4}}};
    NpzWriter writer(scratch / "a.npz", arrays);
    writer.writeAt(0, 4, some(1, 2));
    EXPECT_THROW(writer.writeAt(0, 4, some(1, 1)), Error);
    EXPECT_THROW(writer.writeAt(0, 0, some(0, 2)), Error);
    EXPECT_THROW(writer.writeAt(0, 8, some(2, 2)), Error);
    EXPECT_THROW(writer.writeAt(0, 0, some(0, 4)), Error);
    EXPECT_THROW(writer.writeAt(0, 12, some(2, 2)), Error);
    EXPECT_THROW(writer.writeAt(0, 20, some(0, 1)), Error);
    writer.writeAt(0, 0, some(0, 1));
    writer.writeAt(0, 12, some(3, 1));
    writer.finish();
    for (const std::size_t missing : {0U, 1U, 3U}) {
        NpzWriter incomplete(scratch / "b.npz", arrays);
        for (std::size_t i = 0; i < 4; ++i)
            if (i != missing) incomplete.writeAt(0, 4 * i, some(i, 1));
        EXPECT_THROW(incomplete.finish(), Error) << missing;
    }
    EXPECT_EQ(scratch.files(), std::vector<std::string>{"a.npz"});
}

}  // namespace
}  // namespace peeler
