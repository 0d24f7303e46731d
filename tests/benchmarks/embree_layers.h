// SPDX-License-Identifier: Apache-2.0
// Every layer of a picture by Embree: build, all hits of each pixel's ray, sort.
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

/// The number of rays traced at once.
enum class Packet : std::uint8_t { k1 = 1, k8 = 8, k16 = 16 };

/// The distance's bits above (positive floats sort like their bits), the primitive below.
using EmbreeHit = std::uint64_t;

/// Takes a pixel's hits, nearest first. Called by several threads at once.
using TakeHits = std::function<void(int x, int y, std::span<const EmbreeHit> hits)>;

/// Traces the triangles that peeler rasterises, with the same threads and rules: back faces are
/// culled (not with Faces::kBoth), and alpha is tested (the base colour's texture, bilinear, finest
/// level; not vertex colours), if the material says so.
class EmbreeLayers {
  public:
    explicit EmbreeLayers(const PosedScene& posed, Faces faces = Faces::kGltf);
    ~EmbreeLayers();
    EmbreeLayers(const EmbreeLayers&) = delete;
    EmbreeLayers& operator=(const EmbreeLayers&) = delete;

    std::size_t triangles() const;

    /// Rebuilds the hierarchy.
    void build();

    /// Finds and sorts all hits, between the camera's near and far plane, of a ray through every
    /// pixel's sample; returns their number. They live until their strip of rows is done. A
    /// distance is a camera Z.
    std::uint64_t trace(const View& view, Packet packet, const TakeHits& take = {});

    std::string version() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler::benchmark
