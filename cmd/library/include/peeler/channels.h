// SPDX-License-Identifier: Apache-2.0
// The channel table: fragment quantities besides colour and Z.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <peeler/layered_image.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// A channel. channelTable() lists its components and a summary.
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

/// A row of the table. `components` are EXR channel names.
struct ChannelInfo {
    Channel channel;
    std::string_view name;  ///< name on the command line
    std::span<const std::string_view> components;
    /// kHalf: the channel has the same precision as the colour. kFloat, kUint: always this type.
    PixelType type;
    /// The macro that makes channels.frag output the channel, one float per component; "" = the
    /// channel is derived from the fragment's Z and primitive (core/fragments/depth_sort.h).
    std::string_view definition;
    std::string_view summary;
};

/// Returns the table, in the order of the enumeration. LayeredImage::extra has the same order.
std::span<const ChannelInfo> channelTable();

inline const ChannelInfo& infoOf(Channel channel) {
    return channelTable()[static_cast<std::size_t>(channel)];
}

}  // namespace peeler::inline v0

#pragma GCC visibility pop
