// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/embree_layers.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <utility>

#include "core/base/parallel.h"
#include "core/scene/view.h"
#include "support/embree.h"
#include "support/triangles.h"

namespace peeler::benchmark {
namespace {

/// Triangles of the scene with the same alpha test and culling.
struct Surface {
    const Material* material = nullptr;  ///< null if the surface has no alpha test
    const Image* image = nullptr;
    bool cull = false;                   ///< whether to ignore hits of back faces
    std::vector<float> vertices{};       ///< nine floats per triangle
    std::vector<unsigned> indices{};     ///< Embree's indices, three per triangle
    std::vector<glm::vec2> texcoords{};  ///< three per triangle, for the alpha test
};

/// The hits of the rays in a packet.
struct Collector {
    test::EmbreeContext context{};      // first member, because collect() casts a pointer to it
    std::vector<EmbreeHit> hits[16]{};  // hits of each ray, by ray ID
};

float wrapped(float coordinate, int wrap) {
    constexpr int kClamp = 33071, kMirror = 33648;
    if (wrap == kClamp) return std::clamp(coordinate, 0.0F, 1.0F);
    if (wrap == kMirror) return 1 - std::abs(1 - (coordinate - 2 * std::floor(coordinate / 2)));
    return coordinate - std::floor(coordinate);
}

float alphaAt(const Surface& surface, glm::vec2 uv) {
    const TextureRef& texture = surface.material->base_color_texture;
    const Image& image = *surface.image;
    uv = glm::vec2(texture.transform * glm::vec3(uv, 1));
    const float x = wrapped(uv.x, texture.sampler.wrap_s) * static_cast<float>(image.width) - 0.5F;
    const float y = wrapped(uv.y, texture.sampler.wrap_t) * static_cast<float>(image.height) - 0.5F;
    const float fx = x - std::floor(x), fy = y - std::floor(y);
    const auto texel = [&](float column, float row) {
        const int c = std::clamp(static_cast<int>(column), 0, image.width - 1);
        const int r = std::clamp(static_cast<int>(row), 0, image.height - 1);
        return static_cast<float>(
            image.rgba[static_cast<std::size_t>(r * image.width + c) * 4 + 3]);
    };
    const float x0 = std::floor(x), y0 = std::floor(y);
    const float above = texel(x0, y0) * (1 - fx) + texel(x0 + 1, y0) * fx;
    const float below = texel(x0, y0 + 1) * (1 - fx) + texel(x0 + 1, y0 + 1) * fx;
    return (above * (1 - fy) + below * fy) / 255 * surface.material->base_color.a;
}

bool passesAlpha(const Surface& surface, unsigned primitive, float u, float v) {
    const glm::vec2* corner = &surface.texcoords[std::size_t{primitive} * 3];
    const float alpha = alphaAt(surface, (1 - u - v) * corner[0] + u * corner[1] + v * corner[2]);
    return surface.material->alpha_mode == AlphaMode::kMask
               ? alpha >= surface.material->alpha_cutoff
               : alpha > 0;
}

/// Records all hits, but rejects them, so that Embree continues along the rays.
template <bool kCull, bool kAlpha>
void collect(const RTCFilterFunctionNArguments* arguments) {
    auto* collector = reinterpret_cast<Collector*>(arguments->context);
    const auto* surface = static_cast<const Surface*>(arguments->geometryUserPtr);
    const unsigned n = arguments->N;
    RTCRayN* ray = arguments->ray;
    RTCHitN* hit = arguments->hit;
    for (unsigned i = 0; i < n; ++i) {
        if (arguments->valid[i] != -1) continue;
        arguments->valid[i] = 0;
        if constexpr (kCull) {
            const float facing = RTCRayN_dir_x(ray, n, i) * RTCHitN_Ng_x(hit, n, i) +
                                 RTCRayN_dir_y(ray, n, i) * RTCHitN_Ng_y(hit, n, i) +
                                 RTCRayN_dir_z(ray, n, i) * RTCHitN_Ng_z(hit, n, i);
            if (facing >= 0) continue;
        }
        const unsigned primitive = RTCHitN_primID(hit, n, i);
        if constexpr (kAlpha) {
            if (!passesAlpha(*surface, primitive, RTCHitN_u(hit, n, i), RTCHitN_v(hit, n, i)))
                continue;
        }
        collector->hits[RTCRayN_id(ray, n, i)].push_back(
            EmbreeHit{std::bit_cast<std::uint32_t>(RTCRayN_tfar(ray, n, i))} << 32U | primitive);
    }
}

RTCFilterFunctionN filterOf(const Surface& surface) {
    constexpr RTCFilterFunctionN kFilters[2][2] = {{collect<false, false>, collect<false, true>},
                                                   {collect<true, false>, collect<true, true>}};
    return kFilters[surface.cull ? 1 : 0][surface.material ? 1 : 0];
}

/// Rays through the sample of each pixel of a view. The length of a direction along the camera's Z
/// is 1, so hit distances are camera Z. Rays of a lens or list have length 1.
struct Rays {
    explicit Rays(const View& view)
        : of(view),
          origin(worldPosition(view, view.sample.x, view.sample.y, 0)),
          corner(worldPosition(view, view.sample.x, view.sample.y, 1) - glm::dvec3(origin)),
          near(static_cast<float>(view.projection.near)),
          far(static_cast<float>(view.projection.far)) {
        const auto stepOf = [&](double x, double y, double z) {
            return glm::vec3(worldPosition(view, view.sample.x + x, view.sample.y + y, z) -
                             worldPosition(view, view.sample.x, view.sample.y, z));
        };
        origin_step[0] = stepOf(1, 0, 0);
        origin_step[1] = stepOf(0, 1, 0);
        step[0] = stepOf(1, 0, 1) - origin_step[0];
        step[1] = stepOf(0, 1, 1) - origin_step[1];
    }

    const View& of;
    glm::vec3 origin, corner;
    glm::vec3 origin_step[2], step[2];  ///< steps to the right pixel and to the lower pixel
    float near, far;
};

template <class RayHit>
void aim(RayHit& packet, std::size_t lane, const Rays& rays, int x, int y) {
    const auto column = static_cast<float>(x), row = static_cast<float>(y);
    glm::vec3 origin = rays.origin + column * rays.origin_step[0] + row * rays.origin_step[1];
    glm::vec3 direction = rays.corner + column * rays.step[0] + row * rays.step[1];
    if (rays.of.rays) {
        const Ray ray = rayOf(rays.of, glm::dvec2(x, y) + rays.of.sample);
        origin = glm::vec3(ray.origin);
        direction = glm::vec3(ray.direction);
    }
    auto& ray = packet.ray;
    ray.org_x[lane] = origin.x;
    ray.org_y[lane] = origin.y;
    ray.org_z[lane] = origin.z;
    ray.dir_x[lane] = direction.x;
    ray.dir_y[lane] = direction.y;
    ray.dir_z[lane] = direction.z;
    ray.tnear[lane] = rays.near;
    ray.tfar[lane] = rays.far;
    ray.time[lane] = 0;
    ray.mask[lane] = 0xFFFFFFFFU;
    ray.id[lane] = static_cast<unsigned>(lane);
    ray.flags[lane] = 0;
    packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
}

/// A packet of one ray, with the member names of RTCRayHit8.
struct OneRay {
    struct {
        float org_x[1], org_y[1], org_z[1], tnear[1], dir_x[1], dir_y[1], dir_z[1], time[1],
            tfar[1];
        unsigned mask[1], id[1], flags[1];
    } ray;
    struct {
        float Ng_x[1], Ng_y[1], Ng_z[1], u[1], v[1];
        unsigned primID[1], geomID[1], instID[1][1];
    } hit;
};

void intersect(const int*, RTCScene scene, test::EmbreeContext& context, OneRay* one) {
    RTCRayHit ray{};  // RTCRayHit must be aligned to 16 bytes
    ray.ray = std::bit_cast<RTCRay>(one->ray);
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    test::intersect1(scene, context, test::RayOrder::kCoherent, &ray);
}
void intersect(const int* valid, RTCScene scene, test::EmbreeContext& context, RTCRayHit8* rays) {
    test::intersect8(valid, scene, context, test::RayOrder::kCoherent, rays);
}
void intersect(const int* valid, RTCScene scene, test::EmbreeContext& context, RTCRayHit16* rays) {
    test::intersect16(valid, scene, context, test::RayOrder::kCoherent, rays);
}

/// The hits of a strip of rows, stored like a band: one pixel's list after another.
struct Strip {
    std::vector<EmbreeHit> hits{};
    std::vector<std::uint32_t> ends{};  ///< end of each pixel's list in `hits`
};

template <class RayHit, int kColumns, int kRows>
std::uint64_t traceStrip(RTCScene scene, const Rays& rays, const Window& window,
                         const TakeHits& take) {
    static thread_local Strip strip;  // static, to keep its memory
    static thread_local Collector collector;
    collector.context = test::embreeContext(test::RayOrder::kCoherent);
    strip.hits.clear();
    strip.ends.clear();
    for (int y0 = window.y0; y0 < window.y1; y0 += kRows) {
        for (int x0 = window.x0; x0 < window.x1; x0 += kColumns) {
            alignas(64) RayHit packet;
            alignas(64) int valid[kColumns * kRows];
            for (std::size_t lane = 0; lane < std::size(valid); ++lane) {
                const int x = x0 + static_cast<int>(lane) % kColumns;
                const int y = y0 + static_cast<int>(lane) / kColumns;
                valid[lane] = x < window.x1 && y < window.y1 ? -1 : 0;
                aim(packet, lane, rays, x, y);
                collector.hits[lane].clear();
            }
            intersect(valid, scene, collector.context, &packet);
            for (std::size_t lane = 0; lane < std::size(valid); ++lane) {
                std::vector<EmbreeHit>& list = collector.hits[lane];
                std::sort(list.begin(), list.end());
                const int x = x0 + static_cast<int>(lane) % kColumns;
                const int y = y0 + static_cast<int>(lane) / kColumns;
                if (take && x < window.x1 && y < window.y1) take(x, y, list);
                strip.hits.insert(strip.hits.end(), list.begin(), list.end());
                strip.ends.push_back(static_cast<std::uint32_t>(strip.hits.size()));
            }
        }
    }
    return strip.hits.size();
}

}  // namespace

struct EmbreeLayers::State {
    RTCDevice device = rtcNewDevice(("threads=" + std::to_string(threadCount())).c_str());
    RTCScene scene = nullptr;
    std::vector<std::unique_ptr<Surface>> surfaces{};
    std::size_t triangles = 0;
    bool culls = true;  ///< whether to cull back faces of single-sided materials

    Surface& surfaceOf(const Scene& scene_file, const Material& material);
    void add(const PosedScene& posed, const MeshInstance& instance, std::size_t primitive);
};

Surface& EmbreeLayers::State::surfaceOf(const Scene& scene_file, const Material& material) {
    const bool tested = material.alpha_mode != AlphaMode::kOpaque && material.base_color_texture;
    const Material* judge = tested ? &material : nullptr;
    const bool cull = culls && !material.double_sided;
    for (const auto& surface : surfaces)
        if (surface->material == judge && surface->cull == cull) return *surface;
    auto& added = *surfaces.emplace_back(std::make_unique<Surface>());
    added.material = judge;
    added.cull = cull;
    if (tested)
        added.image =
            &scene_file.images[static_cast<std::size_t>(material.base_color_texture.image)];
    return added;
}

void EmbreeLayers::State::add(const PosedScene& posed, const MeshInstance& instance,
                              std::size_t primitive) {
    const Scene& scene_file = posed.scene();
    const Primitive& p = posed.primitives(instance)[primitive];
    const Material& material = scene_file.materials[static_cast<std::size_t>(p.material)];
    const auto& positions = posed.positions(instance, primitive);
    const auto& texcoords =
        p.texcoords[static_cast<std::size_t>(material.base_color_texture.texcoord)];
    Surface& surface = surfaceOf(scene_file, material);
    const std::size_t count = p.indices.empty() ? p.positions.size() : p.indices.size();
    const auto corner = [&](std::size_t i) {
        const std::size_t at = p.indices.empty() ? i : p.indices[i];
        const glm::dvec4 world = instance.world * glm::dvec4(glm::dvec3(positions[at]), 1);
        for (int k = 0; k < 3; ++k)
            surface.vertices.push_back(static_cast<float>(world[k]));
        surface.indices.push_back(static_cast<unsigned>(surface.indices.size()));
        if (surface.material)
            surface.texcoords.push_back(texcoords.empty() ? glm::vec2(0) : texcoords[at]);
    };
    const auto triangle = [&](std::size_t a, std::size_t b, std::size_t c) {
        corner(a);
        corner(instance.mirrored ? c : b);
        corner(instance.mirrored ? b : c);
        ++triangles;
    };
    test::forEachTriangle(p.topology, count, triangle);
}

EmbreeLayers::EmbreeLayers(const PosedScene& posed, Faces faces)
    : state_(std::make_unique<State>()) {
    state_->culls = faces == Faces::kGltf;
    for (const MeshInstance& instance : posed.meshes()) {
        for (std::size_t i = 0; i < posed.primitives(instance).size(); ++i)
            state_->add(posed, instance, i);
    }
    for (const auto& surface : state_->surfaces)
        // Embree reads 16 bytes at the last vertex, 4 bytes past its end.
        surface->vertices.push_back(0);
}

EmbreeLayers::~EmbreeLayers() {
    rtcReleaseScene(state_->scene);
    rtcReleaseDevice(state_->device);
}

std::size_t EmbreeLayers::triangles() const {
    return state_->triangles;
}

void EmbreeLayers::build() {
    if (state_->scene) rtcReleaseScene(state_->scene);
    state_->scene = rtcNewScene(state_->device);
    for (const auto& surface : state_->surfaces) {
        RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
        const std::size_t count = surface->indices.size();
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                   surface->vertices.data(), 0, 12, count);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                   surface->indices.data(), 0, 12, count / 3);
        rtcSetGeometryUserData(geometry, surface.get());
        rtcSetGeometryIntersectFilterFunction(geometry, filterOf(*surface));
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(state_->scene, geometry);
        rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(state_->scene);
}

std::uint64_t EmbreeLayers::trace(const View& view, Packet packet, const TakeHits& take) {
    constexpr int kStrip = 16;
    const Rays rays(view);
    const auto strips = static_cast<std::size_t>((view.height + kStrip - 1) / kStrip);
    const auto trace_strip = packet == Packet::k1   ? traceStrip<OneRay, 1, 1>
                             : packet == Packet::k8 ? traceStrip<RTCRayHit8, 4, 2>
                                                    : traceStrip<RTCRayHit16, 4, 4>;
    std::atomic<std::uint64_t> hits = 0;
    parallelFor(strips, [&](std::size_t i) {
        const int y0 = static_cast<int>(i) * kStrip;
        hits += trace_strip(state_->scene, rays,
                            {0, y0, view.width, std::min(view.height, y0 + kStrip)}, take);
    });
    return hits;
}

std::string EmbreeLayers::version() const {
    const auto property = [&](RTCDeviceProperty which) {
        return std::to_string(rtcGetDeviceProperty(state_->device, which));
    };
    return property(RTC_DEVICE_PROPERTY_VERSION_MAJOR) + "." +
           property(RTC_DEVICE_PROPERTY_VERSION_MINOR) + "." +
           property(RTC_DEVICE_PROPERTY_VERSION_PATCH);
}

}  // namespace peeler::benchmark
