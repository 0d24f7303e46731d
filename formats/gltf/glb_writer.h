// SPDX-License-Identifier: Apache-2.0
// Editable copy of a glTF file with its buffers and images, which can be saved as one .glb.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <peeler/gltf_options.h>
#include <peeler/scene.h>
#include <peeler/text.h>
#include "formats/file/read_warnings.h"
#include "formats/gltf/gltf_files.h"

namespace peeler {

/// The properties of a new accessor. The accessor has no min and max.
struct NewAccessor {
    int component_type = 5126;  ///< as in glTF: 5126 FLOAT, 5123 UNSIGNED_SHORT
    bool normalized = false;
    std::string type = "SCALAR";
    std::size_t count = 0;
};

/// A glTF file that can be edited and saved as .glb. The class interprets as little as possible, so
/// extras, unknown extensions, compressed data and the order of members are kept. All buffers
/// become one buffer, followed only by placeholders for decompressed data; images are embedded.
/// Indices into all other arrays stay valid.
class GlbWriter {
  public:
    /// Reads the file and the files of its buffers and images, in the same sandbox as readGltf(),
    /// which must have accepted the file. An image that cannot be embedded stays external, with a
    /// warning. Throws the errors of readGltf(), and Error (kOutput) if the result would exceed the
    /// 4 GiB limit of a .glb.
    GlbWriter(const std::filesystem::path& path, const GltfOptions& options);
    /// Converts the nodes, meshes and materials of a scene that was read from `path`, a file of
    /// another format. All numbers stay unchanged. Omits textures, with a warning.
    GlbWriter(const std::filesystem::path& path, const Scene& scene);
    GlbWriter(const GlbWriter&) = delete;
    GlbWriter& operator=(const GlbWriter&) = delete;

    /// Returns the peak memory of a GlbWriter of this glTF file before write(), in bytes, without
    /// the objects added to it. `named` are the external files to which the file refers. Reads the
    /// file. Throws the errors of the constructor.
    static std::uint64_t memory(const std::filesystem::path& path, const GltfOptions& options,
                                std::span<const std::filesystem::path> named);
    /// Returns the peak memory of a GlbWriter of a scene before write(), in bytes.
    static std::uint64_t memory(const Scene& scene);

    nlohmann::ordered_json& gltf() { return json_; }
    const std::vector<Text>& warnings() const { return warnings_; }

    /// Add an object and return its index. `target` is as in glTF 2.0 §5.11.5; 34962 is
    /// ARRAY_BUFFER.
    std::size_t addBufferView(std::vector<std::uint8_t> bytes, std::optional<int> target = {});
    std::size_t addAccessor(std::vector<std::uint8_t> bytes, const NewAccessor& accessor);
    std::size_t addImage(std::vector<std::uint8_t> bytes, const std::string& mime_type,
                         const std::string& name);

    /// Writes the .glb (glTF 2.0 §4.4) atomically. Throws Error (kOutput). Nothing may be added
    /// afterwards.
    void write(const std::string& path);

  private:
    void takeBuffers(const nlohmann::json& checked,
                     std::optional<std::span<const std::uint8_t>> binary);
    void relocate(nlohmann::ordered_json& place) const;
    void takeImages();
    std::optional<std::span<const std::uint8_t>> bufferBytes(
        const nlohmann::json& buffer, std::size_t index,
        std::optional<std::span<const std::uint8_t>> binary);
    std::uint64_t append(std::span<const std::uint8_t> bytes);
    nlohmann::ordered_json primitiveJson(const Primitive& primitive, std::size_t materials);

    std::string path_;
    GltfFolder folder_;
    nlohmann::ordered_json json_;
    /// Storage of the bytes that the spans below refer to.
    std::deque<std::vector<std::uint8_t>> storage_;
    /// Parts of the binary chunk. Each part starts at a multiple of 4 bytes.
    std::vector<std::span<const std::uint8_t>> parts_;
    std::uint64_t size_ = 0;  ///< total size of the parts with padding, in bytes
    /// For each source buffer, its offset in the binary chunk; no value if the buffer is not
    /// embedded.
    std::vector<std::optional<std::uint64_t>> starts_;
    std::vector<std::size_t> placeholders_;  ///< new index of each buffer without data
    std::vector<Text> warnings_;
    ReadWarnings given_by_read_gltf_{false, {}};
};

}  // namespace peeler
