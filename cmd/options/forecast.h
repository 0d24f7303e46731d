// SPDX-License-Identifier: Apache-2.0
// Forecasts of file sizes and memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cmd/cli/report.h"
#include "cmd/session/reporter.h"
#include "formats/file/size_forecast.h"

namespace peeler::cmd {

/// A file that will be written, or all files that share a name with a number pattern.
struct ForecastFile {
    std::filesystem::path path;
    SizeForecast size{};
    /// The explanation of the size: "1,234 hits of 64 bytes"; "" = unknown.
    std::string contents{};
    std::string kind{};  ///< as in WrittenFile
};

/// The files that a run, or its next picture, will write.
struct Forecast {
    std::vector<ForecastFile> files;
    /// The number of pictures left in a sequence, each with files of about the same size.
    std::uint64_t times = 1;

    /// Returns the total size of the files, not multiplied by `times`.
    SizeForecast size() const;
};

using DiskSpaceOf = std::function<std::optional<DiskSpace>(const std::filesystem::path&)>;

/// Compares the forecast with the free space of each disk. Warns if the files need more than a
/// tenth of the free space. Otherwise prints a note if `always`, if the files need at least 1 GB,
/// or if they need more than a hundredth of the free space. Throws Error (kOutput) if the files
/// with exact sizes do not fit; this check ignores `times`, because later pictures may be smaller.
/// Skips disks whose free space is unknown.
void reportForecast(const Forecast& forecast, Reporter& reporter, bool always = false,
                    const DiskSpaceOf& disk = diskSpaceOf);

/// Returns an upper estimate of the peak memory of an identical run, given this run's peak. The
/// peaks may differ, because the number of buffers in use depends on thread scheduling.
std::uint64_t repeatedPeak(std::uint64_t peak);
/// Reports the forecast of a run's maximum resident bytes.
void reportMemory(std::uint64_t bytes, Reporter& reporter);

bool mayExceedDisk(const Forecast& forecast, const DiskSpaceOf& disk = diskSpaceOf);

/// Returns the files as --dry-run lists them (cmd/README.md, "JSON"): `output` (and `kind`),
/// `forecastBytes`, `forecast` (exact, at most or about), `freeBytes` and `exists`.
Json forecastJson(const Forecast& forecast, const DiskSpaceOf& disk = diskSpaceOf);

void addDryRunOption(VerbOptions& verb, bool& dry_run);

}  // namespace peeler::cmd
