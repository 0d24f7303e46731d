// SPDX-License-Identifier: Apache-2.0
// Reads the file, checks it, and hands tinygltf no more than it handles well.
#include "formats/gltf/gltf_document.h"

#include <algorithm>
#include <limits>
#include <new>
#include <nlohmann/json.hpp>
#include <set>

#include "core/base/error.h"
#include "formats/file/content_hash.h"
#include "formats/file/regular_file.h"
#include "formats/gltf/gltf_container.h"
#include "formats/gltf/gltf_parts.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

using nlohmann::json;

// Who reads so many warnings has seen enough; a hostile file could have one for each of its bytes.
constexpr std::size_t kMaxWarnings = 100;

/// Moves an array out of the root object; an empty one if it is not there.
json take(json& gltf, const char* name) {
    const auto found = gltf.find(name);
    if (found == gltf.end()) return json::array();
    json result = std::move(*found);
    gltf.erase(found);
    return result;
}

/// Moves this member of every node out; an empty object for those without.
json takeFromNodes(json& gltf, const char* member) {
    json result = json::array();
    if (const auto nodes = gltf.find("nodes"); nodes != gltf.end()) {
        for (json& node : *nodes) {
            const auto found = node.find(member);
            result.push_back(found == node.end() ? json::object() : std::move(*found));
            if (found != node.end()) node.erase(found);
        }
    }
    return result;
}

/// tinygltf reads and decodes whatever buffers and images name, in the current folder too, wants a
/// buffer view for every index accessor, and gives up where an animation or a light is odd. It
/// never sees any of these: the arrays have been taken out before, and the rest is taken out here.
json withoutWhatTinygltfMishandles(json gltf) {
    gltf.erase("extensions");
    if (const auto meshes = gltf.find("meshes"); meshes != gltf.end())
        for (json& mesh : *meshes)
            for (json& primitive : mesh["primitives"])
                primitive.erase("indices");
    return gltf;
}

/// Functions that find no file. tinygltf takes all or none of them, and newer ones have one more.
template <class Callbacks>
Callbacks noFiles() {
    Callbacks files{};
    files.FileExists = [](const std::string&, void*) { return false; };
    files.ExpandFilePath = [](const std::string&, void*) { return std::string(); };
    files.ReadWholeFile = [](std::vector<unsigned char>*, std::string*, const std::string&, void*) {
        return false;
    };
    files.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&,
                              void*) { return false; };
    if constexpr (requires { files.GetFileSizeInBytes; })
        files.GetFileSizeInBytes = [](std::size_t*, std::string*, const std::string&, void*) {
            return false;
        };
    return files;
}

tinygltf::Model parseModel(const json& gltf, const std::string& path) {
    const std::string text = withoutWhatTinygltfMishandles(gltf).dump();
    if (text.size() > std::numeric_limits<unsigned int>::max())
        throw Error(ErrorKind::kInput, "the JSON has more than 4 GiB", path,
                    "move the data URIs to files of their own");
    tinygltf::TinyGLTF parser;
    // Nothing in the text makes it open a file; these callbacks make sure.
    parser.SetFsCallbacks(noFiles<tinygltf::FsCallbacks>());
    tinygltf::Model model;
    std::string problems, remarks;
    bool parsed = false;
    try {
        parsed = parser.LoadASCIIFromString(&model, &problems, &remarks, text.data(),
                                            static_cast<unsigned int>(text.size()), "");
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& problem) {
        problems = problem.what();
    }
    if (!parsed) {
        while (!problems.empty() && problems.back() == '\n')
            problems.pop_back();
        failGltf("the glTF cannot be read: " + problems, path);
    }
    if (const auto meshes = gltf.find("meshes"); meshes != gltf.end())
        for (std::size_t i = 0; i < meshes->size(); ++i)
            for (std::size_t j = 0; j < model.meshes[i].primitives.size(); ++j)
                model.meshes[i].primitives[j].indices =
                    (*meshes)[i]["primitives"][j].value("indices", -1);
    return model;
}

void readBuffer(GltfDocument& document, const json& buffers, std::size_t index,
                const GltfContainer& container) {
    const std::string where = childPointer("/buffers", index);
    const json& buffer = buffers[index];
    const auto uri = buffer.find("uri");
    std::span<const std::uint8_t> bytes;
    if (uri == buffer.end()) {
        // Without a URI: the binary chunk, or a placeholder for an extension (§3.6.1.2).
        if (index != 0 || !container.binary) return;
        bytes = *container.binary;
    } else if (const std::string& text = uri->get_ref<const std::string&>(); isDataUri(text)) {
        bytes = document.storage.emplace_back(decodeDataUri(text, where + "/uri"));
    } else {
        bytes = document.keep(document.folder.read(text, where + "/uri"));
    }
    const auto length = buffer["byteLength"].get<std::uint64_t>();
    if (length > bytes.size())
        throw Error(ErrorKind::kInput,
                    "the buffer is truncated: byteLength says " + std::to_string(length) + ", " +
                        std::to_string(bytes.size()) + " bytes are there",
                    where, "copy or export the file again");
    document.buffers[index] = bytes.first(length);
}

void readBuffers(GltfDocument& document, const json& buffers, const GltfContainer& container) {
    document.buffers.resize(buffers.size());
    for (std::size_t i = 0; i < buffers.size(); ++i)
        if (!isMeshoptFallback(buffers[i])) readBuffer(document, buffers, i, container);
}

/// Decodes the compressed views. Where that fails, the view's own bytes stand in for it, if there
/// are any and options.strict is off.
void decompressViews(GltfDocument& document, const json& gltf, const json& buffers,
                     const GltfContainer& container, const GltfOptions& options) {
    const auto views = gltf.find("bufferViews");
    if (views == gltf.end()) return;
    for (const MeshoptProblem& problem : decodeMeshoptViews(*views, document, options)) {
        const auto buffer =
            static_cast<std::size_t>(document.model.bufferViews[problem.view].buffer);
        if (options.strict) throw problem.error;
        if (document.buffers[buffer].empty() && buffers[buffer].contains("uri")) {
            try {
                readBuffer(document, buffers, buffer, container);
            } catch (const Error&) {
                throw problem.error;  // it is the cause
            }
        }
        if (document.buffers[buffer].empty()) throw problem.error;
        document.warn("The uncompressed data stands in for that of " + problem.error.where() +
                      ": " + problem.error.what() + ".");
    }
}

void listImages(GltfDocument& document, const json& images) {
    for (const json& image : images) {
        GltfDocument::ImageSource& source = document.images.emplace_back();
        if (const auto name = image.find("name"); name != image.end() && name->is_string())
            source.name = name->get<std::string>();
        source.uri = image.value("uri", "");
        source.buffer_view = image.value("bufferView", -1);
    }
}

/// Lists the files that buffers and images name.
void listFiles(GltfDocument& document, const json& buffers, const json& images) {
    std::set<std::string> uris;
    for (const json* owners : {&buffers, &images})
        for (const json& owner : *owners)
            if (const auto uri = owner.find("uri"); uri != owner.end())
                uris.insert(uri->get<std::string>());
    std::set<std::filesystem::path> files;
    for (const std::string& uri : uris)
        if (const auto file = document.folder.find(uri)) files.insert(*file);
    document.files.assign(files.begin(), files.end());
}

}  // namespace

void GltfDocument::warn(const std::string& sentence) {
    if (warnings.size() > kMaxWarnings ||
        std::find(warnings.begin(), warnings.end(), sentence) != warnings.end())
        return;
    warnings.push_back(warnings.size() < kMaxWarnings ? sentence
                                                      : "There is more to warn of than fits here.");
}

std::span<const std::uint8_t> GltfDocument::keep(std::vector<std::uint8_t> bytes) {
    content_hash = contentHash(std::as_bytes(std::span(bytes)), content_hash);
    return storage.emplace_back(std::move(bytes));
}

void loadGltfDocument(GltfDocument& document, const std::filesystem::path& path,
                      const GltfOptions& options) {
    const std::string name = path.string();
    const auto bytes = document.keep(readRegularFile(path, options.max_file_bytes));
    if (bytes.empty())
        throw Error(ErrorKind::kInput, "the file is empty", name, "copy or export it again");
    const GltfContainer container = splitGltfContainer(bytes, name, document.warnings);
    json gltf = parseGltfJson(container.json, name);
    checkGltfVersion(gltf, name);
    checkRequiredExtensions(gltf, options.ignored_extensions);
    checkGltfSchema(gltf);
    const json buffers = take(gltf, "buffers"), images = take(gltf, "images");
    document.animations = take(gltf, "animations");
    document.skins = take(gltf, "skins");
    readGltfLights(gltf, document);
    document.node_extensions = takeFromNodes(gltf, "extensions");
    document.node_extras = takeFromNodes(gltf, "extras");
    document.variants = readVariantNames(gltf);
    document.model = parseModel(gltf, name);
    checkGltfModel(document.model);
    readBuffers(document, buffers, container);
    decompressViews(document, gltf, buffers, container, options);
    decodeDracoPrimitives(document, options);
    listImages(document, images);
    listFiles(document, buffers, images);
}

}  // namespace peeler
