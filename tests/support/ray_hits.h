// SPDX-License-Identifier: Apache-2.0
// Ray hits computed by formulas: spheres replace the solids of a scene.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/layered_image.h>
#include <peeler/scene.h>
#include "core/fragments/supersampling.h"
#include "core/rays/solids.h"
#include "core/scene/posed_scene.h"
#include "formats/rays/ray_output.h"

namespace peeler::test {

/// Returns a closed tetrahedron without shared vertices.
inline Primitive tetrahedron(int material = 0, float size = 1) {
    const glm::vec3 corner[] = {{0, 0, 0}, {size, 0, 0}, {0, size, 0}, {0, 0, size}};
    Primitive primitive;
    primitive.material = material;
    for (const int i : {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2})
        primitive.positions.push_back(corner[i]);
    return primitive;
}

/// Returns a scene of `count` nodes "body 0", "body 1", …, each with its own closed mesh and
/// material ("m0", "m1", …).
inline Scene bodies(int count) {
    Scene scene;
    scene.scenes.resize(1);
    scene.meshes.resize(static_cast<std::size_t>(count));
    scene.nodes.resize(static_cast<std::size_t>(count));
    scene.materials.resize(static_cast<std::size_t>(count) + 1);
    for (int i = 0; i < count; ++i) {
        const auto n = static_cast<std::size_t>(i);
        scene.meshes[n].primitives = {tetrahedron(i)};
        scene.nodes[n].name = "body " + std::to_string(i);
        scene.nodes[n].mesh = i;
        scene.materials[n].name = "m" + std::to_string(i);
        scene.scenes[0].roots.push_back(i);
    }
    return scene;
}

/// Returns the draw-order key of the first triangle of the n-th node in bodies().
inline std::uint32_t keyOf(int body) {
    return 1 + 4 * static_cast<std::uint32_t>(body);
}

struct Hit {
    double t = 0;
    std::uint32_t key = 0;
};

/// Returns the hits of a bundle. at(start, direction) returns the hits of a ray in any order; `t`
/// is the distance from `start`, which is the eye for a pinhole bundle.
inline LayeredImage rayHits(
    const Bundle& bundle,
    const std::function<std::vector<Hit>(const glm::dvec3&, const glm::dvec3&)>& at) {
    const View& view = bundle.view;
    LayeredImage image;
    image.window = view.crop;
    image.offsets.push_back(0);
    image.extra.push_back({{kKeyChannel}, PixelType::kUint, {}});
    std::vector<std::uint32_t> keys;
    for (int y = view.crop.y0; y < view.crop.y1; ++y) {
        for (int x = view.crop.x0; x < view.crop.x1; ++x) {
            const glm::dvec3 start = worldPosition(view, x + 0.5, y + 0.5, 0);
            const glm::dvec3 direction = worldPosition(view, x + 0.5, y + 0.5, 1) - start;
            std::vector<Hit> hits = at(start, glm::normalize(direction));
            std::ranges::stable_sort(hits, {}, &Hit::t);
            for (const Hit& hit : hits) {
                image.z.push_back(static_cast<float>(hit.t / glm::length(direction)));
                keys.push_back(hit.key);
            }
            image.offsets.push_back(static_cast<std::uint32_t>(keys.size()));
        }
    }
    const auto bytes = std::as_bytes(std::span(keys));
    image.extra[0].data.assign(bytes.begin(), bytes.end());
    return image;
}

struct Sphere {
    glm::dvec3 center{0};
    double radius = 1;
};

/// Returns the hits of a bundle with spheres. Hits of the n-th sphere have the key of the n-th node
/// in bodies().
inline LayeredImage sphereHits(const Bundle& bundle, const std::vector<Sphere>& spheres) {
    return rayHits(bundle, [&](const glm::dvec3& start, const glm::dvec3& direction) {
        std::vector<Hit> hits;
        for (std::size_t i = 0; i < spheres.size(); ++i) {
            const glm::dvec3 to = spheres[i].center - start;
            const double middle = glm::dot(to, direction);
            const double square =
                spheres[i].radius * spheres[i].radius - glm::dot(to, to) + middle * middle;
            if (square <= 0) continue;
            for (const double side : {-1, 1})
                hits.push_back({middle + side * std::sqrt(square), keyOf(static_cast<int>(i))});
        }
        return hits;
    });
}

/// Two bodies, two spheres that replace them, and two bundles of parallel rays.
class TracedSpheres {
  protected:
    void trace(RayOutput& output, std::span<const Bundle> bundles) const {
        output.begin(bundles, {});
        for (std::size_t i = 0; i < bundles.size(); ++i)
            output.take(i, sphereHits(bundles[i], spheres_));
        output.finish();
    }

    Scene scene_ = bodies(2);
    PosedScene shown_{scene_};
    Solids solids_{shown_};
    std::vector<Sphere> spheres_ = {{{0, 0, 0}, 1}, {{0.1, 0, 0}, 0.5}};
    Bounds box_{{-1.2, -1.1, -1}, {1.2, 1.1, 1}};
    std::vector<Bundle> bundles_ = {parallelBundle("side", box_, box_, {1, 0, 0}, {50}),
                                    parallelBundle("askew", box_, box_, {1, 2, -3}, {41})};
};

}  // namespace peeler::test
