// SPDX-License-Identifier: Apache-2.0
// Room for the channels of fragments.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/channels.h>
#include <peeler/layered_image.h>
#include <peeler/sink.h>

namespace peeler {

/// What an array is called: the name of the channel that has its components, else what these have
/// in common up to a dot, else that of its only one.
std::string nameOf(const FragmentArray& array);

/// The array of a channel, still without fragments. `color_type` is that of the colours.
FragmentArray emptyArray(Channel channel, PixelType color_type);

/// A band of a plan without fragments: colours and the plan's channels.
LayeredImage emptyBand(const Plan& plan);

/// Bytes of these channels of a fragment in a LayeredImage.
std::size_t channelBytes(std::span<const Channel> channels, PixelType color_type);

/// How many floats channels.frag yields for a fragment.
std::size_t shadedComponents(std::span<const Channel> channels);

}  // namespace peeler
