// SPDX-License-Identifier: Apache-2.0
// What a command says of its work: the options that ask for it, the JSON result, the summary line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <peeler/sink.h>
#include <peeler/stage_times.h>
#include "cmd/cli/progress_lines.h"
#include "cmd/session/reporter.h"
#include "core/views/many_cameras.h"

namespace peeler::cmd {

class VerbOptions;

/// Where a command reports its result and its progress.
struct ReportOptions {
    bool json = false;
    bool quiet = false, verbose = false;
    std::optional<std::filesystem::path> file;
    ProgressStyle progress = ProgressStyle::kAuto;

    /// Makes the reporter as quiet or as wordy as was asked for. A quiet one shows progress in the
    /// styles for programs alone.
    void applyTo(Reporter& reporter) const;
};

/// Declares --json, --report, --progress, --quiet and --verbose.
void addReportOptions(VerbOptions& verb, ReportOptions& options);

/// A file that is there, and its size.
struct WrittenFile {
    std::filesystem::path path;
    std::uint64_t bytes = 0;
    std::string kind{};  ///< for verbs that write several
};

/// What every verb reports of a run that reads something and writes something made of it.
struct RunResult {
    std::vector<std::filesystem::path> inputs{};  ///< the scene, or images
    /// The name that was asked for; "" = nothing was written, or files under several names.
    std::filesystem::path output{};
    std::uint64_t bytes = 0;  ///< of all files of that name together
    /// How many bytes were forecast, exactly or at most, before the first one; of verbs that do.
    std::optional<std::uint64_t> forecast_bytes{};
    /// Likewise how many to be resident at most.
    std::optional<std::uint64_t> forecast_memory{};
    /// Each of the files, of verbs that write several under one name, or under several names.
    std::optional<std::vector<WrittenFile>> files{};
    /// Of a scene whose format does not say it: the format, the axis that is up, and the unit.
    std::string format{}, up{};
    double metres_per_unit = 1;
    std::string engine{};         ///< that has found the hits; "" = no rays were traced
    std::string settings_hash{};  ///< peeler:settingsHash; "" = not known
    /// GL_RENDERER; of a verb that renders nothing, what its input says; "" = no GL was used.
    std::string renderer{};
    std::string backend{};          ///< "" = nothing was rendered by GL
    std::uint64_t peak_memory = 0;  ///< bytes
    StageTimes milliseconds{};

    /// Sets the one file that was written. Throws Error (kOutput) if it is not there.
    void setFile(const std::filesystem::path& file);
    /// Sets the files that were written under one name. Throws Error (kOutput) if one is not there.
    void setFiles(const std::filesystem::path& name, const std::vector<std::filesystem::path>& all);
    /// Adds a file to the list, which is there from then on. Throws Error (kOutput) if it is not
    /// there.
    const WrittenFile& addFile(const std::filesystem::path& file, const std::string& kind = "");
};

/// How a picture for eyes is shown.
struct DisplayedAs {
    std::string tone_map{};
    float exposure = 0;  ///< stops
    bool automatic_exposure = false;
    std::uint64_t alpha_raised_pixels = 0;
};

/// What became of one picture.
struct PictureResult : RunResult {
    std::string sample{};                     ///< its key, if `output` is a shard
    std::optional<int> frame;                 ///< of a sequence
    double time = 0;                          ///< of the frame, seconds
    std::optional<int> view{};                ///< of many views
    std::string camera{};                     ///< what the view is called
    std::optional<Normalizing> normalized{};  ///< what --normalize did
    bool skipped = false;                     ///< it was there already; only its `bytes` are known
    int width = 0, height = 0;                ///< display window
    std::uint64_t layers = 0;
    std::uint64_t fragments_counted = 0, fragments_stored = 0;
    std::uint64_t fragments_blended = 0;  ///< of those not stored
    int samples = 1;                      ///< a pixel
    std::string method;
    int passes = 0;
    std::optional<DisplayedAs> display{};  ///< of pictures for eyes
};

/// Fills in size, layers and fragments of a picture, what it was made with, and the memory that it
/// took.
void describePicture(const Plan& plan, const Provenance& provenance, PictureResult& result);

/// A run as JSON (cmd/README.md, "JSON"): `input` (`inputs` of several), `output`, `bytes` and what
/// was forecast, then what the verb found, `format`, `up` and `metresPerUnit` of a scene that does
/// not say the latter two, `engine` if it traced rays, then `settingsHash`, `renderer`, `backend`,
/// `peakMemory` and `milliseconds`. Every stage is there, 0 where it did not happen.
Json toJson(const RunResult& run, const Json& findings);

/// {"scale", "middle"}: points p of the file are at scale · (p − middle).
Json normalizingJson(const Normalizing& by);

/// What toJson() says of a picture besides what it says of every run; `frame` and `time` only of a
/// sequence.
Json findingsOf(const PictureResult& result);

/// A picture as JSON; of one that was skipped only its file, frame and time.
Json toJson(const PictureResult& result);

/// "out.exr: 24 layers, 7,123,456 fragments, 12.3 MB, 812 ms"
std::string summary(const PictureResult& result);

/// Milliseconds from the beginning to the end, rounded and grouped: "812 ms".
std::string totalText(const StageTimes& milliseconds);

/// Reports a result as it was asked for: in the report's file, as lines on stderr and as JSON on
/// stdout. Throws Error (kOutput).
void reportResult(const ReportOptions& options, const Json& json,
                  const std::vector<std::string>& lines, Reporter& reporter);

/// The same of a picture, with its summary.
void reportResult(const ReportOptions& options, const PictureResult& result, Reporter& reporter);

/// The text that --json prints and --report stores: indented, a newline at the end; bytes that are
/// not UTF-8 (file names) replaced.
std::string jsonText(const Json& json);

/// Stores a result under `path`, whole or not at all. Throws Error (kOutput).
void writeReport(const std::filesystem::path& path, const Json& json);

/// The size in bytes of a file that has been written. Throws Error (kOutput) if it is gone.
std::uint64_t fileBytes(const std::filesystem::path& file);

/// "640 x 480 at (0, 0)"
std::string windowText(const Window& window);

/// Stops as --exposure takes them back: "-1.4", "0".
std::string stopsText(float stops);

/// "7,123,456"
std::string groupedText(std::uint64_t value);

/// "12.3 MB"
std::string bytesText(std::uint64_t bytes);

/// "1 layer", "2 layers"
std::string countText(std::uint64_t count, const std::string& noun);

}  // namespace peeler::cmd
