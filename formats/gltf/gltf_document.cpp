// SPDX-License-Identifier: Apache-2.0
// Loading and checking of a glTF file.
//
// tinygltf gets only the parts of the JSON that it handles well.
#include "formats/gltf/gltf_document.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <new>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "core/base/printable.h"
#include "formats/file/content_hash.h"
#include "formats/file/json_text.h"
#include "formats/file/regular_file.h"
#include "formats/gltf/gltf_container.h"
#include "formats/gltf/gltf_parts.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

using nlohmann::json;

/// Moves an array out of the root object. Returns an empty array if the root object lacks it.
json take(json& gltf, const char* name) {
    const auto found = gltf.find(name);
    if (found == gltf.end()) return json::array();
    json result = std::move(*found);
    gltf.erase(found);
    return result;
}

/// Moves a member out of every node into an array. The array has null for nodes without the member.
json takeFromNodes(json& gltf, const char* member) {
    json result = json::array();
    if (const auto nodes = gltf.find("nodes"); nodes != gltf.end()) {
        for (json& node : *nodes) {
            const auto found = node.find(member);
            result.push_back(found == node.end() ? json() : std::move(*found));
            if (found != node.end()) node.erase(found);
        }
    }
    return result;
}

/// Returns file callbacks that find no file. tinygltf requires all callbacks or none; newer
/// versions have one more callback.
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

/// Returns the size of the block that glibc's malloc() allocates: one word more than requested,
/// rounded up to two words, at least four words.
constexpr std::uint64_t allocated(std::uint64_t bytes) {
    constexpr std::uint64_t kWord = sizeof(void*), kStep = 2 * kWord;
    return std::max(2 * kStep, (bytes + kWord + kStep - 1) / kStep * kStep);
}

/// Returns the heap memory of a string. Up to 15 bytes are stored in the object itself.
constexpr std::uint64_t textBytes(std::uint64_t size) {
    return size > 15 ? allocated(size + 1) : 0;
}

/// Returns the memory of a vector that has grown by doubling its storage.
constexpr std::uint64_t grownBytes(std::uint64_t elements, std::uint64_t size) {
    return elements == 0 ? 0 : allocated(std::bit_ceil(elements) * size);
}

/// Returns the number of JSON values in all objects called `name`, counting these objects.
std::uint64_t valuesIn(const json& value, const char* name, bool inside = false) {
    std::uint64_t values = inside ? 1 : 0;
    if (!value.is_structured()) return values;
    for (const auto& [key, member] : value.items())
        values += valuesIn(member, name, inside || (value.is_object() && key == name));
    return values;
}

/// Returns the bytes of all numeric arrays in tinygltf's model.
std::uint64_t numberBytes(const json& value) {
    if (!value.is_structured()) return 0;
    if (value.is_array() && !value.empty() && value.front().is_number())
        return grownBytes(value.size(), sizeof(double)) * 3 / 2;
    std::uint64_t bytes = 0;
    for (const json& member : value)
        bytes += numberBytes(member);
    return bytes;
}

/// Returns the heap memory of tinygltf's model of this JSON, without strings. The factor 3/2 covers
/// a vector that is doubling its storage while the old storage is still allocated.
std::uint64_t modelBytes(const json& gltf) {
    constexpr std::pair<const char*, std::uint64_t> kElements[] = {
        {"nodes", sizeof(tinygltf::Node)},
        {"accessors", sizeof(tinygltf::Accessor)},
        {"meshes", sizeof(tinygltf::Mesh)},
        {"materials", sizeof(tinygltf::Material)},
        {"textures", sizeof(tinygltf::Texture)},
        {"samplers", sizeof(tinygltf::Sampler)},
        {"cameras", sizeof(tinygltf::Camera)},
        {"scenes", sizeof(tinygltf::Scene)},
        {"bufferViews", sizeof(tinygltf::BufferView)},
    };
    // In the model, an extension is a tree of values in maps or vectors.
    constexpr std::uint64_t kOfExtension = 2 * sizeof(tinygltf::Value);
    std::uint64_t bytes = kOfExtension * valuesIn(gltf, "extensions") + numberBytes(gltf);
    for (const auto& [name, size] : kElements) {
        if (const auto found = gltf.find(name); found != gltf.end())
            bytes += grownBytes(found->size(), size) * 3 / 2;
    }
    if (const auto meshes = gltf.find("meshes"); meshes != gltf.end()) {
        for (const json& mesh : *meshes) {
            if (const auto primitives = mesh.find("primitives"); primitives != mesh.end())
                bytes += grownBytes(primitives->size(), sizeof(tinygltf::Primitive));
        }
    }
    return bytes;
}

/// Moves the `indices` of all primitives out of the JSON. Returns them by mesh and primitive; −1 if
/// missing.
std::vector<std::vector<int>> takeIndices(json& gltf) {
    std::vector<std::vector<int>> indices;
    const auto meshes = gltf.find("meshes");
    if (meshes == gltf.end()) return indices;
    for (json& mesh : *meshes) {
        std::vector<int>& of_mesh = indices.emplace_back();
        for (json& primitive : mesh["primitives"]) {
            of_mesh.push_back(primitive.value("indices", -1));
            primitive.erase("indices");
        }
    }
    return indices;
}

/// Erases all members with this name, at any depth.
void eraseAll(json& value, const char* name) {
    if (value.is_object()) value.erase(name);
    if (value.is_structured())
        for (json& member : value)
            eraseAll(member, name);
}

tinygltf::Model parseModel(json gltf, GltfDocument& document, const std::string& path) {
    // tinygltf reads and decodes all buffers and images, even from the current folder. It requires
    // a buffer view for every index accessor, fails on unusual animations or lights, and takes ten
    // times the memory for unused extras. So tinygltf gets none of these. The caller has removed
    // the arrays; remove the rest here.
    gltf.erase("extensions");
    eraseAll(gltf, "extras");
    const std::vector<std::vector<int>> indices = takeIndices(gltf);
    const std::uint64_t of_model = modelBytes(gltf);
    const std::string text = dumpJson(std::exchange(gltf, {}));
    // Strings are in memory twice: tinygltf's JSON holds all strings, its model all strings except
    // keys.
    document.memory.allow(of_model + parsedBytes(text) + text.size(), path);
    if (text.size() > std::numeric_limits<unsigned int>::max())
        throw Error(ErrorKind::kInput, "the JSON has more than 4 GiB", path,
                    "move the data URIs to files of their own");
    tinygltf::TinyGLTF parser;
    // These callbacks guarantee that tinygltf opens no file, whatever the text contains.
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
    for (std::size_t i = 0; i < indices.size(); ++i)
        for (std::size_t j = 0; j < model.meshes[i].primitives.size(); ++j)
            model.meshes[i].primitives[j].indices = indices[i][j];
    return model;
}

void readBuffer(GltfDocument& document, const json& buffers, std::size_t index,
                const GltfContainer& container) {
    const std::string where = childPointer("/buffers", index);
    const json& buffer = buffers[index];
    const auto uri = buffer.find("uri");
    std::span<const std::uint8_t> bytes;
    if (uri == buffer.end()) {
        // A buffer without a URI is the binary chunk, or a placeholder for an extension (§3.6.1.2).
        if (index != 0 || !container.binary) return;
        bytes = *container.binary;
    } else {
        bytes = document.readUri(uri->get_ref<const std::string&>(), where + "/uri");
    }
    const auto length = buffer["byteLength"].get<std::uint64_t>();
    if (length > bytes.size())
        throw Error(ErrorKind::kInput,
                    "the buffer is truncated: byteLength says " + std::to_string(length) +
                        ", but only " + std::to_string(bytes.size()) + " bytes are there",
                    where, "copy or export the file again");
    document.buffers[index] = bytes.first(length);
}

void readBuffers(GltfDocument& document, const json& buffers, const GltfContainer& container) {
    document.buffers.resize(buffers.size());
    for (std::size_t i = 0; i < buffers.size(); ++i)
        if (!isMeshoptFallback(buffers[i])) readBuffer(document, buffers, i, container);
}

/// Decodes the compressed views. If decoding fails, uses the view's uncompressed fallback. Throws
/// the error if there is no fallback or if options.strict is set.
void decompressViews(GltfDocument& document, const json& views, const json& buffers,
                     const GltfContainer& container, const GltfOptions& options) {
    for (const MeshoptProblem& problem : decodeMeshoptViews(views, document, options)) {
        const auto buffer =
            static_cast<std::size_t>(document.model.bufferViews[problem.view].buffer);
        if (options.strict) throw problem.error;
        if (document.buffers[buffer].empty() && buffers[buffer].contains("uri")) {
            try {
                readBuffer(document, buffers, buffer, container);
            } catch (const Error&) {
                throw problem.error;  // report the original error, not the failure of the fallback
            }
        }
        if (document.buffers[buffer].empty()) throw problem.error;
        document.warn("The uncompressed fallback is used because of an error at " +
                      problem.error.whereText() + ": " + problem.error.whatText() + ".");
    }
}

void listImages(GltfDocument& document, const json& images) {
    for (const json& image : images) {
        GltfDocument::ImageSource& source = document.images.emplace_back();
        if (const auto name = image.find("name"); name != image.end() && name->is_string())
            source.name = name->get<std::string>();
        source.uri = image.value("uri", "");
        source.buffer_view = image.value("bufferView", -1);
        if (!source.uri.empty() && source.buffer_view >= 0)
            document.warn("The image " + childPointer("/images", document.images.size() - 1) +
                              " has a URI and a buffer view (ONE_OF_MISMATCH); the buffer view " +
                              "is used.",
                          childPointer("/images", document.images.size() - 1));
    }
}

/// Collects the files to which buffers and images refer.
void listFiles(GltfDocument& document, const json& buffers, const json& images) {
    std::set<std::string> uris;
    for (const json* owners : {&buffers, &images})
        for (const json& owner : *owners)
            if (const auto uri = owner.find("uri"); uri != owner.end()) {
                const auto& text = uri->get_ref<const std::string&>();
                if (!isDataUri(text)) uris.insert(text);
            }
    std::set<std::filesystem::path> files;
    for (const std::string& uri : uris)
        if (const auto file = document.folder.find(uri)) files.insert(*file);
    document.files.assign(files.begin(), files.end());
}

}  // namespace

std::uint64_t parsedBytes(std::string_view text) {
    constexpr std::uint64_t kTreeNode = 4 * sizeof(void*);
    constexpr std::uint64_t kText = allocated(sizeof(json::string_t));
    constexpr std::uint64_t kArray = allocated(sizeof(json::array_t));
    constexpr std::uint64_t kObject = allocated(sizeof(json::object_t));
    constexpr std::uint64_t kMember = allocated(kTreeNode + sizeof(json::object_t::value_type));
    std::uint64_t bytes = 0, largest = 0, longest = 0;
    // For each open array or object, the number of elements before the current element.
    std::vector<std::uint64_t> elements;
    std::size_t quote = text.npos;  // position of the open string's quotation mark
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '"') {
            if (quote != text.npos) {
                bytes += kText + textBytes(i - quote - 1);
                longest = std::max<std::uint64_t>(longest, i - quote);
            }
            quote = quote == text.npos ? i : text.npos;
        } else if (quote != text.npos) {
            i += c == '\\' ? 1 : 0;
        } else if (c == ',' && !elements.empty()) {
            ++elements.back();
        } else if (c == ':') {
            bytes += kMember - kText;  // kMember includes the key's string
        } else if (c == '{' || c == '[') {
            bytes += c == '[' ? kArray : kObject;
            elements.push_back(0);
        } else if ((c == '}' || c == ']') && !elements.empty()) {
            const std::uint64_t array = grownBytes(elements.back() + 1, sizeof(json));
            elements.pop_back();
            if (c == '}') continue;
            bytes += array;
            largest = std::max(largest, array);
        }
    }
    return bytes + 2 * largest + 2 * longest;
}

std::span<const std::uint8_t> GltfDocument::readUri(const std::string& uri,
                                                    const std::string& where) {
    if (isDataUri(uri)) {
        memory.allow(uri.size() * 3 / 4, where);
        if (uri.find_first_of(kBase64Space) != std::string::npos)
            warn("The data URI " + where + " has white space in it (INVALID_URI).", where);
        return storage.emplace_back(decodeDataUri(uri, where));
    }
    const auto [entry, is_new] = read_.try_emplace(uri);
    if (!is_new) {
        content_hash = contentHash(std::as_bytes(entry->second), content_hash);
        return entry->second;
    }
    std::error_code unknown;
    if (const auto file = folder.find(uri))
        if (const auto size = std::filesystem::file_size(*file, unknown); !unknown)
            memory.allow(size, where);
    try {
        return entry->second = keep(folder.read(uri, where, warnings));
    } catch (...) {
        read_.erase(entry);
        throw;
    }
}

std::span<const std::uint8_t> GltfDocument::keep(std::vector<std::uint8_t> bytes) {
    content_hash = contentHash(std::as_bytes(std::span(bytes)), content_hash);
    return storage.emplace_back(std::move(bytes));
}

void loadGltfDocument(GltfDocument& document, const std::filesystem::path& path,
                      const GltfOptions& options) {
    const std::string name = path.string();
    std::error_code unknown;
    if (const auto size = std::filesystem::file_size(path, unknown); !unknown)
        document.memory.allow(size, name);
    const auto bytes = document.keep(readRegularFile(path, options.max_file_bytes));
    if (bytes.empty())
        throw Error(ErrorKind::kInput, "the file is empty", name, "copy or export it again");
    const GltfContainer container = splitGltfContainer(bytes, name, document.warnings);
    checkJsonDepth(container.json, name);
    document.memory.allow(parsedBytes(container.json), name);
    json gltf = parseGltfJson(container.json, name);
    checkGltfVersion(gltf, name, document.warnings);
    checkRequiredExtensions(gltf, options.ignored_extensions);
    // Check the memory before the schema, because checking millions of nodes would take seconds.
    if (const auto nodes = gltf.find("nodes"); nodes != gltf.end() && nodes->is_array())
        document.memory.allow(nodes->size() * (sizeof(tinygltf::Node) + sizeof(Node)), name);
    checkGltfSchema(gltf);
    checkGltfForest(gltf, document.warnings);
    warnOfTwoPlaces(gltf, document.warnings);
    warnOfEmptyParts(gltf, document.warnings);
    document.undeclared_extensions = undeclaredExtensions(gltf);
    const json buffers = take(gltf, "buffers"), images = take(gltf, "images");
    document.animations = take(gltf, "animations");
    document.skins = take(gltf, "skins");
    readGltfLights(gltf, document);
    document.node_extensions = takeFromNodes(gltf, "extensions");
    document.node_extras = takeFromNodes(gltf, "extras");
    document.variants = readVariantNames(gltf);
    const json views = gltf.value("bufferViews", json::array());
    // The remaining JSON is serialised again, into a string that grows by doubling its storage.
    document.memory.allow(2 * container.json.size(), name);
    document.model = parseModel(std::move(gltf), document, name);
    checkGltfCameras(document.model);
    readBuffers(document, buffers, container);
    decompressViews(document, views, buffers, container, options);
    decodeDracoPrimitives(document, options);
    listImages(document, images);
    listFiles(document, buffers, images);
}

}  // namespace peeler
