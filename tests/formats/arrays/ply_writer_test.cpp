// SPDX-License-Identifier: Apache-2.0
#include "formats/arrays/table_writers.h"

#include <gtest/gtest.h>

#include <cstring>

#include <peeler/error.h>
#include "support/test_support.h"

namespace peeler {
namespace {

/// Returns a record: x (double), y (float), an ID and a byte of red.
std::vector<std::byte> point(double x, float y, std::uint32_t id, std::uint8_t red) {
    std::vector<std::byte> bytes(17);
    std::memcpy(bytes.data(), &x, 8);
    std::memcpy(&bytes[8], &y, 4);
    std::memcpy(&bytes[12], &id, 4);
    std::memcpy(&bytes[16], &red, 1);
    return bytes;
}

TEST(PlyWriter, WritesTheHeaderOfTheStandardAndTheBytes) {
    const test::ScratchDir scratch;
    const std::string path = scratch / "p.ply";
    std::vector<std::byte> all = point(0.1, 2, 3, 4), second = point(-5, 6, 0xFFFFFFFF, 255);
    {
        PlyWriter writer(path,
                         {{"x", NumberType::kDouble},
                          {"y", NumberType::kFloat},
                          {"id", NumberType::kUint32},
                          {"red", NumberType::kUint8}},
                         {"a comment"});
        ASSERT_EQ(writer.pointSize(), 17U);
        writer.append(all);
        writer.append(second);
        EXPECT_FALSE(std::filesystem::exists(path));
        EXPECT_THROW(writer.append(std::span(all).first(16)), Error);
        writer.finish();
    }
    all.insert(all.end(), second.begin(), second.end());
    EXPECT_EQ(test::bytesOf(path),
              "ply\nformat binary_little_endian 1.0\ncomment arrays_version 2\ncomment a comment\n"
              "comment ...................\nelement vertex 2\n"
              "property double x\nproperty float y\nproperty uint id\nproperty uchar red\n"
              "end_header\n" +
                  std::string(reinterpret_cast<const char*>(all.data()), all.size()));
}

TEST(PlyWriter, PointsComeInAnyOrder) {
    const test::ScratchDir scratch;
    const auto write = [&](const std::string& name, auto&& fill) {
        PlyWriter writer(scratch / name, {{"x", NumberType::kUint32}});
        fill(writer);
        writer.finish();
        return test::bytesOf(scratch / name);
    };
    const std::uint32_t points[] = {1, 2, 3, 4};
    const auto some = [&](std::size_t first, std::size_t count) {
        return std::as_bytes(std::span(points).subspan(first, count));
    };
    EXPECT_EQ(write("a.ply", [&](PlyWriter& writer) { writer.append(some(0, 4)); }),
              write("b.ply", [&](PlyWriter& writer) {
                  writer.writeAt(3, some(3, 1));
                  writer.writeAt(0, some(0, 1));
                  writer.writeAt(1, some(1, 2));
                  EXPECT_THROW(writer.writeAt(0, some(0, 1).first(3)), Error);
              }));
    EXPECT_THROW(write("c.ply", [&](PlyWriter& writer) { writer.writeAt(1, some(1, 3)); }), Error);
}

TEST(PlyWriter, TheHeaderHasRoomForAnyNumberOfPoints) {
    const test::ScratchDir scratch;
    const auto size_with = [&](std::size_t points) {
        PlyWriter writer(scratch / "p.ply", {{"red", NumberType::kUint8}});
        writer.append(std::vector<std::byte>(points));
        writer.finish();
        return std::filesystem::file_size(scratch / "p.ply") - points;
    };
    EXPECT_EQ(size_with(0), size_with(123456));
}

TEST(PlyWriter, RefusesWhatTheFormatLacks) {
    const test::ScratchDir scratch;
    const std::string path = scratch / "p.ply";
    EXPECT_THROW(PlyWriter(path, {{"x", NumberType::kHalf}}), Error);
    EXPECT_THROW(PlyWriter(path, {{"a name"}}), Error);
    EXPECT_THROW(PlyWriter(path, {{"x"}}, {"two\nlines"}), Error);
    EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

}  // namespace
}  // namespace peeler
