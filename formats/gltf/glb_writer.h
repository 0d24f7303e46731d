// SPDX-License-Identifier: Apache-2.0
// A glTF file with all that belongs to it, open to additions, as one .glb.
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

/// The numbers of a new accessor; no min and max.
struct NewAccessor {
    int component_type = 5126;  ///< glTF's number; 5126 FLOAT, 5123 UNSIGNED_SHORT
    bool normalized = false;
    std::string type = "SCALAR";
    std::size_t count = 0;
};

/// Nothing of the source is interpreted that need not be, so nothing is lost: extras, unknown
/// extensions, compressed data and the order of members stay. The buffers become one (placeholders
/// for decompressed data stay behind it), images move into it, and all other indices stay as they
/// are.
class GlbWriter {
  public:
    /// Reads the file and what its buffers and images name, in the same sandbox as readGltf, which
    /// has to have accepted it before. Throws Error(kInput) as that does, and (kOutput) as soon as
    /// the whole would pass the 4 GiB of a .glb. An image that cannot be taken in stays outside,
    /// with a warning.
    GlbWriter(const std::filesystem::path& path, const GltfOptions& options);
    /// A glTF of a scene that was read from a file of another format (`path`): its nodes, meshes
    /// and materials, with the numbers that they have. Textures are left out, with a warning.
    GlbWriter(const std::filesystem::path& path, const Scene& scene);
    GlbWriter(const GlbWriter&) = delete;
    GlbWriter& operator=(const GlbWriter&) = delete;

    /// Most bytes that one of a glTF holds until it is written, without what is added; `named` are
    /// the files that it names. Reads the file. Throws like the constructor.
    static std::uint64_t memory(const std::filesystem::path& path, const GltfOptions& options,
                                std::span<const std::filesystem::path> named);
    /// Likewise of one of a scene of another format.
    static std::uint64_t memory(const Scene& scene);

    nlohmann::ordered_json& gltf() { return json_; }
    const std::vector<Text>& warnings() const { return warnings_; }

    /// Add something and return its index. `target` is as in glTF 2.0 §5.11.5: 34962 = vertices.
    std::size_t addBufferView(std::vector<std::uint8_t> bytes, std::optional<int> target = {});
    std::size_t addAccessor(std::vector<std::uint8_t> bytes, const NewAccessor& accessor);
    std::size_t addImage(std::vector<std::uint8_t> bytes, const std::string& mime_type,
                         const std::string& name);

    /// Writes the file as .glb (glTF 2.0 §4.4), whole or not at all. Throws Error (kOutput).
    /// Nothing may be added afterwards.
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
    std::deque<std::vector<std::uint8_t>> storage_;  ///< what the spans point into
    /// The parts of the binary chunk; each begins at a multiple of 4 bytes.
    std::vector<std::span<const std::uint8_t>> parts_;
    std::uint64_t size_ = 0;  ///< of all parts, padded
    /// Of each buffer of the source: where it begins in the binary chunk; none if it is not there.
    std::vector<std::optional<std::uint64_t>> starts_;
    std::vector<std::size_t> placeholders_;  ///< of each buffer that is not there, its new index
    std::vector<Text> warnings_;
    ReadWarnings given_by_read_gltf_{false, {}};
};

}  // namespace peeler
