// SPDX-License-Identifier: Apache-2.0
#include "formats/arrays/fragment_columns.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <set>
#include <span>
#include <string_view>

#include "core/base/resize_anew.h"
#include "formats/file/byte_buffer.h"

namespace peeler {
namespace {

constexpr std::uint32_t kNothing = 0xFFFFFFFFU;
constexpr std::string_view kFacingName = "facing";

/// A known column. It is used if a picture has all of the column's channels and these channels
/// share one type.
struct KnownColumn {
    std::string_view name;
    std::vector<std::string_view> channels;
    ColumnUse use = ColumnUse::kCopy;
    std::vector<std::string_view> properties{};
    /// The column's name in a picture without the channel `facing`; empty if the name is the same.
    std::string_view toward_viewer{};
};

std::span<const KnownColumn> knownColumns() {
    using enum ColumnUse;
    // clang-format off: rows of a table
    static const KnownColumn kColumns[] = {
        {"t_hit", {"distance"}},
        {"z_hit", {"cameraZ"}},
        {"primitive_ids", {"id.primitive"}, kIndex, {"primitive"}},
        {"primitive_uvs", {"barycentric.U", "barycentric.V"}},
        {"facing", {kFacingName}, kSign},
        {"normals", {"N.X", "N.Y", "N.Z"}, kFront, {}, "viewer_normals"},
        {"primitive_normals", {"Ng.X", "Ng.Y", "Ng.Z"}, kFront, {}, "viewer_primitive_normals"},
        {"node_ids", {"id.object"}, kIndex, {"node"}},
        {"instance_ids", {"id.instance"}, kIndex, {"instance"}},
        {"material_ids", {"id.material"}, kMaterial, {"material"}},
        {"positions", {"P.X", "P.Y", "P.Z"}},
        {"texcoords", {"UV.U", "UV.V"}},
        {"tangents", {"T.X", "T.Y", "T.Z", "T.W"}},
        {"base_color", {"baseColor.R", "baseColor.G", "baseColor.B"}},
        {"emissive", {"emissive.R", "emissive.G", "emissive.B"}},
        {"roughness", {"material.roughness"}},
        {"metallic", {"material.metallic"}},
        {"motion", {"motion.X", "motion.Y"}},
    };
    // clang-format on
    return kColumns;
}

bool isIndex(ColumnUse use) {
    return use == ColumnUse::kIndex || use == ColumnUse::kMaterial;
}

/// Returns the type of these channels, or nothing if a channel is missing or the types differ.
std::optional<PixelType> commonType(const LayeredImage& band,
                                    std::span<const std::string_view> channels) {
    std::optional<PixelType> common;
    for (const std::string_view name : channels) {
        const FragmentChannel channel = findChannel(band, name);
        if (!channel || (common && *common != channel.type())) return {};
        common = channel.type();
    }
    return common;
}

/// Returns a channel's name as an array name: printable ASCII without path separators.
std::string arrayName(std::string channel) {
    std::ranges::replace_if(
        channel, [](unsigned char c) { return c < ' ' || c == '/' || c == '\\' || c >= 0x7f; },
        '_');
    return channel;
}

/// Returns a channel's name as a property name: one word of a PLY header, without dots.
std::string propertyName(std::string channel) {
    std::ranges::replace_if(
        channel, [](unsigned char c) { return c <= ' ' || c == '.' || c >= 0x7f; }, '_');
    return channel;
}

}  // namespace

NumberType numberTypeOf(PixelType type) {
    constexpr NumberType kTypes[] = {NumberType::kHalf, NumberType::kFloat, NumberType::kUint32};
    return kTypes[static_cast<std::size_t>(type)];
}

std::span<const std::byte> componentsOf(const FragmentArray& array, std::size_t first,
                                        std::size_t count, std::vector<std::byte>& storage) {
    const std::size_t number = pixelTypeSize(array.type), stride = array.stride();
    const std::size_t fragments = array.data.size() / stride;
    resizeAnew(storage, fragments * count * number);
    for (std::size_t f = 0; f < fragments; ++f) {
        std::memcpy(storage.data() + f * count * number,
                    array.data.data() + f * stride + first * number, count * number);
    }
    return storage;
}

std::vector<FragmentColumn> fragmentColumns(const LayeredImage& band) {
    const bool knows_front = static_cast<bool>(findChannel(band, kFacingName));
    std::vector<FragmentColumn> columns;
    std::set<std::string_view> used;
    for (const KnownColumn& known : knownColumns()) {
        const std::optional<PixelType> type = commonType(band, known.channels);
        if (!type || isIndex(known.use) != (*type == PixelType::kUint)) continue;
        const bool is_viewers = known.use == ColumnUse::kFront && !knows_front;
        FragmentColumn& column = columns.emplace_back();
        column.name = is_viewers ? known.toward_viewer : known.name;
        column.channels.assign(known.channels.begin(), known.channels.end());
        column.type = known.use == ColumnUse::kSign ? NumberType::kInt32 : numberTypeOf(*type);
        column.use = is_viewers ? ColumnUse::kCopy : known.use;
        column.properties.assign(known.properties.begin(), known.properties.end());
        used.insert(known.channels.begin(), known.channels.end());
    }
    for (const FragmentArray& array : band.extra) {
        for (const std::string& channel : array.channels) {
            if (used.contains(channel)) continue;
            FragmentColumn& column = columns.emplace_back();
            column.name = arrayName(channel);
            column.channels = {channel};
            column.type = numberTypeOf(array.type);
            if (array.type == PixelType::kUint) column.properties = {propertyName(channel)};
        }
    }
    return columns;
}

FragmentColumnReader::FragmentColumnReader(const LayeredImage& band, const FragmentColumn& column,
                                           std::uint32_t default_material)
    : column_(&column), default_material_(default_material) {
    for (const std::string& channel : column.channels)
        channels_.push_back(findChannel(band, channel));
    if (column.use == ColumnUse::kFront) facing_ = findChannel(band, kFacingName);
}

std::byte* FragmentColumnReader::put(std::size_t fragment, std::byte* out) const {
    const std::size_t size = infoOf(column_->type).size;
    // To flip a normal, toggle the sign bit of each component (half or float).
    const bool flips = facing_ && facing_.value(fragment) < 0;
    for (const FragmentChannel& channel : channels_) {
        if (column_->use == ColumnUse::kSign) {
            out = storeNumber(std::int32_t{channel.value(fragment) < 0 ? -1 : 1}, out);
            continue;
        }
        if (isIndex(column_->use)) {
            const std::uint32_t id = channel.id(fragment);
            const bool is_default = column_->use == ColumnUse::kMaterial &&
                                    default_material_ != 0 && id == default_material_;
            out = storeNumber(is_default ? kNothing : id - 1, out);
            continue;
        }
        std::memcpy(out, channel.data(fragment), size);
        out += size;
        if (flips) out[-1] ^= std::byte{0x80};
    }
    return out;
}

}  // namespace peeler
