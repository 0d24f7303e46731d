// SPDX-License-Identifier: Apache-2.0
// A glTF file in memory: its buffers, and its model with all indices checked.
#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/gltf_options.h>
#include <peeler/scene.h>
#include "formats/file/read_warnings.h"
#include "formats/file/reading_limits.h"
#include "formats/gltf/gltf_files.h"

namespace peeler {

struct GltfDocument {
    GltfDocument(const std::filesystem::path& path, const GltfOptions& options)
        : warnings(options.strict, path.string()),
          folder(path, options.max_file_bytes, options.allow_outside),
          memory(options.memory) {}
    GltfDocument(const GltfDocument&) = delete;
    GltfDocument& operator=(const GltfDocument&) = delete;

    /// tinygltf's model without buffers, images, animations, skins and node extensions, which have
    /// their own members below.
    tinygltf::Model model;
    nlohmann::json animations, skins;  ///< JSON arrays, which have been checked
    nlohmann::json node_extensions;    ///< JSON array: an object or null for each node
    nlohmann::json node_extras;        ///< JSON array: any value or null for each node

    /// The bytes of each buffer, exactly `byteLength`; empty for buffers without a URI (except the
    /// binary chunk) and for placeholders of decompressed data.
    std::vector<std::span<const std::uint8_t>> buffers;

    /// The decoded bytes of each compressed buffer view, used instead of those in `buffers`; empty
    /// for other views. May have fewer elements than the list of views.
    std::vector<std::span<const std::uint8_t>> decoded_views;

    /// The location of an image. The image's bytes are read on first use.
    struct ImageSource {
        std::string name, uri;
        int buffer_view = -1;
    };
    std::vector<ImageSource> images;

    std::vector<std::filesystem::path> files;  ///< files of buffers and images, each listed once

    std::vector<Light> lights;
    std::vector<int> node_lights;  ///< for each node, an index into `lights`; −1 for no light

    std::vector<std::string> variants;  ///< names of the material variants
    /// Names of extensions that are used but not declared.
    std::vector<std::string> undeclared_extensions;

    ReadWarnings warnings;
    std::uint64_t content_hash = 0;  ///< hash of all bytes read so far
    GltfFolder folder;
    /// Storage of the bytes that the spans above refer to.
    std::deque<std::vector<std::uint8_t>> storage;

    void warn(const Text& sentence, const Text& where = {}) { warnings.warn(sentence, where); }
    /// Stores a file's bytes in `storage`, adds them to the hash, and returns them.
    std::span<const std::uint8_t> keep(std::vector<std::uint8_t> bytes);
    /// Returns the bytes at a URI. Reads a file once, through GltfFolder, and keeps its bytes.
    /// `where` is the JSON pointer of the URI.
    std::span<const std::uint8_t> readUri(const std::string& uri, const std::string& where);

    ReadingMemory memory;

  private:
    /// Bytes of each file read so far, by URI.
    std::map<std::string, std::span<const std::uint8_t>> read_;
};

/// Returns the memory, in bytes, that parsing a JSON text takes. Strings, arrays and objects (maps)
/// are allocated separately from their values; the members of objects are nodes of a red-black
/// tree. When the largest array is freed, its values move into a list that doubles its storage, so
/// the values are briefly in memory three times. The parser holds the longest string in two
/// buffers: the raw text, and the text for messages.
std::uint64_t parsedBytes(std::string_view text);

/// Reads the file and all files of its buffers into `document`, which must have been constructed
/// for the same path.
void loadGltfDocument(GltfDocument& document, const std::filesystem::path& path,
                      const GltfOptions& options);

}  // namespace peeler
