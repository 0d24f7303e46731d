// SPDX-License-Identifier: Apache-2.0
// Result reports: their options, the JSON result, the summary line.
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
#include <peeler/view.h>
#include "cmd/cli/progress_lines.h"
#include "cmd/session/reporter.h"
#include "core/views/many_cameras.h"

namespace peeler::cmd {

class VerbOptions;

/// The options for reporting a command's result and progress.
struct ReportOptions {
    bool json = false;
    bool quiet = false, verbose = false;
    std::optional<std::filesystem::path> file;
    ProgressStyle progress = ProgressStyle::kAuto;

    /// Sets the reporter's verbosity and progress style. If quiet, shows progress only in the
    /// styles that programs read.
    void applyTo(Reporter& reporter) const;
};

/// Declares --json, --report, --progress, --quiet and --verbose.
void addReportOptions(VerbOptions& verb, ReportOptions& options);

/// Returns the options given among those of addReportOptions().
ReportOptions givenReportOptions(const VerbOptions& verb);

/// A written file and its size.
struct WrittenFile {
    std::filesystem::path path;
    std::uint64_t bytes = 0;
    std::string kind{};  ///< kind of the file, for verbs that write several kinds
};

/// The result of a run, common to all verbs that read and write files.
struct RunResult {
    std::vector<std::filesystem::path> inputs{};  ///< the scene, or the images
    /// The requested output name; "" = nothing was written, or the files have several names.
    std::filesystem::path output{};
    std::uint64_t bytes = 0;  ///< total size of all files written under the name `output`
    /// The forecast of the file size in bytes; none if the verb makes no forecast.
    std::optional<std::uint64_t> forecast_bytes{};
    /// The forecast of the maximum resident bytes; none if the verb makes no forecast.
    std::optional<std::uint64_t> forecast_memory{};
    /// The written files, for verbs that may write several files.
    std::optional<std::vector<WrittenFile>> files{};
    /// The scene's format, up axis and unit. Set only for formats that do not specify axis and
    /// unit.
    std::string format{}, up{};
    double metres_per_unit = 1;
    std::string engine{};         ///< the engine that found the hits; "" = no rays were traced
    std::string settings_hash{};  ///< the attribute peeler:settingsHash; "" = unknown
    /// GL_RENDERER. A verb that does not render copies it from the input. "" = no GL was used.
    std::string renderer{};
    std::string backend{};          ///< GL backend; "" = no GL rendering
    std::uint64_t peak_memory = 0;  ///< bytes
    StageTimes milliseconds{};

    /// Sets the only file written. Throws Error (kOutput) if it is missing.
    void setFile(const std::filesystem::path& file);
    /// Sets the files written under one name. Throws Error (kOutput) if any of them is missing.
    void setFiles(const std::filesystem::path& name, const std::vector<std::filesystem::path>& all);
    /// Adds a written file to `files` and its size to `bytes`. Throws Error (kOutput) if the file
    /// is missing.
    const WrittenFile& addFile(const std::filesystem::path& file, const std::string& kind = "");
};

/// The display transform that was applied to a picture.
struct DisplayedAs {
    std::string tone_map{};
    float exposure = 0;  ///< stops
    bool automatic_exposure = false;
    std::uint64_t alpha_raised_pixels = 0;
};

/// The result for one picture.
struct PictureResult : RunResult {
    std::string sample{};                     ///< key of the sample if `output` is a shard
    std::optional<int> frame;                 ///< number of the frame, in a sequence
    double time = 0;                          ///< time of the frame, seconds
    std::optional<int> view{};                ///< index of the view, if there are several
    std::string camera{};                     ///< name of the camera
    std::optional<Normalizing> normalized{};  ///< the transform that --normalize applied
    std::optional<View> sample_view{};        ///< view of a sample, reported as calibrationJson()
    bool skipped = false;       ///< whether the file already existed; then only `bytes` is known
    int width = 0, height = 0;  ///< size of the display window, pixels
    std::uint64_t layers = 0;
    std::uint64_t fragments_counted = 0, fragments_stored = 0;
    std::uint64_t fragments_blended = 0;  ///< a part of the fragments not stored
    int samples = 1;                      ///< sub-pixel samples per pixel
    /// For the summary: the samples whose fragments the counts add up, whether the counts omit
    /// fragments behind opaque surfaces, the camera, and the light of a display picture.
    int counted_samples = 1;
    bool counts_visible = false;
    bool camera_cut = false;  ///< whether to say that the camera cuts the scene off
    std::string light{};
    std::string method;
    int passes = 0;
    std::optional<DisplayedAs> display{};  ///< set only for display pictures
};

/// Sets the picture's size, layers, fragments, provenance and the memory used.
void describePicture(const Plan& plan, const Provenance& provenance, PictureResult& result);

/// Returns a run as JSON (cmd/README.md, "JSON"): `input` (`inputs` if several), `output`, `bytes`
/// and the forecasts; then `findings`; `format`, `up` and `metresPerUnit` for a scene whose format
/// does not specify axis and unit; `engine` if rays were traced; then `settingsHash`, `renderer`,
/// `backend`, `peakMemory` and `milliseconds`. Every stage is listed, with 0 if it did not run.
Json toJson(const RunResult& run, const Json& findings);

/// Returns {"scale", "middle"} of the normalising transform, which maps a point p of the file to
/// scale · (p − middle).
Json normalizingJson(const Normalizing& by);

/// Returns the members of toJson() that only pictures have. `frame` and `time` are present only in
/// a sequence.
Json findingsOf(const PictureResult& result);

/// Returns the result for a picture as JSON. A skipped picture has only its file and its number in
/// the sequence.
Json toJson(const PictureResult& result);

/// Returns a one-line summary: "out.exr: 24 layers, 7,123,456 fragments, 12.3 MB, 812 ms". Counts
/// are per sample.
std::string summary(const PictureResult& result);

/// Returns the total time, rounded and grouped: "812 ms".
std::string totalText(const StageTimes& milliseconds);

/// Reports a result as requested by the options: in the report file, as lines on stderr and as JSON
/// on stdout. Throws Error (kOutput) if writing fails.
void reportResult(const ReportOptions& options, const Json& json,
                  const std::vector<std::string>& lines, Reporter& reporter);

/// Reports the result for a picture, including its summary().
void reportResult(const ReportOptions& options, const PictureResult& result, Reporter& reporter);

/// Returns the JSON text for --json and --report: indented, with a final newline. Replaces invalid
/// UTF-8, which file names may contain.
std::string jsonText(const Json& json);

/// Writes a result to `path` atomically. Throws Error (kOutput) if writing fails.
void writeReport(const std::filesystem::path& path, const Json& json);

/// Returns the size in bytes of a written file. Throws Error (kOutput) if it is missing.
std::uint64_t fileBytes(const std::filesystem::path& file);

/// Returns a window as text: "640 x 480 at (0, 0)".
std::string windowText(const Window& window);

/// Returns an exposure in stops as text that --exposure accepts: "-1.4", "0".
std::string stopsText(float stops);

/// Returns a number with grouped digits: "7,123,456".
std::string groupedText(std::uint64_t value);

/// Returns a size in bytes as text: "12.3 MB".
std::string bytesText(std::uint64_t bytes);

/// Returns a count with its noun: "1 layer", "2 layers".
std::string countText(std::uint64_t count, const std::string& noun);

}  // namespace peeler::cmd
