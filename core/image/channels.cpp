// SPDX-License-Identifier: Apache-2.0
#include "core/image/channels.h"

#include <algorithm>
#include <string>

namespace peeler::inline v0 {
namespace {

using Names = std::string_view[];
constexpr Names kNormal = {"N.X", "N.Y", "N.Z"};
constexpr Names kGeometricNormal = {"Ng.X", "Ng.Y", "Ng.Z"};
constexpr Names kPosition = {"P.X", "P.Y", "P.Z"};
constexpr Names kUv = {"UV.U", "UV.V"};
constexpr Names kTangent = {"T.X", "T.Y", "T.Z", "T.W"};
constexpr Names kBaseColor = {"baseColor.R", "baseColor.G", "baseColor.B"};
constexpr Names kEmissive = {"emissive.R", "emissive.G", "emissive.B"};
constexpr Names kRoughnessMetallic = {"material.roughness", "material.metallic"};
constexpr Names kFacing = {"facing"};
constexpr Names kMotion = {"motion.X", "motion.Y"};
constexpr Names kId = {"id.object", "id.material", "id.primitive", "id.instance"};
constexpr Names kBarycentric = {"barycentric.U", "barycentric.V"};
constexpr Names kDistance = {"distance"};

constexpr ChannelInfo kChannels[] = {
    {Channel::kNormal, "normal", kNormal, PixelType::kHalf, "CHANNEL_NORMAL",
     "shading normal, normal map included; unit, world space, on the viewer's side"},
    {Channel::kGeometricNormal, "geometric-normal", kGeometricNormal, PixelType::kHalf, "",
     "normal of the flat triangle; unit, world space, toward the viewer"},
    {Channel::kPosition, "position", kPosition, PixelType::kFloat, "", "world space"},
    {Channel::kUv, "uv", kUv, PixelType::kFloat, "CHANNEL_UV", "first texture coordinates, V down"},
    {Channel::kTangent, "tangent", kTangent, PixelType::kHalf, "CHANNEL_TANGENT",
     "direction of increasing U; unit, world space; T.W is the handedness"},
    {Channel::kBaseColor, "base-color", kBaseColor, PixelType::kHalf, "CHANNEL_BASE_COLOR",
     "the material's colour; linear, not premultiplied by alpha"},
    {Channel::kEmissive, "emissive", kEmissive, PixelType::kHalf, "CHANNEL_EMISSIVE",
     "light emitted by the material; linear"},
    {Channel::kRoughnessMetallic, "roughness-metallic", kRoughnessMetallic, PixelType::kHalf,
     "CHANNEL_ROUGHNESS_METALLIC", "the material's roughness and metalness; 0 to 1"},
    {Channel::kFacing, "facing", kFacing, PixelType::kHalf, "",
     "1 on the front of a triangle, -1 on its back"},
    {Channel::kMotion, "motion", kMotion, PixelType::kFloat, "",
     "offset to the place of the surface point one frame later, even if that frame is not "
     "rendered; pixels, Y down"},
    {Channel::kId, "id", kId, PixelType::kUint, "",
     "index + 1 of the object (node), of the material, of the triangle in its mesh and of the "
     "instance"},
    {Channel::kBarycentric, "barycentric", kBarycentric, PixelType::kFloat, "",
     "weights of the triangle's second and third corner"},
    {Channel::kDistance, "distance", kDistance, PixelType::kFloat, "",
     "distance from the camera along the pixel's ray"},
};

PixelType typeOf(const ChannelInfo& info, PixelType color_type) {
    return info.type == PixelType::kHalf ? color_type : info.type;
}

}  // namespace

std::span<const ChannelInfo> channelTable() {
    return kChannels;
}

}  // namespace peeler::inline v0

namespace peeler {

std::string nameOf(const FragmentArray& array) {
    for (const ChannelInfo& info : kChannels)
        if (std::ranges::equal(array.channels, info.components)) return std::string(info.name);
    const std::string& first = array.channels.front();
    const std::size_t dot = first.rfind('.');
    return array.components() == 1 || dot == std::string::npos ? first : first.substr(0, dot);
}

FragmentArray emptyArray(Channel channel, PixelType color_type) {
    const ChannelInfo& info = infoOf(channel);
    FragmentArray array;
    array.channels.assign(info.components.begin(), info.components.end());
    array.type = typeOf(info, color_type);
    return array;
}

LayeredImage emptyBand(const Plan& plan) {
    LayeredImage band;
    band.color = {colorNames(plan.tinted), plan.color_type, {}};
    band.extra = plan.channels;
    return band;
}

std::size_t channelBytes(std::span<const Channel> channels, PixelType color_type) {
    std::size_t bytes = 0;
    for (const Channel channel : channels) {
        const ChannelInfo& info = infoOf(channel);
        bytes += info.components.size() * pixelTypeSize(typeOf(info, color_type));
    }
    return bytes;
}

std::size_t shadedComponents(std::span<const Channel> channels) {
    std::size_t components = 0;
    for (const Channel channel : channels)
        if (const ChannelInfo& info = infoOf(channel); !info.definition.empty())
            components += info.components.size();
    return components;
}

}  // namespace peeler
