// SPDX-License-Identifier: Apache-2.0
// Runs the command on deliberately broken files. Within limits of time and memory, the command must
// write a picture or report an input error, and must never write a picture with missing geometry.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "assets/model_files.h"
#include "core/base/parallel.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostMemory = std::uint64_t{512} << 20;

/// An error code of the Khronos validator for a fault that makes geometry unusable. peeler must
/// reject the file if the error's JSON pointer begins with `below`. After errors elsewhere (a
/// missing image, a skin without joints), peeler can still draw the rest.
struct Unusable {
    const char* code;
    const char* below;
};
constexpr Unusable kUnusable[] = {
    // There is no JSON, or the container is truncated.
    {"GLB_INVALID_MAGIC", ""},
    {"GLB_UNEXPECTED_END_OF_HEADER", ""},
    {"GLB_UNEXPECTED_FIRST_CHUNK", ""},
    {"GLB_LENGTH_MISMATCH", ""},
    {"GLB_CHUNK_TOO_BIG", ""},
    {"GLB_UNEXPECTED_END_OF_CHUNK_DATA", ""},
    {"INVALID_JSON", ""},
    // The vertices, or the nodes that place them, are missing.
    {"TYPE_MISMATCH", "/buffers"},
    {"TYPE_MISMATCH", "/bufferViews"},
    {"TYPE_MISMATCH", "/accessors"},
    {"TYPE_MISMATCH", "/meshes"},
    {"TYPE_MISMATCH", "/nodes"},
    // Skipping a broken element would shift the indices of later elements.
    {"TYPE_MISMATCH", "/materials"},
    {"UNDEFINED_PROPERTY", "/buffers"},
    {"UNDEFINED_PROPERTY", "/bufferViews"},
    {"UNDEFINED_PROPERTY", "/accessors"},
    {"UNDEFINED_PROPERTY", "/meshes"},
    {"UNRESOLVED_REFERENCE", "/bufferViews"},
    {"UNRESOLVED_REFERENCE", "/accessors"},
    {"UNRESOLVED_REFERENCE", "/meshes"},
    {"UNRESOLVED_REFERENCE", "/nodes"},
    {"UNRESOLVED_REFERENCE", "/scenes"},
    {"VALUE_NOT_IN_RANGE", "/bufferViews"},
    {"VALUE_NOT_IN_RANGE", "/accessors"},
    {"IO_ERROR", "/buffers"},
    {"INVALID_URI", "/buffers"},
    {"BUFFER_BYTE_LENGTH_MISMATCH", ""},
    // The data exists but is invalid.
    {"ACCESSOR_SPARSE_COUNT_OUT_OF_RANGE", ""},
    {"ACCESSOR_INDEX_PRIMITIVE_RESTART", ""},
    {"MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT", ""},
    {"NODE_LOOP", ""},
    {"NODE_PARENT_OVERRIDE", ""},
};

/// Files that peeler reads although the validator rejects them.
constexpr const char* kReadAllTheSame[] = {
    "json/bom.gltf",                     // byte order mark; RFC 8259 §8.1 lets readers ignore it
    "buffer_view/zero_bytelength.gltf",  // gives a warning: some Cesium tiles have such views
};

struct Message {
    std::string code, pointer;
};

std::vector<Message> errorsOf(const fs::path& report) {
    std::vector<Message> errors;
    if (!fs::exists(report)) return errors;
    const auto json = nlohmann::json::parse(bytesOf(report));
    for (const auto& message : json.at("issues").at("messages"))
        if (message.at("severity") == 0)
            errors.push_back({message.at("code"), message.value("pointer", "")});
    return errors;
}

bool unusable(const Message& message) {
    for (const Unusable& row : kUnusable)
        if (message.code == row.code && message.pointer.starts_with(row.below)) return true;
    return false;
}

/// Returns the location at the end of the error's line.
std::string placeOf(const std::string& err) {
    const std::size_t begin = err.find("peeler: error: ");
    if (begin == std::string::npos) return "";
    const std::string line = err.substr(begin, err.find('\n', begin) - begin);
    return line.substr(line.rfind(": ") + 2);
}

/// Whether one JSON pointer is a parent of the other, or both are equal.
bool related(const std::string& a, const std::string& b) {
    return a.starts_with(b) || b.starts_with(a);
}

void check(const fs::path& file, const CommandResult& run) {
    EXPECT_TRUE(run.exit_code == 0 || run.exit_code == 3) << run.exit_code << ": " << run.err;
    EXPECT_LT(run.cpu_seconds, kEndlessSeconds);
    if (!kShadowMemory) {
        EXPECT_LT(run.peak_memory, kMostMemory);
    }
    EXPECT_EQ(run.err.find("Sanitizer"), std::string::npos) << run.err;
    EXPECT_EQ(run.err.find("runtime error"), std::string::npos) << run.err;
    if (run.exit_code == 3) {
        EXPECT_NE(run.err.find("peeler: hint: "), std::string::npos) << run.err;
        EXPECT_FALSE(placeOf(run.err).empty()) << run.err;
    }

    bool must_be_refused = false, has_pointer = false, place_agrees = false;
    for (const Message& message : errorsOf(fs::path(file.string() + ".report.json"))) {
        must_be_refused = must_be_refused || unusable(message);
        has_pointer = has_pointer || (unusable(message) && !message.pointer.empty());
        place_agrees = place_agrees || (unusable(message) && !message.pointer.empty() &&
                                        related(placeOf(run.err), message.pointer));
    }
    for (const char* read : kReadAllTheSame)
        if (file.string().ends_with(read)) must_be_refused = false;
    if (!must_be_refused) return;
    EXPECT_EQ(run.exit_code, 3) << "the validator calls its geometry unusable";
    if (has_pointer) {
        EXPECT_EQ(placeOf(run.err)[0], '/') << run.err;
        EXPECT_TRUE(place_agrees) << run.err;
    }
}

TEST(Malformed, FilesEndInAPictureOrAnInputError) {
    PEELER_REQUIRE_ASSETS(assets);
    const std::vector<fs::path> files = modelFiles(assets / "malformed-gltf");
    ASSERT_EQ(files.size(), 150U);
    const ScratchDir scratch;
    std::vector<CommandResult> runs(files.size());
    parallelFor(files.size(), [&](std::size_t i) {
        runs[i] =
            runPeelerProcess({"render", files[i], "-o", scratch / (std::to_string(i) + ".exr"),
                              "--size", "32x24", "--backend", "egl"});
    });
    std::size_t refused = 0;
    double slowest = 0;
    std::uint64_t largest = 0;
    for (std::size_t i = 0; i < files.size(); ++i) {
        SCOPED_TRACE(files[i].string());
        check(files[i], runs[i]);
        EXPECT_EQ(fs::exists(scratch / (std::to_string(i) + ".exr")), runs[i].exit_code == 0);
        refused += runs[i].exit_code == 3;
        slowest = std::max(slowest, runs[i].cpu_seconds);
        largest = std::max(largest, runs[i].peak_memory);
    }
    std::printf("%zu files, %zu refused; at most %.2f s and %.0f MB\n", files.size(), refused,
                slowest, static_cast<double>(largest) / 1e6);
    EXPECT_GT(refused, 70U);
    EXPECT_LT(refused, files.size());
}

}  // namespace
}  // namespace peeler::test
