// SPDX-License-Identifier: Apache-2.0
// The table of channels: quantities of a fragment besides colour and Z.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <peeler/layered_image.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// A channel; the table has its components and a sentence on each.
enum class Channel : std::uint8_t {
    kNormal,
    kGeometricNormal,
    kPosition,
    kUv,
    kTangent,
    kBaseColor,
    kEmissive,
    kRoughnessMetallic,
    kFacing,
    kMotion,
    kId,
    kBarycentric,
    kDistance
};

/// One row of the table. Components have the names of the channels in files.
struct ChannelInfo {
    Channel channel;
    std::string_view name;  ///< as on the command line
    std::span<const std::string_view> components;
    /// kHalf: as precise as the colour. kFloat and kUint: always.
    PixelType type;
    /// The definition with which channels.frag yields it, a float a component; "" = it follows from
    /// the fragment's Z and primitive (core/fragments/depth_sort.h).
    std::string_view definition;
    std::string_view summary;
};

/// In the order of the enumeration, which is that of the arrays in a LayeredImage.
std::span<const ChannelInfo> channelTable();

inline const ChannelInfo& infoOf(Channel channel) {
    return channelTable()[static_cast<std::size_t>(channel)];
}

}  // namespace peeler::inline v0

#pragma GCC visibility pop
