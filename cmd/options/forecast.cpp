// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/forecast.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "formats/file/regular_file.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kNotableBytes = 1'000'000'000;

/// The names of Certainty values, in the order of the enumeration.
constexpr const char* kCertainties[] = {"exact", "at most", "about"};

std::string sizeText(const SizeForecast& size) {
    std::string bytes = bytesText(size.bytes);
    if (size.certainty == Certainty::kExact) return bytes;
    return std::string(kCertainties[static_cast<std::size_t>(size.certainty)]) + ' ' + bytes;
}

/// The files of a run that go to one disk.
struct DiskShare {
    DiskSpace disk;
    SizeForecast size{};
    std::uint64_t certain = 0;  ///< bytes of the files whose size is exact
    std::string names{};        ///< for messages: "out.ply", "out.ply and 2 more files"
    std::string contents{};     ///< ForecastFile::contents if there is only one file
};

std::vector<DiskShare> sharesOf(const Forecast& forecast, const DiskSpaceOf& disk_of) {
    std::vector<DiskShare> shares;
    std::vector<std::uint64_t> files;  // number of files per share
    for (const ForecastFile& file : forecast.files) {
        const std::optional<DiskSpace> disk = disk_of(file.path);
        if (!disk) continue;
        std::size_t i = 0;
        while (i < shares.size() && shares[i].disk.device != disk->device)
            ++i;
        if (i == shares.size()) {
            shares.push_back({.disk = *disk});
            files.push_back(0);
        }
        DiskShare& share = shares[i];
        share.size += file.size;
        if (file.size.certainty == Certainty::kExact) share.certain += file.size.bytes;
        if (++files[i] == 1) {
            share.names = file.path.string();
            share.contents = file.contents;
        } else {
            share.contents.clear();
        }
    }
    for (std::size_t i = 0; i < shares.size(); ++i)
        if (files[i] > 1) shares[i].names += " and " + countText(files[i] - 1, "more file");
    return shares;
}

bool isMoreThan(std::uint64_t bytes, std::uint64_t part, const DiskSpace& disk) {
    return bytes > disk.free / part;
}

std::string percentText(std::uint64_t bytes, std::uint64_t of) {
    if (of == 0) return "all";
    const double share = 100 * static_cast<double>(bytes) / static_cast<double>(of);
    return groupedText(static_cast<std::uint64_t>(share)) + " %";
}

void reportShare(const DiskShare& share, std::uint64_t times, Reporter& reporter, bool always) {
    const std::string contents = share.contents.empty() ? "" : " (" + share.contents + ")";
    const std::string free = bytesText(share.disk.free);
    if (share.certain > share.disk.free) {
        throw Error(ErrorKind::kOutput,
                    "not enough disk space: " + bytesText(share.certain) + contents + " needed, " +
                        free + " free",
                    share.names, "free some space, write elsewhere, or reduce the output");
    }
    SizeForecast all = share.size;
    // Saturates, because no disk has 2^64 bytes.
    all.bytes = all.bytes > UINT64_MAX / times ? UINT64_MAX : all.bytes * times;
    if (times > 1 && all.certainty == Certainty::kExact) all.certainty = Certainty::kAbout;
    const std::string who =
        times > 1 ? countText(times, "picture") + " like " + share.names : share.names;
    const std::string what = who + " will take " + sizeText(all) + (times > 1 ? "" : contents);
    if (isMoreThan(all.bytes, 10, share.disk)) {
        reporter.warning(what + ", " + percentText(all.bytes, share.disk.free) + " of the " + free +
                         " free there.");
    } else if (always || all.bytes >= kNotableBytes || isMoreThan(all.bytes, 100, share.disk)) {
        reporter.note(what + " of the " + free + " free there");
    }
}

}  // namespace

SizeForecast Forecast::size() const {
    SizeForecast sum;
    for (const ForecastFile& file : files)
        sum += file.size;
    return sum;
}

void reportForecast(const Forecast& forecast, Reporter& reporter, bool always,
                    const DiskSpaceOf& disk) {
    for (const DiskShare& share : sharesOf(forecast, disk))
        reportShare(share, forecast.times, reporter, always);
}

std::uint64_t repeatedPeak(std::uint64_t peak) {
    return peak + peak / 32;
}

void reportMemory(std::uint64_t bytes, Reporter& reporter) {
    reporter.note("the run will use at most " + bytesText(bytes) + " of memory");
}

bool mayExceedDisk(const Forecast& forecast, const DiskSpaceOf& disk) {
    return std::ranges::any_of(sharesOf(forecast, disk), [](const DiskShare& share) {
        return share.size.bytes > share.disk.free;
    });
}

Json forecastJson(const Forecast& forecast, const DiskSpaceOf& disk) {
    Json list = Json::array();
    for (const ForecastFile& file : forecast.files) {
        const std::optional<DiskSpace> space = disk(file.path);
        Json entry;
        if (!file.kind.empty()) entry["kind"] = file.kind;
        entry["output"] = file.path.string();
        entry["forecastBytes"] = file.size.bytes;
        entry["forecast"] = kCertainties[static_cast<std::size_t>(file.size.certainty)];
        entry["freeBytes"] = space ? Json(space->free) : Json();
        entry["exists"] = fileExists(file.path, ErrorKind::kOutput);
        list.push_back(std::move(entry));
    }
    return list;
}

void addDryRunOption(VerbOptions& verb, bool& dry_run) {
    verb.addFlag(
            "--dry-run", dry_run,
            "print as JSON the planned files, their sizes and the memory needed, and write nothing")
        .group("Output");
}

}  // namespace peeler::cmd
