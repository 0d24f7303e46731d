// SPDX-License-Identifier: Apache-2.0
// How large a file will be, told before its first byte, and how much room its disk has.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include <peeler/scene.h>

namespace peeler {

/// How sure a forecast is.
enum class Certainty : std::uint8_t {
    kExact,   ///< to the byte: what is not compressed, of rows that are counted
    kAtMost,  ///< what is compressed takes no more
    kAbout    ///< more or less: it depends on how somebody else's bytes are written again
};

struct SizeForecast {
    std::uint64_t bytes = 0;
    Certainty certainty = Certainty::kExact;

    /// Several files together are as certain as the least certain one.
    SizeForecast& operator+=(const SizeForecast& other) {
        bytes += other.bytes;
        if (other.certainty > certainty) certainty = other.certainty;
        return *this;
    }
};

/// A disk and what it has left.
struct DiskSpace {
    std::uint64_t device = 0;  ///< the same for all files of one file system
    std::uint64_t free = 0;    ///< bytes, for whoever runs this program (f_bavail of statvfs)
};

/// The disk that `file` will lie on: that of the nearest folder above it that is there, symbolic
/// links followed. Nothing if the system does not tell.
std::optional<DiskSpace> diskSpaceOf(const std::filesystem::path& file);

/// The most bytes that the header of an OpenEXR part takes; `ids` are named in it.
std::uint64_t exrHeaderBytes(const IdNames& ids);
/// The most bytes that a chunk takes besides its pixels: its place in the offset table, numbers of
/// part and row, and sizes; those of a deep chunk are longer than others.
inline constexpr std::uint64_t kExrChunkBytes = 64;

}  // namespace peeler
