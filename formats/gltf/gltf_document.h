// SPDX-License-Identifier: Apache-2.0
// A glTF file in memory: its model with all indices checked, and its buffers.
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

    /// Without buffers, images, animations, skins and node extensions, which are below.
    tinygltf::Model model;
    nlohmann::json animations, skins;  ///< arrays, as in the file, checked
    nlohmann::json node_extensions;    ///< array: an object or null per node
    nlohmann::json node_extras;        ///< array: any value or null per node

    /// Each buffer's bytes, exactly `byteLength`; empty for a buffer without a URI and for a
    /// placeholder of decompressed data.
    std::vector<std::span<const std::uint8_t>> buffers;

    /// Decoded bytes of compressed buffer views, which take precedence over `buffers`. Empty for
    /// other views; may be shorter than the list of views.
    std::vector<std::span<const std::uint8_t>> decoded_views;

    /// The location of an image; its bytes are read on first use.
    struct ImageSource {
        std::string name, uri;
        int buffer_view = -1;
    };
    std::vector<ImageSource> images;

    std::vector<std::filesystem::path> files;  ///< of buffers and images, each once

    std::vector<Light> lights;
    std::vector<int> node_lights;  ///< by node: index into `lights`, −1 = none

    std::vector<std::string> variants;               ///< names
    std::vector<std::string> undeclared_extensions;  ///< used but not declared

    ReadWarnings warnings;
    std::uint64_t content_hash = 0;  ///< of all bytes read so far
    GltfFolder folder;
    std::deque<std::vector<std::uint8_t>> storage;  ///< owns the bytes of the spans above

    /// Keeps a file's bytes alive and adds them to the hash.
    void warn(const Text& sentence, const Text& where = {}) { warnings.warn(sentence, where); }
    std::span<const std::uint8_t> keep(std::vector<std::uint8_t> bytes);
    /// Returns the bytes at a URI, read through GltfFolder and kept; `where` is its JSON pointer.
    /// Each URI is read once.
    std::span<const std::uint8_t> readUri(const std::string& uri, const std::string& where);

    ReadingMemory memory;

  private:
    std::map<std::string, std::span<const std::uint8_t>> read_;  ///< by URI
};

/// Returns the memory in bytes of parsed JSON. Strings, arrays and objects (maps) are allocated
/// apart from their values, and members are nodes of a red-black tree. The largest array exists
/// three times for a moment when it is freed, since its values move into a list that doubles. The
/// parser has two buffers with the longest string: raw, and as shown in messages.
std::uint64_t parsedBytes(std::string_view text);

/// Reads the file and everything its buffers reference. `document` was constructed for the same
/// path.
void loadGltfDocument(GltfDocument& document, const std::filesystem::path& path,
                      const GltfOptions& options);

}  // namespace peeler
