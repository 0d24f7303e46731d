// SPDX-License-Identifier: Apache-2.0
// Channels of Gaussian splats.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include <peeler/channels.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>
#include "core/fragments/surface_channels.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// Returns the bytes per fragment that fillSplatChannels() takes temporarily.
std::uint64_t splatChannelBytes(std::span<const Channel> channels);

/// Fills the channels of a band of splats, which are the arrays behind that of the keys, extra[0].
/// The base colour is the splat's, without opacity. Of the channels that shaders compute, a splat
/// has no others: they are 0. `next` is as in FragmentSources.
void fillSplatChannels(const PosedScene& posed, const View& view, std::span<const Channel> channels,
                       const NextFrame* next, LayeredImage& band);

}  // namespace peeler
