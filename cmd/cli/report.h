// SPDX-License-Identifier: Apache-2.0
// What a command says of its work: stage times, the JSON result, the summary line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "core/base/stage_times.h"
#include "core/image/sink.h"

namespace peeler::cmd {

/// What is told as JSON: keys stay in the order in which they are set.
using Json = nlohmann::ordered_json;

/// What became of one picture.
struct PictureResult {
    std::filesystem::path output;
    std::optional<int> frame;  ///< of a sequence
    double time = 0;           ///< of the frame, seconds
    bool skipped = false;      ///< it was there already; of the rest only `bytes` is known
    std::uint64_t bytes = 0;
    int width = 0, height = 0;  ///< display window
    std::uint64_t layers = 0;
    std::uint64_t fragments_counted = 0, fragments_stored = 0;
    std::uint64_t fragments_blended = 0;  ///< of those not stored
    int samples = 1;                      ///< a pixel
    std::string method, renderer, backend;
    int passes = 0;
    std::uint64_t peak_memory = 0;  ///< bytes
    StageTimes milliseconds;
};

/// Fills in size, layers and fragments of a picture, what it was made with, and the memory that it
/// took.
void describePicture(const Plan& plan, const Provenance& provenance, PictureResult& result);

/// The keys of a picture (cmd/README.md, "JSON"), in that order; `frame` and `time` only of a
/// sequence. Every stage is there, 0 where it did not happen.
nlohmann::ordered_json toJson(const PictureResult& result);

/// "out.exr: 24 layers, 7,123,456 fragments, 12.3 MB, 812 ms"
std::string summary(const PictureResult& result);

/// The text that --json prints and --report stores: indented, a newline at the end; bytes that are
/// not UTF-8 (file names) replaced.
std::string jsonText(const nlohmann::ordered_json& json);

/// Stores a result under `path`, whole or not at all. Throws Error (kOutput).
void writeReport(const std::filesystem::path& path, const nlohmann::ordered_json& json);

/// The size of a file that is there for all we know. Throws Error (kOutput) if it is not.
std::uint64_t fileBytes(const std::filesystem::path& file);

/// "7,123,456"
std::string groupedText(std::uint64_t value);

/// "12.3 MB"
std::string bytesText(std::uint64_t bytes);

/// "1 layer", "2 layers"
std::string countText(std::uint64_t count, const std::string& noun);

}  // namespace peeler::cmd
