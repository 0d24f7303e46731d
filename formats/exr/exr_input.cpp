// SPDX-License-Identifier: Apache-2.0
// Low-level OpenEXR reader, based on OpenEXRCore, with checks of its results.
//
// OpenEXRCore, the C library, decodes chunks of the same part on several threads and keeps no
// buffers between chunks. OpenEXR's C++ classes would keep buffers for every one of hundreds of
// parts.
#include "formats/exr/exr_input.h"

#include <OpenEXR/openexr.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <limits>
#include <new>
#include <system_error>
#include <utility>

#include <peeler/error.h>
#include "formats/exr/exr_classes.h"
#include "formats/exr/exr_layout.h"
#include "formats/image/exr_headers.h"

namespace peeler {
namespace {

/// Maximum number of channels per part. One part may hold all layers.
constexpr int kMaxChannels = 1 << 16;
/// Slightly more than the size of zlib's state, in bytes.
constexpr std::size_t kZlibState = 1 << 16;
/// The number of bytes that OpenEXR's classes may always allocate for a block of rows or a tile,
/// even if the block holds few of the image's pixels. The classes may allocate more only if the
/// file is large enough.
constexpr std::uint64_t kMostBlock = 64U << 20;

/// The details of the last failure, which OpenEXRCore reports to a callback on the calling thread.
thread_local std::string last_message;
/// An exception caught in a callback, because exceptions must not pass through C code. It is thrown
/// again after the call. OpenEXRCore itself would report lack of memory or a read error as a
/// damaged file, or continue without an attribute.
thread_local std::exception_ptr withheld;

void keepMessage(exr_const_context_t, exr_result_t, const char* message) {
    try {
        last_message = message ? message : "";
    } catch (...) {
        withheld = std::current_exception();
    }
}

void* allocate(std::size_t bytes) {
    void* const memory = std::malloc(bytes);
    if (!memory) withheld = std::make_exception_ptr(std::bad_alloc());
    return memory;
}

/// Reads bytes for OpenEXRCore. Without this callback, OpenEXRCore would open the path again, and
/// would block if the path has become a pipe.
std::int64_t readExrBytes(exr_const_context_t, void* file, void* to, std::uint64_t size,
                          std::uint64_t at, exr_stream_error_func_ptr_t) {
    try {
        return static_cast<std::int64_t>(
            static_cast<const RegularFile*>(file)->readSome(at, {static_cast<char*>(to), size}));
    } catch (...) {
        withheld = std::current_exception();
        return -1;
    }
}

std::int64_t exrFileSize(exr_const_context_t, void* file) {
    return static_cast<std::int64_t>(static_cast<const RegularFile*>(file)->size());
}

Window toWindow(const exr_attr_box2i_t& box) {
    // Clamp the coordinates to avoid overflow. moveToOrigin() refuses windows this large.
    constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
    return {std::max(box.min.x, -static_cast<int>(kMost)),
            std::max(box.min.y, -static_cast<int>(kMost)),
            static_cast<int>(std::min(std::int64_t{box.max.x} + 1, kMost)),
            static_cast<int>(std::min(std::int64_t{box.max.y} + 1, kMost))};
}

PixelType toPixelType(int type) {
    if (type == EXR_PIXEL_UINT) return PixelType::kUint;
    return type == EXR_PIXEL_HALF ? PixelType::kHalf : PixelType::kFloat;
}

std::uint16_t fromPixelType(PixelType type) {
    if (type == PixelType::kUint) return EXR_PIXEL_UINT;
    return type == PixelType::kHalf ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
}

const char* typeName(exr_storage_t storage) {
    switch (storage) {
        case EXR_STORAGE_SCANLINE:
            return "scanlineimage";
        case EXR_STORAGE_TILED:
            return "tiledimage";
        case EXR_STORAGE_DEEP_SCANLINE:
            return "deepscanline";
        case EXR_STORAGE_DEEP_TILED:
            return "deeptile";
        default:
            return "unknown";
    }
}

const char* compressionName(exr_compression_t compression) {
    constexpr std::array kNames = {"none",  "rle", "zips", "zip",  "piz",
                                   "pxr24", "b44", "b44a", "dwaa", "dwab"};
    const auto index = static_cast<std::size_t>(compression);
    return index < kNames.size() ? kNames[index] : "unknown";
}

/// Returns an attribute's value as text, or "" for types that are not converted.
std::string attributeText(const exr_attribute_t& attribute) {
    switch (attribute.type) {
        case EXR_ATTR_STRING:
            return {attribute.string->str, static_cast<std::size_t>(attribute.string->length)};
        case EXR_ATTR_INT:
            return numberText(attribute.i);
        case EXR_ATTR_FLOAT:
            return numberText(attribute.f);
        case EXR_ATTR_DOUBLE:
            return numberText(attribute.d);
        case EXR_ATTR_RATIONAL:
            return numberText(attribute.rational->num) + "/" +
                   numberText(attribute.rational->denom);
        default:
            return {};
    }
}

/// Returns the maximum ratio of unpacked to packed size, with a margin. PIZ writes at least 9 bits
/// for 256 2-byte numbers; B44A writes 3 bytes for 16 such numbers. PXR24 expands 3 bytes from zlib
/// to 4; DWA expands 4 bytes to 256, or 2 to 128.
std::uint64_t mostRatio(const std::string& compression) {
    if (compression == "pxr24") return 2 * kMostZlibRatio;
    return compression.starts_with("dwa") ? 64 * kMostZlibRatio : kMostZlibRatio;
}

/// Whether OpenEXR's classes are needed to read a flat part.
bool needsClasses(const ExrInputPart& part) {
    return part.type == "tiledimage" || (!part.deep() && part.compression.starts_with("dwa"));
}

/// Whether deep images may have a compression ("Technical Introduction", section on deep data).
bool canBeDeep(const std::string& compression) {
    constexpr std::array kOfDeep = {"none", "rle", "zips", "zip"};
    return std::ranges::find(kOfDeep, compression) != kOfDeep.end();
}

class DecodePipeline {
  public:
    explicit DecodePipeline(exr_const_context_t context) : context_(context) {}
    ~DecodePipeline() { exr_decoding_destroy(context_, &pipeline); }
    DecodePipeline(const DecodePipeline&) = delete;
    DecodePipeline& operator=(const DecodePipeline&) = delete;

    exr_decode_pipeline_t pipeline{};

  private:
    exr_const_context_t context_;
};

}  // namespace

std::vector<FragmentArray> fragmentArrays(std::span<const ExrInputChannel> channels) {
    std::vector<FragmentArray> arrays;
    std::string group;
    for (const ExrInputChannel& channel : channels) {
        const std::string prefix = channel.name.substr(0, channel.name.rfind('.') + 1);
        if (arrays.empty() || prefix.empty() || prefix != group ||
            arrays.back().type != channel.type) {
            arrays.push_back({{}, channel.type, {}});
        }
        group = prefix;
        arrays.back().channels.push_back(channel.name);
    }
    return arrays;
}

const ExrInputChannel* ExrInputPart::channel(const std::string& wanted) const {
    const auto found =
        std::lower_bound(channels.begin(), channels.end(), wanted,
                         [](const ExrInputChannel& channel, const std::string& text) {
                             return channel.name < text;
                         });
    return found == channels.end() || found->name != wanted ? nullptr : &*found;
}

std::string ExrInputPart::attribute(const std::string& wanted) const {
    const auto found = attributes.find(wanted);
    return found == attributes.end() ? std::string() : found->second;
}

ExrInput::ExrInput(std::string path) : path_(std::move(path)), file_(path_) {
    file_.check();
    bytes_ = file_.size();
    checkExrHeaders(file_, path_);

    exr_context_initializer_t options = EXR_DEFAULT_CONTEXT_INITIALIZER;
    options.error_handler_fn = keepMessage;
    options.user_data = &file_;
    options.read_fn = readExrBytes;
    options.size_fn = exrFileSize;
    options.alloc_fn = allocate;
    options.max_image_width = kMostImageSide;
    options.max_image_height = kMostImageSide;
    options.max_tile_width = kMostImageSide;
    options.max_tile_height = kMostImageSide;
    try {
        check(exr_start_read(&context_, path_.c_str(), &options));
        readHeaders();
        moveToOrigin();
        checkSizes();
        if (std::ranges::any_of(parts_, needsClasses))
            classes_ = std::make_unique<ExrClasses>(file_, path_);
    } catch (...) {
        exr_finish(&context_);
        throw;
    }
}

ExrInput::~ExrInput() {
    exr_finish(&context_);
}

void ExrInput::readHeaders() {
    int parts = 0;
    check(exr_get_count(context_, &parts));
    for (int i = 0; i < parts; ++i) {
        ExrInputPart& part = parts_.emplace_back();
        const char* name = nullptr;
        if (exr_get_name(context_, i, &name) == EXR_ERR_SUCCESS && name) part.name = name;
        readHeader(i, part);
        readAttributes(i, part);
    }
}

void ExrInput::readHeader(int index, ExrInputPart& part) {
    exr_storage_t storage{};
    check(exr_get_storage(context_, index, &storage), part.name);
    part.type = typeName(storage);
    exr_compression_t compression{};
    check(exr_get_compression(context_, index, &compression), part.name);
    part.compression = compressionName(compression);
    exr_attr_box2i_t box{};
    check(exr_get_data_window(context_, index, &box), part.name);
    part.data_window = toWindow(box);
    if (storage == EXR_STORAGE_TILED || storage == EXR_STORAGE_DEEP_TILED) {
        std::uint32_t width = 0, height = 0;
        exr_tile_level_mode_t levels{};
        exr_tile_round_mode_t rounding{};
        check(exr_get_tile_descriptor(context_, index, &width, &height, &levels, &rounding),
              part.name);
        part.tile_width = static_cast<int>(width);
        part.tile_height = static_cast<int>(height);
    }
    check(exr_get_display_window(context_, index, &box), part.name);
    part.display_window = toWindow(box);

    const exr_attr_chlist_t* channels = nullptr;
    check(exr_get_channels(context_, index, &channels), part.name);
    for (int c = 0; c < channels->num_channels; ++c) {
        const exr_attr_chlist_entry_t& entry = channels->entries[c];
        if (entry.x_sampling != 1 || entry.y_sampling != 1) {
            throw Error(ErrorKind::kInput,
                        std::string("the channel ") + entry.name.str + " is subsampled",
                        path_ + ": " + part.name, "write it again with all channels at full size");
        }
        part.channels.push_back({entry.name.str, toPixelType(entry.pixel_type)});
    }
}

void ExrInput::readAttributes(int index, ExrInputPart& part) {
    int32_t attributes = 0;
    check(exr_get_attribute_count(context_, index, &attributes), part.name);
    for (int32_t a = 0; a < attributes; ++a) {
        const exr_attribute_t* attribute = nullptr;
        check(exr_get_attribute_by_index(context_, index, EXR_ATTR_LIST_FILE_ORDER, a, &attribute),
              part.name);
        std::string text = attributeText(*attribute);
        if (!text.empty()) part.attributes[attribute->name] = std::move(text);
        const std::string_view name = attribute->name;
        if (attribute->type == EXR_ATTR_OPAQUE &&
            std::string_view(attribute->type_name) == "idmanifest") {
            const auto* bytes = static_cast<const std::byte*>(attribute->opaque->packed_data);
            part.id_manifest.assign(bytes, bytes + attribute->opaque->size);
        } else if (attribute->type == EXR_ATTR_STRING_VECTOR && name == "multiView") {
            const exr_attr_string_vector_t& views = *attribute->stringvector;
            for (int32_t v = 0; v < views.n_strings; ++v)
                part.views.emplace_back(views.strings[v].str,
                                        static_cast<std::size_t>(views.strings[v].length));
        } else if (attribute->type == EXR_ATTR_CHROMATICITIES && name == "chromaticities") {
            const exr_attr_chromaticities_t& c = *attribute->chromaticities;
            part.chromaticities = {c.red_x,  c.red_y,  c.green_x, c.green_y,
                                   c.blue_x, c.blue_y, c.white_x, c.white_y};
        }
    }
}

/// Moves all windows so that the first display window begins at (0, 0).
void ExrInput::moveToOrigin() {
    const auto isFar = [](const Window& window) {
        return std::max({std::abs(window.x0), std::abs(window.y0), std::abs(window.x1),
                         std::abs(window.y1)}) > kMostCoordinate;
    };
    for (const ExrInputPart& part : parts_) {
        if (isFar(part.data_window) || isFar(part.display_window))
            throw Error(ErrorKind::kInput, "a part has an implausible size",
                        path_ + ": " + part.name);
    }
    if (parts_.empty()) return;
    origin_x_ = parts_.front().display_window.x0;
    origin_y_ = parts_.front().display_window.y0;
    for (ExrInputPart& part : parts_) {
        for (Window* window : {&part.data_window, &part.display_window}) {
            *window = {window->x0 - origin_x_, window->y0 - origin_y_, window->x1 - origin_x_,
                       window->y1 - origin_y_};
        }
    }
}

void ExrInput::checkSizes() const {
    std::uint64_t least = 0;  // minimum packed size of all pixels, in bytes
    for (const ExrInputPart& part : parts_) {
        const Window& window = part.data_window;
        if (window.width() > kMostImageSide || window.height() > kMostImageSide || window.empty() ||
            part.channels.size() > kMaxChannels) {
            throw Error(ErrorKind::kInput, "a part has an implausible size",
                        path_ + ": " + part.name);
        }
        if (part.deep() && !canBeDeep(part.compression)) {
            throw Error(ErrorKind::kInput,
                        "OpenEXR has no deep images with compression " + part.compression,
                        path_ + ": " + part.name, "write it again with zips, rle or none");
        }
        // Every deep pixel has at least a sample count.
        std::uint64_t pixel = part.deep() ? sizeof(std::uint32_t) : 0;
        if (!part.deep()) {
            for (const auto& channel : part.channels)
                pixel += pixelTypeSize(channel.type);
        }
        least += window.pixels() * pixel / mostRatio(part.compression);
    }
    if (least > bytes_) {
        throw Error(ErrorKind::kInput, "the file is too small for the pixels that it declares",
                    path_, "it may be cut off; write it again");
    }
    for (std::size_t i = 0; i < parts_.size(); ++i) {
        const ExrInputPart& part = parts_[i];
        if (!needsClasses(part)) continue;
        checkBlock(part, part.tile_width > 0 ? part.tile_width : part.data_window.width(),
                   rowsPerChunk(i));
    }
}

/// Throws Error (kInput) if a block of this width and number of rows exceeds both kMostBlock and
/// the maximum that a file of this size can unpack to.
void ExrInput::checkBlock(const ExrInputPart& part, int width, int rows) const {
    std::uint64_t pixel = 0;
    for (const auto& channel : part.channels)
        pixel += pixelTypeSize(channel.type);
    const std::uint64_t bytes =
        pixel * static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(rows);
    if (bytes > kMostBlock && bytes / mostRatio(part.compression) > bytes_)
        refuse("a block of pixels has an implausible size", part);
}

std::vector<StoredAttribute> ExrInput::attributes(std::size_t part) const {
    ExrHeaders headers(file_, path_);
    ExrHeaders::Attribute found;
    std::vector<StoredAttribute> attributes;
    for (std::size_t i = 0; i <= part && headers.nextPart(); ++i) {
        while (headers.nextAttribute(found)) {
            if (i != part) continue;
            StoredAttribute& attribute = attributes.emplace_back();
            attribute.name = found.name;
            attribute.type = found.type;
            attribute.value.resize(found.size);
            file_.readSome(found.place, {reinterpret_cast<char*>(attribute.value.data()),
                                         attribute.value.size()});
        }
    }
    return attributes;
}

int ExrInput::rowsPerChunk(std::size_t part) const {
    if (parts_[part].tile_height > 0) return parts_[part].tile_height;
    int32_t rows = 0;
    check(exr_get_scanlines_per_chunk(context_, static_cast<int>(part), &rows), parts_[part].name);
    return std::max(1, rows);
}

void ExrInput::readChunk(std::size_t part, int y, const Window& window,
                         std::span<const ExrTarget> targets) const {
    // Decode the whole chunk into planes, then copy the requested rows and columns.
    Planes planes(targets.size());
    const Window chunk = needsClasses(parts_[part]) ? decodeByClasses(part, y, targets, planes)
                                                    : decodeChunk(part, y, targets, planes);
    const Window rows = intersect({window.x0, chunk.y0, window.x1, chunk.y1}, window);
    if (rows.empty()) refuse("a chunk has an implausible size", parts_[part]);
    for (std::size_t t = 0; t < targets.size(); ++t) {
        const std::size_t size = pixelTypeSize(targets[t].type);
        const auto width = static_cast<std::size_t>(chunk.width());
        const auto left = static_cast<std::size_t>(rows.x0 - chunk.x0);
        for (int row = rows.y0; row < rows.y1; ++row) {
            const auto from = static_cast<std::size_t>(row - chunk.y0) * width + left;
            const auto to = static_cast<std::size_t>(row - window.y0) * targets[t].stride;
            std::memcpy(targets[t].first + to, planes[t].data() + from * size,
                        static_cast<std::size_t>(rows.width()) * size);
        }
    }
}

/// Decodes the chunk that holds row `y` into the planes. Returns the window of the chunk.
Window ExrInput::decodeChunk(std::size_t part, int y, std::span<const ExrTarget> targets,
                             Planes& planes) const {
    const ExrInputPart& info = parts_[part];
    const int index = static_cast<int>(part);
    exr_chunk_info_t chunk{};
    check(exr_read_scanline_chunk_info(context_, index, y + origin_y_, &chunk), info.name);
    // OpenEXR 3.1.5 leaves memory uninitialised if uncompressed data is truncated.
    const bool whole = info.compression != "none" || chunk.packed_size == chunk.unpacked_size;
    const int top = chunk.start_y - origin_y_;
    const Window pixels{info.data_window.x0, top, info.data_window.x1, top + chunk.height};
    if (chunk.packed_size > bytes_ || intersect(pixels, info.data_window).empty() || !whole)
        refuse("a chunk has an implausible size", info);
    DecodePipeline decoder(context_);
    exr_decode_pipeline_t& pipeline = decoder.pipeline;
    check(exr_decoding_initialize(context_, index, &chunk, &pipeline), info.name);
    for (std::size_t t = 0; t < targets.size(); ++t) {
        const std::size_t size = pixelTypeSize(targets[t].type);
        planes[t].resize(pixels.pixels() * size);
        // The channels of the pipeline have the same order as those of the part.
        const ExrInputChannel* wanted = info.channel(targets[t].name);
        const auto c = wanted ? wanted - info.channels.data() : pipeline.channel_count;
        if (c < pipeline.channel_count && targets[t].name == pipeline.channels[c].channel_name) {
            exr_coding_channel_info_t& channel = pipeline.channels[c];
            channel.decode_to_ptr = reinterpret_cast<std::uint8_t*>(planes[t].data());
            channel.user_data_type = fromPixelType(targets[t].type);
            channel.user_bytes_per_element = static_cast<std::int16_t>(size);
            channel.user_pixel_stride = static_cast<std::int32_t>(size);
            channel.user_line_stride =
                static_cast<std::int32_t>(size * static_cast<std::size_t>(pixels.width()));
        }
    }
    check(exr_decoding_choose_default_routines(context_, index, &pipeline), info.name);
    check(exr_decoding_run(context_, index, &pipeline), info.name);
    return pixels;
}

/// Implements decodeChunk() for a part that needs OpenEXR's classes. `y` must be the first row of a
/// chunk.
Window ExrInput::decodeByClasses(std::size_t part, int y, std::span<const ExrTarget> targets,
                                 Planes& planes) const {
    const ExrInputPart& info = parts_[part];
    const Window& all = info.data_window;
    const Window pixels{all.x0, y, all.x1, std::min(y + rowsPerChunk(part), all.y1)};
    std::vector<ExrPlane> wanted;
    for (std::size_t t = 0; t < targets.size(); ++t) {
        planes[t].resize(pixels.pixels() * pixelTypeSize(targets[t].type));
        wanted.push_back({targets[t].name, targets[t].type, planes[t].data()});
    }
    classes_->readRows(static_cast<int>(part),
                       {pixels.x0 + origin_x_, pixels.y0 + origin_y_, pixels.x1 + origin_x_,
                        pixels.y1 + origin_y_},
                       wanted, path_ + ": " + info.name);
    return pixels;
}

void ExrInput::checkChunks(std::size_t part) const {
    const ExrInputPart& info = parts_[part];
    const int rows = rowsPerChunk(part);
    for (int y = info.data_window.y0; y < info.data_window.y1; y += rows) {
        exr_chunk_info_t chunk{};
        check(exr_read_scanline_chunk_info(context_, static_cast<int>(part), y + origin_y_, &chunk),
              info.name);
        if (chunk.data_offset > bytes_ || chunk.packed_size > bytes_ - chunk.data_offset)
            refuse("a chunk reaches beyond the end of the file", info);
    }
}

void ExrInput::refuse(const std::string& what, const ExrInputPart& part) const {
    throw Error(ErrorKind::kInput, what, part.name.empty() ? path_ : path_ + ": " + part.name,
                "the file may be damaged or cut off; write it again");
}

void ExrInput::check(int result, const std::string& part) const {
    // zlib reports lack of memory as damaged data. If memory is short, an allocation of the size of
    // zlib's state fails, too, and sets `withheld`.
    if (result != EXR_ERR_SUCCESS) std::free(allocate(kZlibState));
    if (withheld) std::rethrow_exception(std::exchange(withheld, nullptr));
    if (result == EXR_ERR_SUCCESS) return;
    const std::string message =
        last_message.empty() ? exr_get_default_error_message(result) : last_message;
    last_message.clear();
    // OpenEXR 3.2 reports lack of memory, too, if a chunk unpacks to more than its declared size.
    const bool overlong = message.find("decompress") != std::string::npos;
    if (result == EXR_ERR_OUT_OF_MEMORY && !overlong)
        throw Error(ErrorKind::kMemory, message, path_);
    throw Error(ErrorKind::kInput, "OpenEXR cannot read the file: " + message,
                part.empty() ? path_ : path_ + ": " + part,
                "the file may be damaged or cut off; write it again");
}

}  // namespace peeler
