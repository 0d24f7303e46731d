// SPDX-License-Identifier: Apache-2.0
// Baked vertex attributes and occlusion textures in the JSON of a glTF file.
#include "formats/gltf/baked_gltf.h"

#include <cstring>
#include <map>
#include <set>

#include <peeler/error.h>
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

using nlohmann::ordered_json;

constexpr const char* kDraco = "KHR_draco_mesh_compression";
constexpr int kColorComponent = 5123, kValueComponent = 5126;  // unsigned short, float

/// Returns values for all vertices of the file's primitive. Vertices that the scene does not keep
/// get 0.
template <class T>
std::vector<std::uint8_t> bytesOfAll(const std::vector<T>& values, std::size_t a_vertex,
                                     const PrimitiveSource& source) {
    std::vector<std::uint8_t> bytes(source.vertices * a_vertex * sizeof(T));
    if (!values.empty())
        std::memcpy(bytes.data() + source.first_vertex * a_vertex * sizeof(T), values.data(),
                    values.size() * sizeof(T));
    return bytes;
}

class VertexValues {
  public:
    VertexValues(GlbWriter& package, const std::string& attribute,
                 const std::vector<BakedPrimitive>& primitives)
        : package_(package), attribute_(attribute) {
        for (const BakedPrimitive& primitive : primitives)
            baked_[primitive.node].push_back(&primitive);
    }

    void add() {
        // All nodes of each mesh, with or without values.
        std::map<std::size_t, std::vector<std::size_t>> nodes_of;
        const ordered_json& nodes = package_.gltf().at("nodes");
        for (std::size_t i = 0; i < nodes.size(); ++i)
            if (nodes[i].contains("mesh"))
                nodes_of[nodes[i]["mesh"].get<std::size_t>()].push_back(i);
        for (const auto& [mesh, users] : nodes_of)
            share(mesh, users);
    }

  private:
    /// The baked primitives of one node's mesh.
    using Values = std::vector<const BakedPrimitive*>;

    const Values& valuesOf(std::size_t node) const {
        static const Values kNone;
        const auto found = baked_.find(static_cast<int>(node));
        return found == baked_.end() ? kNone : found->second;
    }

    static bool same(const Values& a, const Values& b) {
        return a.size() == b.size() &&
               std::equal(a.begin(), a.end(), b.begin(),
                          [](const auto* one, const auto* other) { return *one == *other; });
    }

    /// Gives each node the version of the mesh with the node's values. Nodes without values keep
    /// the original mesh. If every node has values, the first version replaces the original mesh.
    void share(std::size_t mesh, const std::vector<std::size_t>& users) {
        struct Version {
            const Values* values;
            std::size_t mesh;
        };
        std::vector<Version> versions;
        for (const std::size_t node : users)
            if (valuesOf(node).empty()) versions = {{&valuesOf(node), mesh}};
        const ordered_json original = package_.gltf()["meshes"].at(mesh);
        for (const std::size_t node : users) {
            const Values& values = valuesOf(node);
            std::size_t place = 0;
            while (place < versions.size() && !same(*versions[place].values, values))
                ++place;
            if (place == versions.size()) {
                ordered_json& meshes = package_.gltf()["meshes"];
                versions.push_back({&values, place == 0 ? mesh : meshes.size()});
                if (place > 0) meshes.push_back(original);
                for (const BakedPrimitive* primitive : values)
                    addTo(versions.back().mesh, *primitive);
            }
            package_.gltf()["nodes"][node]["mesh"] = versions[place].mesh;
        }
    }

    void addTo(std::size_t mesh, const BakedPrimitive& values) {
        const std::size_t width = values.values.size() / values.colors.size();
        const std::size_t color =
            package_.addAccessor(bytesOfAll(values.colors, 1, values.source),
                                 {kColorComponent, true, "VEC4", values.source.vertices});
        const std::size_t value = package_.addAccessor(
            bytesOfAll(values.values, width, values.source),
            {kValueComponent, false, width == 1 ? "SCALAR" : "VEC3", values.source.vertices});
        ordered_json& primitive =
            package_.gltf()["meshes"][mesh].at("primitives").at(values.source.primitive);
        const auto extensions = primitive.find("extensions");
        const bool draco = extensions != primitive.end() && extensions->contains(kDraco);
        if (draco) correctCounts(primitive, values.source.vertices);
        const auto put = [&](const std::string& name, std::size_t accessor) {
            primitive["attributes"][name] = accessor;
            if (draco) (*extensions)[kDraco]["attributes"].erase(name);
        };
        put("COLOR_0", color);
        put(attribute_, value);
        stopColors(package_.gltf()["meshes"][mesh].at("primitives").at(values.source.primitive),
                   values.source.vertices);
    }

    /// Sets the colour displacements of morph targets to zero, since the new colours belong to the
    /// baked pose.
    void stopColors(ordered_json& primitive, std::size_t vertices) {
        const auto targets = primitive.find("targets");
        if (targets == primitive.end()) return;
        for (ordered_json& target : *targets) {
            if (!target.contains("COLOR_0")) continue;
            ordered_json& accessors = package_.gltf()["accessors"];
            target["COLOR_0"] = accessors.size();
            accessors.push_back(
                {{"componentType", kValueComponent}, {"count", vertices}, {"type", "VEC4"}});
        }
    }

    /// Corrects the counts of accessors. All attributes of a primitive must have the same count,
    /// but some encoders declare a number of vertices that differs from the decoded number
    /// (Khronos' own 2CylinderEngine).
    void correctCounts(const ordered_json& primitive, std::size_t vertices) {
        for (const auto& [name, id] : primitive["extensions"][kDraco]["attributes"].items()) {
            const auto attribute = primitive["attributes"].find(name);
            // Readers ignore an attribute of the extension if the primitive itself lacks the
            // attribute.
            if (attribute == primitive["attributes"].end()) continue;
            ordered_json& accessor = package_.gltf()["accessors"].at(attribute->get<std::size_t>());
            if (!accessor.contains("bufferView")) accessor["count"] = vertices;
        }
    }

    GlbWriter& package_;
    const std::string& attribute_;
    std::map<int, Values> baked_;  ///< values of each node
};

template <class Body>
void forEachPrimitive(ordered_json& gltf, const Body& body) {
    const auto meshes = gltf.find("meshes");
    if (meshes == gltf.end()) return;
    for (ordered_json& mesh : *meshes)
        for (ordered_json& primitive : mesh["primitives"])
            body(primitive);
}

/// Returns the JSON array of a primitive's variant materials (KHR_materials_variants), or null.
ordered_json* mappingsOf(ordered_json& primitive) {
    const auto extensions = primitive.find("extensions");
    if (extensions == primitive.end()) return nullptr;
    const auto variants = extensions->find("KHR_materials_variants");
    return variants == extensions->end() ? nullptr : &variants->at("mappings");
}

/// Calls body(index) for every material of a primitive, in all variants.
template <class Body>
void forEachMaterial(ordered_json& primitive, const Body& body) {
    if (const auto own = primitive.find("material"); own != primitive.end()) body(*own);
    ordered_json* mappings = mappingsOf(primitive);
    if (!mappings) return;
    for (ordered_json& mapping : *mappings)
        body(mapping.at("material"));
}

/// Returns the indices of materials that are used by a primitive without this attribute.
std::set<std::size_t> materialsWithout(ordered_json& gltf, const std::string& attribute) {
    std::set<std::size_t> materials;
    forEachPrimitive(gltf, [&](ordered_json& primitive) {
        if (primitive.at("attributes").contains(attribute)) return;
        forEachMaterial(primitive, [&](const ordered_json& index) {
            materials.insert(index.get<std::size_t>());
        });
    });
    return materials;
}

/// Applies a change to the JSON. Throws Error (kInput) if an object for which values were baked is
/// missing; the file has then changed since it was read.
template <class Change>
void changing(const Change& change) {
    try {
        change();
    } catch (const nlohmann::json::exception&) {
        throw Error(ErrorKind::kInput, "the scene's file has changed since it was read", "",
                    "try again");
    }
}

}  // namespace

void addVertexValues(GlbWriter& package, const std::string& attribute,
                     const std::vector<BakedPrimitive>& primitives) {
    changing([&] { VertexValues(package, attribute, primitives).add(); });
}

void showVertexColorsAlone(GlbWriter& package) {
    changing([&] {
        constexpr const char* kUnlit = "KHR_materials_unlit";
        ordered_json& gltf = package.gltf();
        gltf["materials"].push_back({{"name", "vertex colors alone"},
                                     {"pbrMetallicRoughness", {{"metallicFactor", 0}}},
                                     {"doubleSided", true},
                                     {"extensions", {{kUnlit, ordered_json::object()}}}});
        const std::size_t material = gltf["materials"].size() - 1;
        forEachPrimitive(gltf, [&](ordered_json& primitive) {
            primitive["material"] = material;
            const auto extensions = primitive.find("extensions");
            if (extensions != primitive.end()) extensions->erase("KHR_materials_variants");
        });
        ordered_json& used = gltf["extensionsUsed"];
        if (std::ranges::find(used, kUnlit) == used.end()) used.push_back(kUnlit);
    });
}

void setDefaultScene(GlbWriter& package, int scene) {
    ordered_json& gltf = package.gltf();
    if (gltf.contains("scenes")) gltf["scene"] = scene;
}

void setVariant(GlbWriter& package, std::size_t variant) {
    changing([&] {
        forEachPrimitive(package.gltf(), [&](ordered_json& primitive) {
            const ordered_json* mappings = mappingsOf(primitive);
            if (!mappings) return;
            for (const ordered_json& mapping : *mappings) {
                const ordered_json& variants = mapping.at("variants");
                if (std::ranges::find(variants, ordered_json(variant)) == variants.end()) continue;
                const auto material = mapping.at("material").get<std::size_t>();
                primitive["material"] = material;
                return;
            }
        });
    });
}

void addOcclusionTextures(GlbWriter& package, int uv_set, std::vector<BakedTexture> textures) {
    changing([&] {
        ordered_json& gltf = package.gltf();
        const std::string uvs = "TEXCOORD_" + std::to_string(uv_set);
        const std::set<std::size_t> shared = materialsWithout(gltf, uvs);
        for (BakedTexture& texture : textures) {
            const bool fallback = texture.material < 0;
            const auto old = static_cast<std::size_t>(texture.material);
            const std::size_t image = package.addImage(
                std::move(texture.png), "image/png",
                fallback ? "occlusion where there is no material"
                         : "occlusion of material " + std::to_string(texture.material));
            gltf["textures"].push_back({{"source", image}});
            ordered_json info = {{"index", gltf["textures"].size() - 1}};
            if (uv_set != 0) info["texCoord"] = uv_set;
            if (!fallback && !shared.contains(old)) {
                gltf.at("materials").at(old)["occlusionTexture"] = info;
                continue;
            }
            ordered_json material =
                fallback ? ordered_json::object() : gltf.at("materials").at(old);
            material["occlusionTexture"] = info;
            gltf["materials"].push_back(std::move(material));
            const std::size_t fresh = gltf["materials"].size() - 1;
            forEachPrimitive(gltf, [&](ordered_json& primitive) {
                if (!primitive.at("attributes").contains(uvs)) return;
                if (fallback) {
                    primitive.emplace("material", fresh);  // does nothing if there is a material
                    return;
                }
                forEachMaterial(primitive, [&](ordered_json& index) {
                    if (index.get<std::size_t>() == old) index = fresh;
                });
            });
        }
    });
}

}  // namespace peeler
