// SPDX-License-Identifier: Apache-2.0
// Reading of the codebooks that the levels of a BasisLZ file share.
#include <string>
#include <utility>

#include "formats/image/basis_lz.h"

namespace peeler {
namespace {

/// A reader that splits the global data into its consecutive parts.
class GlobalData {
  public:
    explicit GlobalData(const Ktx2Container& file)
        : bytes_(file.global_data), offset_(file.global_offset) {}

    std::uint64_t position() const { return offset_; }

    std::span<const std::uint8_t> take(std::uint64_t size, const char* what) {
        if (size > bytes_.size())
            failKtx2(std::string("the ") + what + " of BasisLZ, " + std::to_string(size) +
                         " bytes, reach beyond the global data",
                     offset_);
        const auto part = bytes_.first(size);
        bytes_ = bytes_.subspan(size);
        offset_ += size;
        return part;
    }
    std::uint32_t number(std::size_t size, const char* what) {
        std::uint32_t value = 0;
        const auto bytes = take(size, what);
        for (std::size_t i = size; i-- > 0;)
            value = value << 8U | bytes[i];
        return value;
    }
    bool finished() const { return bytes_.empty(); }

  private:
    std::span<const std::uint8_t> bytes_;
    std::uint64_t offset_;
};

/// Reads an "image description": the positions of a level's slices.
std::vector<BasisSlice> readSlices(GlobalData& data, const Ktx2Level& level, bool second_plane) {
    constexpr std::uint32_t kPredictedFrame = 2;
    const std::uint64_t at = data.position();
    const char* const what = "image descriptions";
    if (data.number(4, what) & kPredictedFrame)
        failKtx2("a level is a frame of a video, which needs the one before it", at);
    std::vector<BasisSlice> planes;
    for (const bool second : {false, true}) {
        const std::uint64_t offset = data.number(4, what), size = data.number(4, what);
        if (second && !second_plane) {
            if (offset != 0 || size != 0) failKtx2("a level has an unexpected alpha slice", at);
            continue;
        }
        if (size == 0 || offset > level.bytes.size() || size > level.bytes.size() - offset)
            failKtx2("a slice of " + std::to_string(size) + " bytes from byte " +
                         std::to_string(offset) + " on does not fit its level of " +
                         std::to_string(level.bytes.size()),
                     at);
        planes.push_back({level.bytes.subspan(offset, size), level.offset + offset});
    }
    return planes;
}

/// Reads "ETC1S Endpoint Codebooks". Each endpoint is stored as differences from the previous
/// endpoint. A channel's previous value selects its Huffman code.
std::vector<Etc1sEndpoint> readEndpoints(BitReader bits, std::size_t count) {
    const std::array<HuffmanTable, 3> color_deltas = {
        HuffmanTable::read(bits), HuffmanTable::read(bits), HuffmanTable::read(bits)};
    const HuffmanTable intensity_deltas = HuffmanTable::read(bits);
    const std::size_t stored = bits.take(1) ? 1 : 3;  // a grey value, or R, G and B
    std::array<std::uint32_t, 3> color = {16, 16, 16};
    std::uint32_t intensity = 0;
    std::vector<Etc1sEndpoint> endpoints(count);
    for (Etc1sEndpoint& endpoint : endpoints) {
        intensity = (intensity + intensity_deltas.decode(bits)) & 7U;
        for (std::size_t c = 0; c < stored; ++c) {
            const std::size_t range = color[c] <= 9 ? 0 : color[c] <= 21 ? 1 : 2;
            color[c] = (color[c] + color_deltas[range].decode(bits)) & 31U;
        }
        endpoint.intensity = static_cast<std::uint8_t>(intensity);
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t five = color[stored == 1 ? 0 : c];
            endpoint.color[c] = static_cast<std::uint8_t>(five << 3U | five >> 2U);
        }
        if (bits.overrun()) failKtx2("the endpoints of BasisLZ are cut short", bits.position());
    }
    return endpoints;
}

/// Reads "ETC1S Selector Codebooks". Each selector is stored unchanged, or as the difference (XOR)
/// from the previous selector.
std::vector<std::uint32_t> readSelectors(BitReader bits, std::size_t count) {
    if (bits.take(2) != 0)
        failKtx2("the selectors of BasisLZ are of another version", bits.position());
    const bool plain = bits.take(1) != 0;
    const HuffmanTable differences = plain ? HuffmanTable() : HuffmanTable::read(bits);
    std::vector<std::uint32_t> selectors(count);
    for (std::size_t i = 0; i < count; ++i) {
        const bool whole = plain || i == 0;
        std::uint32_t value = whole ? 0 : selectors[i - 1];
        for (unsigned row = 0; row < 4; ++row)
            value ^= (whole ? bits.take(8) : differences.decode(bits) & 0xFFU) << (8 * row);
        selectors[i] = value;
        if (bits.overrun()) failKtx2("the selectors of BasisLZ are cut short", bits.position());
    }
    return selectors;
}

}  // namespace

BasisCodebooks readBasisCodebooks(const Ktx2Container& file) {
    GlobalData data(file);
    const std::uint64_t begin = data.position();
    const char* const header = "global header";
    const std::size_t endpoints = data.number(2, header), selectors = data.number(2, header);
    const std::uint64_t endpoint_bytes = data.number(4, header),
                        selector_bytes = data.number(4, header),
                        table_bytes = data.number(4, header),
                        extended_bytes = data.number(4, header);
    if (endpoints == 0 || selectors == 0 || extended_bytes != 0)
        failKtx2("BasisLZ needs endpoints and selectors and takes no extended data, but has " +
                     std::to_string(endpoints) + " endpoints, " + std::to_string(selectors) +
                     " selectors and " + std::to_string(extended_bytes) + " bytes of extended data",
                 begin);
    BasisCodebooks out;
    for (std::size_t i = 0; i < file.levels.size(); ++i) {
        auto planes = readSlices(data, file.levels[i], file.second_plane);
        if (i == 0) out.planes = std::move(planes);
    }
    const auto part = [&](std::uint64_t size, const char* what) {
        const std::uint64_t at = data.position();
        return BitReader(data.take(size, what), at);
    };
    const BitReader endpoint_bits = part(endpoint_bytes, "endpoints"),
                    selector_bits = part(selector_bytes, "selectors");
    const std::uint64_t tables_at = data.position();
    BitReader tables = part(table_bytes, "tables");
    if (!data.finished())
        failKtx2("data follows the last part of BasisLZ's global data", data.position());
    out.endpoints = readEndpoints(endpoint_bits, endpoints);
    out.selectors = readSelectors(selector_bits, selectors);

    // "ETC1S Slice Huffman Tables".
    out.predictions = HuffmanTable::read(tables);
    out.endpoint_deltas = HuffmanTable::read(tables);
    out.selector_codes = HuffmanTable::read(tables);
    out.selector_runs = HuffmanTable::read(tables);
    out.history = tables.take(13);
    if (tables.overrun()) failKtx2("the tables of BasisLZ are cut short", tables_at);
    // The symbols of the selector code are the selectors, the entries of the history, and a run.
    const std::uint64_t codes = selectors + out.history + 1;
    if (out.predictions.symbols() > kBasisPredictions + 1 ||
        out.endpoint_deltas.symbols() > endpoints || out.selector_codes.symbols() > codes ||
        out.selector_runs.symbols() > kBasisRuns)
        failKtx2("a code of BasisLZ has unknown symbols", tables_at);
    return out;
}

}  // namespace peeler
