// SPDX-License-Identifier: Apache-2.0
#include "formats/file/size_forecast.h"

#include <sys/stat.h>
#include <sys/statvfs.h>

#include <string>
#include <system_error>

namespace peeler {

std::optional<DiskSpace> diskSpaceOf(const std::filesystem::path& file) {
    namespace fs = std::filesystem;
    std::error_code failure;
    // An existing file keeps its disk space until its replacement is complete, so its space counts
    // as used. Follow links, because the new file replaces their target.
    fs::path folder = fs::weakly_canonical(fs::absolute(file, failure), failure).parent_path();
    while (!folder.empty() && !fs::is_directory(folder, failure)) {
        if (folder == folder.parent_path()) return {};
        folder = folder.parent_path();
    }
    struct statvfs space {};
    struct stat place {};
    if (statvfs(folder.c_str(), &space) != 0 || stat(folder.c_str(), &place) != 0) return {};
    return DiskSpace{place.st_dev, std::uint64_t{space.f_bavail} * space.f_frsize};
}

std::uint64_t exrHeaderBytes(const IdNames& ids) {
    // Without names, peeler's headers take 2,000 to 6,000 bytes.
    constexpr std::uint64_t kAttributes = std::uint64_t{16} << 10, kIdAndSizes = 32;
    std::uint64_t bytes = kAttributes;
    for (const auto* names : {&ids.objects, &ids.materials})
        for (const std::string& name : *names)
            bytes += name.size() + kIdAndSizes;
    return bytes;
}

}  // namespace peeler
