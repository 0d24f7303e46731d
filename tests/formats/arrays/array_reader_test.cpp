// SPDX-License-Identifier: Apache-2.0
// Tests NumPy arrays of every type, and invalid files.
#include "formats/arrays/array_reader.h"

#include <gtest/gtest.h>

#include <peeler/error.h>
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

std::span<const std::uint8_t> bytesIn(const std::string& text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

TEST(ArrayReader, EveryTypeAndOrder) {
    PEELER_REQUIRE_PYTHON("numpy");
    const ScratchDir scratch;
    const Outcome wrote = runPython(R"(
import sys, numpy
a = numpy.arange(24).reshape(2, 3, 4)
for order in '<>':
    for kind in 'f8 f4 i8 i4 i2 i1 u8 u4 u2 u1'.split():
        for version in (1, 0), (2, 0), (3, 0):
            for transposed in 0, 1:
                array = (a - 12 if kind[0] != 'u' else a).astype(order + kind)
                if transposed: array = numpy.asfortranarray(array)
                name = f'{sys.argv[1]}/{ord(order)}{kind}{version[0]}{transposed}.npy'
                with open(name, 'wb') as file: numpy.lib.format.write_array(file, array, version)
numpy.save(sys.argv[1] + '/one', numpy.float64(3.5))
numpy.save(sys.argv[1] + '/line', numpy.arange(5.0))
numpy.save(sys.argv[1] + '/none', numpy.zeros((0, 3)))
numpy.save(sys.argv[1] + '/x_half', numpy.zeros(3, 'f2'))
numpy.save(sys.argv[1] + '/x_bool', numpy.zeros(3, bool))
numpy.save(sys.argv[1] + '/x_text', numpy.array(['f8']))
numpy.save(sys.argv[1] + '/x_rows', numpy.zeros(3, [('f8', 'f8')]))
numpy.save(sys.argv[1] + '/x_object', numpy.array([None]), allow_pickle=True)
)",
                                    {scratch.path()});
    ASSERT_EQ(wrote.exit_code, 0) << wrote.err;
    int arrays = 0;
    for (const std::string& file : scratch.files()) {
        const std::string text = bytesOf(scratch / file);
        const auto array = npyArray(bytesIn(text), file);
        EXPECT_EQ(array.has_value(), !file.starts_with("x_")) << file;
        if (!array || file.size() != 10) continue;
        ++arrays;
        EXPECT_EQ(array->shape, (std::vector<std::uint64_t>{2, 3, 4})) << file;
        EXPECT_EQ(array->number->type, file.substr(2, 2)) << file;
        EXPECT_EQ(array->columns, file[5] == '1') << file;
        ASSERT_EQ(array->count(), 24U) << file;
        for (int i = 0; i < 24; ++i)
            EXPECT_EQ(array->at(static_cast<std::uint64_t>(i)), file[2] == 'u' ? i : i - 12)
                << file;
    }
    EXPECT_EQ(arrays, 2 * 10 * 3 * 2);
    const std::string one = bytesOf(scratch / "one.npy"), line = bytesOf(scratch / "line.npy");
    EXPECT_TRUE(npyArray(bytesIn(one), "one")->shape.empty());
    EXPECT_EQ(npyArray(bytesIn(one), "one")->at(0), 3.5);
    EXPECT_EQ(npyArray(bytesIn(line), "line")->shape, (std::vector<std::uint64_t>{5}));
    EXPECT_EQ(npyArray(bytesIn(bytesOf(scratch / "none.npy")), "none")->count(), 0U);
    // A truncated file must give an Error or not be recognised as .npy.
    for (std::size_t size = 0; size < line.size(); ++size) {
        const std::string cut = line.substr(0, size);
        if (size < 6)
            EXPECT_FALSE(npyArray(bytesIn(cut), "cut"));
        else
            EXPECT_THROW(npyArray(bytesIn(cut), "cut"), Error) << size;
    }
}

}  // namespace
}  // namespace peeler::test
