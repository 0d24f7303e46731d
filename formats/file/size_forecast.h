// SPDX-License-Identifier: Apache-2.0
// Forecasts of file sizes before anything is written, and the free disk space.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include <peeler/scene.h>

namespace peeler {

enum class Certainty : std::uint8_t {
    kExact,   ///< the exact number of bytes, as for uncompressed data with a known number of rows
    kAtMost,  ///< an upper bound, as for compressed data
    kAbout    ///< an estimate, as for input bytes that are encoded again
};

struct SizeForecast {
    std::uint64_t bytes = 0;
    Certainty certainty = Certainty::kExact;

    /// Adds another forecast. The sum has the lower certainty of the two.
    SizeForecast& operator+=(const SizeForecast& other) {
        bytes += other.bytes;
        if (other.certainty > certainty) certainty = other.certainty;
        return *this;
    }
};

struct DiskSpace {
    std::uint64_t device = 0;  ///< number of the file system (st_dev)
    std::uint64_t free = 0;    ///< bytes available to this user (f_bavail of statvfs)
};

/// Returns the disk that will hold `file`: the disk of its nearest existing parent folder, with
/// symbolic links followed. Returns nothing if this disk cannot be determined.
std::optional<DiskSpace> diskSpaceOf(const std::filesystem::path& file);

/// Returns the maximum size, in bytes, of the header of an OpenEXR part that stores the names
/// `ids`.
std::uint64_t exrHeaderBytes(const IdNames& ids);
/// The maximum bytes per chunk in addition to its pixels: offset table entry, part and row numbers,
/// and sizes. Deep chunks need the most.
inline constexpr std::uint64_t kExrChunkBytes = 64;

}  // namespace peeler
