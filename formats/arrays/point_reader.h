// SPDX-License-Identifier: Apache-2.0
// Reads points from files of other programs: point clouds and arrays.
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

/// The most points that are taken from a file.
inline constexpr std::uint64_t kMostPoints = std::uint64_t{1} << 28;

/// The points of a PLY file or a .npz, told apart by how they begin, with the coordinates that
/// stand there. Files up to 8 GiB; the bytes of the file are in memory meanwhile. Throws Error
/// (kInput) if it is neither, is damaged, has no point or more than kMostPoints, or a coordinate
/// that is no number or beyond 32-bit floats; (kMemory) if file and points are over the budget.
std::vector<glm::dvec3> readPoints(const std::filesystem::path& path,
                                   const MemoryBudget& memory = {});

/// Is told how many bytes are about to be taken, and throws if they may not be.
using AllowBytes = std::function<void(std::uint64_t bytes)>;

/// The points of a PLY 1.0 file (G. Turk, "The PLY Polygon File Format", 1994), text or binary of
/// either byte order: x, y, z of the element `vertex`, of any type; all else is skipped. `where` is
/// the file's name. Throws Error (kInput), and what `allow` throws.
std::vector<glm::dvec3> plyPoints(
    std::span<const std::uint8_t> file, const std::string& where,
    const AllowBytes& allow = [](std::uint64_t) {});

/// The points of a .npz as numpy.savez and savez_compressed write it (ZIP, PKWARE APPNOTE 6.3, with
/// ZIP64; in it numpy.lib.format 1 to 3): the array `points`, else `positions`, else the only one
/// of shape (n, 3), of 32- or 64-bit floats in either byte order and C or Fortran order. Pickles
/// are never opened. `where` is the file's name. Throws Error (kInput), and what `allow` throws.
std::vector<glm::dvec3> npzPoints(
    std::span<const std::uint8_t> file, const std::string& where,
    const AllowBytes& allow = [](std::uint64_t) {});

}  // namespace peeler
