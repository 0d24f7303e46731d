// SPDX-License-Identifier: Apache-2.0
// The .glb container and the JSON of glTF files.
#include "formats/gltf/gltf_container.h"

#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include <peeler/error.h>
#include "formats/file/json_text.h"
#include "formats/file/read_warnings.h"

namespace peeler {
namespace {

constexpr std::uint32_t kChunkJson = 0x4E4F534A, kChunkBinary = 0x004E4942;
constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;

std::uint32_t littleEndian32(std::span<const std::uint8_t> bytes, std::size_t offset) {
    return static_cast<std::uint32_t>(bytes[offset]) |
           static_cast<std::uint32_t>(bytes[offset + 1]) << 8U |
           static_cast<std::uint32_t>(bytes[offset + 2]) << 16U |
           static_cast<std::uint32_t>(bytes[offset + 3]) << 24U;
}

[[noreturn]] void failContainer(const std::string& what, const std::string& path,
                                const char* hint = "copy or export the file again") {
    throw Error(ErrorKind::kInput, what, path, hint);
}

[[noreturn]] void failTruncated(const char* part, std::uint64_t promised, std::uint64_t present,
                                const std::string& path) {
    failContainer("the file is truncated: the " + std::string(part) + " says " +
                      std::to_string(promised) + " bytes, but only " + std::to_string(present) +
                      " are there",
                  path);
}

constexpr char kSceneHint[] = "a scene is a .gltf or .glb file";

/// Returns the text of a JSON object, without a leading byte order mark.
std::string_view objectText(std::string_view text, const std::string& path) {
    if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
    const std::size_t begin = text.find_first_not_of(" \t\r\n");
    if (begin == std::string_view::npos)
        failContainer("the file contains no JSON, only white space or nothing", path);
    if (text[begin] == '[')
        failContainer("this JSON is not glTF: it is an array, not an object", path, kSceneHint);
    if (text[begin] != '{')
        failContainer("the file is neither binary glTF nor a JSON object", path, kSceneHint);
    return text;
}

}  // namespace

bool isGlb(std::span<const std::uint8_t> bytes) {
    return bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
}

GltfContainer splitGltfContainer(std::span<const std::uint8_t> bytes, const std::string& path,
                                 ReadWarnings& warnings) {
    if (!isGlb(bytes))
        return {{reinterpret_cast<const char*>(bytes.data()), bytes.size()}, std::nullopt};

    if (bytes.size() < kHeaderBytes) failTruncated("header", kHeaderBytes, bytes.size(), path);
    const std::uint32_t version = littleEndian32(bytes, 4);
    const std::uint32_t length = littleEndian32(bytes, 8);
    if (version != 2)
        failContainer(
            "the file is binary glTF " + std::to_string(version) + ", but only version 2 is read",
            path, "convert it to glTF 2.0");
    if (length > bytes.size()) failTruncated("header", length, bytes.size(), path);
    if (length < bytes.size()) {
        warnings.warn("The file is longer than its header says; the rest is ignored.", path);
        bytes = bytes.first(length);
    }

    GltfContainer result;
    std::size_t offset = kHeaderBytes;
    bool crowded = false;
    for (int chunk = 0; offset < bytes.size(); ++chunk) {
        const std::size_t left = bytes.size() - offset;
        if (left < kChunkHeaderBytes) failTruncated("chunk header", kChunkHeaderBytes, left, path);
        const std::uint32_t chunk_length = littleEndian32(bytes, offset);
        const std::uint32_t type = littleEndian32(bytes, offset + 4);
        offset += kChunkHeaderBytes;
        if (chunk_length > bytes.size() - offset)
            failTruncated("chunk header", chunk_length, bytes.size() - offset, path);
        const std::span<const std::uint8_t> data = bytes.subspan(offset, chunk_length);
        if (chunk == 0 && type != kChunkJson) failContainer("the first chunk is not JSON", path);
        if (chunk == 0) {
            result.json = {reinterpret_cast<const char*>(data.data()), data.size()};
        } else if (type == kChunkBinary && !result.binary) {
            result.binary = data;
        } else if ((type == kChunkBinary || type == kChunkJson) && !std::exchange(crowded, true)) {
            warnings.warn(
                "The file has more than one JSON or binary chunk; the extra ones are ignored.",
                path);
        }
        offset += chunk_length;
    }
    if (bytes.size() == kHeaderBytes) failContainer("the file has no JSON chunk", path);
    return result;
}

nlohmann::json parseGltfJson(std::string_view text, const std::string& path) {
    return parseJson(objectText(text, path), path);
}

nlohmann::ordered_json parseOrderedGltfJson(std::string_view text, const std::string& path) {
    return parseOrderedJson(objectText(text, path), path);
}

}  // namespace peeler
