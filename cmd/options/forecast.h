// SPDX-License-Identifier: Apache-2.0
// What a verb says of the sizes of its files before it writes them.
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

/// A file that will be written, or all files of a name with a place for numbers.
struct ForecastFile {
    std::filesystem::path path;
    SizeForecast size{};
    /// Why it is so large, as far as that is known: "1,234 hits of 64 bytes".
    std::string contents{};
    std::string kind{};  ///< for verbs that write several, as in WrittenFile
};

/// All files that a run will write, or those of its next picture.
struct Forecast {
    std::vector<ForecastFile> files;
    /// How many times as much the run will write if it goes on like this: the pictures that are
    /// left of a sequence.
    std::uint64_t times = 1;

    /// Of all files, once.
    SizeForecast size() const;
};

using DiskSpaceOf = std::function<std::optional<DiskSpace>(const std::filesystem::path&)>;

/// Compares what will be written with the free space, disk by disk. More than a tenth of it is a
/// warning; from 1 GB or a hundredth of it on, or if `always`, there is a note. Throws Error
/// (kOutput) if more is certain to be needed than is free: nothing has been written yet. What is
/// certain does not count `times`, since pictures to come may be smaller. A disk that does not tell
/// is passed over.
void reportForecast(const Forecast& forecast, Reporter& reporter, bool always = false,
                    const DiskSpaceOf& disk = diskSpaceOf);

/// What a run that gets as far as this one has may have had resident by then, who had `peak`:
/// threads take turns as it happens, and with them their buffers.
std::uint64_t repeatedPeak(std::uint64_t peak);
/// Says how many bytes a run will have resident at most.
void reportMemory(std::uint64_t bytes, Reporter& reporter);

/// Whether some disk has less room than its files take, at most or certainly.
bool mayExceedDisk(const Forecast& forecast, const DiskSpaceOf& disk = diskSpaceOf);

/// The files as --dry-run lists them (cmd/README.md, "JSON"): `output` (and `kind`),
/// `forecastBytes`, `forecast` (exact, at most or about), `freeBytes` and `exists`.
Json forecastJson(const Forecast& forecast, const DiskSpaceOf& disk = diskSpaceOf);

/// Declares --dry-run.
void addDryRunOption(VerbOptions& verb, bool& dry_run);

}  // namespace peeler::cmd
