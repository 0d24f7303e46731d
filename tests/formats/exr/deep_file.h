// SPDX-License-Identifier: Apache-2.0
// Deep files, read or written with OpenEXR's own classes. Tests use them to check peeler's files,
// and to imitate files of other programs.
#pragma once

#include <Imath/half.h>
#include <OpenEXR/ImfArray.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineInputPart.h>
#include <OpenEXR/ImfDeepScanLineOutputPart.h>
#include <OpenEXR/ImfDeepTiledOutputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfPartType.h>

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace peeler::test {

/// The samples of one part. Each channel has a list for each pixel (row-major in the data window),
/// with values converted to double.
struct DeepPart {
    std::string name = "deep";
    Imath::Box2i window;
    std::vector<std::uint32_t> counts;
    std::map<std::string, Imf::PixelType> types;
    std::map<std::string, std::vector<std::vector<double>>> values;

    std::size_t width() const { return static_cast<std::size_t>(window.max.x - window.min.x + 1); }
    std::size_t pixels() const {
        return width() * static_cast<std::size_t>(window.max.y - window.min.y + 1);
    }
};

namespace detail {

constexpr std::size_t kSlot = 4;  // bytes of a sample, whatever its type

/// Buffers in the layout that OpenEXR requires: each channel has an array of pointers, one to the
/// samples of each pixel.
struct Buffers {
    std::map<std::string, std::vector<std::vector<unsigned char>>> samples;
    std::map<std::string, std::vector<char*>> pointers;

    Imf::DeepFrameBuffer frameBuffer(DeepPart& part) {
        Imf::DeepFrameBuffer buffer;
        const auto width = part.width();
        const auto origin =
            static_cast<std::ptrdiff_t>(part.window.min.x) +
            static_cast<std::ptrdiff_t>(part.window.min.y) * static_cast<std::ptrdiff_t>(width);
        buffer.insertSampleCountSlice(
            Imf::Slice(Imf::UINT, reinterpret_cast<char*>(part.counts.data() - origin),
                       sizeof(std::uint32_t), sizeof(std::uint32_t) * width));
        for (const auto& [name, type] : part.types) {
            buffer.insert(
                name, Imf::DeepSlice(type, reinterpret_cast<char*>(pointers[name].data() - origin),
                                     sizeof(char*), sizeof(char*) * width, kSlot));
        }
        return buffer;
    }

    void allocate(const DeepPart& part) {
        for (const auto& [name, type] : part.types) {
            auto& lists = samples[name];
            auto& places = pointers[name];
            lists.resize(part.pixels());
            places.resize(part.pixels());
            for (std::size_t p = 0; p < part.pixels(); ++p) {
                lists[p].assign(part.counts[p] * kSlot + kSlot, 0);
                places[p] = reinterpret_cast<char*>(lists[p].data());
            }
        }
    }
};

inline double valueAt(const unsigned char* from, Imf::PixelType type) {
    if (type == Imf::HALF) return static_cast<double>(*reinterpret_cast<const half*>(from));
    if (type == Imf::FLOAT) return static_cast<double>(*reinterpret_cast<const float*>(from));
    return *reinterpret_cast<const std::uint32_t*>(from);
}

inline void storeAt(unsigned char* to, Imf::PixelType type, double value) {
    if (type == Imf::HALF) {
        *reinterpret_cast<half*>(to) = half(static_cast<float>(value));
    } else if (type == Imf::FLOAT) {
        *reinterpret_cast<float*>(to) = static_cast<float>(value);
    } else {
        *reinterpret_cast<std::uint32_t*>(to) = static_cast<std::uint32_t>(value);
    }
}

}  // namespace detail

/// Returns a part with these float channels and the same samples in every pixel. Each sample is a
/// list of values in the order of `channels`.
inline DeepPart deepPart(const Imath::Box2i& window, const std::vector<std::string>& channels,
                         const std::vector<std::vector<double>>& samples) {
    DeepPart part;
    part.window = window;
    part.counts.assign(part.pixels(), static_cast<std::uint32_t>(samples.size()));
    for (std::size_t c = 0; c < channels.size(); ++c) {
        part.types[channels[c]] = Imf::FLOAT;
        std::vector<double> values;
        for (const std::vector<double>& sample : samples)
            values.push_back(sample.at(c));
        part.values[channels[c]].assign(part.pixels(), values);
    }
    return part;
}

inline DeepPart readDeepPart(Imf::MultiPartInputFile& file, int index) {
    DeepPart part;
    const Imf::Header& header = file.header(index);
    part.name = header.hasName() ? header.name() : "";
    part.window = header.dataWindow();
    part.counts.resize(part.pixels());
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
        part.types[c.name()] = c.channel().type;
    detail::Buffers buffers;
    for (const auto& [name, type] : part.types)
        buffers.pointers[name].resize(part.pixels());
    Imf::DeepScanLineInputPart input(file, index);
    input.setFrameBuffer(buffers.frameBuffer(part));
    input.readPixelSampleCounts(part.window.min.y, part.window.max.y);
    buffers.allocate(part);  // the frame buffer already points to these buffers
    input.readPixels(part.window.min.y, part.window.max.y);
    for (const auto& [name, type] : part.types) {
        auto& lists = part.values[name];
        lists.resize(part.pixels());
        for (std::size_t p = 0; p < part.pixels(); ++p) {
            for (std::uint32_t k = 0; k < part.counts[p]; ++k) {
                lists[p].push_back(
                    detail::valueAt(buffers.samples[name][p].data() + k * detail::kSlot, type));
            }
        }
    }
    return part;
}

struct DeepFileOptions {
    Imf::Compression compression = Imf::ZIPS_COMPRESSION;
    int tile = 0;  ///< side of the tiles; 0 = scan lines
    Imath::Box2i display{{0, 0}, {15, 11}};
    /// Changes the header of each part.
    std::function<void(std::size_t part, Imf::Header&)> header{};
};

/// Writes a deep file without peeler's attributes, like another program.
inline void writeDeepFile(const std::string& path, std::vector<DeepPart> parts,
                          const DeepFileOptions& options = {}) {
    std::vector<Imf::Header> headers;
    for (const DeepPart& part : parts) {
        Imf::Header header(options.display, part.window);
        header.setName(part.name);
        header.compression() = options.compression;
        header.setType(options.tile > 0 ? Imf::DEEPTILE : Imf::DEEPSCANLINE);
        if (options.tile > 0) {
            const auto side = static_cast<unsigned>(options.tile);
            header.setTileDescription(Imf::TileDescription(side, side, Imf::ONE_LEVEL));
        }
        for (const auto& [name, type] : part.types)
            header.channels().insert(name, Imf::Channel(type));
        if (options.header) options.header(headers.size(), header);
        headers.push_back(header);
    }
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), static_cast<int>(headers.size()));
    for (std::size_t i = 0; i < parts.size(); ++i) {
        DeepPart& part = parts[i];
        detail::Buffers buffers;
        buffers.allocate(part);
        for (const auto& [name, type] : part.types) {
            for (std::size_t p = 0; p < part.pixels(); ++p) {
                for (std::uint32_t k = 0; k < part.counts[p]; ++k) {
                    detail::storeAt(buffers.samples[name][p].data() + k * detail::kSlot, type,
                                    part.values[name][p][k]);
                }
            }
        }
        if (options.tile > 0) {
            Imf::DeepTiledOutputPart output(file, static_cast<int>(i));
            output.setFrameBuffer(buffers.frameBuffer(part));
            output.writeTiles(0, output.numXTiles() - 1, 0, output.numYTiles() - 1);
        } else {
            Imf::DeepScanLineOutputPart output(file, static_cast<int>(i));
            output.setFrameBuffer(buffers.frameBuffer(part));
            output.writePixels(part.window.max.y - part.window.min.y + 1);
        }
    }
}

}  // namespace peeler::test
