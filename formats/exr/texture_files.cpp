// SPDX-License-Identifier: Apache-2.0
// Texture writers: PNG in memory, OpenEXR chunk by chunk.
#include "formats/exr/texture_files.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "formats/exr/exr_chunks.h"
#include "formats/file/atomic_file.h"
#include "formats/image/image_library.h"

namespace peeler {
namespace {

template <class T>
std::vector<T> quantized(const std::vector<float>& values) {
    constexpr float kMost = static_cast<float>(std::numeric_limits<T>::max());
    std::vector<T> result(values.size());
    std::ranges::transform(values, result.begin(), [](float value) {
        const float clipped = value > 0 ? std::min(value, 1.0F) : 0.0F;  // NaN becomes 0
        return static_cast<T>(std::lround(clipped * kMost));
    });
    return result;
}

struct MemoryFile final : EncodedFile {
    std::vector<std::uint8_t> bytes;

    std::uint64_t size() const override { return bytes.size(); }
    std::size_t writeAt(std::uint64_t offset, std::span<const std::byte> from) override {
        if (bytes.size() < offset + from.size()) bytes.resize(offset + from.size());
        std::memcpy(bytes.data() + offset, from.data(), from.size());
        return from.size();
    }
    std::size_t readAt(std::uint64_t offset, std::span<std::byte> to) override {
        if (offset >= bytes.size()) return 0;
        const std::size_t count = std::min<std::size_t>(to.size(), bytes.size() - offset);
        std::memcpy(to.data(), bytes.data() + offset, count);
        return count;
    }
};

std::vector<std::uint8_t> encodedPng(const ValueTexture& texture, int bits,
                                     const std::string& software) {
    MemoryFile file;
    try {
        const auto encoder = imageEncoder("png");
        encoder->open({"texture.png", texture.size, texture.size,
                       static_cast<int>(texture.components), bits, software},
                      file);
        if (bits == 16)
            encoder->writeRows(0, texture.size, quantized<std::uint16_t>(texture.values).data());
        else
            encoder->writeRows(0, texture.size, quantized<std::uint8_t>(texture.values).data());
        encoder->close();
    } catch (const std::runtime_error& problem) {
        throw Error(ErrorKind::kOutput, "cannot encode a PNG: " + std::string(problem.what()),
                    texture.name);
    }
    return file.bytes;
}

Imf::Header textureHeader(const ValueTexture& texture, const std::string& software) {
    Imf::Header header(texture.size, texture.size);
    header.setName(texture.name);
    header.setType(Imf::SCANLINEIMAGE);
    header.compression() = Imf::ZIP_COMPRESSION;
    if (!software.empty()) header.insert("software", Imf::StringAttribute(software));
    if (texture.components == 1) {
        header.channels().insert("Y", Imf::Channel(Imf::FLOAT));
    } else {
        for (const char* channel : {"B", "G", "R"})
            header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
    }
    return header;
}

/// Copies rows in chunk order: row by row, and in each row channel by channel, sorted by name.
void gather(const ValueTexture& texture, int row, int rows, std::byte* out) {
    const auto side = static_cast<std::size_t>(texture.size);
    const std::size_t width = texture.components;
    const auto first = static_cast<std::size_t>(row), count = static_cast<std::size_t>(rows);
    for (std::size_t y = first; y < first + count; ++y)
        for (std::size_t c = width; c-- > 0;)
            for (std::size_t x = 0; x < side; ++x, out += sizeof(float))
                std::memcpy(out, &texture.values[(y * side + x) * width + c], sizeof(float));
}

}  // namespace

std::vector<std::uint8_t> encodePng(const ValueTexture& texture, int bits) {
    return encodedPng(texture, bits, "");
}

void writePngTexture(const std::string& path, const ValueTexture& texture,
                     const std::string& software) {
    AtomicFile file(path);
    const std::vector<std::uint8_t> bytes = encodedPng(texture, 16, software);
    file.append(std::as_bytes(std::span(bytes)));
    file.commit();
}

void writeExrTextures(const std::string& path, std::span<const ValueTexture> textures,
                      const std::string& software) {
    AtomicFile file(path);
    std::vector<Imf::Header> headers;
    for (const ValueTexture& texture : textures)
        headers.push_back(textureHeader(texture, software));
    ExrOutput exr(file, headers);
    ExrPackerPool packers(kDefaultZipLevel, Imf::ZIP_COMPRESSION);
    for (std::size_t part = 0; part < textures.size(); ++part) {
        const ValueTexture& texture = textures[part];
        std::vector<ByteBuffer> packed(static_cast<std::size_t>(exr.chunkCount(part)));
        parallelFor(packed.size(), [&](std::size_t chunk) {
            const int row = static_cast<int>(chunk) * kExrRowsPerChunk;
            const int rows = std::min(kExrRowsPerChunk, texture.size - row);
            packers.with([&](ExrChunkPacker& packer) {
                const std::size_t bytes = static_cast<std::size_t>(rows) *
                                          static_cast<std::size_t>(texture.size) *
                                          texture.components * sizeof(float);
                gather(texture, row, rows, packer.raw(bytes).data());
                packer.pack(packed[chunk]);
            });
        });
        for (std::size_t chunk = 0; chunk < packed.size(); ++chunk)
            exr.append(part, static_cast<int>(chunk), packed[chunk]);
    }
    exr.finish();
    file.commit();
}

}  // namespace peeler
