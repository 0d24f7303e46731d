// SPDX-License-Identifier: Apache-2.0
// Fragment arrays of channels.
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

/// Returns the name of an array: the name of the Channel with the same components, if there is one.
/// Otherwise the first component's name or, if the array has several components, the part of that
/// name before the last dot.
std::string nameOf(const FragmentArray& array);

/// Returns an empty array (no fragments) for a channel. `color_type` is the pixel type of colours.
FragmentArray emptyArray(Channel channel, PixelType color_type);

/// Returns an empty band (no fragments) with the arrays of a plan's bands: colours and channels.
LayeredImage emptyBand(const Plan& plan);

/// Returns the bytes per fragment of these channels in a LayeredImage.
std::size_t channelBytes(std::span<const Channel> channels, PixelType color_type);

/// Returns the number of floats that channels.frag outputs per fragment.
std::size_t shadedComponents(std::span<const Channel> channels);

}  // namespace peeler
