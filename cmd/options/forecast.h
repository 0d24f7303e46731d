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

/// A file to be written, or all files of a numbered name.
struct ForecastFile {
    std::filesystem::path path;
    SizeForecast size{};
    /// The reason for its size, if known: "1,234 hits of 64 bytes".
    std::string contents{};
    std::string kind{};  ///< for verbs that write several files, as in WrittenFile
};

/// The files of a run, or of its next picture.
struct Forecast {
    std::vector<ForecastFile> files;
    /// The factor for the rest of the run: the remaining pictures of a sequence.
    std::uint64_t times = 1;

    /// Returns the size of all files, without `times`.
    SizeForecast size() const;
};

using DiskSpaceOf = std::function<std::optional<DiskSpace>(const std::filesystem::path&)>;

/// Compares the forecast with the free space, per disk. Warns if it exceeds a tenth of the free
/// space; notes it from 1 GB or a hundredth of the free space on, or if `always`. Throws Error
/// (kOutput) if the certain size exceeds the free space; nothing has been written yet. The certain
/// size does not include `times`, since later pictures may be smaller. Skips disks whose free space
/// is unknown.
void reportForecast(const Forecast& forecast, Reporter& reporter, bool always = false,
                    const DiskSpaceOf& disk = diskSpaceOf);

/// Returns an upper estimate of the peak memory of a repeated run that had `peak` bytes this time:
/// thread scheduling varies, and with it the buffers in use.
std::uint64_t repeatedPeak(std::uint64_t peak);
/// Reports the maximum resident bytes of a run.
void reportMemory(std::uint64_t bytes, Reporter& reporter);

/// Whether some disk has less free space than its files may need.
bool mayExceedDisk(const Forecast& forecast, const DiskSpaceOf& disk = diskSpaceOf);

/// Returns the files as --dry-run lists them (cmd/README.md, "JSON"): `output` (and `kind`),
/// `forecastBytes`, `forecast` (exact, at most or about), `freeBytes` and `exists`.
Json forecastJson(const Forecast& forecast, const DiskSpaceOf& disk = diskSpaceOf);

/// Declares --dry-run.
void addDryRunOption(VerbOptions& verb, bool& dry_run);

}  // namespace peeler::cmd
