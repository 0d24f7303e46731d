// SPDX-License-Identifier: Apache-2.0
// A glTF file in memory: its model with every index checked, and the bytes of its buffers.
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

    /// Without buffers, images, animations, skins and the extensions of nodes: those are below.
    tinygltf::Model model;
    nlohmann::json animations, skins;  ///< arrays, as the file has them, checked
    nlohmann::json node_extensions;    ///< array: of each node an object, or null
    nlohmann::json node_extras;        ///< array: of each node whatever it has, or null

    /// The bytes of each buffer, exactly `byteLength` of them; empty for one without a URI, and for
    /// one that only marks the place of decompressed data.
    std::vector<std::span<const std::uint8_t>> buffers;

    /// The bytes of the buffer views that an extension compresses, decoded; they go before those in
    /// `buffers`. Empty for the others; may be shorter than the list of views.
    std::vector<std::span<const std::uint8_t>> decoded_views;

    /// Where an image is; its bytes are read when something uses it.
    struct ImageSource {
        std::string name, uri;
        int buffer_view = -1;
    };
    std::vector<ImageSource> images;

    std::vector<std::filesystem::path> files;  ///< that buffers and images name, each once

    std::vector<Light> lights;
    std::vector<int> node_lights;  ///< of each node: an index into `lights`, −1 = none

    std::vector<std::string> variants;               ///< names
    std::vector<std::string> undeclared_extensions;  ///< that the file has and does not declare

    ReadWarnings warnings;
    std::uint64_t content_hash = 0;  ///< of everything read so far
    GltfFolder folder;
    std::deque<std::vector<std::uint8_t>> storage;  ///< what the spans above point into

    /// Adds a sentence to the warnings, as ReadWarnings does.
    void warn(const Text& sentence, const Text& where = {}) { warnings.warn(sentence, where); }
    /// Keeps the bytes of a file alive and lets them enter the hash.
    std::span<const std::uint8_t> keep(std::vector<std::uint8_t> bytes);
    /// The bytes that a URI names, as GltfFolder reads them, kept; `where` is its JSON pointer.
    /// What several things name is read once.
    std::span<const std::uint8_t> readUri(const std::string& uri, const std::string& where);

    ReadingMemory memory;

  private:
    std::map<std::string, std::span<const std::uint8_t>> read_;  ///< by URI
};

/// The bytes of memory that JSON takes once parsed: texts, arrays and objects (maps) are allocated
/// apart from their values, and members are nodes of a red-black tree. The largest array exists
/// three times for a moment when it is freed, since its values are moved into a list that doubles,
/// and the parser has two buffers with the longest text: as it is, and as messages show it.
std::uint64_t parsedBytes(std::string_view text);

/// Reads the file and everything that its buffers name. `document` has been made for this path.
void loadGltfDocument(GltfDocument& document, const std::filesystem::path& path,
                      const GltfOptions& options);

}  // namespace peeler
