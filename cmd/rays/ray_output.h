// SPDX-License-Identifier: Apache-2.0
// What becomes of the hits of traced bundles. A new kind of output is one new file.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "core/image/channels.h"
#include "core/image/layered_image.h"
#include "core/rays/bundle.h"

namespace peeler::cmd {

/// Takes bundle after bundle, each band by band, top to bottom. One that is destroyed before
/// finish() leaves nothing behind.
class RayOutput {
  public:
    virtual ~RayOutput() = default;
    /// What it needs of every hit besides t and key, in the order of the table.
    virtual std::vector<Channel> channels() const { return {}; }
    /// Whether begin() has to be told how many hits there are, which takes a count pass more.
    virtual bool needsHits() const { return false; }
    /// `hits[i]` are those of bundle i; empty unless needed.
    virtual void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) = 0;
    /// Hits of some rows of bundle i: z is camera Z (Bundle::tScale makes it t), extra[0] the keys
    /// (kKeyChannel), then channels(), perhaps among others.
    virtual void take(std::size_t bundle, const LayeredImage& band) = 0;
    virtual void finish() = 0;
    /// Adds what it has to tell to the result of the run.
    virtual void tell(nlohmann::ordered_json& result) const = 0;
};

}  // namespace peeler::cmd
