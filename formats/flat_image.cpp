// SPDX-License-Identifier: Apache-2.0
// OpenImageIO behind a checked interface: the reader is chosen by the first bytes of the file.
#include "formats/flat_image.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/srgb.h"
#include "formats/file_kind.h"
#include "formats/image_metadata.h"

namespace peeler {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Plugin {
    FileKind kind;
    const char* name;  ///< OpenImageIO's
    /// Takes out what is not needed and what decoders complain about on stderr.
    Bytes (*reduce)(std::span<const std::uint8_t>);
};
constexpr Plugin kPlugins[] = {
    {FileKind::kPng, "png", withoutPngMetadata},
    {FileKind::kJpeg, "jpeg", withoutJpegMetadata},
    {FileKind::kTiff, "tiff", nullptr},
    {FileKind::kExr, "openexr", nullptr},
    {FileKind::kHdr, "hdr", nullptr},
};

[[noreturn]] void fail(const std::string& what, const std::string& hint = "") {
    throw Error(ErrorKind::kInput, what, "", hint);
}

const Plugin& pluginFor(const std::string& path) {
    const FileKind kind = fileKind(path);
    for (const Plugin& plugin : kPlugins) {
        if (plugin.kind == kind) return plugin;
    }
    fail("neither an OpenEXR nor a PNG, JPEG or TIFF image");
}

/// An open file with what it reads from.
struct Input {
    Bytes bytes;
    std::optional<OIIO::Filesystem::IOMemReader> memory;
    std::unique_ptr<OIIO::ImageInput> image;
    OIIO::ImageSpec spec;

    void check(bool success) const {
        if (!success) fail("the image cannot be decoded: " + image->geterror());
    }
};

void open(const std::string& path, const Plugin& plugin, Input& input) {
    input.image = OIIO::ImageInput::create(plugin.name);
    if (!input.image) {
        OIIO::geterror();  // leave none behind for others
        fail("no decoder for " + std::string(plugin.name) + " is installed");
    }
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    OIIO::Filesystem::IOProxy* proxy = nullptr;
    if (plugin.reduce) {
        std::ifstream file(path, std::ios::binary);
        const std::vector<char> stored{std::istreambuf_iterator<char>(file), {}};
        input.bytes =
            plugin.reduce({reinterpret_cast<const std::uint8_t*>(stored.data()), stored.size()});
        input.memory.emplace(input.bytes.data(), input.bytes.size());
        proxy = &*input.memory;
        config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    }
    input.check(input.image->open(path, input.spec, config));
}

void checkSize(const OIIO::ImageSpec& spec, const FlatImageLimits& limits) {
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1)
        fail("the image has no pixels");
    if (spec.deep) fail("it is a deep image", "only flat and layered images can be read here");
    const std::uint64_t bytes = std::uint64_t{16} * static_cast<std::uint64_t>(spec.width) *
                                static_cast<std::uint64_t>(spec.height);
    if (std::max(spec.width, spec.height) > limits.max_side || bytes > limits.max_bytes) {
        fail("the image of " + std::to_string(spec.width) + " x " + std::to_string(spec.height) +
                 " pixels is larger than the limit of " + std::to_string(limits.max_side) +
                 " pixels a side and " + std::to_string(limits.max_bytes / 16) + " pixels",
             "scale or crop it");
    }
}

/// The channels to read as R, G, B, A; −1 = there is none.
std::array<int, 4> channelsOf(const OIIO::ImageSpec& spec, FileKind kind) {
    if (kind != FileKind::kExr) {
        constexpr std::array<int, 4> kByCount[] = {
            {0, 0, 0, -1}, {0, 0, 0, 1}, {0, 1, 2, -1}, {0, 1, 2, 3}};
        return kByCount[static_cast<std::size_t>(std::min(spec.nchannels, 4) - 1)];
    }
    const int grey = spec.channelindex("Y"), alpha = spec.channelindex("A");
    const std::array<int, 3> rgb{spec.channelindex("R"), spec.channelindex("G"),
                                 spec.channelindex("B")};
    if (rgb[0] >= 0 && rgb[1] >= 0 && rgb[2] >= 0) return {rgb[0], rgb[1], rgb[2], alpha};
    if (grey < 0) fail("its first part has neither channels R, G, B nor Y");
    return {grey, grey, grey, alpha};
}

/// How samples become linear and premultiplied.
struct Encoding {
    bool srgb = false, straight = false;

    std::array<float, 4> decode(std::array<float, 4> color) const {
        const float alpha = color[3];
        if (!srgb && !straight) return color;
        for (std::size_t c = 0; c < 3; ++c) {
            float value = color[c];
            if (!straight) value = alpha > 0 ? value / alpha : 0;
            color[c] = alpha * (srgb ? linearFromSrgb(value) : value);
        }
        return color;
    }
};

void decode(const Input& input, FileKind kind, CompositeImage& out) {
    const OIIO::ImageSpec& spec = input.spec;
    const std::array<int, 4> channels = channelsOf(spec, kind);
    const int first = *std::min_element(channels.begin(), channels.begin() + 3);
    const int end = *std::max_element(channels.begin(), channels.end()) + 1;
    const int begin = channels[3] >= 0 ? std::min(first, channels[3]) : first;
    const auto stored = static_cast<std::size_t>(end - begin);
    std::vector<float> samples(out.window.pixels() * stored);
    input.check(input.image->read_image(0, 0, begin, end, OIIO::TypeDesc::FLOAT, samples.data()));

    Encoding encoding;
    encoding.srgb = kind != FileKind::kExr && !spec.format.is_floating_point();
    encoding.straight =
        channels[3] >= 0 &&
        (kind == FileKind::kPng || spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0);
    const auto width = static_cast<std::size_t>(out.window.width());
    parallelFor(static_cast<std::size_t>(out.window.height()), [&](std::size_t row) {
        for (std::size_t pixel = row * width; pixel < (row + 1) * width; ++pixel) {
            std::array<float, 4> color{0, 0, 0, 1};
            for (std::size_t c = 0; c < 4; ++c) {
                if (channels[c] < 0) continue;
                color[c] = samples[pixel * stored + static_cast<std::size_t>(channels[c] - begin)];
            }
            out.rgba[pixel] = encoding.decode(color);
        }
    });
}

FlatImage read(const std::string& path, const FlatImageLimits& limits) {
    const Plugin& plugin = pluginFor(path);
    Input input;
    open(path, plugin, input);
    checkSize(input.spec, limits);
    FlatImage flat;
    flat.placed = plugin.kind == FileKind::kExr;
    const OIIO::ImageSpec& spec = input.spec;
    const int x = flat.placed ? spec.x - spec.full_x : 0,
              y = flat.placed ? spec.y - spec.full_y : 0;
    flat.width = flat.placed ? spec.full_width : spec.width;
    flat.height = flat.placed ? spec.full_height : spec.height;
    flat.image.window = {x, y, x + spec.width, y + spec.height};
    flat.image.rgba.resize(flat.image.window.pixels());
    flat.image.z.assign(flat.image.window.pixels(), std::numeric_limits<float>::infinity());
    decode(input, plugin.kind, flat.image);
    input.image->close();
    return flat;
}

}  // namespace

FlatImage readFlatImage(const std::string& path, const FlatImageLimits& limits) {
    try {
        return read(path, limits);
    } catch (const Error& error) {
        throw Error(error.kind(), error.what(), error.where().empty() ? path : error.where(),
                    error.hint());
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kMemory, "not enough memory to decode the image", path);
    } catch (const std::exception& problem) {
        throw Error(ErrorKind::kInput,
                    "the image cannot be decoded: " + std::string(problem.what()), path);
    }
}

}  // namespace peeler
