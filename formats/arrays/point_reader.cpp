// SPDX-License-Identifier: Apache-2.0
// Recognition of point file formats by their first bytes, and checks of the points.
#include "formats/arrays/point_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include <peeler/error.h>
#include "formats/file/reading_limits.h"
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

constexpr std::uint64_t kMostFileBytes = std::uint64_t{8} << 30;

struct PointFormat {
    std::string_view magic;
    std::vector<glm::dvec3> (*read)(std::span<const std::uint8_t> file, const std::string& where,
                                    const AllowBytes& allow);
};

constexpr PointFormat kFormats[] = {
    {"ply", plyPoints},
    {"PK\x03\x04", npzPoints},
};

bool isUsable(const glm::dvec3& point) {
    constexpr double kMost = std::numeric_limits<float>::max();
    return std::abs(point.x) <= kMost && std::abs(point.y) <= kMost && std::abs(point.z) <= kMost;
}

}  // namespace

std::vector<glm::dvec3> readPoints(const std::filesystem::path& path, const MemoryBudget& memory) {
    ReadingMemory reading(memory);
    const auto allow = [&](std::uint64_t bytes) { reading.allow(bytes, path.string()); };
    allow(RegularFile(path).size());
    const std::vector<std::uint8_t> bytes = readRegularFile(path, kMostFileBytes);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto* const format = std::ranges::find_if(
        kFormats, [&](const PointFormat& row) { return text.starts_with(row.magic); });
    if (format == std::end(kFormats))
        throw Error(ErrorKind::kInput, "this is neither a PLY file nor a .npz", path.string(),
                    "write one with numpy.savez(path, points=array)");
    std::vector<glm::dvec3> points = format->read(bytes, path.string(), allow);
    if (points.empty()) throw Error(ErrorKind::kInput, "the file has no points", path.string());
    const auto bad = std::ranges::find_if_not(points, isUsable);
    if (bad != points.end())
        throw Error(
            ErrorKind::kInput,
            "point " + std::to_string(bad - points.begin()) + " is infinite, NaN or too far away",
            path.string(), "leave this point out; points are counted from 0");
    return points;
}

}  // namespace peeler
