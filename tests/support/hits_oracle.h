// SPDX-License-Identifier: Apache-2.0
// Independent oracle for the hits of bundles: Embree finds the triangles near a ray, and a test in
// double precision finds the hits.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <peeler/bundle.h>
#include "core/base/parallel.h"
#include "core/lens/picture_rays.h"
#include "core/scene/view.h"
#include "support/closed_meshes.h"
#include "support/edge_distance.h"
#include "support/embree_oracle.h"
#include "support/traced_hits.h"

namespace peeler::test {

/// A ray. The length of `direction` is the unit of `t`.
struct DoubleRay {
    glm::dvec3 origin{0}, direction{0};
};

/// Returns the `t` at which a ray meets a triangle from either side, or nothing. Edges are part of
/// the triangle.
inline std::optional<double> meetingT(const Triangle& triangle, const DoubleRay& ray) {
    const auto& [a, b, c] = triangle.corner;
    const glm::dvec3 e1 = b - a, e2 = c - a, across = glm::cross(ray.direction, e2);
    const double determinant = glm::dot(e1, across);
    const glm::dvec3 from = glm::cross(ray.origin - a, e1);
    const double u = glm::dot(ray.origin - a, across) / determinant;
    const double v = glm::dot(ray.direction, from) / determinant;
    // For an edge-on triangle, u and v are NaN, so there is no hit.
    if (!(u >= 0 && v >= 0 && u + v <= 1)) return std::nullopt;
    return glm::dot(e2, from) / determinant;
}

struct DoubleHit {
    unsigned triangle = 0;  ///< index in TriangleSoup::triangles
    double t = 0;
};

/// A finder of all hits of a ray. Embree has single precision, so it finds only candidates, in
/// boxes enlarged by more than its error.
class DoubleHits {
  public:
    explicit DoubleHits(const TriangleSoup& soup)
        : soup_(soup), device_(newEmbreeDevice()), scene_(rtcNewScene(device_)) {
        double largest = 0;
        for (const Triangle& triangle : soup.triangles)
            for (const glm::dvec3& corner : triangle.corner)
                for (int axis = 0; axis < 3; ++axis)
                    largest = std::max(largest, std::abs(corner[axis]));
        room_ = 1e-5 * largest;
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(soup.triangles.size()));
        rtcSetGeometryUserData(geometry, this);
        rtcSetGeometryBoundsFunction(geometry, &DoubleHits::bound, nullptr);
        rtcSetGeometryIntersectFunction(geometry, &DoubleHits::meet);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }
    ~DoubleHits() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    DoubleHits(const DoubleHits&) = delete;
    DoubleHits& operator=(const DoubleHits&) = delete;

    /// Returns the hits in front of the origin, sorted by triangle. Thread-safe.
    std::vector<DoubleHit> operator()(const DoubleRay& ray) const {
        Query query{embreeContext(RayOrder::kIncoherent), ray, {}};
        RTCRayHit near{};
        near.ray = embreeRay(ray.origin, ray.direction);
        near.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        intersect1(scene_, query.context, RayOrder::kIncoherent, &near);
        std::ranges::sort(query.hits, {}, &DoubleHit::triangle);
        return std::move(query.hits);
    }

  private:
    struct Query {
        EmbreeContext context;  // first member, because meet() casts a pointer to it
        DoubleRay ray;
        std::vector<DoubleHit> hits;
    };
    static void bound(const RTCBoundsFunctionArguments* arguments) {
        const auto& self = *static_cast<const DoubleHits*>(arguments->geometryUserPtr);
        const auto& [a, b, c] = self.soup_.triangles[arguments->primID].corner;
        const glm::vec3 lower(glm::min(glm::min(a, b), c) - self.room_),
            upper(glm::max(glm::max(a, b), c) + self.room_);
        RTCBounds& box = *arguments->bounds_o;
        box.lower_x = lower.x;
        box.lower_y = lower.y;
        box.lower_z = lower.z;
        box.upper_x = upper.x;
        box.upper_y = upper.y;
        box.upper_z = upper.z;
    }
    static void meet(const RTCIntersectFunctionNArguments* arguments) {
        if (!arguments->valid[0]) return;
        const auto& self = *static_cast<const DoubleHits*>(arguments->geometryUserPtr);
        auto& query = *reinterpret_cast<Query*>(arguments->context);
        const unsigned triangle = arguments->primID;
        // Embree reports all hits, because `tfar` stays the same.
        const auto t = meetingT(self.soup_.triangles[triangle], query.ray);
        // The box of a triangle behind the origin may contain the origin.
        if (t && *t >= 0) query.hits.push_back({triangle, *t});
    }

    const TriangleSoup& soup_;
    RTCDevice device_;
    RTCScene scene_;
    double room_ = 0;
};

/// The agreement between the hits of a source and those of the oracle.
struct HitAgreement {
    std::size_t rays = 0, hits = 0;
    std::size_t differing = 0;  ///< rays with a different number of hits
    std::size_t elsewhere = 0;  ///< rays with a different number of hits or different triangles
    /// The greatest distance, in ray spacings, from a ray in `elsewhere` to the nearest edge of a
    /// triangle that only the source or only the oracle hits.
    double farthest = 0;
    double largest_error = 0;  ///< maximum error of Z, relative to the scene's size

    void add(const HitAgreement& other) {
        rays += other.rays;
        hits += other.hits;
        differing += other.differing;
        elsewhere += other.elsewhere;
        farthest = std::max(farthest, other.farthest);
        largest_error = std::max(largest_error, other.largest_error);
    }
    void print(const std::string& name) const {
        std::printf(
            "%s: %zu rays, %zu hits, %zu rays differ in number (%.5f %%), those and %zu that hit "
            "other triangles are at most %.3g rays from an edge; largest error of t %.2g of the "
            "size\n",
            name.c_str(), rays, hits, differing,
            100.0 * static_cast<double>(differing) / static_cast<double>(rays),
            elsewhere - differing, farthest, largest_error);
    }
};

/// Returns the scene without alpha tests, because the oracle does not read textures.
inline Scene withoutAlpha(Scene scene) {
    for (Material& material : scene.materials)
        material.alpha_mode = AlphaMode::kOpaque;
    return scene;
}

/// A comparison of a source's hits with the oracle's. The scene may have only triangles.
class HitsOracle {
  public:
    explicit HitsOracle(const PosedScene& posed)
        : soup_(soupOf(posed.scene())), hits_(soup_), box_(posed.bounds().value()) {}

    double size() const { return glm::length(box_.max - box_.min); }

    HitAgreement compare(HitSource& source, const View& view) const {
        const TracedHits traced = trace(source, view);
        HitAgreement all;
        std::mutex mutex;
        parallelFor(static_cast<std::size_t>(view.crop.height()), [&](std::size_t row) {
            HitAgreement part;
            for (int x = view.crop.x0; x < view.crop.x1; ++x)
                compareRay(traced, view, x, view.crop.y0 + static_cast<int>(row), part);
            const std::lock_guard lock(mutex);
            all.add(part);
        });
        return all;
    }

    /// Returns the views of parallel bundles, one of them along an axis, and of a pinhole in front
    /// of the scene.
    std::vector<View> views(int directions, int resolution) const {
        std::vector<View> views;
        auto along = sphereDirections(directions);
        along.emplace_back(0, 0, -1);
        for (const glm::dvec3& direction : along)
            views.push_back(parallelBundle("b", box_, box_, direction, {resolution}).view);
        const glm::dvec3 middle = 0.5 * (box_.min + box_.max), toward(-0.5, -0.3, -0.8);
        View eye;
        eye.camera_to_world =
            *lookAlong(middle - 0.8 * size() * glm::normalize(toward), toward, {0.1, 1, 0.2});
        eye.width = eye.height = resolution;
        eye.crop = {0, 0, resolution, resolution};
        eye.projection.half_width = eye.projection.half_height = 0.7;
        eye.projection.near = 0.01 * size();
        views.push_back(eye);
        return views;
    }

    /// Returns the views of lenses in front of the scene and in its middle, and of a moving camera.
    std::vector<View> lensViews(int resolution) const {
        const glm::dvec3 middle = 0.5 * (box_.min + box_.max), toward(-0.5, -0.3, -0.8);
        View view;
        view.camera_to_world =
            *lookAlong(middle - 0.6 * size() * glm::normalize(toward), toward, {0.1, 1, 0.2});
        view.projection.near = 0;
        std::vector<View> views;
        const auto add = [&](const Lens& lens, double focal, const Size& picture) {
            view.width = picture.width;
            view.height = picture.height;
            view.crop = {0, 0, picture.width, picture.height};
            const glm::dvec2 centre(picture.width / 2.0 - 0.3, picture.height / 2.0 + 0.2);
            view.rays = lensPicture({lens, {focal, 1.01 * focal, centre.x, centre.y}}, picture);
            views.push_back(view);
        };
        const Size square{resolution, resolution};
        add({"opencv-fisheye", {0.02, -0.01, 0.002, 0}}, resolution / 2.2, square);
        add({"opencv", {-0.2, 0.05, 1e-3, -1e-3, 0}}, resolution / 1.2, square);
        views.push_back(views.back());
        glm::dmat4 end = view.camera_to_world;
        end[3] += 0.2 * size() * end[0];
        views.back().rays = shutterPicture(view.rays, {view.camera_to_world, end}, square.height);
        views.back().camera_to_world = glm::dmat4(1);
        view.camera_to_world[3] = glm::dvec4(middle, 1);
        add({"equirectangular"}, 1, {2 * resolution, resolution});
        return views;
    }

  private:
    void compareRay(const TracedHits& traced, const View& view, int x, int y,
                    HitAgreement& agreement) const {
        const LayeredImage& image = traced.image;
        const glm::dvec2 at = glm::dvec2(x, y) + view.sample;
        const auto [origin, direction] = rayOf(view, at);
        const DoubleRay ray{origin, direction};  // its `t` is LayeredImage::z
        const std::vector<DoubleHit> expected = hits_(ray);
        const std::size_t pixel = image.pixelIndex(x, y);
        struct Found {
            unsigned triangle = 0;
            float z = 0;
        };
        const auto keys = image.extra.front().as<const std::uint32_t>();
        std::vector<Found> found;
        for (std::uint32_t f = image.offsets[pixel]; f < image.offsets[pixel + 1]; ++f)
            found.push_back({keys[f] - 1, image.z[f]});  // a key is the triangle's number, from 1
        std::ranges::sort(found, {}, &Found::triangle);
        ++agreement.rays;
        agreement.hits += found.size();
        if (found.size() != expected.size()) ++agreement.differing;
        bool same = true;
        const auto missed = [&](unsigned triangle) {
            same = false;
            agreement.farthest =
                std::max(agreement.farthest, raysToEdge(soup_.triangles[triangle], view, at));
        };
        auto hit = found.begin();
        for (const DoubleHit& want : expected) {
            for (; hit != found.end() && hit->triangle < want.triangle; ++hit)
                missed(hit->triangle);
            if (hit == found.end() || hit->triangle != want.triangle) {
                missed(want.triangle);
                continue;
            }
            agreement.largest_error =
                std::max(agreement.largest_error, std::abs(double{hit->z} - want.t) / size());
            ++hit;
        }
        for (; hit != found.end(); ++hit)
            missed(hit->triangle);
        if (!same) ++agreement.elsewhere;
    }

    static double raysToEdge(const Triangle& triangle, const View& view, const glm::dvec2& at) {
        if (view.rays) {
            const auto [origin, direction] = rayOf(view, at);
            const glm::dvec3 next = rayOf(view, at + glm::dvec2(1, 0)).direction;
            return angleToEdges(triangle.corner, origin, direction) / glm::length(next - direction);
        }
        const PixelRays rays(view);
        const glm::dmat4 camera_from_world = glm::inverse(view.camera_to_world);
        glm::dvec2 outline[3];
        for (std::size_t i = 0; i < 3; ++i)
            outline[i] =
                rays.pixel(glm::dvec3(camera_from_world * glm::dvec4(triangle.corner[i], 1)));
        return distanceToEdges(outline, at);
    }

    TriangleSoup soup_;
    DoubleHits hits_;
    Bounds box_;
};

/// Returns disconnected triangles of any shape at random positions.
inline Scene randomTriangles(unsigned seed, int count) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> place(-1, 1), extent(-0.4F, 0.4F);
    const auto point = [&](auto& along) {
        const float x = along(random), y = along(random), z = along(random);
        return glm::vec3(x, y, z);
    };
    Primitive primitive;
    for (int i = 0; i < count; ++i) {
        const glm::vec3 center = point(place);
        for (int k = 0; k < 3; ++k)
            primitive.positions.push_back(center + point(extent));
    }
    return sceneOf({{"", {primitive}}});
}

/// Returns the scene with a second copy of every root and of all nodes below it, because a node may
/// have only one parent.
inline Scene doubled(Scene scene) {
    const std::vector<int> roots = scene.scenes.front().roots;
    const auto copy = [&](const auto& self, int node) -> int {
        Node again = scene.nodes[static_cast<std::size_t>(node)];
        for (int& child : again.children)
            child = self(self, child);
        scene.nodes.push_back(again);
        return static_cast<int>(scene.nodes.size()) - 1;
    };
    for (const int root : roots)
        scene.scenes.front().roots.push_back(copy(copy, root));
    return scene;
}

/// Expects every ray to have each hit twice, at the same Z.
inline void expectTwiceTheHits(const LayeredImage& once, const LayeredImage& twice) {
    ASSERT_EQ(2 * once.fragments(), twice.fragments());
    for (std::size_t p = 0; p < once.window.pixels(); ++p) {
        ASSERT_EQ(2 * once.count(p), twice.count(p)) << "ray " << p;
        for (std::uint32_t k = 0; k < twice.count(p); ++k)
            ASSERT_EQ(twice.z[twice.offsets[p] + k], once.z[once.offsets[p] + k / 2])
                << "ray " << p;
    }
}

}  // namespace peeler::test
