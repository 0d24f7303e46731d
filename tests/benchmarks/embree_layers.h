// SPDX-License-Identifier: Apache-2.0
// All layers of a picture, found by Embree: builds a hierarchy, finds all hits of each pixel's ray,
// and sorts them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <peeler/capture_settings.h>
#include <peeler/view.h>
#include "core/scene/posed_scene.h"

namespace peeler::benchmark {

/// The number of rays that are traced together.
enum class Packet : std::uint8_t { k1 = 1, k8 = 8, k16 = 16 };

/// A hit as one number: the bits of its distance (positive floats sort like their bits) above the
/// index of the triangle.
using EmbreeHit = std::uint64_t;

/// Receives the hits of a pixel, nearest first. Several threads call it at the same time.
using TakeHits = std::function<void(int x, int y, std::span<const EmbreeHit> hits)>;

/// Traces the triangles that peeler rasterises, with as many threads and by the same rules. Back
/// faces are culled except with Faces::kBoth. If the material has an alpha test, it uses the base
/// colour's texture (bilinear, finest level), but not vertex colours.
class EmbreeLayers {
  public:
    explicit EmbreeLayers(const PosedScene& posed, Faces faces = Faces::kGltf);
    ~EmbreeLayers();
    EmbreeLayers(const EmbreeLayers&) = delete;
    EmbreeLayers& operator=(const EmbreeLayers&) = delete;

    std::size_t triangles() const;

    /// Builds the hierarchy, again if there is one.
    void build();

    /// Finds and sorts all hits between the camera's near and far plane on a ray through every
    /// pixel's sample; returns their number. The hits stay in memory until their strip of rows is
    /// done. The distance in an EmbreeHit is camera Z, not the length along the ray.
    std::uint64_t trace(const View& view, Packet packet, const TakeHits& take = {});

    std::string version() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler::benchmark
