// SPDX-License-Identifier: Apache-2.0
// The steps of reading a glTF file, in order of execution, each in its own source file.
//
// The steps of loadGltfDocument() fill a document; the steps of readGltf() then build the scene.
// They throw Error (kInput) with a JSON pointer as `where` if the file is faulty.
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
#include "formats/gltf/gltf_accessor.h"
#include "formats/gltf/gltf_document.h"

namespace peeler {

// Defined in gltf_checks.cpp: rules of glTF 2.0 beyond types and indices.

/// Checks that the version is 2.x and that the minimum version, if any, is 2.0. A version that is a
/// number becomes a string, with a warning. `path` is the `where` of errors about the whole file.
void checkGltfVersion(nlohmann::json& gltf, const std::string& path, ReadWarnings& warnings);

/// Checks that every extension in extensionsRequired is supported or in `ignored`.
void checkRequiredExtensions(const nlohmann::json& gltf, const std::vector<std::string>& ignored);

/// Checks that nodes form a forest (§3.5.2: a node has at most one parent). If a scene lists a node
/// that has a parent, the node becomes a root, with a warning; throws Error (kInput) if the scene
/// also lists an ancestor of the node. Removes duplicates from a scene's list. Requires checked
/// indices (checkGltfSchema()).
void checkGltfForest(nlohmann::json& gltf, ReadWarnings& warnings);

/// Warns about nodes that have a matrix and also a translation, rotation or scale. tinygltf uses
/// the matrix.
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
/// (kInput) if a light breaks a rule that the schema table cannot express: a negative colour or
/// intensity, a cone whose inner angle exceeds the outer angle, a cone wider than a hemisphere, or
/// a spot light without `spot`.
void readGltfLights(const nlohmann::json& gltf, GltfDocument& document);

// Defined in gltf_variants.cpp: KHR_materials_variants, alternative materials for the same meshes.

/// Returns the names of the variants, in file order. checkGltfSchema() must have checked the JSON.
std::vector<std::string> readVariantNames(const nlohmann::json& gltf);

/// Returns a primitive's material in each of `count` variants; −1 for variants without a material.
/// Returns an empty list if the primitive has no variants. If several mappings name a variant, uses
/// the first mapping.
std::vector<int> variantMaterials(const tinygltf::Primitive& primitive, std::size_t count);

// Defined in gltf_meshopt.cpp: buffer views of EXT_meshopt_compression and KHR_meshopt_compression.

/// Whether a buffer is marked as a placeholder for decompressed data. A placeholder with a URI is a
/// fallback, which is loaded only if the compressed data is damaged.
bool isMeshoptFallback(const nlohmann::json& buffer);

/// A buffer view that failed to decode. `error` points to the view's extension object.
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
/// once. The indices become those of triangles even if the primitive was a strip.
///
/// Compressed data takes precedence over an uncompressed fallback, as the extension requires ("must
/// process KHR_draco_mesh_compression first"). If the compressed data is damaged and options.strict
/// is off, uses the fallback, with a warning. Before decoding, checks output sizes against the
/// counts of the accessors and max_geometry_bytes. Errors point to the extension object.
void decodeDracoPrimitives(GltfDocument& document, const GltfOptions& options);

// Defined in gltf_materials.cpp: materials and the textures that they use.

/// Fills scene.materials (the file's materials in order, then glTF's default material) and
/// scene.images (the images that materials use, without duplicates). Removes unreadable images from
/// their materials, with a warning. If options.strict is on, throws Error (kInput) with the image's
/// JSON pointer instead.
void readGltfMaterials(GltfDocument& document, const GltfOptions& options, Scene& scene);

// Defined in gltf_material_extensions.cpp: the KHR_materials extensions of a material.

/// A function that converts a texture reference in the file to a reference in the scene. `where` is
/// the JSON pointer of the reference in the file.
using ReadTexture = std::function<TextureRef(const tinygltf::TextureInfo&, const std::string&)>;

/// Return a member of an object, or null if it is missing. The schema check has checked its type.
const tinygltf::Value* findMember(const tinygltf::Value& object, const char* name);
const tinygltf::Value* findExtension(const tinygltf::ExtensionMap& extensions, const char* name);

/// Applies the material's extensions. Clamps values outside the range of their extension, with a
/// warning. If the material is unlit, ignores all other extensions that change its appearance,
/// since KHR_materials_unlit excludes them. `where` is the material's JSON pointer.
void readMaterialExtensions(const tinygltf::Material& source, const std::string& where,
                            const GltfOptions& options, GltfDocument& document,
                            const ReadTexture& read_texture, Material& material);

// Defined in gltf_meshes.cpp: vertex attributes, indices, topology.

/// Returns all meshes of the document, in order. Primitives without a material get the last
/// material. Skips primitives that draw nothing, clamps colours to 0–1, and normalises normals and
/// tangents, each with a warning.
std::vector<Mesh> readGltfMeshes(GltfDocument& document, const GltfOptions& options,
                                 const std::vector<Material>& materials);

// Defined in gltf_splats.cpp: primitives of KHR_gaussian_splatting.

/// Whether a primitive's points are Gaussian splats.
bool isGltfSplats(const tinygltf::Primitive& primitive);
/// Whether the extension defines an attribute with this name.
bool isSplatAttributeName(std::string_view name);

/// A function that returns the values of an attribute, which the primitive must have.
using ReadAttribute =
    std::function<std::vector<float>(const std::string& name, const AccessorFormat& format)>;

/// Returns the splats of a primitive; `where` is its JSON pointer. Normalises rotations, with a
/// warning if their lengths are not 1. Throws Error (kInput) for kernels, colour spaces and other
/// words of extensions, missing attributes, and values out of range.
Splats readGltfSplats(GltfDocument& document, const tinygltf::Primitive& primitive,
                      const std::string& where, const ReadAttribute& read);

// Defined in gltf_vertex_data.cpp: corrections of vertex data to the ranges that shading expects
// (§3.7.2.1).

/// Clamps colours to 0–1. Returns true if any component was outside by more than a rounding error.
bool clampColors(std::vector<glm::vec4>& colors);
/// Scales directions to unit length if their length deviates by more than the rounding error of
/// small integers. Zero vectors stay zero. Returns true if any direction was scaled or is zero.
bool scaleToUnit(std::vector<glm::vec3>& normals);
bool scaleToUnit(std::vector<glm::vec4>& tangents);
/// Sets the handedness of every tangent to 1 or −1. Returns true if any handedness had another
/// value.
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
/// the geometry limit. Even the keys of a small file can exceed the limit, since samplers may share
/// bytes.
std::vector<Animation> readGltfAnimations(GltfDocument& document, const GltfOptions& options,
                                          const Scene& scene);

}  // namespace peeler
