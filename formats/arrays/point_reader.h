// SPDX-License-Identifier: Apache-2.0
// Readers of points from other programs' files: point clouds and arrays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include <peeler/memory_budget.h>

namespace peeler {

/// The maximum number of points accepted from a file.
inline constexpr std::uint64_t kMostPoints = std::uint64_t{1} << 28;
inline constexpr const char* kTooManyPoints = "there are more than the allowed 2^28 points";
inline constexpr const char* kFewerPoints = "split the file";

/// Returns the points of a PLY file or a .npz, with their coordinates as stored. The first bytes of
/// the file decide its format. Holds the whole file, at most 8 GiB, in memory. Throws Error
/// (kInput) if the file has neither format, is damaged, has no point or more than kMostPoints, or
/// has a coordinate that is NaN or exceeds the range of 32-bit floats. Throws Error (kMemory) if
/// the file and its points exceed the budget.
std::vector<glm::dvec3> readPoints(const std::filesystem::path& path,
                                   const MemoryBudget& memory = {});

/// A callback that receives the number of bytes about to be allocated, and throws if they exceed
/// the limit.
using AllowBytes = std::function<void(std::uint64_t bytes)>;

/// Returns the points of a PLY 1.0 file (G. Turk, "The PLY Polygon File Format", 1994), text or
/// binary of either byte order: x, y, z of the element `vertex`, of any type. Skips everything
/// else. `where` is the file's name. Throws Error (kInput), and anything `allow` throws.
std::vector<glm::dvec3> plyPoints(
    std::span<const std::uint8_t> file, const std::string& where,
    const AllowBytes& allow = [](std::uint64_t) {});

/// Returns the points of a .npz as written by numpy.savez and savez_compressed (ZIP, PKWARE APPNOTE
/// 6.3, with ZIP64; members in numpy.lib.format 1 to 3): the array `points`, else `positions`, else
/// the only array of shape (n, 3). Elements are 32- or 64-bit floats in either byte order and in C
/// or Fortran order. Never unpickles objects. `where` is the file's name. Throws Error (kInput),
/// and anything `allow` throws.
std::vector<glm::dvec3> npzPoints(
    std::span<const std::uint8_t> file, const std::string& where,
    const AllowBytes& allow = [](std::uint64_t) {});

}  // namespace peeler
