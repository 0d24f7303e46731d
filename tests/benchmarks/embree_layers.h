// SPDX-License-Identifier: Apache-2.0
// Every layer of a picture as Embree finds them: build, all hits of each pixel's ray, sort.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/capture/capture_settings.h"
#include "core/scene/posed_scene.h"
#include "core/scene/view.h"

namespace peeler::benchmark {

/// How many rays are traced at once.
enum class Packet : std::uint8_t { k1 = 1, k8 = 8, k16 = 16 };

/// Traces the triangles that peeler rasterises, with the same threads, by the same rules: back
/// faces are culled (or with Faces::kBoth are not), and alpha is tested (the base colour's texture,
/// bilinear, finest level; not vertex colours), where the material says so.
class EmbreeLayers {
  public:
    explicit EmbreeLayers(const PosedScene& posed, Faces faces = Faces::kGltf);
    ~EmbreeLayers();
    EmbreeLayers(const EmbreeLayers&) = delete;
    EmbreeLayers& operator=(const EmbreeLayers&) = delete;

    std::size_t triangles() const;

    /// Builds the hierarchy anew.
    void build();

    /// Finds and sorts all hits, between the camera's near and far plane, of a ray through every
    /// pixel's sample; returns how many there are. They are kept until their strip of rows is done.
    std::uint64_t trace(const View& view, Packet packet);

    std::string version() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler::benchmark
