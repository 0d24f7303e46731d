// SPDX-License-Identifier: Apache-2.0
// The steps of reading a glTF file, each in its own source file, in order of execution. The first
// steps are those of loadGltfDocument(), which fill a document; then come those of readGltf(),
// which build the scene. They throw Error (kInput) with a JSON pointer as `where` if the file is
// faulty.
#pragma once

#include <tiny_gltf.h>

#include <cstddef>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/error.h>
#include <peeler/gltf_options.h>
#include <peeler/scene.h>
#include "formats/gltf/gltf_document.h"

namespace peeler {

// Defined in gltf_checks.cpp: rules of glTF 2.0 beyond types and indices.

/// Checks that the version is 2.x, which a glTF 2.0 reader can read. A version given as a number
/// becomes a string, with a warning. `path` is the `where` of errors about the whole file.
void checkGltfVersion(nlohmann::json& gltf, const std::string& path, ReadWarnings& warnings);

/// Checks that every extension in extensionsRequired is supported or in `ignored`.
void checkRequiredExtensions(const nlohmann::json& gltf, const std::vector<std::string>& ignored);

/// Checks that nodes form a forest (§3.5.2: a node has at most one parent). If a scene lists a node
/// that has a parent, the node becomes a root, with a warning, provided that the scene still shows
/// it only once. Removes duplicates from a scene's list. Indices must have been checked
/// (checkGltfSchema()).
void checkGltfForest(nlohmann::json& gltf, ReadWarnings& warnings);

/// Warns about nodes with both a matrix and a translation, rotation or scale. tinygltf uses their
/// matrix.
void warnOfTwoPlaces(const nlohmann::json& gltf, ReadWarnings& warnings);

/// Warns about empty buffers, buffer views and accessors, which the schema does not allow.
void warnOfEmptyParts(const nlohmann::json& gltf, ReadWarnings& warnings);

/// Returns the names of extensions that the file uses but does not list in extensionsUsed (§3.12).
std::vector<std::string> undeclaredExtensions(const nlohmann::json& gltf);

/// Checks that cameras have zfar > znear and a field of view below π.
void checkGltfCameras(const tinygltf::Model& model);

// Defined in gltf_lights.cpp: KHR_lights_punctual.

/// Fills `lights` and `node_lights` of the document from JSON that checkGltfSchema() has checked.
/// Skips lights of unknown type with a warning, as the extension's schema allows. Throws Error
/// (kInput) if a light breaks a rule that the schema table cannot express: negative colours and
/// intensities, cones that are inside out or wider than a hemisphere, a spot light without `spot`.
void readGltfLights(const nlohmann::json& gltf, GltfDocument& document);

// Defined in gltf_variants.cpp: KHR_materials_variants, alternative materials for the same meshes.

/// Returns the names of the variants, in file order. checkGltfSchema() must have checked the JSON.
std::vector<std::string> readVariantNames(const nlohmann::json& gltf);

/// Returns a primitive's material in each of `count` variants, or −1 if it has none in a variant;
/// empty if it has none in any variant. If several mappings name a variant, uses the first.
std::vector<int> variantMaterials(const tinygltf::Primitive& primitive, std::size_t count);

// Defined in gltf_meshopt.cpp: buffer views of EXT_meshopt_compression and KHR_meshopt_compression.

/// Whether a buffer is marked as a placeholder for decompressed data. Even if a placeholder has a
/// URI, it is loaded only if the compressed data is damaged.
bool isMeshoptFallback(const nlohmann::json& buffer);

/// A buffer view that failed to decode; `error` points to its extension object.
struct MeshoptProblem {
    std::size_t view;
    Error error;
};

/// Decodes all compressed views in `buffer_views` (checked by checkGltfSchema()) into the
/// document's `decoded_views`, in parallel. Checks their total size against max_geometry_bytes
/// before any allocation. Returns the views that failed to decode, in order.
std::vector<MeshoptProblem> decodeMeshoptViews(const nlohmann::json& buffer_views,
                                               GltfDocument& document, const GltfOptions& options);

// Defined in gltf_draco.cpp: primitives of KHR_draco_mesh_compression.

/// Decodes all Draco primitives in parallel. Then points their attributes and indices to new
/// accessors with the decoded data, so that later steps need no code for Draco. Decodes shared data
/// once. Compressed data takes precedence over an uncompressed fallback, as the extension requires
/// ("must process KHR_draco_mesh_compression first"). If the compressed data is damaged and
/// options.strict is off, uses the fallback, with a warning. Decoded indices are those of triangles
/// even if the primitive was a strip. Before decoding, checks output sizes against the counts of
/// the accessors and max_geometry_bytes. Errors point to the extension object.
void decodeDracoPrimitives(GltfDocument& document, const GltfOptions& options);

// Defined in gltf_materials.cpp: materials and the textures that they use.

/// Fills scene.materials (those of the file in order, then glTF's default material) and
/// scene.images (those that materials use, without duplicates). Removes unreadable images from
/// their materials, with a warning. If options.strict is on, throws Error (kInput) with the image's
/// JSON pointer instead.
void readGltfMaterials(GltfDocument& document, const GltfOptions& options, Scene& scene);

// Defined in gltf_material_extensions.cpp: the KHR_materials extensions of a material.

/// A function that converts a texture reference in the file to one in the scene; `where` is the
/// JSON pointer of the reference in the file.
using ReadTexture = std::function<TextureRef(const tinygltf::TextureInfo&, const std::string&)>;

/// Return a member of an object; null if missing. The schema check has checked its type.
const tinygltf::Value* findMember(const tinygltf::Value& object, const char* name);
const tinygltf::Value* findExtension(const tinygltf::ExtensionMap& extensions, const char* name);

/// Applies the material's extensions. Clamps values outside the range of their extension, with a
/// warning. An unlit material ignores all other extensions that change its appearance, since
/// KHR_materials_unlit excludes them. `where` is the material's JSON pointer.
void readMaterialExtensions(const tinygltf::Material& source, const std::string& where,
                            const GltfOptions& options, GltfDocument& document,
                            const ReadTexture& read_texture, Material& material);

// Defined in gltf_meshes.cpp: vertex attributes, indices, topology.

/// Returns all meshes of the document, in order. Primitives without a material get the last one.
/// Skips primitives that draw nothing, clamps colours to 0–1, and normalises normals and tangents,
/// each with a warning.
std::vector<Mesh> readGltfMeshes(GltfDocument& document, const GltfOptions& options,
                                 const std::vector<Material>& materials);

// Defined in gltf_vertex_data.cpp: corrections of vertex data to the ranges that shading expects
// (§3.7.2.1).

/// Clamps colours to 0–1. Returns true if any component was outside by more than rounding.
bool clampColors(std::vector<glm::vec4>& colors);
/// Scales directions to unit length if their length deviates by more than the quantisation of small
/// integers explains. Zero vectors stay. Returns true if any direction was not of unit length.
bool scaleToUnit(std::vector<glm::vec3>& normals);
bool scaleToUnit(std::vector<glm::vec4>& tangents);
/// Sets the handedness of every tangent to 1 or −1. Returns true if any had another value.
bool makeSigns(std::vector<glm::vec4>& tangents);
/// Whether each vertex's weights are non-negative and sum to 1.
bool addUpToOne(const std::vector<JointSet>& sets);
/// Whether glTF defines an attribute with this name, or reserves the name for applications
/// (`_NAME`).
bool isAttributeName(std::string_view name);

// Defined in gltf_nodes.cpp: nodes, their skins and instances.

/// Fills the scene's `nodes` and `skins`; the scene must already have its meshes. Throws Error
/// (kInput) if a mesh uses joints that its skin lacks, or if inverse bind matrices or instance
/// attributes have the wrong count or format.
void readGltfNodes(GltfDocument& document, const GltfOptions& options, Scene& scene);

// Defined in gltf_animations.cpp.

/// Returns all animations of the document, for the nodes and meshes of the scene. Skips channels
/// with unknown targets, with a warning. Throws Error (kInput) if times are not finite or decrease,
/// if the values do not match the times or the property in count or format, or if the keys exceed
/// the geometry limit (which they can even in a small file, since samplers may share bytes).
std::vector<Animation> readGltfAnimations(GltfDocument& document, const GltfOptions& options,
                                          const Scene& scene);

}  // namespace peeler
