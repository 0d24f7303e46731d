// SPDX-License-Identifier: Apache-2.0
// Bounds-checked reading and conversion of accessor data.
#include "formats/gltf/gltf_accessor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "formats/gltf/gltf_schema.h"

namespace peeler {

/// An array of numeric elements in memory, with any alignment. If `data` is null, all elements are
/// zeros.
struct AccessorSource {
    const std::uint8_t* data = nullptr;
    std::size_t stride = 0;
    int component_type = 0;
    std::size_t components = 1;
    bool normalize = false;
};

namespace {

// The maximum count of an accessor without a buffer view. Such an accessor takes no bytes in the
// file, so the file's size does not limit it.
constexpr std::size_t kMaxUnbackedCount = std::size_t{1} << 24U;

std::string accessorPointer(int accessor) {
    return childPointer("/accessors", static_cast<std::size_t>(accessor));
}

std::size_t componentBytes(int type) {
    return static_cast<std::size_t>(
        tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(type)));
}

/// Converts a normalised integer. The most negative integer also becomes −1 (glTF 2.0 §3.6.2.2).
template <typename Integer>
float normalized(Integer value) {
    return std::max(
        static_cast<float>(value) / static_cast<float>(std::numeric_limits<Integer>::max()), -1.0F);
}

template <typename In, typename Out>
Out converted(In value, bool normalize) {
    if constexpr (std::is_integral_v<In> && std::is_floating_point_v<Out>)
        if (normalize) return normalized(value);
    return static_cast<Out>(value);
}

constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();

/// Copies elements to the indices target(i) of `out`. Skips elements for which target(i) is
/// kNowhere.
template <typename In, typename Out, typename Target>
void copyNumbers(const AccessorSource& source, std::size_t count, Out* out, const Target& target) {
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint8_t* element = source.data + i * source.stride;
        const std::size_t place = target(i);
        if (place == kNowhere) continue;
        Out* to = out + place * source.components;
        for (std::size_t c = 0; c < source.components; ++c) {
            In value;
            std::memcpy(&value, element + c * sizeof(In), sizeof(In));
            to[c] = converted<In, Out>(value, source.normalize);
        }
    }
}

template <typename Out, typename Target>
void copyElements(const AccessorSource& source, std::size_t count, Out* out, const Target& target) {
    switch (source.component_type) {
        case 5120:
            return copyNumbers<std::int8_t>(source, count, out, target);
        case 5121:
            return copyNumbers<std::uint8_t>(source, count, out, target);
        case 5122:
            return copyNumbers<std::int16_t>(source, count, out, target);
        case 5123:
            return copyNumbers<std::uint16_t>(source, count, out, target);
        case 5125:
            return copyNumbers<std::uint32_t>(source, count, out, target);
        default:
            return copyNumbers<float>(source, count, out, target);
    }
}

constexpr auto kSamePlace = [](std::size_t i) { return i; };

}  // namespace

/// The checked elements of an accessor, without its sparse replacements.
struct AccessorReader::Elements : AccessorSource {
    std::size_t count = 0;
};

std::span<const std::uint8_t> AccessorReader::bufferView(int buffer_view) const {
    const auto index = static_cast<std::size_t>(buffer_view);
    const tinygltf::BufferView& view = document_.model.bufferViews[index];
    if (index < document_.decoded_views.size() && !document_.decoded_views[index].empty())
        return document_.decoded_views[index];
    const std::string where = childPointer("/bufferViews", index);
    const std::span<const std::uint8_t> buffer =
        document_.buffers[static_cast<std::size_t>(view.buffer)];
    if (buffer.empty()) failGltf("buffer " + std::to_string(view.buffer) + " has no data", where);
    // The sum cannot overflow, since both numbers are at most 2^53 (schema).
    if (view.byteOffset + view.byteLength > buffer.size())
        failGltf("the view ends at byte " + std::to_string(view.byteOffset + view.byteLength) +
                     ", but its buffer has " + std::to_string(buffer.size()) + " bytes",
                 where);
    return buffer.subspan(view.byteOffset, view.byteLength);
}

std::size_t AccessorReader::count(int accessor) const {
    return document_.model.accessors[static_cast<std::size_t>(accessor)].count;
}

int AccessorReader::components(int accessor) const {
    return tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(
        document_.model.accessors[static_cast<std::size_t>(accessor)].type));
}

AccessorReader::Elements AccessorReader::elements(int accessor) const {
    const tinygltf::Accessor& info = document_.model.accessors[static_cast<std::size_t>(accessor)];
    const std::string where = accessorPointer(accessor);
    Elements result;
    result.count = info.count;
    result.component_type = info.componentType;
    result.components = static_cast<std::size_t>(components(accessor));
    if (info.count == 0) return result;
    if (info.bufferView < 0) {
        if (info.count > kMaxUnbackedCount)
            failGltf("an accessor without a buffer view must have at most " +
                         std::to_string(kMaxUnbackedCount) + " elements, but has " +
                         std::to_string(info.count),
                     where + "/count");
        return result;
    }

    const std::span<const std::uint8_t> view = bufferView(info.bufferView);
    const std::size_t element_bytes = componentBytes(info.componentType) * result.components;
    const std::size_t stride =
        document_.model.bufferViews[static_cast<std::size_t>(info.bufferView)].byteStride;
    result.stride = stride == 0 ? element_bytes : stride;
    if (result.stride < element_bytes)
        failGltf("the stride of " + std::to_string(stride) + " bytes is smaller than the " +
                     std::to_string(element_bytes) + " bytes of an element of accessor " +
                     std::to_string(accessor),
                 childPointer("/bufferViews", static_cast<std::size_t>(info.bufferView)) +
                     "/byteStride");
    // The accessor must fit into its buffer view (§3.6.2.4). The sum cannot overflow, since counts
    // and offsets are at most 2^53 and the stride is at most 252.
    const std::uint64_t end = info.byteOffset + result.stride * (info.count - 1) + element_bytes;
    if (end > view.size())
        failGltf("the accessor ends at byte " + std::to_string(end) + " of its buffer view, " +
                     "which has " + std::to_string(view.size()) + " bytes",
                 where);
    result.data = view.data() + info.byteOffset;
    return result;
}

template <typename Out>
void AccessorReader::applySparse(int accessor, ElementRange range, bool normalize,
                                 std::vector<Out>& values) const {
    const tinygltf::Accessor& info = document_.model.accessors[static_cast<std::size_t>(accessor)];
    if (!info.sparse.isSparse) return;
    const std::string where = accessorPointer(accessor) + "/sparse";
    const auto count = static_cast<std::size_t>(info.sparse.count);
    const auto packed = [&](int buffer_view, std::uint64_t offset, int type, std::size_t components,
                            const char* part) {
        const std::span<const std::uint8_t> view = bufferView(buffer_view);
        const std::size_t bytes = componentBytes(type) * components;
        if (offset + bytes * count > view.size())
            failGltf("the sparse data does not fit its buffer view", where + part);
        return AccessorSource{view.data() + offset, bytes, type, components, normalize};
    };
    std::vector<std::uint32_t> places(count);
    const int index_type = info.sparse.indices.componentType;
    copyElements(packed(info.sparse.indices.bufferView,
                        static_cast<std::uint64_t>(info.sparse.indices.byteOffset), index_type, 1,
                        "/indices"),
                 count, places.data(), kSamePlace);
    const auto beyond = std::find_if(places.begin(), places.end(),
                                     [&](std::uint32_t place) { return place >= info.count; });
    if (beyond != places.end())
        failGltf("element " + std::to_string(*beyond) + " is substituted, but the accessor has " +
                     std::to_string(info.count) + " elements",
                 where + "/indices");
    copyElements(
        packed(info.sparse.values.bufferView,
               static_cast<std::uint64_t>(info.sparse.values.byteOffset), info.componentType,
               static_cast<std::size_t>(components(accessor)), "/values"),
        count, values.data(), [&](std::size_t i) {
            const std::size_t place = places[i];
            return place >= range.first && place - range.first < range.count ? place - range.first
                                                                             : kNowhere;
        });
}

/// Whether an accessor's integers are to be read as normalised. Throws Error (kInput) if the
/// accessor's format is not allowed.
bool AccessorReader::isNormalized(int accessor, const AccessorFormat& format,
                                  const std::string& use) const {
    constexpr int kFloat = 5126;
    static constexpr std::pair<int, const char*> kNames[] = {
        {5120, "BYTE"},           {5121, "UNSIGNED_BYTE"}, {5122, "SHORT"},
        {5123, "UNSIGNED_SHORT"}, {5125, "UNSIGNED_INT"},  {kFloat, "FLOAT"}};
    const tinygltf::Accessor& info = document_.model.accessors[static_cast<std::size_t>(accessor)];
    const auto isAllowed = [&](bool normalized) {
        return std::ranges::find(format.allowed, ComponentFormat{info.componentType, normalized}) !=
               format.allowed.end();
    };
    const bool normalized = info.normalized && info.componentType != kFloat;
    if (isAllowed(normalized)) return normalized;
    const auto* const name =
        std::ranges::find(kNames, info.componentType, &std::pair<int, const char*>::first);
    const std::string said = "accessor " + std::to_string(accessor) + " has " +
                             (info.normalized ? "normalized " : "") + name->second;
    if (info.componentType == kFloat || !isAllowed(!normalized))
        failGltf(said + " components, which this use does not allow", use);
    document_.warn(
        "The integers of " + use + " are read as " +
            (normalized ? "plain integers, but the accessor marks them as normalized"
                        : "normalized, but the accessor does not mark them as normalized") +
            " (" + format.issue + ").",
        use);
    return !normalized;
}

std::vector<float> AccessorReader::floats(int accessor, const AccessorFormat& format,
                                          ElementRange range, const std::string& use) const {
    const tinygltf::Accessor& info = document_.model.accessors[static_cast<std::size_t>(accessor)];
    const int width = components(accessor);
    const bool is_matrix = info.type >= TINYGLTF_TYPE_MAT2 && info.type <= TINYGLTF_TYPE_MAT4;
    if (is_matrix || std::find(format.components.begin(), format.components.end(), width) ==
                         format.components.end())
        failGltf("accessor " + std::to_string(accessor) + " has " + std::to_string(width) +
                     " components, which this use does not allow",
                 use);
    const bool normalize = isNormalized(accessor, format, use);
    Elements source = elements(accessor);
    source.normalize = normalize;
    std::vector<float> values(range.count * source.components);
    if (source.data) {
        source.data += range.first * source.stride;
        copyElements(source, range.count, values.data(), kSamePlace);
    }
    applySparse(accessor, range, source.normalize, values);
    return values;
}

std::vector<float> AccessorReader::matrices(int accessor, std::size_t count,
                                            const std::string& use) const {
    const tinygltf::Accessor& info = document_.model.accessors[static_cast<std::size_t>(accessor)];
    if (info.type != TINYGLTF_TYPE_MAT4 || info.componentType != 5126)
        failGltf("accessor " + std::to_string(accessor) + " must hold 4x4 matrices of floats", use);
    if (info.count < count)
        failGltf("accessor " + std::to_string(accessor) + " has " + std::to_string(info.count) +
                     " matrices, but " + std::to_string(count) + " are needed",
                 use);
    const Elements source = elements(accessor);
    std::vector<float> values(count * source.components);
    if (source.data) copyElements(source, count, values.data(), kSamePlace);
    applySparse(accessor, {0, count}, false, values);
    for (const float value : values)
        if (!std::isfinite(value)) failGltf("a matrix holds a number that is not finite", use);
    return values;
}

std::vector<std::uint32_t> AccessorReader::indices(int accessor, const std::string& use,
                                                   std::uint32_t& max_value) const {
    const tinygltf::Accessor& info = document_.model.accessors[static_cast<std::size_t>(accessor)];
    const int type = info.componentType;
    if (info.type != TINYGLTF_TYPE_SCALAR || (type != 5121 && type != 5123 && type != 5125))
        failGltf("indices must be unsigned integer scalars, but accessor " +
                     std::to_string(accessor) + " is not",
                 use);
    max_value = type == 5121 ? 0xFFU : type == 5123 ? 0xFFFFU : 0xFFFFFFFFU;
    const Elements source = elements(accessor);
    std::vector<std::uint32_t> values(source.count);
    if (source.data) copyElements(source, source.count, values.data(), kSamePlace);
    applySparse(accessor, {0, source.count}, false, values);
    return values;
}

}  // namespace peeler
