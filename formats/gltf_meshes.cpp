// SPDX-License-Identifier: Apache-2.0
// glTF meshes to the scene's: vertex attributes, indices, topology.
#include "formats/gltf_meshes.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "formats/gltf_accessor.h"
#include "formats/gltf_schema.h"
#include "formats/gltf_variants.h"

namespace peeler {
namespace {

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123,
              kFloat = 5126;

// glTF 2.0 §3.7.2.1, and beyond it KHR_mesh_quantization. A file that uses the latter's types
// without naming the extension is read all the same: there is one way only to understand it.
const AccessorFormat kPosition = {{3},
                                  {{kFloat},
                                   {kByte},
                                   {kByte, true},
                                   {kUnsignedByte},
                                   {kUnsignedByte, true},
                                   {kShort},
                                   {kShort, true},
                                   {kUnsignedShort},
                                   {kUnsignedShort, true}}};
const AccessorFormat kNormal = {{3}, {{kFloat}, {kByte, true}, {kShort, true}}};
const AccessorFormat kTangent = {{4}, {{kFloat}, {kByte, true}, {kShort, true}}};
const AccessorFormat kTexcoord = {{2},
                                  {{kFloat},
                                   {kUnsignedByte, true},
                                   {kUnsignedShort, true},
                                   {kByte},
                                   {kByte, true},
                                   {kUnsignedByte},
                                   {kShort},
                                   {kShort, true},
                                   {kUnsignedShort}}};
const AccessorFormat kColor = {{3, 4}, {{kFloat}, {kUnsignedByte, true}, {kUnsignedShort, true}}};

std::uint64_t bytesOf(const Primitive& primitive) {
    const auto bytes = [](const auto& values) { return values.size() * sizeof(values[0]); };
    return bytes(primitive.positions) + bytes(primitive.normals) + bytes(primitive.tangents) +
           bytes(primitive.texcoords[0]) + bytes(primitive.texcoords[1]) + bytes(primitive.colors) +
           bytes(primitive.indices);
}

class PrimitiveReader {
  public:
    PrimitiveReader(GltfDocument& document, const tinygltf::Primitive& source, std::string where)
        : document_(document), accessors_(document), source_(source), where_(std::move(where)) {}

    /// False if it draws nothing.
    bool read(Primitive& out) {
        const auto position = source_.attributes.find("POSITION");
        if (position == source_.attributes.end()) {
            document_.warn("The primitive " + where_ + " has no POSITION; it is left out.");
            return false;
        }
        refuseCompressed(position->second);
        vertex_count_ = accessors_.count(position->second);
        used_ = {0, vertex_count_};
        out.topology = static_cast<Topology>(source_.mode);
        if (source_.indices >= 0) {
            out.indices = indices();
            keepUsedVertices(out.indices);
        }
        out.positions = attribute<glm::vec3>("POSITION", kPosition);
        out.normals = attribute<glm::vec3>("NORMAL", kNormal);
        out.tangents = attribute<glm::vec4>("TANGENT", kTangent);
        out.texcoords[0] = attribute<glm::vec2>("TEXCOORD_0", kTexcoord);
        out.texcoords[1] = attribute<glm::vec2>("TEXCOORD_1", kTexcoord);
        out.colors = colors();
        return dropIncomplete(out);
    }

  private:
    /// A fallback-less compressed primitive has accessors that read as zeros (Draco) by the letter.
    void refuseCompressed(int position) const {
        const tinygltf::Accessor& accessor =
            document_.model.accessors[static_cast<std::size_t>(position)];
        if (source_.extensions.contains("KHR_draco_mesh_compression") && accessor.bufferView < 0 &&
            !accessor.sparse.isSparse)
            throw Error(ErrorKind::kInput,
                        "the primitive is Draco-compressed and has no uncompressed fallback",
                        where_ + "/extensions/KHR_draco_mesh_compression",
                        "decompress it, e.g. with: gltf-transform copy in.glb out.glb");
    }

    std::vector<float> numbers(const char* name, const AccessorFormat& format, int& components) {
        const auto found = source_.attributes.find(name);
        if (found == source_.attributes.end()) return {};
        const std::string where = where_ + "/attributes/" + name;
        if (accessors_.count(found->second) != vertex_count_)
            throw Error(ErrorKind::kInput,
                        "the attribute has " + std::to_string(accessors_.count(found->second)) +
                            " elements, POSITION has " + std::to_string(vertex_count_),
                        where, "check the file with the Khronos glTF validator");
        components = accessors_.components(found->second);
        std::vector<float> values = accessors_.floats(found->second, format, used_, where);
        for (float& value : values) {
            if (std::isfinite(value)) continue;
            if (std::strcmp(name, "POSITION") == 0)
                throw Error(ErrorKind::kInput, "a vertex position is not a finite number", where,
                            "export the file again");
            value = 0;
            document_.warn("The attribute " + where +
                           " holds numbers that are not finite; zeros "
                           "stand in for them.");
        }
        return values;
    }

    template <typename Vector>
    std::vector<Vector> attribute(const char* name, const AccessorFormat& format) {
        int components = 0;
        const std::vector<float> values = numbers(name, format, components);
        static_assert(sizeof(Vector) == sizeof(float) * Vector::length());
        std::vector<Vector> result(values.size() / Vector::length());
        if (!values.empty())
            std::memcpy(result.data(), values.data(), values.size() * sizeof(float));
        return result;
    }

    std::vector<glm::vec4> colors() {
        int components = 4;
        const std::vector<float> values = numbers("COLOR_0", kColor, components);
        const auto width = static_cast<std::size_t>(components);
        std::vector<glm::vec4> result(values.size() / width, glm::vec4(1));
        for (std::size_t i = 0; i < values.size(); ++i)
            result[i / width][static_cast<int>(i % width)] = values[i];
        return result;
    }

    std::vector<std::uint32_t> indices() const {
        const std::string where = where_ + "/indices";
        std::uint32_t restart = 0;
        std::vector<std::uint32_t> result = accessors_.indices(source_.indices, where, restart);
        for (std::size_t i = 0; i < result.size(); ++i) {
            if (result[i] < vertex_count_ && result[i] != restart) continue;
            throw Error(
                ErrorKind::kInput,
                "index " + std::to_string(i) + " is " + std::to_string(result[i]) +
                    (result[i] == restart
                         ? ", the primitive restart value, which glTF forbids"
                         : ", the primitive has " + std::to_string(vertex_count_) + " vertices"),
                where, "check the file with the Khronos glTF validator");
        }
        return result;
    }

    /// Exporters like to let all primitives share one large vertex array and index a stretch of it
    /// each: without this, the array would be copied for every primitive.
    void keepUsedVertices(std::vector<std::uint32_t>& indices) {
        const auto [first, last] = std::minmax_element(indices.begin(), indices.end());
        used_ = {*first, std::size_t{*last} - *first + 1};
        if (used_.first == 0) return;
        for (std::uint32_t& index : indices)
            index -= static_cast<std::uint32_t>(used_.first);
    }

    /// §3.7.2.1: vertices that do not fill a last point, line or triangle are ignored.
    bool dropIncomplete(Primitive& out) {
        const std::size_t count = out.indices.empty() ? used_.count : out.indices.size();
        std::size_t usable = count, least = 1;
        switch (out.topology) {
            case Topology::kPoints:
                break;
            case Topology::kLines:
                usable = count / 2 * 2;
                least = 2;
                break;
            case Topology::kLineLoop:
            case Topology::kLineStrip:
                least = 2;
                break;
            case Topology::kTriangles:
                usable = count / 3 * 3;
                least = 3;
                break;
            case Topology::kTriangleStrip:
            case Topology::kTriangleFan:
                least = 3;
                break;
        }
        if (usable < least) {
            document_.warn("The primitive " + where_ +
                           " has too few vertices to draw anything; "
                           "it is left out.");
            return false;
        }
        if (usable == count) return true;
        document_.warn("The primitive " + where_ +
                       " has vertices left over that fill no line or "
                       "triangle; they are ignored.");
        if (!out.indices.empty()) {
            out.indices.resize(usable);
            return true;
        }
        const auto shorten = [&](auto& values) {
            if (!values.empty()) values.resize(usable);
        };
        shorten(out.positions);
        shorten(out.normals);
        shorten(out.tangents);
        for (auto& texcoords : out.texcoords)
            shorten(texcoords);
        shorten(out.colors);
        return true;
    }

    GltfDocument& document_;
    AccessorReader accessors_;
    const tinygltf::Primitive& source_;
    std::string where_;
    std::size_t vertex_count_ = 0;
    ElementRange used_;  ///< of the vertices
};

}  // namespace

std::vector<Mesh> readGltfMeshes(GltfDocument& document, const GltfOptions& options,
                                 int default_material) {
    std::vector<Mesh> meshes;
    std::uint64_t geometry_bytes = 0;
    meshes.reserve(document.model.meshes.size());
    for (std::size_t i = 0; i < document.model.meshes.size(); ++i) {
        const tinygltf::Mesh& source = document.model.meshes[i];
        Mesh& mesh = meshes.emplace_back();
        mesh.name = source.name;
        for (std::size_t j = 0; j < source.primitives.size(); ++j) {
            const tinygltf::Primitive& from = source.primitives[j];
            const std::string where = childPointer(childPointer("/meshes", i) + "/primitives", j);
            if (!from.targets.empty()) document.has_morph_targets = true;
            Primitive primitive;
            primitive.material = from.material >= 0 ? from.material : default_material;
            primitive.variants = variantMaterials(from, document.variants.size());
            if (!PrimitiveReader(document, from, where).read(primitive)) continue;
            geometry_bytes += bytesOf(primitive);
            if (geometry_bytes > options.max_geometry_bytes)
                throw Error(ErrorKind::kInput,
                            "the geometry needs more than the limit of " +
                                std::to_string(options.max_geometry_bytes) + " bytes",
                            where, "split the scene");
            mesh.primitives.push_back(std::move(primitive));
        }
    }
    return meshes;
}

}  // namespace peeler
