// SPDX-License-Identifier: Apache-2.0
// Reading of a glTF file step by step, including its scenes and cameras.
#include "formats/gltf/gltf_reader.h"

#include <algorithm>

#include <peeler/error.h>
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_parts.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

void readScenes(const tinygltf::Model& model, Scene& scene) {
    for (const tinygltf::Scene& source : model.scenes)
        scene.scenes.push_back({source.name, source.nodes});
    scene.default_scene = std::max(model.defaultScene, 0);
    if (!scene.scenes.empty()) return;
    // A file without scenes is a library (§3.5.1). Show all of its nodes.
    scene.scenes.push_back({"", rootsOf(scene.nodes)});
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
            // In tinygltf, zero means a missing member; the schema check rejects explicit zeros.
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
    std::vector<std::string> names = document.model.extensionsUsed;
    names.insert(names.end(), document.undeclared_extensions.begin(),
                 document.undeclared_extensions.end());
    for (const std::string& name : names) {
        const std::vector<GltfExtension>& known = gltfExtensions();
        const auto found = std::find_if(known.begin(), known.end(),
                                        [&](const auto& entry) { return name == entry.name; });
        const auto& required = document.model.extensionsRequired;
        const bool supported = found != known.end() && found->supported;
        if (!supported && std::ranges::find(required, name) != required.end())
            document.warn("The extension " + name + ", which the file requires, is ignored.");
        else if (found == known.end())
            document.warn("The extension " + name + " is not known; it is ignored.");
        else if (!found->supported)
            document.warn("The extension " + name + " is ignored: " + found->note + ".");
    }
}

}  // namespace

Scene readGltf(const std::filesystem::path& path, const GltfOptions& options) {
    try {
        GltfDocument document(path, options);
        loadGltfDocument(document, path, options);
        Scene scene;
        readGltfMaterials(document, options, scene);
        scene.meshes = readGltfMeshes(document, options, scene.materials);
        readGltfNodes(document, options, scene);
        scene.animations = readGltfAnimations(document, options, scene);
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
        scene.files = std::move(document.files);
        scene.warnings = document.warnings.take();
        return scene;
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kMemory, "not enough memory to read the scene", path.string());
    } catch (const std::exception& problem) {
        // tinygltf or OpenImageIO failed because of a fault that the checks above did not find.
        failGltf("the scene cannot be read: " + std::string(problem.what()), path.string());
    }
}

}  // namespace peeler
