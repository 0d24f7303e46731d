// SPDX-License-Identifier: Apache-2.0
// Merging of buffers and images into one binary chunk.
#include "formats/gltf/glb_writer.h"

#include <array>
#include <limits>
#include <map>
#include <string_view>
#include <system_error>

#include <peeler/error.h>
#include "formats/file/atomic_file.h"
#include "formats/file/json_text.h"
#include "formats/file/regular_file.h"
#include "formats/gltf/gltf_container.h"
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_parts.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::uint64_t kMostContainerBytes = std::numeric_limits<std::uint32_t>::max();
// Alignment of chunks, in bytes; sufficient for every accessor.
constexpr std::uint64_t kContainerAlignment = 4;

std::uint64_t padded(std::uint64_t bytes) {
    return (bytes + kContainerAlignment - 1) / kContainerAlignment * kContainerAlignment;
}

/// The magic bytes of the image formats that glTF allows.
struct ImageMagic {
    std::size_t offset;
    std::string_view bytes;
    const char* mime_type;
};
constexpr ImageMagic kImageMagic[] = {
    {0, "\x89PNG", "image/png"},     {0, "\xFF\xD8\xFF", "image/jpeg"},
    {8, "WEBP", "image/webp"},       {0, "\xABKTX 20", "image/ktx2"},
    {0, "DDS ", "image/vnd-ms.dds"}, {4, "ftypavif", "image/avif"},
};

/// Returns the media type of an image, or null for formats that glTF does not allow.
const char* mimeTypeOf(std::span<const std::uint8_t> bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    for (const ImageMagic& magic : kImageMagic)
        if (text.size() > magic.offset && text.substr(magic.offset).starts_with(magic.bytes))
            return magic.mime_type;
    return nullptr;
}

/// Returns the array with this name in the root object. Creates the array if it is missing.
ordered_json& arrayIn(ordered_json& gltf, const char* name) {
    ordered_json& array = gltf[name];
    if (array.is_null()) array = ordered_json::array();
    return array;
}

std::size_t appendElement(ordered_json& gltf, const char* name, ordered_json element) {
    ordered_json& array = arrayIn(gltf, name);
    array.push_back(std::move(element));
    return array.size() - 1;
}

[[noreturn]] void failTooLarge(const std::string& path) {
    throw Error(ErrorKind::kOutput, "the .glb would exceed its format's limit of 4 GiB", path,
                "bake parts of the scene into separate files");
}

std::string word(std::uint64_t value) {
    std::string bytes(4, '\0');
    for (std::size_t i = 0; i < 4; ++i)
        bytes[i] = static_cast<char>(value >> (8 * i) & 0xFFU);
    return bytes;
}

}  // namespace

GlbWriter::GlbWriter(const std::filesystem::path& path, const GltfOptions& options)
    : path_(path.string()), folder_(path, options.max_file_bytes, options.allow_outside) {
    const std::span<const std::uint8_t> bytes =
        storage_.emplace_back(readRegularFile(path, options.max_file_bytes));
    const GltfContainer container = splitGltfContainer(bytes, path_, given_by_read_gltf_);
    json checked = parseGltfJson(container.json, path_);
    checkGltfSchema(checked);
    json_ = parseOrderedGltfJson(container.json, path_);
    takeBuffers(checked, container.binary);
    takeImages();
}

std::uint64_t GlbWriter::memory(const std::filesystem::path& path, const GltfOptions& options,
                                std::span<const std::filesystem::path> named) {
    const std::vector<std::uint8_t> bytes = readRegularFile(path, options.max_file_bytes);
    ReadWarnings given_by_read_gltf(false, {});
    const GltfContainer container = splitGltfContainer(bytes, path.string(), given_by_read_gltf);
    // The JSON is in memory as text and as two trees: a checked tree and an edited tree. Decoding
    // data URIs turns four characters into three bytes.
    std::uint64_t all = bytes.size() + 2 * parsedBytes(container.json);
    if (!container.binary) all += bytes.size() / 4 * 3;
    for (const std::filesystem::path& file : named) {
        std::error_code failure;
        const std::uint64_t of_file = std::filesystem::file_size(file, failure);
        if (!failure) all += of_file;
    }
    return all;
}

std::uint64_t GlbWriter::append(std::span<const std::uint8_t> bytes) {
    const std::uint64_t start = size_;
    size_ += padded(bytes.size());
    if (size_ > kMostContainerBytes) failTooLarge(path_);
    parts_.push_back(bytes);
    return start;
}

/// Returns the bytes of a source buffer, or no value for a placeholder of decompressed data.
std::optional<std::span<const std::uint8_t>> GlbWriter::bufferBytes(
    const json& buffer, std::size_t index, std::optional<std::span<const std::uint8_t>> binary) {
    const std::string where = childPointer("/buffers", index);
    const auto uri = buffer.find("uri");
    if (uri == buffer.end() && (index != 0 || !binary || isMeshoptFallback(buffer))) return {};
    std::span<const std::uint8_t> bytes;
    if (uri == buffer.end()) {
        bytes = *binary;
    } else if (const auto text = uri->get<std::string>(); isDataUri(text)) {
        bytes = storage_.emplace_back(decodeDataUri(text, where + "/uri"));
    } else {
        try {
            bytes = storage_.emplace_back(folder_.read(text, where + "/uri", given_by_read_gltf_));
        } catch (const Error&) {
            if (isMeshoptFallback(buffer)) return {};  // a fallback buffer is optional
            throw;
        }
    }
    const auto length = buffer["byteLength"].get<std::uint64_t>();
    if (length > bytes.size())
        throw Error(ErrorKind::kInput, "the buffer is truncated", where,
                    "copy or export the file again");
    return bytes.first(length);
}

void GlbWriter::takeBuffers(const json& checked,
                            std::optional<std::span<const std::uint8_t>> binary) {
    ordered_json merged = ordered_json::object();
    std::vector<ordered_json> placeholders;
    const std::size_t count = checked.contains("buffers") ? checked["buffers"].size() : 0;
    for (std::size_t i = 0; i < count; ++i) {
        ordered_json buffer = json_["buffers"][i];
        buffer.erase("uri");
        const std::optional<std::span<const std::uint8_t>> bytes =
            bufferBytes(checked["buffers"][i], i, binary);
        if (bytes) {
            if (parts_.empty()) merged = buffer;
            starts_.emplace_back(append(*bytes));
            placeholders_.push_back(0);
        } else {
            placeholders.push_back(std::move(buffer));
            starts_.emplace_back();
            placeholders_.push_back(placeholders.size());
        }
    }
    ordered_json& buffers = json_["buffers"] = ordered_json::array();
    buffers.push_back(std::move(merged));  // write() sets the byteLength later
    for (ordered_json& placeholder : placeholders)
        buffers.push_back(std::move(placeholder));
    const auto views = json_.find("bufferViews");
    if (views == json_.end()) return;
    for (ordered_json& view : *views) {
        relocate(view);
        const auto extensions = view.find("extensions");
        if (extensions == view.end()) continue;
        for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
            if (extensions->contains(name)) relocate((*extensions)[name]);
    }
}

/// Updates a reference to a buffer, and its offset, to the new position in the .glb.
void GlbWriter::relocate(ordered_json& place) const {
    const auto buffer = place["buffer"].get<std::size_t>();
    if (!starts_[buffer]) {
        place["buffer"] = placeholders_[buffer];
        return;
    }
    place["buffer"] = 0;
    if (*starts_[buffer] == 0) return;
    place["byteOffset"] = *starts_[buffer] + place.value("byteOffset", std::uint64_t{0});
}

void GlbWriter::takeImages() {
    const auto images = json_.find("images");
    if (images == json_.end()) return;
    struct Place {
        std::size_t view;
        const char* mime_type;
    };
    // Images are indexed by URI, so that a file that is used several times is read only once.
    std::map<std::string, Place> known;
    for (std::size_t i = 0; i < images->size(); ++i) {
        ordered_json& image = (*images)[i];
        if (!image.contains("uri")) continue;
        const std::string where = childPointer("/images", i);
        const auto uri = image["uri"].get<std::string>();
        auto place = known.find(uri);
        if (place == known.end()) {
            std::vector<std::uint8_t> bytes;
            try {
                bytes = isDataUri(uri) ? decodeDataUri(uri, where)
                                       : folder_.read(uri, where, given_by_read_gltf_);
            } catch (const Error& problem) {
                warnings_.push_back("The image " + where +
                                    " is not embedded: " + problem.whatText() + ".");
                continue;
            }
            const char* mime_type = mimeTypeOf(bytes);
            if (!mime_type) {
                if (!isDataUri(uri))  // a data URI may stay in the JSON
                    warnings_.push_back("The image " + where +
                                        " is not embedded: glTF does not allow its format.");
                continue;
            }
            place = known.emplace(uri, Place{addBufferView(std::move(bytes)), mime_type}).first;
        }
        image.erase("uri");
        image["mimeType"] = place->second.mime_type;
        image["bufferView"] = place->second.view;
    }
}

std::size_t GlbWriter::addBufferView(std::vector<std::uint8_t> bytes, std::optional<int> target) {
    const std::size_t length = bytes.size();
    const std::uint64_t start = append(storage_.emplace_back(std::move(bytes)));
    ordered_json view = {{"buffer", 0}, {"byteOffset", start}, {"byteLength", length}};
    if (target) view["target"] = *target;
    return appendElement(json_, "bufferViews", std::move(view));
}

std::size_t GlbWriter::addAccessor(std::vector<std::uint8_t> bytes, const NewAccessor& accessor) {
    ordered_json result = {{"bufferView", addBufferView(std::move(bytes), 34962)},
                           {"componentType", accessor.component_type}};
    if (accessor.normalized) result["normalized"] = true;
    result["count"] = accessor.count;
    result["type"] = accessor.type;
    return appendElement(json_, "accessors", std::move(result));
}

std::size_t GlbWriter::addImage(std::vector<std::uint8_t> bytes, const std::string& mime_type,
                                const std::string& name) {
    ordered_json image = {{"name", name}, {"mimeType", mime_type}};
    image["bufferView"] = addBufferView(std::move(bytes));
    return appendElement(json_, "images", std::move(image));
}

void GlbWriter::write(const std::string& path) {
    static constexpr std::array<std::byte, kContainerAlignment> kZeros{};
    // glTF does not allow empty buffers.
    if (size_ == 0) append(storage_.emplace_back(kContainerAlignment));
    json_["buffers"][0]["byteLength"] = size_;
    std::string text = dumpJson(json_);
    text.resize(padded(text.size()), ' ');
    constexpr std::uint64_t kHeaders = 12 + 8 + 8;
    const std::uint64_t total = kHeaders + text.size() + size_;
    if (total > kMostContainerBytes) failTooLarge(path);
    AtomicFile file(path);
    const auto put = [&](const std::string& bytes) {
        file.append(std::as_bytes(std::span(bytes)));
    };
    put("glTF" + word(2) + word(total) + word(text.size()) + "JSON");
    put(text);
    put(word(size_) + std::string("BIN\0", 4));
    for (const std::span<const std::uint8_t>& part : parts_) {
        file.append(std::as_bytes(part));
        file.append(std::span(kZeros).first(padded(part.size()) - part.size()));
    }
    file.commit();
}

}  // namespace peeler
