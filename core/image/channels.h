// SPDX-License-Identifier: Apache-2.0
// What a fragment can be asked for besides colour and Z.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/layered_image.h"

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

/// One row of the table. Components are called as they are in files (formats/README.md,
/// "Channels").
struct ChannelInfo {
    Channel channel;
    std::string_view name;  ///< as on the command line
    std::span<const std::string_view> components;
    /// kHalf: as precise as the colour. kFloat and kUint: always.
    PixelType type;
    /// The definition with which channels.frag yields it, a float a component; "" = it follows from
    /// the fragment's Z and primitive (core/capture/captured_fragments.h).
    std::string_view definition;
    std::string_view summary;
};

/// In the order of the enumeration, which is that of the arrays in a LayeredImage.
std::span<const ChannelInfo> channelTable();

inline const ChannelInfo& infoOf(Channel channel) {
    return channelTable()[static_cast<std::size_t>(channel)];
}

/// What an array is called: the name of the channel that has its components, else what these have
/// in common up to a dot, else that of its only one.
std::string nameOf(const FragmentArray& array);

/// The array of a channel, still without fragments. `color_type` is that of the colours.
FragmentArray emptyArray(Channel channel, PixelType color_type);

/// Bytes of these channels of a fragment in a LayeredImage.
std::size_t channelBytes(std::span<const Channel> channels, PixelType color_type);

/// How many floats channels.frag yields for a fragment.
std::size_t shadedComponents(std::span<const Channel> channels);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
