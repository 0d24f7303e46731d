// SPDX-License-Identifier: Apache-2.0
// The steps of reading a glTF file, one source file each, in order of execution: first those of
// loadGltfDocument(), which fill a document, then those of readGltf(), which build the scene. A
// faulty file raises Error (kInput) with a JSON pointer as `where`.
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

// gltf_checks.cpp: glTF 2.0 rules beyond types and indices.

/// Checks that the file is a glTF 2.x that a 2.0 reader may read. A numeric version becomes a
/// string, with a warning. `path` is the `where` of errors about the whole file.
void checkGltfVersion(nlohmann::json& gltf, const std::string& path, ReadWarnings& warnings);

/// Checks that everything in extensionsRequired is supported or ignored.
void checkRequiredExtensions(const nlohmann::json& gltf, const std::vector<std::string>& ignored);

/// Checks that nodes form a forest (§3.5.2: a node has at most one parent). Non-root nodes listed
/// by a scene become roots, with a warning, if a scene still shows them only once; duplicates in a
/// scene's list are removed. Indices must have been checked (checkGltfSchema).
void checkGltfForest(nlohmann::json& gltf, ReadWarnings& warnings);

/// Warns of nodes with both a matrix and a translation, rotation or scale: tinygltf uses the
/// matrix.
void warnOfTwoPlaces(const nlohmann::json& gltf, ReadWarnings& warnings);

/// Warns of empty buffers, buffer views and accessors, which the schema forbids.
void warnOfEmptyParts(const nlohmann::json& gltf, ReadWarnings& warnings);

/// Returns the names of extensions used in the file but missing from extensionsUsed (§3.12).
std::vector<std::string> undeclaredExtensions(const nlohmann::json& gltf);

/// Checks that cameras have zfar > znear and a field of view below π.
void checkGltfCameras(const tinygltf::Model& model);

// gltf_lights.cpp: KHR_lights_punctual.

/// Fills `lights` and `node_lights` of the document from JSON checked by checkGltfSchema(). A light
/// of unknown type is skipped with a warning, as the extension's schema allows. Throws Error
/// (kInput) if a light breaks a rule beyond the schema table: negative colours and intensities,
/// cones that are inside out or wider than a hemisphere, a spot light without `spot`.
void readGltfLights(const nlohmann::json& gltf, GltfDocument& document);

// gltf_variants.cpp: KHR_materials_variants, alternative materials for the same meshes.

/// Returns the variant names, in file order. The JSON was checked by checkGltfSchema().
std::vector<std::string> readVariantNames(const nlohmann::json& gltf);

/// Returns the primitive's material for each of `count` variants, −1 where it has none; empty if it
/// has none for any variant. The first of several mappings for a variant wins.
std::vector<int> variantMaterials(const tinygltf::Primitive& primitive, std::size_t count);

// gltf_meshopt.cpp: buffer views of EXT_meshopt_compression and KHR_meshopt_compression.

/// Whether the buffer is marked as a placeholder for decompressed data. It is then not loaded, even
/// if it has a URI, unless the compressed data turns out to be damaged.
bool isMeshoptFallback(const nlohmann::json& buffer);

/// A buffer view that failed to decode; `error` points to its extension object.
struct MeshoptProblem {
    std::size_t view;
    Error error;
};

/// Decodes all compressed views of `buffer_views` (checked by checkGltfSchema) into the document's
/// `decoded_views`, in parallel. Their total size is checked against max_geometry_bytes before any
/// allocation. Returns the failures by view.
std::vector<MeshoptProblem> decodeMeshoptViews(const nlohmann::json& buffer_views,
                                               GltfDocument& document, const GltfOptions& options);

// gltf_draco.cpp: primitives of KHR_draco_mesh_compression.

/// Decodes all Draco primitives in parallel and points their attributes and indices to new
/// accessors with the decoded data, so that later steps need not know about Draco. Shared data is
/// decoded once. Compressed data takes precedence over an uncompressed fallback, as the extension
/// requires ("must process KHR_draco_mesh_compression first"). The fallback is used, with a
/// warning, if the compressed data is damaged and options.strict is off. Decoded indices are
/// triangles even if the primitive was a strip. Output sizes are checked against the accessors'
/// counts and max_geometry_bytes before decoding. Errors point to the extension object.
void decodeDracoPrimitives(GltfDocument& document, const GltfOptions& options);

// gltf_materials.cpp: materials and the textures that they use.

/// Fills scene.materials (the file's in order, then glTF's default material) and scene.images
/// (those used by materials, without duplicates). An unreadable image is dropped from its materials
/// with a warning. Throws Error (kInput) with the image's JSON pointer if options.strict is on.
void readGltfMaterials(GltfDocument& document, const GltfOptions& options, Scene& scene);

// gltf_material_extensions.cpp: the KHR_materials extensions of a material.

/// Converts a texture reference of the file to the scene's; `where` is its JSON pointer.
using ReadTexture = std::function<TextureRef(const tinygltf::TextureInfo&, const std::string&)>;

/// Return a member of an object, or null. Its type was checked against the schema.
const tinygltf::Value* findMember(const tinygltf::Value& object, const char* name);
const tinygltf::Value* findExtension(const tinygltf::ExtensionMap& extensions, const char* name);

/// Applies the material's extensions. Values outside their extension's range are clamped with a
/// warning. An unlit material ignores all other extensions that change its appearance, since
/// KHR_materials_unlit excludes them. `where` is the material's JSON pointer.
void readMaterialExtensions(const tinygltf::Material& source, const std::string& where,
                            const GltfOptions& options, GltfDocument& document,
                            const ReadTexture& read_texture, Material& material);

// gltf_meshes.cpp: vertex attributes, indices, topology.

/// Returns all meshes of the document, in order. Primitives without a material get the last one.
/// Primitives that draw nothing are skipped with a warning. Colours are clamped to 0–1, normals and
/// tangents are normalised, with a warning.
std::vector<Mesh> readGltfMeshes(GltfDocument& document, const GltfOptions& options,
                                 const std::vector<Material>& materials);

// gltf_vertex_data.cpp: vertex data in the ranges that shading expects (§3.7.2.1).

/// Clamps colours to 0–1. Returns whether one was outside by more than rounding.
bool clampColors(std::vector<glm::vec4>& colors);
/// Normalises directions whose length is off by more than small-integer quantisation explains. Zero
/// vectors stay. Returns whether any was changed.
bool scaleToUnit(std::vector<glm::vec3>& normals);
bool scaleToUnit(std::vector<glm::vec4>& tangents);
/// Sets the handedness of every tangent to 1 or −1. Returns whether one was neither.
bool makeSigns(std::vector<glm::vec4>& tangents);
/// Whether each vertex's weights are non-negative and sum to 1.
bool addUpToOne(const std::vector<JointSet>& sets);
/// Whether glTF defines an attribute of this name or leaves it to applications (`_NAME`).
bool isAttributeName(std::string_view name);

// gltf_nodes.cpp: nodes, their skins and instances.

/// Fills the scene's `nodes` and `skins`; its meshes must be there. Throws Error (kInput) if a mesh
/// uses joints that its skin lacks, or if inverse bind matrices or instance attributes have the
/// wrong count or format.
void readGltfNodes(GltfDocument& document, const GltfOptions& options, Scene& scene);

// gltf_animations.cpp.

/// Returns all animations of the document, for the scene's nodes and meshes. Channels with unknown
/// targets are skipped with a warning. Throws Error (kInput) if times are not finite or decrease,
/// if values do not match the times or the property in count or format, or if there are more keys
/// than the geometry limit allows (samplers of a small file may share the same bytes).
std::vector<Animation> readGltfAnimations(GltfDocument& document, const GltfOptions& options,
                                          const Scene& scene);

}  // namespace peeler
