// SPDX-License-Identifier: Apache-2.0
// Flat OpenEXR files as other programs write them, written with OpenEXR's own classes.
#pragma once

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTiledOutputPart.h>

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "formats/exr/deep_file.h"

namespace peeler::test {

/// The pixels of one part. A channel has one number per pixel of the data window (row-major), or a
/// single number for all pixels.
struct FlatPart {
    std::string name = "flat";
    Imath::Box2i window{{0, 0}, {3, 2}};
    std::map<std::string, std::vector<double>> values{};
    std::map<std::string, Imf::PixelType> types{};  ///< types of channels that are not half
    int sampling = 1;                               ///< subsampling factor of all channels

    Imf::PixelType typeOf(const std::string& channel) const {
        const auto found = types.find(channel);
        return found == types.end() ? Imf::HALF : found->second;
    }
};

struct FlatFileOptions {
    Imf::Compression compression = Imf::ZIP_COMPRESSION;
    int tile = 0;  ///< side of the tiles; 0 = scan lines
    Imf::LevelMode levels = Imf::ONE_LEVEL;
    Imf::LineOrder order = Imf::INCREASING_Y;
    Imath::Box2i display{{0, 0}, {7, 5}};
    /// Changes the header of each part.
    std::function<void(std::size_t part, Imf::Header&)> header{};
};

namespace detail {

/// Writes all levels of a tiled part, each with the pixels of the first.
inline void writeTiles(Imf::MultiPartOutputFile& file, int part, const Imf::FrameBuffer& buffer) {
    Imf::TiledOutputPart output(file, part);
    output.setFrameBuffer(buffer);
    for (int y = 0; y < output.numYLevels(); ++y) {
        for (int x = 0; x < output.numXLevels(); ++x) {
            if (output.isValidLevel(x, y))
                output.writeTiles(0, output.numXTiles(x) - 1, 0, output.numYTiles(y) - 1, x, y);
        }
    }
}

}  // namespace detail

inline void writeFlatFile(const std::string& path, const std::vector<FlatPart>& parts,
                          const FlatFileOptions& options = {}) {
    std::vector<Imf::Header> headers;
    for (const FlatPart& part : parts) {
        Imf::Header header(options.display, part.window);
        header.setName(part.name);
        header.compression() = options.compression;
        header.lineOrder() = options.order;
        header.setType(options.tile > 0 ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
        if (options.tile > 0) {
            const auto side = static_cast<unsigned>(options.tile);
            header.setTileDescription(Imf::TileDescription(side, side, options.levels));
        }
        for (const auto& [name, values] : part.values)
            header.channels().insert(name,
                                     Imf::Channel(part.typeOf(name), part.sampling, part.sampling));
        if (options.header) options.header(headers.size(), header);
        headers.push_back(header);
    }
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), static_cast<int>(headers.size()));
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const FlatPart& part = parts[i];
        const auto width = static_cast<std::size_t>(part.window.max.x - part.window.min.x + 1);
        const auto height = static_cast<std::size_t>(part.window.max.y - part.window.min.y + 1);
        std::map<std::string, std::vector<unsigned char>> pixels;
        Imf::FrameBuffer buffer;
        for (const auto& [name, values] : part.values) {
            std::vector<unsigned char>& bytes = pixels[name];
            bytes.resize(width * height * detail::kSlot);
            for (std::size_t p = 0; p < width * height; ++p)
                detail::storeAt(bytes.data() + p * detail::kSlot, part.typeOf(name),
                                values[values.size() == 1 ? 0 : p]);
            buffer.insert(
                name, Imf::Slice::Make(part.typeOf(name), bytes.data(), part.window, detail::kSlot,
                                       detail::kSlot * width, part.sampling, part.sampling));
        }
        if (options.tile > 0) {
            detail::writeTiles(file, static_cast<int>(i), buffer);
            continue;
        }
        Imf::OutputPart output(file, static_cast<int>(i));
        output.setFrameBuffer(buffer);
        output.writePixels(static_cast<int>(height));
    }
}

/// Writes `parts` parts of black pixels with these windows. `change` modifies each header.
inline void writeBlackFile(const std::string& path, const Imath::Box2i& window,
                           const Imath::Box2i& display,
                           const std::function<void(Imf::Header&)>& change = {},
                           std::size_t parts = 1) {
    std::vector<FlatPart> all(parts,
                              {.window = window, .values = {{"R", {0}}, {"G", {0}}, {"B", {0}}}});
    for (std::size_t i = 0; i < parts; ++i)
        all[i].name = "part " + std::to_string(i);
    FlatFileOptions options;
    options.display = display;
    options.header = [&](std::size_t, Imf::Header& header) {
        if (change) change(header);
    };
    writeFlatFile(path, all, options);
}

}  // namespace peeler::test
