// SPDX-License-Identifier: Apache-2.0
// Conversion of glTF meshes: vertex attributes, indices, topology.
#include "formats/gltf/gltf_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <type_traits>

#include <peeler/error.h>
#include "core/scene/material.h"
#include "formats/gltf/gltf_accessor.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123,
              kFloat = 5126;

// Formats that glTF 2.0 §3.7.2.1 and KHR_mesh_quantization allow. Positions may have the types of
// KHR_mesh_quantization even if a file does not declare the extension, since these types are
// unambiguous.
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
const AccessorFormat kTexcoord = {
    {2}, {{kFloat}, {kByte, true}, {kUnsignedByte, true}, {kShort, true}, {kUnsignedShort, true}}};
/// Formats that are allowed if the file declares KHR_mesh_quantization. Integers that are not
/// normalised are used unchanged.
const AccessorFormat kQuantizedTexcoord = {{2}, kPosition.allowed};
const AccessorFormat kColor = {{3, 4}, {{kFloat}, {kUnsignedByte, true}, {kUnsignedShort, true}}};
const AccessorFormat kJoints = {{4}, {{kUnsignedByte}, {kUnsignedShort}}};
const AccessorFormat kWeights = {{4}, {{kFloat}, {kUnsignedByte, true}, {kUnsignedShort, true}}};
const AccessorFormat kDisplacement = {{3},
                                      {{kFloat}, {kByte}, {kByte, true}, {kShort}, {kShort, true}}};
const AccessorFormat kColorDisplacement = {
    {3, 4},
    {{kFloat}, {kByte, true}, {kUnsignedByte, true}, {kShort, true}, {kUnsignedShort, true}}};

constexpr const char* kQuantization = "KHR_mesh_quantization";

/// Calls body(array) for every array with one element per vertex. Arrays may be empty.
template <class SomePrimitive, class Body>
void forEachVertexArray(SomePrimitive& primitive, const Body& body) {
    body(primitive.positions);
    body(primitive.normals);
    body(primitive.tangents);
    for (auto& texcoords : primitive.texcoords)
        body(texcoords);
    body(primitive.colors);
    for (auto& set : primitive.joint_sets) {
        body(set.joints);
        body(set.weights);
    }
    for (auto& target : primitive.targets) {
        body(target.positions);
        body(target.normals);
        body(target.tangents);
        for (auto& texcoords : target.texcoords)
            body(texcoords);
        body(target.colors);
    }
}

/// Returns the bytes that a splat takes besides its position.
std::uint64_t splatBytes(const Splats& splats) {
    return sizeof(glm::vec3) + sizeof(glm::vec4) + sizeof(float) +
           splats.coefficients() * sizeof(glm::vec3);
}

std::uint64_t primitiveBytes(const Primitive& primitive) {
    std::uint64_t sum = primitive.indices.size() * sizeof(std::uint32_t);
    forEachVertexArray(primitive,
                       [&](const auto& values) { sum += values.size() * sizeof(values[0]); });
    if (primitive.splats) sum += primitive.positions.size() * splatBytes(*primitive.splats);
    return sum;
}

class PrimitiveReader {
  public:
    PrimitiveReader(GltfDocument& document, const tinygltf::Primitive& source, std::string where,
                    const SizeLimit& budget)
        : document_(document),
          accessors_(document),
          source_(source),
          where_(std::move(where)),
          budget_(budget) {}

    /// Reads the primitive. Returns false, with a warning, if the primitive draws nothing.
    bool read(Primitive& out) {
        const auto position = source_.attributes.find("POSITION");
        if (position == source_.attributes.end()) {
            document_.warn("The primitive " + where_ + " has no POSITION; it is left out.");
            return false;
        }
        vertex_count_ = accessors_.count(position->second);
        used_ = {0, vertex_count_};
        out.topology = static_cast<Topology>(source_.mode);
        if (vertex_count_ == 0 || (source_.indices >= 0 && accessors_.count(source_.indices) == 0))
            return leaveOut();
        if (source_.indices >= 0) {
            out.indices = indices();
            keepUsedVertices(out.indices);
        }
        out.source.first_vertex = used_.first;
        out.source.vertices = vertex_count_;
        out.positions = attribute<glm::vec3>("POSITION", kPosition);
        if (isGltfSplats(source_)) {
            readSplats(out);
            return true;
        }
        out.normals = attribute<glm::vec3>("NORMAL", kNormal);
        out.tangents = attribute<glm::vec4>("TANGENT", kTangent);
        for (std::size_t set = 0; set < out.texcoords.size(); ++set)
            out.texcoords[set] =
                attribute<glm::vec2>("TEXCOORD_" + std::to_string(set), texcoordFormat());
        out.colors = colors(source_.attributes, where_ + "/attributes", kColor, glm::vec4(1));
        readJoints(out);
        mend(out);
        checkNames(source_.attributes, where_ + "/attributes", out.joint_sets.size());
        for (std::size_t i = 0; i < source_.targets.size(); ++i)
            out.targets.push_back(target(source_.targets[i], childPointer(where_ + "/targets", i)));
        return dropIncomplete(out);
    }

  private:
    using Attributes = std::map<std::string, int>;

    /// Returns the values of an attribute of `from`, or an empty list if the attribute is missing.
    /// `where` is the JSON pointer of `from`.
    std::vector<float> numbers(const Attributes& from, const std::string& where,
                               const std::string& name, const AccessorFormat& format,
                               int& components) {
        const auto found = from.find(name);
        if (found == from.end()) return {};
        const std::string use = where + '/' + name;
        if (accessors_.count(found->second) != vertex_count_)
            failGltf("the attribute has " + std::to_string(accessors_.count(found->second)) +
                         " elements, but POSITION has " + std::to_string(vertex_count_),
                     use);
        components = accessors_.components(found->second);
        // Check the budget for the result, too: many primitives may refer to the same accessor
        // without data, which takes no bytes in the file.
        least_bytes_ +=
            used_.count * static_cast<std::uint64_t>(components) * sizeof(std::uint16_t);
        budget_.check(least_bytes_,
                      childPointer("/accessors", static_cast<std::size_t>(found->second)));
        // The values are in memory twice: as raw floats and in the primitive.
        document_.memory.allow(
            2 * used_.count * static_cast<std::size_t>(components) * sizeof(float), use);
        std::vector<float> values = accessors_.floats(found->second, format, used_, use);
        for (float& value : values) {
            if (std::isfinite(value)) continue;
            if (name == "POSITION" || isSplatAttributeName(name))
                throw Error(ErrorKind::kInput,
                            name == "POSITION" ? "a vertex position is not a finite number"
                                               : "a number of a splat is not finite",
                            use, "export the file again");
            value = 0;
            document_.warn("The attribute " + use +
                           " holds numbers that are not finite; they are taken as 0.");
        }
        return values;
    }

    template <typename Vector>
    std::vector<Vector> vectors(const Attributes& from, const std::string& where,
                                const std::string& name, const AccessorFormat& format) {
        int components = 0;
        const std::vector<float> values = numbers(from, where, name, format, components);
        static_assert(sizeof(Vector) == sizeof(float) * Vector::length());
        std::vector<Vector> result(values.size() / Vector::length());
        if (!values.empty())
            std::memcpy(result.data(), values.data(), values.size() * sizeof(float));
        return result;
    }

    template <typename Vector>
    std::vector<Vector> attribute(const std::string& name, const AccessorFormat& format) {
        return vectors<Vector>(source_.attributes, where_ + "/attributes", name, format);
    }

    const AccessorFormat& texcoordFormat() const {
        const std::vector<std::string>& used = document_.model.extensionsUsed;
        return std::ranges::find(used, kQuantization) == used.end() ? kTexcoord
                                                                    : kQuantizedTexcoord;
    }

    /// Returns COLOR_0 of `from`. Colours without alpha get the alpha of `missing`.
    std::vector<glm::vec4> colors(const Attributes& from, const std::string& where,
                                  const AccessorFormat& format, const glm::vec4& missing) {
        int components = 4;
        const std::vector<float> values = numbers(from, where, "COLOR_0", format, components);
        const auto width = static_cast<std::size_t>(components);
        std::vector<glm::vec4> result(values.size() / width, missing);
        for (std::size_t i = 0; i < values.size(); ++i)
            result[i / width][static_cast<int>(i % width)] = values[i];
        return result;
    }

    void warnOf(const std::string& name, const std::string& what) {
        const std::string place = where_ + "/attributes/" + name;
        document_.warn("The attribute " + place + ' ' + what + '.', place);
    }

    /// Repairs values that would harm shading, with a warning.
    void mend(Primitive& out) {
        constexpr const char* kNotUnit =
            "has vectors that are not of unit length (ACCESSOR_VECTOR3_NON_UNIT); they are "
            "normalised, except for zeros";
        if (scaleToUnit(out.normals)) warnOf("NORMAL", kNotUnit);
        if (scaleToUnit(out.tangents)) warnOf("TANGENT", kNotUnit);
        if (makeSigns(out.tangents))
            warnOf("TANGENT",
                   "has a w that is neither 1 nor -1 (ACCESSOR_INVALID_SIGN); its sign is used");
        if (clampColors(out.colors))
            warnOf("COLOR_0",
                   "has colours outside 0 to 1 (ACCESSOR_NON_CLAMPED); they are clamped");
        if (!addUpToOne(out.joint_sets))
            warnOf("WEIGHTS_0",
                   "has weights that do not add up to 1, or negative ones "
                   "(ACCESSOR_WEIGHTS_NON_NORMALIZED); they are scaled");
    }

    /// Warns about attributes that glTF does not define, and about JOINTS_n and WEIGHTS_n beyond
    /// the first gap in n.
    void checkNames(const Attributes& attributes, const std::string& where,
                    std::size_t joint_sets) {
        for (const auto& [name, accessor] : attributes) {
            const bool joints = name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_");
            if (isGltfSplats(source_) && isSplatAttributeName(name)) continue;
            if (isAttributeName(name) &&
                (!joints || std::stoull(name.substr(name.find('_') + 1)) < joint_sets))
                continue;
            const std::string place = childPointer(where, name);
            document_.warn(
                "The attribute " + place +
                    " is not allowed there by glTF (MESH_PRIMITIVE_INVALID_ATTRIBUTE); " +
                    "it is left out.",
                place);
        }
    }

    /// Reads the splats at the positions, one per index if there are indices.
    void readSplats(Primitive& out) {
        Splats splats = readGltfSplats(
            document_, source_, where_, [&](const std::string& name, const AccessorFormat& format) {
                int components = 0;
                return numbers(source_.attributes, where_ + "/attributes", name, format,
                               components);
            });
        if (!out.indices.empty()) {
            const std::uint64_t bytes =
                out.indices.size() * (splatBytes(splats) + sizeof(glm::vec3));
            budget_.check(bytes, where_ + "/indices");
            document_.memory.allow(bytes, where_ + "/indices");
            const auto gather = [&](auto& values, std::size_t width) {
                std::remove_reference_t<decltype(values)> gathered;
                gathered.reserve(out.indices.size() * width);
                for (const std::uint32_t index : out.indices)
                    for (std::size_t i = 0; i < width; ++i)
                        gathered.push_back(values[index * width + i]);
                values = std::move(gathered);
            };
            gather(out.positions, 1);
            gather(splats.scales, 1);
            gather(splats.rotations, 1);
            gather(splats.opacities, 1);
            gather(splats.harmonics, splats.coefficients());
            out.indices.clear();
        }
        out.splats = std::make_shared<const Splats>(std::move(splats));
        checkNames(source_.attributes, where_ + "/attributes", 0);
        if (!source_.targets.empty())
            document_.warn("The morph targets of the splats " + where_ + " are left out.",
                           where_ + "/targets");
        out.targets.resize(source_.targets.size());
    }

    void readJoints(Primitive& out) {
        for (int i = 0;; ++i) {
            const std::string number = std::to_string(i);
            const auto joints = attribute<glm::vec4>("JOINTS_" + number, kJoints);
            JointSet set;
            set.weights = attribute<glm::vec4>("WEIGHTS_" + number, kWeights);
            if (joints.empty() && set.weights.empty()) return;
            if (joints.size() != set.weights.size())
                throw Error(ErrorKind::kInput,
                            "there are joints without weights, or weights without joints",
                            where_ + "/attributes", "give JOINTS_n and WEIGHTS_n together");
            set.joints.assign(joints.begin(), joints.end());  // small integers are exact as floats
            out.joint_sets.push_back(std::move(set));
        }
    }

    MorphTarget target(const Attributes& from, const std::string& where) {
        for (const auto& [name, accessor] : from) {
            if (name.starts_with('_') || source_.attributes.contains(name)) continue;
            const std::string place = childPointer(where, name);
            document_.warn("The target " + place +
                               " displaces an attribute that the primitive lacks "
                               "(MESH_PRIMITIVE_MORPH_TARGET_NO_BASE_ACCESSOR).",
                           place);
        }
        checkNames(from, where, 0);
        return {vectors<glm::vec3>(from, where, "POSITION", kDisplacement),
                vectors<glm::vec3>(from, where, "NORMAL", kDisplacement),
                vectors<glm::vec3>(from, where, "TANGENT", kDisplacement),
                {vectors<glm::vec2>(from, where, "TEXCOORD_0", texcoordFormat()),
                 vectors<glm::vec2>(from, where, "TEXCOORD_1", texcoordFormat())},
                colors(from, where, kColorDisplacement, glm::vec4(0))};
    }

    bool leaveOut() {
        document_.warn("The primitive " + where_ +
                       " has too few vertices to draw anything; it is "
                       "left out.");
        return false;
    }

    std::vector<std::uint32_t> indices() {
        const std::string where = where_ + "/indices";
        std::uint32_t restart = 0;
        document_.memory.allow(accessors_.count(source_.indices) * sizeof(std::uint32_t), where);
        std::vector<std::uint32_t> result = accessors_.indices(source_.indices, where, restart);
        for (std::size_t i = 0; i < result.size(); ++i) {
            if (result[i] < vertex_count_ && result[i] != restart) continue;
            failGltf("index " + std::to_string(i) + " is " + std::to_string(result[i]) +
                         (result[i] == restart ? ", the primitive restart value, which glTF forbids"
                                               : ", but the primitive has " +
                                                     std::to_string(vertex_count_) + " vertices"),
                     where);
        }
        return result;
    }

    /// Restricts reading to the vertices from the lowest to the highest index. Exporters often give
    /// all primitives the same large vertex array, although each primitive uses only a part.
    void keepUsedVertices(std::vector<std::uint32_t>& indices) {
        const auto [first, last] = std::minmax_element(indices.begin(), indices.end());
        used_ = {*first, std::size_t{*last} - *first + 1};
        if (used_.first == 0) return;
        for (std::uint32_t& index : indices)
            index -= static_cast<std::uint32_t>(used_.first);
    }

    /// Drops trailing vertices that do not complete a line or triangle, as §3.7.2.1 requires.
    /// Returns false if nothing is left to draw.
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
        if (usable < least) return leaveOut();
        if (usable == count) return true;
        document_.warn("The primitive " + where_ +
                       " has leftover vertices that complete no line or "
                       "triangle; they are ignored.");
        if (!out.indices.empty()) {
            out.indices.resize(usable);
            return true;
        }
        forEachVertexArray(out, [&](auto& values) {
            if (!values.empty()) values.resize(usable);
        });
        return true;
    }

    GltfDocument& document_;
    AccessorReader accessors_;
    const tinygltf::Primitive& source_;
    std::string where_;
    const SizeLimit& budget_;
    std::uint64_t least_bytes_ = 0;  ///< lower bound of the primitive's size in the scene, in bytes
    std::size_t vertex_count_ = 0;
    ElementRange used_;  ///< range of the vertices to read
};

using UvSets = std::array<bool, 2>;  ///< for each UV set, whether any texture uses it

std::vector<UvSets> uvSetsOf(const std::vector<Material>& materials) {
    std::vector<UvSets> sets;
    for (Material material : materials) {  // a copy, since texturesOf() needs a mutable material
        UvSets& used = sets.emplace_back();
        for (const MaterialTexture& texture : texturesOf(material))
            if (*texture.ref) used[static_cast<std::size_t>(texture.ref->texcoord)] = true;
    }
    return sets;
}

/// Warns if the primitive lacks texture coordinates for the textures of its materials.
void checkTexcoords(const Primitive& primitive, const std::vector<UvSets>& uv_sets,
                    const std::string& where, GltfDocument& document) {
    std::vector<int> materials = primitive.variants;
    materials.push_back(primitive.material);
    for (const int material : materials)
        for (std::size_t set = 0; material >= 0 && set < primitive.texcoords.size(); ++set)
            if (uv_sets[static_cast<std::size_t>(material)][set] &&
                primitive.texcoords[set].empty())
                document.warn("The primitive " + where + " lacks TEXCOORD_" + std::to_string(set) +
                                  ", which its material uses (MESH_PRIMITIVE_TOO_FEW_TEXCOORDS); " +
                                  "it shows a single texel.",
                              where);
}

}  // namespace

std::vector<Mesh> readGltfMeshes(GltfDocument& document, const GltfOptions& options,
                                 const std::vector<Material>& materials) {
    const int default_material = static_cast<int>(materials.size()) - 1;
    const std::vector<UvSets> uv_sets = uvSetsOf(materials);
    std::vector<Mesh> meshes;
    SizeLimit budget("the geometry needs", options.max_geometry_bytes);
    meshes.reserve(document.model.meshes.size());
    for (std::size_t i = 0; i < document.model.meshes.size(); ++i) {
        const tinygltf::Mesh& source = document.model.meshes[i];
        Mesh& mesh = meshes.emplace_back();
        mesh.name = source.name;
        mesh.weights = source.weights;
        for (std::size_t j = 0; j < source.primitives.size(); ++j) {
            const tinygltf::Primitive& from = source.primitives[j];
            const std::string where = childPointer(childPointer("/meshes", i) + "/primitives", j);
            if (from.targets.size() != source.primitives.front().targets.size())
                failGltf("the primitive has " + std::to_string(from.targets.size()) +
                             " morph targets, but the first one of the mesh has " +
                             std::to_string(source.primitives.front().targets.size()),
                         where + "/targets");
            Primitive primitive;
            primitive.material = from.material >= 0 ? from.material : default_material;
            primitive.variants = variantMaterials(from, document.variants.size());
            primitive.source.primitive = j;
            if (!PrimitiveReader(document, from, where, budget).read(primitive)) continue;
            if (primitive.splats) {  // the extension ignores their material
                primitive.material = default_material;
                primitive.variants.clear();
            }
            budget.take(primitiveBytes(primitive), where);
            checkTexcoords(primitive, uv_sets, where, document);
            mesh.primitives.push_back(std::move(primitive));
        }
    }
    return meshes;
}

}  // namespace peeler
