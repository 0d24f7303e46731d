// SPDX-License-Identifier: Apache-2.0
// The steps of reading a glTF file, each in a file of its own, in the order in which they are
// carried out: first those by which loadGltfDocument() fills a document, then those by which
// readGltf() makes a scene of it. What is wrong with a file is an Error(kInput) with a JSON pointer
// as `where`.
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

// gltf_checks.cpp: what glTF 2.0 demands beyond types and indices.

/// Checks that the file is a glTF 2.x that readers of 2.0 may read. A version that is a number
/// becomes text, with a warning. `path` is the `where` of errors about the file as a whole.
void checkGltfVersion(nlohmann::json& gltf, const std::string& path, ReadWarnings& warnings);

/// Checks that everything in extensionsRequired is supported or ignored.
void checkRequiredExtensions(const nlohmann::json& gltf, const std::vector<std::string>& ignored);

/// Checks that nodes form a forest (§3.5.2: a node has one parent at most). Nodes that scenes list
/// and that are no roots become some, with a warning, where a scene shows them once all the same;
/// what a scene lists twice it lists once. Indices must have been checked (checkGltfSchema).
void checkGltfForest(nlohmann::json& gltf, ReadWarnings& warnings);

/// Warns of nodes with a matrix and a translation, rotation or scale: tinygltf reads the matrix.
void warnOfTwoPlaces(const nlohmann::json& gltf, ReadWarnings& warnings);

/// Warns of buffers and views of no bytes and accessors of no elements: the schema wants more.
void warnOfEmptyParts(const nlohmann::json& gltf, ReadWarnings& warnings);

/// Names of the extensions that stand somewhere in the file and not in extensionsUsed (§3.12).
std::vector<std::string> undeclaredExtensions(const nlohmann::json& gltf);

/// Checks that cameras have far planes behind their near planes and fields of view below π.
void checkGltfCameras(const tinygltf::Model& model);

// gltf_lights.cpp: KHR_lights_punctual.

/// Fills `lights` and `node_lights` of the document from JSON that has passed checkGltfSchema().
/// A light of unknown type is left out with a warning, as the extension's schema has it. Throws for
/// what the schema's table cannot say: negative colours and intensities, cones that are inside out
/// or wider than a half space, a spot light without `spot`.
void readGltfLights(const nlohmann::json& gltf, GltfDocument& document);

// gltf_variants.cpp: KHR_materials_variants, other materials for the same meshes.

/// The names of the variants of a file that has passed checkGltfSchema(), in its order.
std::vector<std::string> readVariantNames(const nlohmann::json& gltf);

/// For each of `count` variants the material of this primitive, −1 where it names none; empty if it
/// names none at all. If two mappings name the same variant, the first counts.
std::vector<int> variantMaterials(const tinygltf::Primitive& primitive, std::size_t count);

// gltf_meshopt.cpp: buffer views of EXT_meshopt_compression and KHR_meshopt_compression.

/// Whether the buffer says that it is only a place for decompressed data. Then it is not loaded,
/// even if it has a URI, unless the compressed data turns out to be damaged.
bool isMeshoptFallback(const nlohmann::json& buffer);

/// A buffer view that could not be decoded, and why; `error` points to its extension object.
struct MeshoptProblem {
    std::size_t view;
    Error error;
};

/// Decodes all compressed views of `buffer_views` (which have passed checkGltfSchema) into
/// `decoded_views` of the document, in parallel. All sizes together are checked against
/// max_geometry_bytes before anything is allocated. The result lists the failures by view.
std::vector<MeshoptProblem> decodeMeshoptViews(const nlohmann::json& buffer_views,
                                               GltfDocument& document, const GltfOptions& options);

// gltf_draco.cpp: primitives of KHR_draco_mesh_compression.

/// Decodes all of them, in parallel, and lets their attributes and indices name new accessors with
/// the decoded numbers, so that whoever reads a primitive afterwards need not know. Primitives that
/// share data are decoded once. The compressed data goes before an uncompressed fallback, as the
/// extension asks of those who support it ("must process KHR_draco_mesh_compression first"); the
/// fallback is read, with a warning, where the compressed data is damaged and options.strict is
/// off. Decoded indices are of triangles even where the primitive was a strip. What would come out
/// is checked against the accessors' counts and max_geometry_bytes before anything is decoded.
/// Errors point to the extension object.
void decodeDracoPrimitives(GltfDocument& document, const GltfOptions& options);

// gltf_materials.cpp: materials and the textures that they use.

/// Fills scene.materials (the file's in order, then glTF's default material) and scene.images
/// (those that a material uses, each once). An image that cannot be had is a warning and the
/// material goes without it; under options.strict it throws Error(kInput) with the image's JSON
/// pointer.
void readGltfMaterials(GltfDocument& document, const GltfOptions& options, Scene& scene);

// gltf_material_extensions.cpp: the KHR_materials extensions of a material.

/// Turns a texture reference of the file into the scene's; `where` is its JSON pointer.
using ReadTexture = std::function<TextureRef(const tinygltf::TextureInfo&, const std::string&)>;

/// A member of an object, or null. The schema check has seen its type.
const tinygltf::Value* findMember(const tinygltf::Value& object, const char* name);
const tinygltf::Value* findExtension(const tinygltf::ExtensionMap& extensions, const char* name);

/// Adds what the material's extensions say. Numbers outside the range of their extension are
/// clamped with a warning. Of an unlit material nothing is read that changes what it looks like:
/// KHR_materials_unlit goes with no such other. `where` is the material's JSON pointer.
void readMaterialExtensions(const tinygltf::Material& source, const std::string& where,
                            const GltfOptions& options, GltfDocument& document,
                            const ReadTexture& read_texture, Material& material);

// gltf_meshes.cpp: vertex attributes, indices, topology.

/// All meshes of the document, in order. Primitives without a material get the last one.
/// Primitives that draw nothing are left out with a warning. Colours are clamped to 0 to 1,
/// normals and tangents of another length are scaled to 1, with a warning.
std::vector<Mesh> readGltfMeshes(GltfDocument& document, const GltfOptions& options,
                                 const std::vector<Material>& materials);

// gltf_vertex_data.cpp: vertex data as shading takes it for granted (§3.7.2.1).

/// Clamps colours to 0 to 1. Returns whether one was outside by more than rounding.
bool clampColors(std::vector<glm::vec4>& colors);
/// Scales directions to length 1 that have another one by more than small integers can be off.
/// Zeros stay. Returns whether one had.
bool scaleToUnit(std::vector<glm::vec3>& normals);
bool scaleToUnit(std::vector<glm::vec4>& tangents);
/// Makes the handedness of every tangent 1 or −1. Returns whether one was neither.
bool makeSigns(std::vector<glm::vec4>& tangents);
/// Whether the weights of each vertex add up to 1 and none is negative.
bool addUpToOne(const std::vector<JointSet>& sets);
/// Whether glTF has an attribute of this name, or leaves it to applications (`_NAME`).
bool isAttributeName(std::string_view name);

// gltf_nodes.cpp: nodes, their skins and instances.

/// Fills `nodes` and `skins` of the scene, whose meshes are there already. Throws for joints that a
/// skin does not have, and for inverse bind matrices and instance attributes of the wrong number or
/// format.
void readGltfNodes(GltfDocument& document, const GltfOptions& options, Scene& scene);

// gltf_animations.cpp.

/// All animations of the document, for nodes and meshes that `scene` has already. Channels that
/// move nothing known to us are left out with a warning. Throws for times that are not finite or
/// fall, for values whose number or format does not fit the times or the property, and for more
/// keys than the geometry limit has bytes for (many samplers may share the same bytes of a small
/// file).
std::vector<Animation> readGltfAnimations(GltfDocument& document, const GltfOptions& options,
                                          const Scene& scene);

}  // namespace peeler
