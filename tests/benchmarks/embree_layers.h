// SPDX-License-Identifier: Apache-2.0
// Layers of a picture, found by Embree: builds a hierarchy, finds all hits of each pixel's ray, and
// sorts them.
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

/// The number of rays traced together.
enum class Packet : std::uint8_t { k1 = 1, k8 = 8, k16 = 16 };

/// A hit as one number: the bits of its distance above the triangle's index. (The bits of positive
/// floats sort like the floats.)
using EmbreeHit = std::uint64_t;

/// Receives the hits of a pixel, nearest first. Called by several threads at the same time.
using TakeHits = std::function<void(int x, int y, std::span<const EmbreeHit> hits)>;

/// Embree's hierarchy of the triangles that peeler rasterises, with peeler's number of threads and
/// rules. Culls back faces except with Faces::kBoth. The alpha test samples the base colour's
/// texture (bilinear, finest level) and ignores vertex colours.
class EmbreeLayers {
  public:
    explicit EmbreeLayers(const PosedScene& posed, Faces faces = Faces::kGltf);
    ~EmbreeLayers();
    EmbreeLayers(const EmbreeLayers&) = delete;
    EmbreeLayers& operator=(const EmbreeLayers&) = delete;

    std::size_t triangles() const;

    /// Builds the hierarchy. May be called again.
    void build();

    /// Traces a ray through every pixel's sample, and sorts all hits between the camera's near and
    /// far plane. Returns the number of hits. Keeps the hits of a strip of rows in memory until the
    /// strip is done. The distance in an EmbreeHit is camera Z, not the length along the ray.
    std::uint64_t trace(const View& view, Packet packet, const TakeHits& take = {});

    std::string version() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler::benchmark
