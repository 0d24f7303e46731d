// SPDX-License-Identifier: Apache-2.0
// Reads glTF 2.0 (.gltf and .glb) into a Scene.
#include "formats/gltf_reader.h"

#include <algorithm>
#include <glm/gtc/quaternion.hpp>

#include "core/error.h"
#include "formats/gltf_document.h"
#include "formats/gltf_materials.h"
#include "formats/gltf_meshes.h"
#include "formats/gltf_schema.h"

namespace peeler {
namespace {

/// §3.5.3: the matrix, or translation · rotation · scale.
glm::dmat4 localMatrix(const tinygltf::Node& source, const std::string& where,
                       GltfDocument& document) {
    glm::dmat4 result(1);
    if (!source.matrix.empty()) {
        auto value = source.matrix.begin();  // column after column, as in GLM
        for (int column = 0; column < 4; ++column)
            for (int row = 0; row < 4; ++row)
                result[column][row] = *value++;
        return result;
    }
    if (!source.rotation.empty()) {
        const std::vector<double>& r = source.rotation;
        const glm::dquat rotation(r[3], r[0], r[1], r[2]);
        // Files round to a few digits; without normalising, a rotation would scale a little.
        if (glm::length(rotation) > 0)
            result = glm::mat4_cast(glm::normalize(rotation));
        else
            document.warn("The rotation of " + where + " is all zeros; it is ignored.");
    }
    if (!source.scale.empty())
        for (int axis = 0; axis < 3; ++axis)
            result[axis] *= source.scale[static_cast<std::size_t>(axis)];
    if (!source.translation.empty())
        result[3] =
            glm::dvec4(source.translation[0], source.translation[1], source.translation[2], 1);
    return result;
}

void readNodes(GltfDocument& document, Scene& scene) {
    for (std::size_t i = 0; i < document.model.nodes.size(); ++i) {
        const tinygltf::Node& source = document.model.nodes[i];
        Node& node = scene.nodes.emplace_back();
        node.name = source.name;
        node.children = source.children;
        node.mesh = source.mesh;
        node.camera = source.camera;
        node.light = document.node_lights[i];
        node.local = localMatrix(source, childPointer("/nodes", i), document);
    }
}

void readScenes(const tinygltf::Model& model, Scene& scene) {
    for (const tinygltf::Scene& source : model.scenes)
        scene.scenes.push_back({source.name, source.nodes});
    scene.default_scene = std::max(model.defaultScene, 0);
    if (!scene.scenes.empty()) return;
    // A file without scenes is a library (§3.5.1); showing all of it is what its user can want.
    std::vector<char> is_child(scene.nodes.size(), 0);
    for (const Node& node : scene.nodes)
        for (const int child : node.children)
            is_child[static_cast<std::size_t>(child)] = 1;
    SceneRoots& all = scene.scenes.emplace_back();
    for (std::size_t i = 0; i < scene.nodes.size(); ++i)
        if (!is_child[i]) all.roots.push_back(static_cast<int>(i));
}

void readCameras(const tinygltf::Model& model, Scene& scene) {
    for (const tinygltf::Camera& source : model.cameras) {
        Camera& camera = scene.cameras.emplace_back();
        camera.name = source.name;
        camera.perspective = source.type == "perspective";
        if (camera.perspective) {
            const tinygltf::PerspectiveCamera& lens = source.perspective;
            camera.yfov = lens.yfov;
            camera.znear = lens.znear;
            // tinygltf's zeros say that the file has none; the schema check refuses written ones.
            if (lens.aspectRatio > 0) camera.aspect_ratio = lens.aspectRatio;
            if (lens.zfar > 0) camera.zfar = lens.zfar;
        } else {
            camera.xmag = source.orthographic.xmag;
            camera.ymag = source.orthographic.ymag;
            camera.znear = source.orthographic.znear;
            camera.zfar = source.orthographic.zfar;
        }
    }
}

void warnOfWhatIsIgnored(GltfDocument& document) {
    if (document.has_animations)
        document.warn("Animations are not evaluated yet: the scene is shown at rest.");
    if (document.has_skins)
        document.warn("Skins are not evaluated yet: meshes are shown in bind pose.");
    if (document.has_morph_targets)
        document.warn("Morph targets are not evaluated yet: meshes are shown without them.");
    for (const std::string& name : document.model.extensionsUsed) {
        const std::vector<GltfExtension>& known = gltfExtensions();
        const auto found = std::find_if(known.begin(), known.end(),
                                        [&](const auto& entry) { return name == entry.name; });
        if (found == known.end())
            document.warn("The extension " + name + " is not known; it is ignored.");
        else if (!found->supported)
            document.warn("The extension " + name + " is ignored: " + found->note + ".");
    }
}

}  // namespace

Scene readGltf(const std::filesystem::path& path, const GltfOptions& options) {
    try {
        GltfDocument document(path, options.max_file_bytes);
        loadGltfDocument(document, path, options);
        Scene scene;
        readGltfMaterials(document, options, scene);
        scene.meshes =
            readGltfMeshes(document, options, static_cast<int>(scene.materials.size()) - 1);
        readNodes(document, scene);
        readScenes(document.model, scene);
        readCameras(document.model, scene);
        scene.lights = std::move(document.lights);
        scene.variants = std::move(document.variants);
        warnOfWhatIsIgnored(document);
        scene.generator = document.model.asset.generator;
        scene.copyright = document.model.asset.copyright;
        scene.extensions_used = document.model.extensionsUsed;
        scene.extensions_required = document.model.extensionsRequired;
        scene.content_hash = document.content_hash;
        scene.warnings = std::move(document.warnings);
        return scene;
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kMemory, "not enough memory to read the scene", path.string());
    } catch (const std::exception& problem) {
        // What the checks before tinygltf and OpenImageIO let through.
        throw Error(ErrorKind::kInput, "the scene cannot be read: " + std::string(problem.what()),
                    path.string(), "check the file with the Khronos glTF validator");
    }
}

}  // namespace peeler
