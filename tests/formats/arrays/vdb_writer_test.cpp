// SPDX-License-Identifier: Apache-2.0
// Tests written .vdb files with OpenVDB's own tools.
#include "formats/arrays/vdb_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <vector>

#include <peeler/error.h>
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

constexpr glm::ivec3 kCells{21, 18, 70};

std::uint8_t& cellAt(std::vector<std::uint8_t>& values, int x, int y, int z) {
    return values[static_cast<std::size_t>((x * kCells.y + y) * kCells.z + z)];
}

/// Returns a box of cells of value 2, plus one cell of value 1 and one of value 3. The box fills
/// some of OpenVDB's blocks completely and others partly.
std::vector<std::uint8_t> box() {
    std::vector<std::uint8_t> values(static_cast<std::size_t>(kCells.x * kCells.y * kCells.z));
    for (int x = 3; x < 20; ++x)
        for (int y = 0; y < 18; ++y)
            for (int z = 6; z < 68; ++z)
                cellAt(values, x, y, z) = 2;
    cellAt(values, 0, 0, 0) = 1;
    cellAt(values, 20, 17, 69) = 3;
    return values;
}

/// Writes the cells; cells with values of at least 2 are inside the solid.
void writeCells(const std::string& path, const std::vector<std::uint8_t>& values) {
    const auto length = static_cast<std::size_t>(kCells.z);
    static_assert(kCells.z > 64 && kCells.z < 128);
    std::vector<std::uint64_t> inside(values.size() / length * 2);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::size_t z = i % length;
        if (values[i] >= 2) inside[i / length * 2 + z / 64] |= std::uint64_t{1} << z % 64;
    }
    AtomicFile file(path);
    writeVdb(file, {kCells, {10, 20, 30}, 0.5, inside}, "test");
    file.commit();
}

TEST(VdbWriter, WhatIsInsideIsActive) {
    PEELER_REQUIRE_PYTHON("numpy");
    PEELER_REQUIRE_PYTHON("pyopenvdb");
    const ScratchDir scratch;
    writeCells(scratch / "a.vdb", box());
    const Outcome read = runPython(R"(
import sys, numpy, pyopenvdb
grids, metadata = pyopenvdb.readAll(sys.argv[1])
assert len(grids) == 1 and metadata == {'creator': 'test'}, (grids, metadata)
grid = grids[0]
assert grid.name == 'density' and grid.gridClass == 'fog volume'
dense = numpy.full((21, 18, 70), -1, numpy.float32)
grid.copyToArray(dense)
expected = numpy.zeros_like(dense)
expected[3:20, :, 6:68] = 1
expected[20, 17, 69] = 1
assert (dense == expected).all()
assert grid.activeVoxelCount() == expected.sum()
assert grid.leafCount() < 68, grid.leafCount()
assert grid.transform.indexToWorld((2, 4, 6)) == (11.25, 22.25, 33.25)
)",
                                   {scratch / "a.vdb"});
    EXPECT_EQ(read.exit_code, 0) << read.err;
}

TEST(VdbWriter, TheSameVoxelsMakeTheSameBytes) {
    const ScratchDir scratch;
    std::vector<std::uint8_t> values = box();
    writeCells(scratch / "a.vdb", values);
    writeCells(scratch / "b.vdb", values);
    cellAt(values, 20, 17, 69) = 0;
    writeCells(scratch / "c.vdb", values);
    const std::string a = bytesOf(scratch / "a.vdb"), c = bytesOf(scratch / "c.vdb");
    EXPECT_EQ(a, bytesOf(scratch / "b.vdb"));
    const std::string uuid = a.substr(21, 36);
    EXPECT_EQ(uuid.find_first_not_of("0123456789abcdef-"), std::string::npos) << uuid;
    EXPECT_EQ(uuid[8], '-');
    EXPECT_NE(uuid, c.substr(21, 36));
}

TEST(VdbWriter, NothingInside) {
    const ScratchDir scratch;
    writeCells(scratch / "a.vdb", std::vector<std::uint8_t>(box().size()));
    EXPECT_GT(bytesOf(scratch / "a.vdb").size(), 100U);
}

TEST(VdbWriter, ADiskThatIsFull) {
    const ScratchDir scratch;
    const std::string path = scratch / "a.vdb";
    const pid_t child = fork();
    if (child == 0) {
        signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{200, 200};
        setrlimit(RLIMIT_FSIZE, &limit);
        try {
            writeCells(path, box());
        } catch (const Error& e) {
            _exit(e.kind() == ErrorKind::kOutput ? 4 : 1);
        }
        _exit(0);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 4);
    EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

}  // namespace
}  // namespace peeler::test
