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

struct ReportOptions {
    bool json = false;
    bool quiet = false, verbose = false;
    std::optional<std::filesystem::path> file;
    ProgressStyle progress = ProgressStyle::kAuto;

    /// Sets the reporter's verbosity and progress style. If quiet, only progress styles for
    /// programs are shown.
    void applyTo(Reporter& reporter) const;
};

/// Declares --json, --report, --progress, --quiet and --verbose.
void addReportOptions(VerbOptions& verb, ReportOptions& options);

/// Returns the values of addReportOptions()'s options.
ReportOptions givenReportOptions(const VerbOptions& verb);

struct WrittenFile {
    std::filesystem::path path;
    std::uint64_t bytes = 0;
    std::string kind{};  ///< set by verbs that write several kinds
};

/// The part of a run's result that is common to all verbs with files.
struct RunResult {
    std::vector<std::filesystem::path> inputs{};  ///< the scene, or the images
    /// The requested output name; "" = nothing was written, or the files have several names.
    std::filesystem::path output{};
    std::uint64_t bytes = 0;  ///< total size of all files written under the name `output`
    /// File size in bytes; none if the verb makes no forecast.
    std::optional<std::uint64_t> forecast_bytes{};
    /// Maximum resident bytes; none if the verb makes no forecast.
    std::optional<std::uint64_t> forecast_memory{};
    /// Set by verbs that may write several files.
    std::optional<std::vector<WrittenFile>> files{};
    /// The scene's format, up axis and unit. Set only if the format does not specify axis and unit.
    std::string format{}, up{};
    double metres_per_unit = 1;
    std::string engine{};         ///< engine that found the hits; "" = no rays were traced
    std::string settings_hash{};  ///< the attribute peeler:settingsHash; "" = unknown
    /// GL_RENDERER, or the input's renderer if the verb does not render; "" = no GL was used.
    std::string renderer{};
    std::string backend{};          ///< "" = no GL rendering
    std::uint64_t peak_memory = 0;  ///< bytes
    StageTimes milliseconds{};

    /// Sets the only written file. Throws Error (kOutput) if the file is missing.
    void setFile(const std::filesystem::path& file);
    /// Sets the files written under one name. Throws Error (kOutput) if any of them is missing.
    void setFiles(const std::filesystem::path& name, const std::vector<std::filesystem::path>& all);
    /// Adds a written file to `files` and its size to `bytes`. Throws Error (kOutput) if the file
    /// is missing.
    const WrittenFile& addFile(const std::filesystem::path& file, const std::string& kind = "");
};

struct DisplayedAs {
    std::string tone_map{};
    float exposure = 0;  ///< stops
    bool automatic_exposure = false;
    std::uint64_t alpha_raised_pixels = 0;
};

struct PictureResult : RunResult {
    std::string sample{};       ///< key of the sample if `output` is a shard
    std::optional<int> frame;   ///< set in a sequence
    double time = 0;            ///< of the frame, seconds
    std::optional<int> view{};  ///< set if there are several views
    std::string camera{};
    std::optional<Normalizing> normalized{};  ///< transform of --normalize
    std::optional<View> sample_view{};        ///< set for a sample; reported as calibrationJson()
    bool skipped = false;       ///< the file already existed, and only `bytes` is known
    int width = 0, height = 0;  ///< size of the display window, pixels
    std::uint64_t layers = 0;
    std::uint64_t fragments_counted = 0, fragments_stored = 0;
    std::uint64_t fragments_blended = 0;  ///< blended into the composite instead of stored
    std::uint64_t without_ray = 0;        ///< number of pixels where a lens sees nothing
    int samples = 1;                      ///< sub-pixel samples per pixel
    /// Only for the summary: the number of samples in the fragment counts; whether the counts omit
    /// fragments behind opaque surfaces; whether the scene's camera cuts the scene off; the light
    /// of a display picture.
    int counted_samples = 1;
    bool counts_visible = false;
    bool camera_cut = false;
    std::string light{};
    std::string method;
    int passes = 0;
    std::optional<DisplayedAs> display{};
};

/// Copies size, layers, fragments, provenance and peak memory to the result.
void describePicture(const Plan& plan, const Provenance& provenance, PictureResult& result);

/// Returns a run as JSON (cmd/README.md, "JSON"): `input` (`inputs` if there are several),
/// `output`, `bytes`, the forecasts and `outputs` (if there may be several); then `findings`;
/// `format`, `up` and `metresPerUnit` for a scene whose format does not specify axis and unit;
/// `engine` if rays were traced; then `settingsHash`, `renderer`, `backend`, `peakMemory` and
/// `milliseconds`. Lists every stage, with 0 if the stage did not run.
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

/// Returns a one-line summary: "out.exr: 24 layers, 7,123,456 fragments, 12.3 MB, 812 ms". The
/// fragments are counted per sample.
std::string summary(const PictureResult& result);

/// Returns the total time, rounded and grouped: "812 ms".
std::string totalText(const StageTimes& milliseconds);

/// Reports a result as the options request: in the report file, as JSON on stdout; `lines` go to
/// stderr. Throws Error (kOutput) if writing fails.
void reportResult(const ReportOptions& options, const Json& json,
                  const std::vector<std::string>& lines, Reporter& reporter);

void reportResult(const ReportOptions& options, const PictureResult& result, Reporter& reporter);

/// Returns the JSON text for --json and --report: indented, with a final newline. Replaces invalid
/// UTF-8, which file names may contain.
std::string jsonText(const Json& json);

/// Writes a result to `path` atomically. Throws Error (kOutput) if writing fails.
void writeReport(const std::filesystem::path& path, const Json& json);

/// Returns the size in bytes of a written file. Throws Error (kOutput) if the file is missing.
std::uint64_t fileBytes(const std::filesystem::path& file);

/// Returns a window as text: "640 x 480 at (0, 0)".
std::string windowText(const Window& window);

/// Returns stops as text that --exposure accepts: "-1.4", "0".
std::string stopsText(float stops);

/// Returns a number with grouped digits: "7,123,456".
std::string groupedText(std::uint64_t value);

/// Returns a number with at most `digits` significant digits: "0.00390625", "1.5e-09".
std::string numberText(double value, int digits = 6);

/// Returns a size in bytes as text: "12.3 MB".
std::string bytesText(std::uint64_t bytes);

/// Returns a count with its noun: "1 layer", "2 layers".
std::string countText(std::uint64_t count, const std::string& noun);

}  // namespace peeler::cmd
