// SPDX-License-Identifier: Apache-2.0
// Tests array files by reading them back with numpy and zipfile. Also tests headers of .safetensors
// files.
#include "formats/arrays/array_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "formats/arrays/safetensors.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler {
namespace {

/// A Python program that verifies the checksums of a file, and prints {"name": [dtype, shape,
/// values]} for every array.
constexpr const char* kRead = R"(
import json, sys, zipfile, numpy
assert zipfile.ZipFile(sys.argv[1]).testzip() is None
a = numpy.load(sys.argv[1], allow_pickle=False)
print(json.dumps({k: [str(a[k].dtype), list(a[k].shape), a[k].flatten().tolist()] for k in a}))
)";

TEST(ArrayWriter, NumpyReadsArraysThatGrewSideBySide) {
    PEELER_REQUIRE_PYTHON("numpy");
    const test::ScratchDir scratch;
    const std::string path = scratch / "a.npz";
    ArrayWriter writer(path, {{"N.X", NumberType::kFloat, {3, 2}},
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

TEST(ArrayWriter, RefusesWhatDoesNotFitTheShapes) {
    const test::ScratchDir scratch;
    const std::string path = scratch / "a.npz";
    const float numbers[] = {1, 2};
    {
        ArrayWriter writer(path, {{"a", NumberType::kFloat, {3}}});
        writer.append(0, asBytes(numbers));
        EXPECT_THROW(writer.append(0, asBytes(numbers)), Error);
        EXPECT_THROW(writer.finish(), Error);
    }
    EXPECT_THROW(ArrayWriter(path, {{"a"}, {"a"}}), Error);
    EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

TEST(ArrayWriter, PiecesComeInAnyOrderFromAnyThread) {
    const test::ScratchDir scratch;
    std::vector<std::uint32_t> numbers(10007);
    std::iota(numbers.begin(), numbers.end(), 7U);
    const auto write = [&](const std::string& name, auto&& fill) {
        ArrayWriter writer(scratch / name, {{"a", NumberType::kUint32, {numbers.size()}},
                                            {"b", NumberType::kUint32, {numbers.size()}}});
        fill(writer);
        writer.finish();
        return test::bytesOf(scratch / name);
    };
    for (const std::string_view extension : arrayExtensions()) {
        const std::string whole = write("whole" + std::string(extension), [&](ArrayWriter& writer) {
            writer.append(0, asBytes(numbers));
            writer.append(1, asBytes(numbers));
        });
        std::vector<std::size_t> ends{0, 1, 3, 4, 1000, 1001, 5000, 5013, 9999, numbers.size()};
        for (const std::uint32_t seed : {1U, 2U, 3U}) {
            std::vector<std::size_t> pieces(2 * (ends.size() - 1));
            std::iota(pieces.begin(), pieces.end(), std::size_t{0});
            std::shuffle(pieces.begin(), pieces.end(), std::mt19937(seed));
            const auto parts = write("parts" + std::string(extension), [&](ArrayWriter& writer) {
                parallelFor(pieces.size(), [&](std::size_t i) {
                    const std::size_t piece = pieces[i] / 2, begin = ends[piece];
                    const auto some = std::span(numbers).subspan(begin, ends[piece + 1] - begin);
                    writer.writeAt(pieces[i] % 2, begin * sizeof numbers[0], asBytes(some));
                });
            });
            EXPECT_TRUE(parts == whole) << "seed " << seed;
        }
    }
}

TEST(ArrayWriter, EveryNumberIsWrittenOnce) {
    const test::ScratchDir scratch;
    const std::uint32_t numbers[] = {1, 2, 3, 4};
    const auto some = [&](std::size_t first, std::size_t count) {
        return std::as_bytes(std::span(numbers).subspan(first, count));
    };
    const std::vector<NamedArray> arrays{{"a", NumberType::kUint32, {4}}};
    ArrayWriter writer(scratch / "a.npz", arrays);
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
        ArrayWriter incomplete(scratch / "b.npz", arrays);
        for (std::size_t i = 0; i < 4; ++i)
            if (i != missing) incomplete.writeAt(0, 4 * i, some(i, 1));
        EXPECT_THROW(incomplete.finish(), Error) << missing;
    }
    EXPECT_EQ(scratch.files(), std::vector<std::string>{"a.npz"});
}

/// A Python program that reads a .safetensors file with NumPy only, and prints its arrays and
/// metadata.
constexpr const char* kReadTensors = R"(
import json, sys, numpy
data = open(sys.argv[1], "rb").read()
length = int.from_bytes(data[:8], "little")
header = json.loads(data[8:8 + length])
types = {"U8": "<u1", "I32": "<i4", "U32": "<u4", "I64": "<i8", "F16": "<f2", "F32": "<f4", "F64": "<f8"}
result, end = {"texts": header.pop("__metadata__", {})}, 0
for name, entry in header.items():
    first, last = entry["data_offsets"]
    assert first == end, "a gap"
    end = last
    dtype = numpy.dtype(types[entry["dtype"]])
    assert (8 + length + first) % dtype.itemsize == 0, "not aligned"
    array = numpy.frombuffer(data[8 + length + first:8 + length + last], dtype).reshape(entry["shape"])
    result[name] = [str(array.dtype), list(array.shape), array.flatten().tolist()]
assert 8 + length + end == len(data)
print(json.dumps(result))
)";

TEST(ArrayWriter, SafetensorsAreAlignedAndHaveNoGaps) {
    PEELER_REQUIRE_PYTHON("numpy");
    const test::ScratchDir scratch;
    const std::string path = scratch / "a.safetensors";
    const std::vector<NamedArray> arrays{
        {"bytes", NumberType::kUint8, {3}},      {"half", NumberType::kHalf, {1}},
        {"z \"é\"", NumberType::kFloat, {1, 2}}, {"splits", NumberType::kInt64, {2}},
        {"none", NumberType::kUint32, {0, 4}},   {"one", NumberType::kDouble, {}}};
    const ArrayTexts texts{{"hash", "abc"}, {"empty", ""}, {"line", "a\n\"b\""}};
    ArrayWriter writer(path, arrays, texts);
    const std::uint8_t bytes[] = {1, 2, 3};
    const std::uint16_t half = 0x3C00;
    const float z[] = {1.5F, -2};
    const std::int64_t splits[] = {0, std::int64_t{1} << 40};
    const double one = 0.1;
    writer.append(0, asBytes(bytes));
    writer.append(1, asBytes(std::span(&half, 1)));
    writer.append(2, asBytes(z));
    writer.append(3, asBytes(splits));
    writer.append(5, asBytes(std::span(&one, 1)));
    writer.finish();
    EXPECT_EQ(ArrayWriter::fileBytes(path, arrays, texts), std::filesystem::file_size(path));

    const auto read = test::runPython(kReadTensors, {path});
    ASSERT_EQ(read.exit_code, 0) << read.err;
    EXPECT_EQ(nlohmann::json::parse(read.out), nlohmann::json::parse(R"({
        "texts": {"hash": "abc", "line": "a\n\"b\""},
        "splits": ["int64", [2], [0, 1099511627776]],
        "one": ["float64", [], [0.1]],
        "arrays_version": ["int64", [], [2]],
        "z \"é\"": ["float32", [1, 2], [1.5, -2]],
        "none": ["uint32", [0, 4], []],
        "half": ["float16", [1], [1.0]],
        "bytes": ["uint8", [3], [1, 2, 3]]})"));
    EXPECT_EQ(arrayText(path, "line"), texts.at("line"));
    EXPECT_EQ(arrayText(path, "empty"), "");

    const SafetensorsHeader header = readSafetensors(RegularFile(path), path);
    ASSERT_EQ(header.arrays.size(), arrays.size() + 1);
    const SafetensorsArray* const found = header.find("splits");
    ASSERT_TRUE(found && found->number);
    EXPECT_EQ(found->shape, std::vector<std::uint64_t>{2});
}

TEST(ArrayWriter, TextsOfAnNpzAreArrays) {
    const test::ScratchDir scratch;
    const std::string path = scratch / "a.npz";
    ArrayWriter writer(path, {{"a", NumberType::kUint8, {0}}}, {{"output_hash", "0123"}});
    writer.finish();
    EXPECT_EQ(arrayText(path, "output_hash"), "0123");
    EXPECT_EQ(arrayText(path, "a"), "");
    EXPECT_THROW(ArrayWriter(scratch / "a.txt", {}), Error);
    EXPECT_THROW(ArrayWriter(path, {{"x"}}, {{"x", "y"}}), Error);
}

/// Returns the bytes of a .safetensors file with this header and `data` bytes of data.
std::vector<std::uint8_t> tensors(const std::string& header, std::size_t data) {
    const std::uint64_t length = header.size();
    std::vector<std::uint8_t> file(8 + header.size() + data);
    std::memcpy(file.data(), &length, 8);
    std::memcpy(file.data() + 8, header.data(), header.size());
    return file;
}

TEST(Safetensors, HeadersThatContradictThemselvesAreRefused) {
    const auto reads = [](const std::string& header, std::size_t data) {
        try {
            readSafetensors(tensors(header, data), "a");
            return true;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput) << header;
            return false;
        }
    };
    const auto array = [](const std::string& shape, const std::string& offsets) {
        return R"("a":{"dtype":"F32","shape":)" + shape + R"(,"data_offsets":)" + offsets + "}";
    };
    EXPECT_TRUE(reads("{}", 0));
    EXPECT_TRUE(reads("{" + array("[2]", "[0,8]") + "}", 8));
    EXPECT_TRUE(reads("{" + array("[0,9]", "[0,0]") + R"(,"__metadata__":{"b":"c"}})", 0));
    EXPECT_TRUE(reads(R"({"a":{"dtype":"E8M0","shape":[3],"data_offsets":[0,3]}})", 3));
    for (const std::string& header :
         {"{" + array("[2]", "[0,8]") + "}", "{" + array("[1]", "[4,8]") + "}",
          "{" + array("[1]", "[4,0]") + "}", "{" + array("[1]", "[0,8]") + "}",
          "{" + array("[4611686018427387905]", "[0,4]") + "}", "{" + array("[-1]", "[0,4]") + "}",
          "{" + array("[1]", "[0]") + "}",
          "{" + array("[1]", "[0,4]") + R"(,"__metadata__":{"b":1}})", std::string("{\"a\":1}"),
          std::string("{"),
          "{" + array("[1]", "[0,4]").replace(1, 1, "c") + "," + array("[1]", "[0,4]") + "}"})
        EXPECT_FALSE(reads(header, 4)) << header;
    EXPECT_FALSE(reads("[]", 0));
    std::vector<std::uint8_t> longer = tensors("{}", 0);
    longer[0] = 3;
    EXPECT_THROW(readSafetensors(longer, "a"), Error);
}

}  // namespace
}  // namespace peeler
