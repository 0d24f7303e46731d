// SPDX-License-Identifier: Apache-2.0
// Choice of the decoder by a file's first bytes, and checks of the header.
#include "formats/image/flat_image.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "core/base/color.h"
#include "core/base/parallel.h"
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"
#include "formats/image/exr_headers.h"
#include "formats/image/image_library.h"
#include "formats/image/image_metadata.h"
#include "formats/image/radiance_header.h"

namespace peeler {
namespace {

[[noreturn]] void failFlatImage(const std::string& what, const std::string& hint = "") {
    throw Error(ErrorKind::kInput, what, "", hint);
}

void checkExrFile(const std::string& path) {
    const RegularFile file(path);
    file.check();
    checkExrHeaders(file, path);
}

struct Plugin {
    FileKind kind;
    const char* name;  ///< name in OpenImageIO
    /// Removes unneeded metadata, about which decoders would print warnings on stderr.
    ReducedImage (*reduce)(std::span<const std::uint8_t>);
    void (*check)(const std::string& path) = nullptr;  ///< checks the file; throws Error (kInput)
};
constexpr Plugin kPlugins[] = {
    {FileKind::kPng, "png", withoutPngMetadata},
    {FileKind::kJpeg, "jpeg", withoutJpegMetadata},
    {FileKind::kTiff, "tiff", nullptr},
    {FileKind::kExr, "openexr", nullptr, checkExrFile},
    {FileKind::kHdr, "hdr", nullptr},
};

const Plugin& pluginFor(const std::string& path) {
    const FileKind kind = fileKind(path);
    for (const Plugin& plugin : kPlugins) {
        if (plugin.kind != kind) continue;
        if (plugin.check) plugin.check(path);
        return plugin;
    }
    failFlatImage("neither an OpenEXR nor a PNG, JPEG or TIFF image");
}

/// A decoder with the file's bytes and metadata.
struct Input {
    ReducedImage reduced;
    std::unique_ptr<ImageDecoder> decoder;
};

RadianceHeader radianceHeaderOf(const std::string& path) {
    const RegularFile file(path);
    file.check();
    std::string text(kMostRadianceHeader, '\0');
    text.resize(file.readSome(0, text));
    return radianceHeader(text);
}

void openDecoder(const std::string& path, const Plugin& plugin, Input& input) {
    if (plugin.reduce) {
        constexpr auto kAll = std::numeric_limits<std::uint64_t>::max();
        input.reduced = plugin.reduce(readRegularFile(path, kAll));
    }
    input.decoder = imageDecoder(plugin.name, path, input.reduced.bytes);
    if (plugin.kind == FileKind::kTiff)
        input.reduced.orientation = input.decoder->image().orientation;
    if (plugin.kind == FileKind::kHdr) {
        RadianceHeader header = radianceHeaderOf(path);
        input.reduced.orientation = header.orientation;
        input.reduced.notes = std::move(header.notes);
    }
}

void checkFlatSize(const StoredImage& stored, const FlatImageLimits& limits) {
    if (stored.width < 1 || stored.height < 1 || stored.depth > 1 || stored.channels.empty())
        failFlatImage("the image has no pixels");
    if (stored.deep)
        failFlatImage("it is a deep image", "only flat and layered images can be read here");
    const std::uint64_t bytes = std::uint64_t{16} * static_cast<std::uint64_t>(stored.width) *
                                static_cast<std::uint64_t>(stored.height);
    if (std::max(stored.width, stored.height) > limits.max_side || bytes > limits.max_bytes) {
        failFlatImage("the image of " + std::to_string(stored.width) + " x " +
                          std::to_string(stored.height) + " pixels is larger than the limit of " +
                          std::to_string(limits.max_side) + " pixels per side and " +
                          std::to_string(limits.max_bytes / 16) + " pixels",
                      "scale or crop it");
    }
}

/// Returns the indices of the channels to read as R, G, B, A; −1 for a missing channel.
std::array<int, 4> channelsOf(const std::vector<std::string>& names, FileKind kind) {
    if (kind != FileKind::kExr) {
        constexpr std::array<int, 4> kByCount[] = {
            {0, 0, 0, -1}, {0, 0, 0, 1}, {0, 1, 2, -1}, {0, 1, 2, 3}};
        return kByCount[std::min<std::size_t>(names.size(), 4) - 1];
    }
    const auto index = [&](const char* name) {
        const auto found = std::ranges::find(names, name);
        return found == names.end() ? -1 : static_cast<int>(found - names.begin());
    };
    const int grey = index("Y"), alpha = index("A");
    const std::array<int, 3> rgb{index("R"), index("G"), index("B")};
    if (rgb[0] >= 0 && rgb[1] >= 0 && rgb[2] >= 0) return {rgb[0], rgb[1], rgb[2], alpha};
    if (grey < 0) failFlatImage("its first part has neither the channels R, G and B nor Y");
    return {grey, grey, grey, alpha};
}

/// The encoding of a file's samples. decode() returns linear, premultiplied values.
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

void decodeFlat(ImageDecoder& decoder, FileKind kind, CompositeImage& out) {
    const StoredImage& image = decoder.image();
    const std::array<int, 4> channels = channelsOf(image.channels, kind);
    const int first = *std::min_element(channels.begin(), channels.begin() + 3);
    const int end = *std::max_element(channels.begin(), channels.end()) + 1;
    const int begin = channels[3] >= 0 ? std::min(first, channels[3]) : first;
    const auto stored = static_cast<std::size_t>(end - begin);
    std::vector<float> samples(out.window.pixels() * stored);
    decoder.read(begin, end, samples.data());

    Encoding encoding;
    encoding.srgb = kind != FileKind::kExr && !image.floating_point;
    encoding.straight = channels[3] >= 0 && (kind == FileKind::kPng || image.straight_alpha);
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

/// Reorders rows and pixels according to TIFF's Orientation (TIFF 6.0, section 8): the sides of the
/// picture on which the first row and the first column lie.
void orient(FlatImage& flat, int orientation) {
    struct Turn {
        bool transposed, from_right, from_bottom;
    };
    constexpr Turn kTurns[] = {{false, false, false}, {false, true, false}, {false, true, true},
                               {false, false, true},  {true, false, false}, {true, true, false},
                               {true, true, true},    {true, false, true}};
    if (orientation < 2 || orientation > static_cast<int>(std::size(kTurns))) return;
    const Turn& turn = kTurns[orientation - 1];
    const auto stored_width = static_cast<std::size_t>(flat.width);
    if (turn.transposed) std::swap(flat.width, flat.height);
    const auto width = static_cast<std::size_t>(flat.width),
               height = static_cast<std::size_t>(flat.height);
    std::vector<std::array<float, 4>> rgba(flat.image.rgba.size());
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t across = turn.from_right ? width - 1 - x : x,
                              down = turn.from_bottom ? height - 1 - y : y;
            rgba[y * width + x] = flat.image.rgba[turn.transposed ? across * stored_width + down
                                                                  : down * stored_width + across];
        }
    flat.image.rgba = std::move(rgba);
    flat.image.window = {0, 0, flat.width, flat.height};
}

FlatImage readNamed(const std::string& path, const FlatImageLimits& limits) {
    const Plugin& plugin = pluginFor(path);
    Input input;
    openDecoder(path, plugin, input);
    const StoredImage& stored = input.decoder->image();
    checkFlatSize(stored, limits);
    FlatImage flat;
    flat.placed = plugin.kind == FileKind::kExr;
    const int x = flat.placed ? stored.x - stored.full_x : 0,
              y = flat.placed ? stored.y - stored.full_y : 0;
    flat.width = flat.placed ? stored.full_width : stored.width;
    flat.height = flat.placed ? stored.full_height : stored.height;
    flat.image.window = {x, y, x + stored.width, y + stored.height};
    flat.image.rgba.resize(flat.image.window.pixels());
    flat.image.z.assign(flat.image.window.pixels(), std::numeric_limits<float>::infinity());
    decodeFlat(*input.decoder, plugin.kind, flat.image);
    if (!flat.placed) orient(flat, input.reduced.orientation);
    flat.notes = std::move(input.reduced.notes);
    flat.notes.insert(flat.notes.end(), stored.notes.begin(), stored.notes.end());
    return flat;
}

/// Returns the result of `action`. Errors without a place get the path as their place.
template <class Action>
auto named(const std::string& path, Action&& action) {
    try {
        return action();
    } catch (const Error& error) {
        throw error.at(error.where().empty() ? path : error.whereText());
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kMemory, "not enough memory to decode the image", path);
    } catch (const std::exception& problem) {
        throw Error(ErrorKind::kInput,
                    "the image cannot be decoded: " + std::string(problem.what()), path);
    }
}

}  // namespace

FlatImage readFlatImage(const std::string& path, const FlatImageLimits& limits) {
    return named(path, [&] { return readNamed(path, limits); });
}

std::string imageDescription(const std::string& path) {
    return named(path,
                 [&] { return imageDecoder(pluginFor(path).name, path)->image().description; });
}

}  // namespace peeler
