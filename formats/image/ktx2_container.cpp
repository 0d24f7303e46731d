// SPDX-License-Identifier: Apache-2.0
// Reader of the header, index, data format descriptor and metadata of KTX 2.0 files.
//
// Quoted names are sections of the specification. Colour models, channels and transfer functions
// have the numbers of the Khronos Data Format Specification 1.3, from "Descriptor block" on.
#include "formats/image/ktx2.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <stdexcept>
#include <string_view>

namespace peeler {
namespace {

constexpr std::string_view kIdentifier = "\xABKTX 20\xBB\r\n\x1A\n";
constexpr std::size_t kKtx2HeaderBytes = 80, kLevelBytes = 24;
// The maximum width and height. With this limit, all sizes fit into 64 bits.
constexpr std::uint32_t kMostKtx2Side = std::uint32_t{1} << 24U;

/// The byte offsets of header fields ("File Structure").
struct Ktx2Field {
    static constexpr std::size_t kVkFormat = 12, kTypeSize = 16, kWidth = 20, kHeight = 24,
                                 kDepth = 28, kLayers = 32, kFaces = 36, kLevels = 40, kScheme = 44,
                                 kDescriptor = 48, kMetadata = 56, kGlobalData = 64;
};

/// A supported texel format: its VkFormats (UNORM and SRGB) and its colour model.
struct Ktx2TexelRow {
    Ktx2Texels texels;
    const char* name;
    std::uint32_t unorm, srgb;
    std::uint32_t model, block_side, block_bytes;
};
constexpr std::uint32_t kModelRgb = 1, kModelEtc1s = 163, kModelUastc = 166;
constexpr Ktx2TexelRow kKtx2Texels[] = {
    {Ktx2Texels::kEtc1s, "ETC1S", 0, 0, kModelEtc1s, 4, 8},
    {Ktx2Texels::kUastc, "UASTC", 0, 0, kModelUastc, 4, 16},
    {Ktx2Texels::kRgb8, "RGB8", 23, 29, kModelRgb, 1, 3},
    {Ktx2Texels::kRgba8, "RGBA8", 37, 43, kModelRgb, 1, 4},
};

/// The swizzle to RGBA for the channels listed in a descriptor. Missing colours are 0, missing
/// alpha is 1 (section "KTXswizzle"). Blocks that declare only the channel RRR hold all three
/// colours: toktx 4.0.0-beta4 declared colour files in this way, and transcoders use them
/// unchanged.
struct Ktx2ChannelRow {
    std::uint32_t model;
    std::string_view channels;
    std::array<char, 4> swizzle;
};
constexpr Ktx2ChannelRow kKtx2Channels[] = {
    {kModelEtc1s, {"\x00", 1}, {'r', 'g', 'b', '1'}},
    {kModelEtc1s, {"\x00\x0F", 2}, {'r', 'g', 'b', 'a'}},
    {kModelEtc1s, "\x03", {'r', 'g', 'b', '1'}},
    {kModelEtc1s, "\x03\x04", {'r', 'a', '0', '1'}},
    {kModelUastc, {"\x00", 1}, {'r', 'g', 'b', '1'}},
    {kModelUastc, "\x03", {'r', 'g', 'b', 'a'}},
    {kModelUastc, "\x04", {'r', 'g', 'b', '1'}},
    {kModelUastc, "\x05", {'r', 'a', '0', '1'}},
    {kModelUastc, "\x06", {'r', 'g', '0', '1'}},
    {kModelRgb, {"\x00\x01\x02", 3}, {'r', 'g', 'b', '1'}},
    {kModelRgb, {"\x00\x01\x02\x0F", 4}, {'r', 'g', 'b', 'a'}},
};

/// A packing, with the maximum number of output bytes per input byte. kKtx2Packings is indexed by
/// supercompressionScheme. Zstandard gives at most 128 KiB for the four bytes of a repeating block
/// (RFC 8878, section 3.1.1.2), DEFLATE 258 bytes for two bits.
struct Ktx2PackingRow {
    const char* name;
    std::uint64_t most_from_one;
};
constexpr Ktx2PackingRow kKtx2Packings[] = {
    {"", 1}, {"BasisLZ", 0}, {"Zstandard", 32768}, {"ZLIB", 1032}};

class Ktx2Reader {
  public:
    explicit Ktx2Reader(std::span<const std::uint8_t> file) : file_(file) {}

    Ktx2Container read() {
        readHeader();
        readDescriptor();
        readLevels();
        readMetadata();
        if (out_.packing == Ktx2Packing::kBasisLz) {
            out_.global_offset = number(Ktx2Field::kGlobalData, 8);
            out_.global_data = section(out_.global_offset, number(Ktx2Field::kGlobalData + 8, 8),
                                       "supercompression global data", Ktx2Field::kGlobalData);
        }
        out_.codec = std::string("KTX2, ") + texels_->name;
        if (const char* packing = kKtx2Packings[static_cast<std::size_t>(out_.packing)].name;
            *packing)
            out_.codec += std::string(", ") + packing;
        return std::move(out_);
    }

  private:
    /// Returns `size` bytes as a little-endian number. The caller must have checked the file's
    /// size.
    std::uint64_t number(std::size_t at, std::size_t size = 4) const {
        std::uint64_t value = 0;
        for (std::size_t i = size; i-- > 0;)
            value = value << 8U | file_[at + i];
        return value;
    }

    std::span<const std::uint8_t> section(std::uint64_t offset, std::uint64_t size,
                                          const char* what, std::size_t named_at) const {
        if (offset > file_.size() || size > file_.size() - offset)
            failKtx2(std::string("the ") + what + " of " + std::to_string(size) +
                         " bytes from byte " + std::to_string(offset) +
                         " on does not fit the file of " + std::to_string(file_.size()) + " bytes",
                     named_at);
        return file_.subspan(offset, size);
    }

    void readHeader() {
        if (file_.size() < kKtx2HeaderBytes + kLevelBytes ||
            !std::equal(kIdentifier.begin(), kIdentifier.end(), file_.begin(),
                        [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; }))
            failKtx2("the KTX 2.0 header is missing", 0);
        width_ = checkedSide(Ktx2Field::kWidth);
        // Conditions of the section "Texture Type".
        struct Shape {
            std::size_t at;
            std::uint64_t must_be;
            const char* otherwise;
        };
        constexpr Shape kShapes[] = {{Ktx2Field::kDepth, 0, "a 3D texture"},
                                     {Ktx2Field::kLayers, 0, "an array of textures"},
                                     {Ktx2Field::kFaces, 1, "a cube map"}};
        for (const Shape& shape : kShapes)
            if (number(shape.at) != shape.must_be)
                failKtx2(std::string("it is ") + shape.otherwise + ", not a 2D texture", shape.at);
        if (number(Ktx2Field::kHeight) == 0)
            failKtx2("it is a 1D texture, not a 2D texture", Ktx2Field::kHeight);
        height_ = checkedSide(Ktx2Field::kHeight);
        if (number(Ktx2Field::kTypeSize) != 1)
            failKtx2("its typeSize is not 1: the components are not bytes", Ktx2Field::kTypeSize);
        const std::uint64_t scheme = number(Ktx2Field::kScheme);
        if (scheme >= std::size(kKtx2Packings))
            failKtx2("the supercompression scheme " + std::to_string(scheme) + " is not known",
                     Ktx2Field::kScheme);
        out_.packing = static_cast<Ktx2Packing>(scheme);
    }

    std::uint32_t checkedSide(std::size_t at) const {
        const std::uint64_t side = number(at);
        if (side == 0 || side > kMostKtx2Side)
            failKtx2("a side has " + std::to_string(side) + " pixels", at);
        return static_cast<std::uint32_t>(side);
    }

    /// Reads the first block of the "Data Format Descriptor". Throws unless it is a basic block.
    void readDescriptor() {
        constexpr std::size_t kBlock = 4, kBasic = 24, kSample = 16;
        const std::uint64_t at = number(Ktx2Field::kDescriptor),
                            size = number(Ktx2Field::kDescriptor + 4);
        const auto descriptor = section(at, size, "data format descriptor", Ktx2Field::kDescriptor);
        if (descriptor.size() < kBlock + kBasic + kSample)
            failKtx2("the data format descriptor is too short", at);
        if (number(at) != size)
            failKtx2("the data format descriptor says that it has " + std::to_string(number(at)) +
                         " bytes, but the index says " + std::to_string(size),
                     at);
        const std::size_t block = at + kBlock;
        const std::uint64_t block_size = number(block + 6, 2);
        if (number(block) != 0 || block_size < kBasic + kSample || block_size > size - kBlock ||
            (block_size - kBasic) % kSample != 0)
            failKtx2("the data format descriptor does not begin with a basic block", block);

        const std::uint64_t format = number(Ktx2Field::kVkFormat), model = number(block + 8, 1);
        const auto* const row = std::ranges::find_if(kKtx2Texels, [&](const Ktx2TexelRow& known) {
            return known.model == model && (known.unorm == format || known.srgb == format);
        });
        if (row == std::end(kKtx2Texels))
            failKtx2("VkFormat " + std::to_string(format) + " with the colour model " +
                         std::to_string(model) +
                         " is not decoded; only ETC1S, UASTC, R8G8B8 and R8G8B8A8 are",
                     Ktx2Field::kVkFormat);
        texels_ = row;
        out_.texels = row->texels;
        if ((row->texels == Ktx2Texels::kEtc1s) != (out_.packing == Ktx2Packing::kBasisLz))
            failKtx2("BasisLZ and ETC1S must be used together", Ktx2Field::kScheme);
        const std::uint64_t side = row->block_side - 1;
        if (number(block + 12) != (side | side << 8U))
            failKtx2(
                "the blocks of texels have another size than those of " + std::string(row->name),
                block + 12);
        readColors(block);
        readSamples(block + kBasic, (block_size - kBasic) / kSample);
    }

    void readColors(std::size_t block) {
        constexpr std::uint64_t kBt709 = 1, kLinear = 1, kSrgb = 2, kPremultiplied = 1;
        const std::uint64_t primaries = number(block + 9, 1), transfer = number(block + 10, 1);
        if (number(block + 11, 1) & kPremultiplied)
            failKtx2("the colours are premultiplied by alpha, which glTF does not allow",
                     block + 11);
        if (primaries > kBt709)
            out_.notes.push_back("its colour primaries (number " + std::to_string(primaries) +
                                 ") are taken as those of BT.709");
        if (transfer == kLinear || transfer == kSrgb)
            out_.srgb = transfer == kSrgb;
        else if (transfer != 0)
            out_.notes.push_back("its transfer function (number " + std::to_string(transfer) +
                                 ") is neither linear nor that of sRGB");
        if (texels_->model == kModelRgb && number(Ktx2Field::kVkFormat) == texels_->srgb &&
            out_.srgb != true)
            failKtx2("its VkFormat is sRGB, but its transfer function is not", block + 10);
    }

    void readSamples(std::size_t at, std::size_t count) {
        constexpr std::size_t kSample = 16;
        // Masks for the channel number, and for the flags float, signed and exponent.
        constexpr std::uint8_t kChannel = 0xF, kNumbers = 0xE0;
        std::string channels;
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t sample = at + i * kSample;
            const std::uint8_t type = file_[sample + 3];
            channels += static_cast<char>(type & kChannel);
            if (texels_->model != kModelRgb) continue;
            if ((type & kNumbers) != 0 || number(sample, 2) != 8 * i || file_[sample + 2] != 7)
                failKtx2("a channel is not an unsigned byte", sample);
        }
        const auto* const row =
            std::ranges::find_if(kKtx2Channels, [&](const Ktx2ChannelRow& known) {
                return known.model == texels_->model && known.channels == channels;
            });
        if (row == std::end(kKtx2Channels) ||
            (texels_->model == kModelRgb && count != texels_->block_bytes))
            failKtx2("the channels are not those of " + std::string(texels_->name), at);
        out_.swizzle = row->swizzle;
        out_.second_plane = texels_->model == kModelEtc1s && count == 2;
    }

    /// Reads the "Level Index".
    void readLevels() {
        const std::uint64_t stored = number(Ktx2Field::kLevels);
        const std::uint64_t most = std::bit_width(std::max(width_, height_));
        const std::uint64_t count = std::max<std::uint64_t>(stored, 1);
        if (count > most || (stored == 0 && texels_->block_side > 1))
            failKtx2("a picture of " + std::to_string(width_) + " x " + std::to_string(height_) +
                         " pixels cannot have " + std::to_string(stored) + " levels",
                     Ktx2Field::kLevels);
        if (file_.size() - kKtx2HeaderBytes < count * kLevelBytes)
            failKtx2("the index of " + std::to_string(count) + " levels is cut short",
                     kKtx2HeaderBytes);
        for (std::size_t i = 0; i < count; ++i)
            out_.levels.push_back(level(i));
        constexpr std::uint32_t kBasisBlock = 4;
        if (width_ % kBasisBlock != 0 || height_ % kBasisBlock != 0)
            out_.notes.push_back("its sides, " + std::to_string(width_) + " x " +
                                 std::to_string(height_) + " pixels, are not multiples of 4");
    }

    Ktx2Level level(std::size_t i) const {
        const std::size_t at = kKtx2HeaderBytes + i * kLevelBytes;
        Ktx2Level out;
        out.offset = number(at, 8);
        out.bytes = section(out.offset, number(at + 8, 8), "level", at);
        const std::uint32_t width = std::max(width_ >> i, 1U), height = std::max(height_ >> i, 1U);
        out.width = static_cast<int>(width);
        out.height = static_cast<int>(height);
        const std::uint64_t side = texels_->block_side;
        out.unpacked_bytes =
            (width + side - 1) / side * ((height + side - 1) / side) * texels_->block_bytes;
        if (out_.packing == Ktx2Packing::kBasisLz) return out;
        if (number(at + 16, 8) != out.unpacked_bytes ||
            (out_.packing == Ktx2Packing::kNone && out.bytes.size() != out.unpacked_bytes))
            failKtx2("a level of " + std::to_string(width) + " x " + std::to_string(height) +
                         " pixels needs " + std::to_string(out.unpacked_bytes) +
                         " bytes, but has " + std::to_string(number(at + 16, 8)) + ", stored as " +
                         std::to_string(out.bytes.size()),
                     at + 8);
        const Ktx2PackingRow& packing = kKtx2Packings[static_cast<std::size_t>(out_.packing)];
        if ((out.unpacked_bytes + packing.most_from_one - 1) / packing.most_from_one >
            out.bytes.size())
            failKtx2(std::to_string(out.bytes.size()) + " bytes of " + packing.name +
                         " cannot be unpacked to " + std::to_string(out.unpacked_bytes),
                     at + 8);
        return out;
    }

    /// Reads the "Key/Value Data".
    void readMetadata() {
        const std::uint64_t begin = number(Ktx2Field::kMetadata);
        const auto pairs = section(begin, number(Ktx2Field::kMetadata + 4), "key/value data",
                                   Ktx2Field::kMetadata);
        for (std::size_t at = 0; at < pairs.size();) {
            const std::size_t left = pairs.size() - at;
            const std::uint64_t size = left < 4 ? 0 : number(begin + at);
            if (size < 2 || size > left - 4)
                failKtx2(
                    "a key/value pair has an invalid length of " + std::to_string(size) + " bytes",
                    begin + at);
            const std::string_view text(reinterpret_cast<const char*>(pairs.data()) + at + 4, size);
            const std::size_t end = text.find('\0');
            if (end == 0 || end == std::string_view::npos)
                failKtx2("a key is empty or does not end", begin + at + 4);
            std::string_view value = text.substr(end + 1);
            value = value.substr(0, value.find('\0'));
            if (text.substr(0, end) == "KTXorientation" && value != "rd")
                // The orientation does not affect texture coordinates.
                out_.notes.emplace_back(
                    "its orientation (KTXorientation) is not rd; it is ignored");
            if (text.substr(0, end) == "KTXswizzle") readSwizzle(value, begin + at + 4);
            at += std::min<std::uint64_t>(4 + (size + 3) / 4 * 4, left);
        }
    }

    void readSwizzle(std::string_view value, std::uint64_t at) {
        constexpr std::string_view kComponents = "rgba";
        if (value.size() != 4 || value.find_first_not_of("rgba01") != std::string_view::npos)
            failKtx2("KTXswizzle is invalid", at);
        if (value == kComponents) return;
        out_.notes.push_back("its swizzle (KTXswizzle), " + std::string(value) + ", is applied");
        const std::array<char, 4> of_texels = out_.swizzle;
        for (std::size_t i = 0; i < 4; ++i) {
            const std::size_t component = kComponents.find(value[i]);
            out_.swizzle[i] = component < 4 ? of_texels[component] : value[i];
        }
    }

    std::span<const std::uint8_t> file_;
    std::uint32_t width_ = 0, height_ = 0;
    const Ktx2TexelRow* texels_ = nullptr;
    Ktx2Container out_;
};

}  // namespace

void failKtx2(const std::string& what, std::uint64_t at) {
    throw std::runtime_error(what + " (KTX2, byte " + std::to_string(at) + ")");
}

Ktx2Container readKtx2(std::span<const std::uint8_t> file) {
    return Ktx2Reader(file).read();
}

}  // namespace peeler
