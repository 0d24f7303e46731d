// SPDX-License-Identifier: Apache-2.0
// Independent oracle: all hits of a ray with a scene's triangles, found by Embree.
#pragma once

#include <algorithm>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

#include "core/scene/posed_scene.h"
#include "support/embree.h"
#include "support/triangles.h"

namespace peeler::test {

struct Triangle {
    glm::dvec3 corner[3];
};

struct TriangleSoup {
    std::vector<Triangle> triangles;
    std::vector<float> vertices;      // nine floats per triangle
    std::vector<char> culled_behind;  // per triangle: whether only the front face can be hit
};

/// Returns the triangles of a scene in world space. Strips and fans become single triangles.
inline TriangleSoup soupOf(const Scene& scene) {
    TriangleSoup soup;
    const PosedScene shown(scene);
    for (const MeshInstance& instance : shown.meshes()) {
        const bool mirrored = instance.mirrored;
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
        for (std::size_t j = 0; j < mesh.primitives.size(); ++j) {
            const Primitive& p = mesh.primitives[j];
            const auto& positions = shown.positions(instance, j);
            const Material& m = scene.materials[static_cast<std::size_t>(p.material)];
            const std::size_t count = p.indices.empty() ? p.positions.size() : p.indices.size();
            const auto corner = [&](std::size_t i) {
                const std::size_t at = p.indices.empty() ? i : p.indices[i];
                return glm::dvec3(instance.world * glm::dvec4(glm::dvec3(positions[at]), 1));
            };
            const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
                Triangle t{{corner(a), corner(mirrored ? c : b), corner(mirrored ? b : c)}};
                for (const auto& v : t.corner)
                    for (int k = 0; k < 3; ++k)
                        soup.vertices.push_back(static_cast<float>(v[k]));
                soup.triangles.push_back(t);
                soup.culled_behind.push_back(!m.double_sided);
            };
            forEachTriangle(p.topology, count, add);
        }
    }
    return soup;
}

/// An Embree scene of triangles.
class EmbreeScene {
  public:
    explicit EmbreeScene(const TriangleSoup& soup, RTCFilterFunctionN filter = nullptr,
                         RTCSceneFlags flags = RTC_SCENE_FLAG_ROBUST)
        : device_(newEmbreeDevice()), scene_(rtcNewScene(device_)) {
        rtcSetSceneFlags(scene_, flags);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        const std::size_t count = soup.triangles.size();
        auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, count * 3));
        std::copy(soup.vertices.begin(), soup.vertices.end(), vertices);
        auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, count));
        for (std::size_t i = 0; i < count * 3; ++i)
            indices[i] = static_cast<unsigned>(i);
        rtcSetGeometryIntersectFilterFunction(geometry, filter);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }
    ~EmbreeScene() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    operator RTCScene() const { return scene_; }

  private:
    RTCDevice device_;
    RTCScene scene_;
};

inline RTCRay embreeRay(const glm::vec3& origin, const glm::vec3& direction) {
    RTCRay ray{};
    ray.org_x = origin.x;
    ray.org_y = origin.y;
    ray.org_z = origin.z;
    ray.dir_x = direction.x;
    ray.dir_y = direction.y;
    ray.dir_z = direction.z;
    ray.tfar = std::numeric_limits<float>::infinity();
    ray.mask = 0xFFFFFFFFU;
    return ray;
}

struct OracleHit {
    float t = 0;
    unsigned triangle = 0;  ///< index in TriangleSoup::triangles
};

/// A finder of all hits of a ray, in any order.
class AllHits {
  public:
    explicit AllHits(const TriangleSoup& soup, RTCSceneFlags flags = RTC_SCENE_FLAG_ROBUST)
        : soup_(soup), scene_(soup, &AllHits::filter, flags) {}
    AllHits(const AllHits&) = delete;
    AllHits& operator=(const AllHits&) = delete;

    /// Returns the distances of hits along the ray, in any order; in scene units if `direction` is
    /// a unit vector. With `cull`, ignores back faces of single-sided surfaces. Thread-safe.
    std::vector<float> operator()(const glm::dvec3& origin, const glm::dvec3& direction,
                                  bool cull) const {
        std::vector<float> t;
        for (const OracleHit& hit : hits(origin, direction, cull))
            t.push_back(hit.t);
        return t;
    }

    std::vector<OracleHit> hits(const glm::dvec3& origin, const glm::dvec3& direction,
                                bool cull = false) const {
        Collector collector{embreeContext(RayOrder::kIncoherent)};
        collector.soup = &soup_;
        collector.cull = cull;
        RTCRayHit ray{};
        ray.ray = embreeRay(origin, direction);
        ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        intersect1(scene_, collector.context, RayOrder::kIncoherent, &ray);
        return collector.hits;
    }

  private:
    struct Collector {
        EmbreeContext context;  // first member, because the filter casts a pointer to it
        const TriangleSoup* soup = nullptr;
        bool cull = false;
        std::vector<OracleHit> hits{};
    };
    static void filter(const RTCFilterFunctionNArguments* arguments) {
        auto* collector = reinterpret_cast<Collector*>(arguments->context);
        const auto* ray = reinterpret_cast<const RTCRay*>(arguments->ray);
        const auto* hit = reinterpret_cast<const RTCHit*>(arguments->hit);
        arguments->valid[0] = 0;  // Embree continues with the next hit
        const float facing =
            ray->dir_x * hit->Ng_x + ray->dir_y * hit->Ng_y + ray->dir_z * hit->Ng_z;
        if (collector->cull && collector->soup->culled_behind[hit->primID] && facing >= 0) return;
        collector->hits.push_back({ray->tfar, hit->primID});
    }

    const TriangleSoup& soup_;
    EmbreeScene scene_;
};

}  // namespace peeler::test
