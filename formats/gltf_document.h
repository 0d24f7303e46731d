// SPDX-License-Identifier: Apache-2.0
// A glTF file in memory: its model with every index checked, and the bytes of its buffers.
#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <deque>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/scene.h"
#include "formats/gltf_files.h"
#include "formats/gltf_reader.h"

namespace peeler {

struct GltfDocument {
    explicit GltfDocument(const std::filesystem::path& path, std::uint64_t max_file_bytes)
        : folder(path, max_file_bytes) {}
    GltfDocument(const GltfDocument&) = delete;
    GltfDocument& operator=(const GltfDocument&) = delete;

    /// Without buffers, images, animations and skins: we read the first two ourselves (below) and
    /// do not use the others yet.
    tinygltf::Model model;

    /// The bytes of each buffer, exactly `byteLength` of them; empty for one without a URI.
    std::vector<std::span<const std::uint8_t>> buffers;

    /// Where an image is; its bytes are read when something uses it.
    struct ImageSource {
        std::string name, uri;
        int buffer_view = -1;
    };
    std::vector<ImageSource> images;

    std::vector<Light> lights;
    std::vector<int> node_lights;  ///< of each node: an index into `lights`, −1 = none

    std::vector<std::string> variants;  ///< names

    bool has_animations = false, has_skins = false, has_morph_targets = false;

    std::vector<std::string> warnings;
    std::uint64_t content_hash = 0;  ///< of everything read so far
    GltfFolder folder;
    std::deque<std::vector<std::uint8_t>> storage;  ///< what `buffers` points into

    /// Adds a sentence to the warnings unless it stands there already.
    void warn(const std::string& sentence);
    /// Keeps the bytes of a file alive and lets them enter the hash.
    std::span<const std::uint8_t> keep(std::vector<std::uint8_t> bytes);
};

/// Reads the file and everything that its buffers name. `document` has been made for this path.
void loadGltfDocument(GltfDocument& document, const std::filesystem::path& path,
                      const GltfOptions& options);

}  // namespace peeler
