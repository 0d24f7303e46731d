// SPDX-License-Identifier: Apache-2.0
// Tests the reading of points from other programs' files, both intact and damaged.
#include "formats/arrays/point_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdio>
#include <fstream>
#include <random>

#include <peeler/error.h>
#include "formats/arrays/table_writers.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

std::span<const std::uint8_t> bytes(const std::string& text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

void expectRefused(const std::string& file, const std::string& what, const std::string& where) {
    try {
        const bool is_ply = file.starts_with("ply");
        is_ply ? plyPoints(bytes(file), "f") : npzPoints(bytes(file), "f");
        ADD_FAILURE() << "taken, but expected: " << what;
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
        EXPECT_EQ(error.where(), where);
    }
}

/// The bytes of a sequence of numbers, in either byte order.
class Packed {
  public:
    explicit Packed(bool big) : big_(big) {}
    template <class T>
    Packed& add(T value) {
        auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
        if (big_) std::ranges::reverse(raw);
        text_.append(raw.data(), raw.size());
        return *this;
    }
    std::string text_;

  private:
    bool big_;
};

std::string richHeader(const std::string& format) {
    return "ply\nformat " + format +
           " 1.0\ncomment of a stranger\nelement camera 2\nproperty float f\nproperty list uchar "
           "ushort l\nelement nothing 99999999999\nelement vertex 2\nproperty uchar red\n"
           "property double z\nproperty short x\nproperty list int8 double d\n"
           "property float32 y\nelement face 1\nproperty list uchar int vertex_indices\n"
           "end_header\n";
}

std::string richBinary(bool big) {
    Packed data(big);
    using U8 = std::uint8_t;
    using U16 = std::uint16_t;
    data.add(1.5F).add(U8{3}).add(U16{1}).add(U16{2}).add(U16{3}).add(2.5F).add(U8{0});
    data.add(U8{255}).add(-3.25).add(std::int16_t{-300}).add(U8{1}).add(7.0).add(0.5F);
    data.add(U8{0}).add(1e-3).add(std::int16_t{4}).add(U8{0}).add(-0.125F);
    data.add(U8{3}).add(0).add(1).add(0);
    return richHeader(big ? "binary_big_endian" : "binary_little_endian") + data.text_;
}

const std::vector<glm::dvec3> kRichPoints = {{-300, 0.5, -3.25}, {4, -0.125, 1e-3}};

TEST(PlyPoints, OfEveryFormat) {
    EXPECT_EQ(plyPoints(bytes(richBinary(false)), "f"), kRichPoints);
    EXPECT_EQ(plyPoints(bytes(richBinary(true)), "f"), kRichPoints);
    const std::string text = richHeader("ascii") +
                             "1.5 3 1 2 3\n2.5 0\n255 -3.25 -300 1 7 5e-1\n0 +0.001 4 0 -0.125\n"
                             "3 0 1 0\n";
    EXPECT_EQ(plyPoints(bytes(text), "f"), kRichPoints);
    std::string windows;
    for (const char c : text)
        windows += c == '\n' ? "\r\n" : std::string(1, c);
    EXPECT_EQ(plyPoints(bytes(windows), "f"), kRichPoints);
}

TEST(PlyPoints, WhatIsWrongIsSaid) {
    const std::string head = "ply\nformat ascii 1.0\nelement vertex ";
    const std::string axes = "property float x\nproperty float y\nproperty float z\n";
    const auto file = [&](const std::string& rows, const std::string& properties,
                          const std::string& data) {
        return head + rows + "\n" + properties + "end_header\n" + data;
    };
    EXPECT_EQ(plyPoints(bytes(file("1", axes, "1 2 3")), "f").size(), 1U);
    expectRefused(file("2", axes, "100 2 300\n4 5\n"), "ends before", "f, vertex 1");
    expectRefused(file("1", axes, "1 two 3"), "not \"two\"", "f, vertex 0");
    expectRefused(file("18446744073709551615", axes, "1 2 3"), "ends before", "f, vertex 0");
    expectRefused(file("18446744073709551616", axes, "1 2 3"), "number of elements", "f:3");
    expectRefused(file("-1", axes, ""), "number of elements", "f:3");
    expectRefused(file("1", "property float x\nproperty float y\n", "1 2"), "x, y and z", "f");
    expectRefused(file("1", axes + "property float x\n", "1 2 3 4"), "x, y and z", "f");
    expectRefused(file("1", axes + "property quad w\n", "1 2 3 4"), "unknown type", "f:7");
    expectRefused(file("1", axes + "property list char int l\n", "1 2 3 -1"), "length",
                  "f, vertex 0");
    expectRefused(file("1", axes + "property list char int l\n", "1 2 3 4000000000"), "ends before",
                  "f, vertex 0");
    expectRefused(file("1", axes + "what is this\n", "1 2 3"), "an unknown line", "f:7");
    expectRefused(head + "1\n" + axes, "end_header", "f:7");
    expectRefused("ply\nelement face 0\nproperty int i\nend_header\n", "format", "f:4");
    expectRefused("ply\nformat ascii 1.0\nelement face 0\nproperty int i\nend_header\n",
                  "no vertices", "f");
}

/// Expects an Error if the file is truncated to fewer than `data` bytes. Expects an Error or points
/// after random changes of bytes.
void expectRobust(const std::string& file, std::uint64_t seed, std::size_t data) {
    const auto read = [](const std::string& damaged) {
        try {
            const bool is_ply = damaged.starts_with("ply");
            const auto points =
                is_ply ? plyPoints(bytes(damaged), "f") : npzPoints(bytes(damaged), "f");
            EXPECT_LT(points.size(), 100000U);
            return true;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
            return false;
        }
    };
    ASSERT_TRUE(read(file));
    for (std::size_t size = 0; size < data; ++size)
        ASSERT_FALSE(read(file.substr(0, size))) << "cut after " << size << " bytes";
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
    std::mt19937_64 random(seed);
    for (int i = 0; i < 5000; ++i) {
        std::string damaged = file;
        for (std::uint64_t n = random() % 4 + 1; n > 0; --n)
            damaged[random() % damaged.size()] = static_cast<char>(random());
        read(damaged);
    }
}

TEST(PlyPoints, DamagedFiles) {
    // The reader ignores the faces after the points, so damage there does not matter.
    const std::string little = richBinary(false);
    expectRobust(little, 1, little.size() - 13);
    const std::string big = richBinary(true);
    expectRobust(big, 2, big.size() - 13);
    const std::string text =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty "
        "list uint8 int l\nproperty float z\nend_header\n1 2 2 8 9 3\n4 5 0 6";
    expectRobust(text, 3, text.size());
}

constexpr const char* kWriteNpz = R"(
import io, sys, zipfile, numpy
p = numpy.array([[-300, 0.5, -3.25], [4, -0.125, 0.0009765625]])
folder = sys.argv[1] + '/'
numpy.savez(folder + 'points.npz', points=p, other=numpy.ones((7, 3)), text=numpy.array(['a']))
numpy.savez_compressed(folder + 'packed.npz', points=p, zeros=numpy.zeros((1000, 3)))
numpy.savez(folder + 'lone.npz', xyz=p.astype('<f4'), ids=numpy.arange(6).reshape(2, 3))
numpy.savez(folder + 'big.npz', p.astype('>f8'))
numpy.savez_compressed(folder + 'big4.npz', p.astype('>f4'))
numpy.savez(folder + 'fortran.npz', points=numpy.asfortranarray(p))
numpy.savez(folder + 'ours.npz', viewer_normals=-p, positions=p, bundle_up=p)
numpy.savez(folder + 'two.npz', a=p, b=p)
numpy.savez(folder + 'none.npz', a=p[:, :2], b=p.astype('f2'), c=p[None])
numpy.savez(folder + 'ints.npz', points=p.astype('i4'))
numpy.savez(folder + 'pickle.npz', points=numpy.array([[p, 'x', None]], dtype=object))
numpy.savez(folder + 'empty.npz', points=p[:0])
raw = io.BytesIO()
numpy.save(raw, p)
for shape in ('few', '(1, 3)'), ('many', '(9, 3)'), ('huge', '(6148914691236517206, 3)'):
    text = raw.getvalue().replace(b'(2, 3)', shape[1].encode())
    zipfile.ZipFile(folder + shape[0] + '.npz', 'w').writestr('points.npy', text)
p[1, 1] = numpy.nan
numpy.savez(folder + 'nan.npz', points=p)
numpy.savez_compressed(folder + 'zeros.npz', points=numpy.zeros((40000, 3)))
)";

TEST(NpzPoints, AsNumpyWritesThem) {
    PEELER_REQUIRE_PYTHON("numpy");
    const ScratchDir scratch;
    const Outcome wrote = runPython(kWriteNpz, {scratch.path()});
    ASSERT_EQ(wrote.exit_code, 0) << wrote.err;
    const std::vector<glm::dvec3> points = {{-300, 0.5, -3.25}, {4, -0.125, 0.0009765625}};
    for (const char* name : {"points", "packed", "lone", "big", "big4", "fortran", "ours"})
        EXPECT_EQ(readPoints(scratch / (std::string(name) + ".npz")), points) << name;
    EXPECT_EQ(readPoints(scratch / "zeros.npz").size(), 40000U);

    expectRefused(bytesOf(scratch / "two.npz"), "several arrays", "f, a.npy and b.npy");
    expectRefused(bytesOf(scratch / "none.npz"), "no array", "f");
    for (const char* name : {"ints.npz", "pickle.npz"})
        expectRefused(bytesOf(scratch / name), "an array of n points", "f, points.npy");
    for (const char* name : {"few.npz", "many.npz", "huge.npz"})
        expectRefused(bytesOf(scratch / name), "contradicts its header", "f, points.npy");
    const auto refused = [&](const char* name) {
        try {
            readPoints(scratch / name);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_EQ(error.where(), (scratch / name).string());
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_EQ(refused("nan.npz"), "point 1 is infinite, NaN or too far away");
    EXPECT_EQ(refused("empty.npz"), "the file has no points");
    std::ofstream(scratch / "other.xyz") << "1 2 3\n";
    EXPECT_EQ(refused("other.xyz"), "this is neither a PLY file nor a .npz");
    EXPECT_NE(refused("missing.npz"), "");

    const std::string stored = bytesOf(scratch / "points.npz");
    expectRobust(stored, 4, stored.size());
    std::string packed = bytesOf(scratch / "packed.npz");
    expectRobust(packed, 5, packed.size());
    // The ZIP directory now declares 1 GiB as the first member's size. The reader must not allocate
    // that much.
    packed.replace(packed.find("PK\x01\x02") + 24, 4, std::string("\0\0\0\x40", 4));
    expectRefused(packed, "impossible size", "f, points.npy");
}

TEST(NpzPoints, RowsOfRaysWithoutPositionsAreNone) {
    const ScratchDir scratch;
    const std::string path = scratch / "hits.npz";
    const std::int64_t splits[] = {0, 1};
    const glm::vec3 vector(0, 0, 1);
    const auto write = [&](const std::string& name) {
        ArrayWriter writer(
            path, {{"ray_splits", NumberType::kInt64, {2}}, {name, NumberType::kFloat, {1, 3}}});
        writer.append(0, asBytes(splits));
        writer.append(1, asBytes(std::span(&vector, 1)));
        writer.finish();
        return bytesOf(path);
    };
    expectRefused(write("normals"), "but no array positions", "f");
    write("positions");
    EXPECT_EQ(readPoints(path), (std::vector<glm::dvec3>{{0, 0, 1}}));
}

TEST(NpzPoints, OurOwnAreZip64) {
    const ScratchDir scratch;
    const std::string path = scratch / "p.npz";
    const std::vector<glm::dvec3> points = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
    ArrayWriter writer(path, {{"points", NumberType::kDouble, {3, 3}}});
    writer.append(0, asBytes(points));
    writer.finish();
    EXPECT_EQ(readPoints(path), points);
    const std::string file = bytesOf(path);
    expectRobust(file, 6, file.size());

    // The header declares more data than the file has.
    std::string damaged = file;
    const std::size_t shape = damaged.find("(3, 3)");
    damaged[shape + 1] = '9';
    expectRefused(damaged, "checksum", "f, points.npy");
}

}  // namespace
}  // namespace peeler::test
