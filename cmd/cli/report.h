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
#include "cmd/cli/progress_lines.h"
#include "cmd/session/reporter.h"
#include "core/views/many_cameras.h"

namespace peeler::cmd {

class VerbOptions;

/// The destinations of a command's result and progress.
struct ReportOptions {
    bool json = false;
    bool quiet = false, verbose = false;
    std::optional<std::filesystem::path> file;
    ProgressStyle progress = ProgressStyle::kAuto;

    /// Sets the reporter's verbosity and progress style. If quiet, shows progress only in styles
    /// for programs.
    void applyTo(Reporter& reporter) const;
};

/// Declares --json, --report, --progress, --quiet and --verbose.
void addReportOptions(VerbOptions& verb, ReportOptions& options);

/// A written file and its size.
struct WrittenFile {
    std::filesystem::path path;
    std::uint64_t bytes = 0;
    std::string kind{};  ///< for verbs that write several
};

/// The result of a run, common to all verbs that read and write files.
struct RunResult {
    std::vector<std::filesystem::path> inputs{};  ///< the scene, or images
    /// The requested name; "" = nothing was written, or files under several names.
    std::filesystem::path output{};
    std::uint64_t bytes = 0;  ///< of all files under that name
    /// The forecast file size in bytes, exact or an upper limit, for verbs that make a forecast.
    std::optional<std::uint64_t> forecast_bytes{};
    /// The forecast limit of resident bytes, for the same verbs.
    std::optional<std::uint64_t> forecast_memory{};
    /// Each file, for verbs that write several under one or more names.
    std::optional<std::vector<WrittenFile>> files{};
    /// Format, up axis and unit, for scenes whose format does not specify axis and unit.
    std::string format{}, up{};
    double metres_per_unit = 1;
    std::string engine{};         ///< that found the hits; "" = no rays were traced
    std::string settings_hash{};  ///< peeler:settingsHash; "" = unknown
    /// GL_RENDERER; taken from the input if the verb does not render; "" = no GL was used.
    std::string renderer{};
    std::string backend{};          ///< "" = no GL rendering
    std::uint64_t peak_memory = 0;  ///< bytes
    StageTimes milliseconds{};

    /// Sets the one written file. Throws Error (kOutput) if it is missing.
    void setFile(const std::filesystem::path& file);
    /// Sets the files written under one name. Throws Error (kOutput) if one is missing.
    void setFiles(const std::filesystem::path& name, const std::vector<std::filesystem::path>& all);
    /// Adds a file to the list, and creates the list if needed. Throws Error (kOutput) if the file
    /// is missing.
    const WrittenFile& addFile(const std::filesystem::path& file, const std::string& kind = "");
};

/// The display transform of a display picture.
struct DisplayedAs {
    std::string tone_map{};
    float exposure = 0;  ///< stops
    bool automatic_exposure = false;
    std::uint64_t alpha_raised_pixels = 0;
};

/// The result for one picture.
struct PictureResult : RunResult {
    std::string sample{};                     ///< sample key, if `output` is a shard
    std::optional<int> frame;                 ///< in a sequence
    double time = 0;                          ///< of the frame, seconds
    std::optional<int> view{};                ///< index among many views
    std::string camera{};                     ///< name of the view
    std::optional<Normalizing> normalized{};  ///< transform of --normalize
    bool skipped = false;                     ///< it existed; only its `bytes` are known
    int width = 0, height = 0;                ///< display window
    std::uint64_t layers = 0;
    std::uint64_t fragments_counted = 0, fragments_stored = 0;
    std::uint64_t fragments_blended = 0;  ///< among those not stored
    int samples = 1;                      ///< per pixel
    std::string method;
    int passes = 0;
    std::optional<DisplayedAs> display{};  ///< for display pictures
};

/// Fills in size, layers and fragments of a picture, its provenance, and the memory used.
void describePicture(const Plan& plan, const Provenance& provenance, PictureResult& result);

/// Returns a run as JSON (cmd/README.md, "JSON"): `input` (`inputs` if several), `output`, `bytes`
/// and the forecasts; then `findings`; `format`, `up` and `metresPerUnit` for a scene whose format
/// lacks the latter two; `engine` if it traced rays; then `settingsHash`, `renderer`, `backend`,
/// `peakMemory` and `milliseconds`. Every stage is listed, with 0 if it did not run.
Json toJson(const RunResult& run, const Json& findings);

/// Returns {"scale", "middle"}: a point p of the file is at scale · (p − middle).
Json normalizingJson(const Normalizing& by);

/// Returns the picture-specific part of toJson(); `frame` and `time` only for a sequence.
Json findingsOf(const PictureResult& result);

/// Returns a picture as JSON; for a skipped one, only its file, frame and time.
Json toJson(const PictureResult& result);

/// Returns "out.exr: 24 layers, 7,123,456 fragments, 12.3 MB, 812 ms".
std::string summary(const PictureResult& result);

/// Returns the total time, rounded and grouped: "812 ms".
std::string totalText(const StageTimes& milliseconds);

/// Reports a result as requested: in the report file, as lines on stderr and as JSON on stdout.
/// Throws Error (kOutput) if writing fails.
void reportResult(const ReportOptions& options, const Json& json,
                  const std::vector<std::string>& lines, Reporter& reporter);

/// Reports a picture, with its summary.
void reportResult(const ReportOptions& options, const PictureResult& result, Reporter& reporter);

/// Returns the text for --json and --report: indented, with a final newline; invalid UTF-8 (in file
/// names) is replaced.
std::string jsonText(const Json& json);

/// Writes a result to `path` atomically. Throws Error (kOutput) if writing fails.
void writeReport(const std::filesystem::path& path, const Json& json);

/// Returns the size in bytes of a written file. Throws Error (kOutput) if it is missing.
std::uint64_t fileBytes(const std::filesystem::path& file);

/// Returns "640 x 480 at (0, 0)".
std::string windowText(const Window& window);

/// Returns stops in the form that --exposure accepts: "-1.4", "0".
std::string stopsText(float stops);

/// Returns "7,123,456".
std::string groupedText(std::uint64_t value);

/// Returns "12.3 MB".
std::string bytesText(std::uint64_t bytes);

/// Returns "1 layer", "2 layers".
std::string countText(std::uint64_t count, const std::string& noun);

}  // namespace peeler::cmd
