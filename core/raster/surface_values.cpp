// SPDX-License-Identifier: Apache-2.0
#include "core/raster/surface_values.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <peeler/error.h>
#include "core/base/color.h"
#include "core/base/parallel.h"
#include "core/fragments/surface_channels.h"
#include "core/image/channels.h"
#include "core/raster/surface_points.h"
#include "core/scene/elements.h"
#include "core/scene/material.h"
#include "core/scene/view.h"

namespace peeler {
namespace {

constexpr int kNearest = 9728, kClampToEdge = 33071, kMirroredRepeat = 33648;

/// Rounds down. std::floor is a function call on processors without SSE 4.1.
double roundedDown(double value) {
    if (!(std::abs(value) < 1e9)) return std::floor(value);
    const auto whole = static_cast<double>(static_cast<std::int32_t>(value));
    return whole > value ? whole - 1 : whole;
}

/// Applies the sampler's wrap mode to a texel coordinate, which must be whole.
int wrapped(double texel, int size, int wrap) {
    if (texel >= 0 && texel < size) return static_cast<int>(texel);
    if (wrap == kClampToEdge)
        return static_cast<int>(std::clamp(texel, 0.0, static_cast<double>(size - 1)));
    const double period = wrap == kMirroredRepeat ? 2.0 * size : size;
    const auto at = static_cast<int>(texel - period * std::floor(texel / period));
    if (wrap == kMirroredRepeat && at >= size) return std::max(0, 2 * size - 1 - at);
    return std::min(at, size - 1);
}

const std::array<double, 256>& decoded(bool srgb) {
    static const auto kTables = [] {
        std::array<std::array<double, 256>, 2> tables{};
        for (std::size_t i = 0; i < 256; ++i) {
            tables[0][i] = static_cast<double>(i) / 255;
            tables[1][i] = linearFromSrgb(tables[0][i]);
        }
        return tables;
    }();
    return kTables[srgb ? 1 : 0];
}

/// The place of a texel in Image::rgba.
std::size_t texelIndex(const Image& image, int x, int y) {
    return 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                static_cast<std::size_t>(x));
}

/// Returns the place in the image of a point of its UV set.
glm::dvec2 placeIn(const TextureRef& texture, const glm::dvec2& uv) {
    return glm::dvec2(glm::dmat3(texture.transform) * glm::dvec3(uv, 1));
}

/// Samples an image at a place; read(x, y) returns the values of a texel.
template <class Read>
auto sampled(const Image& image, const Sampler& sampler, const glm::dvec2& place, bool nearest,
             Read&& read) {
    glm::dvec2 at(place.x * image.width, place.y * image.height);
    if (!std::isfinite(at.x) || !std::isfinite(at.y)) at = glm::dvec2(0);
    if (nearest) {
        return read(wrapped(roundedDown(at.x), image.width, sampler.wrap_s),
                    wrapped(roundedDown(at.y), image.height, sampler.wrap_t));
    }
    at -= 0.5;
    const glm::dvec2 low(roundedDown(at.x), roundedDown(at.y)), share = at - low;
    const int x0 = wrapped(low.x, image.width, sampler.wrap_s);
    const int x1 = wrapped(low.x + 1, image.width, sampler.wrap_s);
    const int y0 = wrapped(low.y, image.height, sampler.wrap_t);
    const int y1 = wrapped(low.y + 1, image.height, sampler.wrap_t);
    const auto above = (1 - share.x) * read(x0, y0) + share.x * read(x1, y0);
    const auto below = (1 - share.x) * read(x0, y1) + share.x * read(x1, y1);
    return (1 - share.y) * above + share.y * below;
}

}  // namespace

glm::dvec4 texelIn(const Image& image, const Sampler& sampler, const glm::dvec2& at, bool nearest,
                   bool srgb) {
    const auto &color = decoded(srgb), &linear = decoded(false);
    return sampled(image, sampler, at, nearest, [&](int x, int y) {
        const std::uint8_t* const rgba = image.rgba.data() + texelIndex(image, x, y);
        return glm::dvec4(color[rgba[0]], color[rgba[1]], color[rgba[2]], linear[rgba[3]]);
    });
}

glm::dvec4 texelAt(const Image& image, const TextureRef& texture, const glm::dvec2& uv, bool srgb) {
    return texelIn(image, texture.sampler, placeIn(texture, uv),
                   texture.sampler.mag_filter == kNearest, srgb);
}

double alphaAt(const Image& image, const TextureRef& texture, const glm::dvec2& uv) {
    const auto& linear = decoded(false);
    return sampled(image, texture.sampler, placeIn(texture, uv),
                   texture.sampler.mag_filter == kNearest,
                   [&](int x, int y) { return linear[image.rgba[texelIndex(image, x, y) + 3]]; });
}

Window texelsAround(const Image& image, const TextureRef& texture,
                    std::span<const glm::dvec2> corners) {
    constexpr double kMost = 1e9;  // with a larger term, rounding could exceed the margin below
    const glm::dmat3 transform(texture.transform);
    std::array<glm::dvec2, 2> ends{glm::dvec2(kMost), glm::dvec2(-kMost)};
    glm::dvec2 most_term(0);
    const glm::dvec2 size(image.width, image.height);
    for (const glm::dvec2& uv : corners) {
        const glm::dvec2 x = glm::dvec2(transform[0]) * uv.x * size,
                         y = glm::dvec2(transform[1]) * uv.y * size,
                         z = glm::dvec2(transform[2]) * size;
        ends = {glm::min(ends[0], x + y + z), glm::max(ends[1], x + y + z)};
        most_term += glm::abs(x) + glm::abs(y) + glm::abs(z);
    }
    // Returns the first and the last texel of an axis. A filter reads the texels within half a
    // texel of a point; half a texel more allows for rounding.
    const auto range = [&](int axis, int length, int wrap) -> std::pair<int, int> {
        const std::pair<int, int> all{0, length - 1};
        if (!(most_term[axis] < kMost)) return all;
        const double first = std::floor(ends[0][axis] - 1), last = std::floor(ends[1][axis] + 1);
        if (wrap != kClampToEdge && std::floor(first / length) != std::floor(last / length))
            return all;
        return std::minmax({wrapped(first, length, wrap), wrapped(last, length, wrap)});
    };
    const auto [x0, x1] = range(0, image.width, texture.sampler.wrap_s);
    const auto [y0, y1] = range(1, image.height, texture.sampler.wrap_t);
    return {x0, y0, x1 + 1, y1 + 1};
}

namespace {

/// Returns the normal without a normal map (shaders/normal.glsl).
glm::dvec3 interpolatedNormal(const SurfacePoint& point) {
    const WorldElement& element = point.element;
    const auto& normals = point.posed.normals(point.geometry());
    if (!normals.empty()) {
        const glm::dvec3 normal =
            normalMatrix(glm::dmat3(element.instance->world)) * point.mean(normals);
        const double size = glm::length(normal);
        if (size > 0) return point.side / size * normal;
    }
    const double size = glm::length(point.facet);
    return size > 0 ? point.facet / size : -glm::normalize(point.direction);
}

/// Returns the directions of U and V (V up the image) in the plane perpendicular to `normal`. Works
/// like shaders/normal.glsl, but with the triangle's edges instead of screen-space derivatives.
std::pair<glm::dvec3, glm::dvec3> tangentFrame(const SurfacePoint& point, const TextureRef& texture,
                                               const glm::dvec3& normal) {
    const WorldElement& element = point.element;
    const auto& tangents = point.posed.tangents(point.geometry());
    if (!tangents.empty() && !element.primitive->normals.empty()) {
        const glm::dvec4 mean = point.mean(tangents);
        glm::dvec3 tangent = glm::dmat3(element.instance->world) * glm::dvec3(mean);
        const double size = glm::length(tangent);
        tangent *= size > 0 ? point.side / size : 0;
        const double handedness = element.instance->mirrored ? -mean.w : mean.w;
        return {tangent, point.side * handedness * glm::cross(normal, tangent)};
    }
    const auto& texcoords = point.texcoords(texture.texcoord);
    if (texcoords.empty()) return {glm::dvec3(0), glm::dvec3(0)};
    const auto& vertex = element.corners.vertex;
    const glm::dvec3 p1 = element.corner[1] - element.corner[0];
    const glm::dvec3 p2 = element.corner[2] - element.corner[0];
    const glm::dmat2 turn = glm::dmat2(glm::dmat3(texture.transform));
    const glm::dvec2 uv0(texcoords[vertex[0]]);
    const glm::dvec2 uv1 = turn * (glm::dvec2(texcoords[vertex[1]]) - uv0);
    const glm::dvec2 uv2 = turn * (glm::dvec2(texcoords[vertex[2]]) - uv0);
    // Chooses the signs as if p1 pointed right and p2 up in the picture, like the shader's
    // derivatives.
    const double turned = glm::dot(glm::cross(p1, p2), point.facet) < 0 ? -1 : 1;
    const glm::dvec3 across_2 = turned * glm::cross(p2, normal);
    const glm::dvec3 across_1 = turned * glm::cross(normal, p1);
    glm::dvec3 tangent = across_2 * uv1.x + across_1 * uv2.x;
    glm::dvec3 bitangent = -(across_2 * uv1.y + across_1 * uv2.y);
    const double scale = std::max(glm::dot(tangent, tangent), glm::dot(bitangent, bitangent));
    const double facing = glm::dot(normal, point.facet) < 0 ? -point.side : point.side;
    const double factor = scale > 0 ? facing / std::sqrt(scale) : 0;
    return {factor * tangent, factor * bitangent};
}

// Each function writes the components of one channel.

void shadingNormal(const SurfacePoint& point, float* out) {
    glm::dvec3 normal = interpolatedNormal(point);
    const Material& material = point.material;
    if (const TextureRef& texture = material.normal_texture) {
        glm::dvec3 mapped = glm::dvec3(point.textured(texture, false)) * 2.0 - 1.0;
        mapped.x *= double{material.normal_scale};
        mapped.y *= double{material.normal_scale};
        const auto [tangent, bitangent] = tangentFrame(point, texture, normal);
        const glm::dvec3 bent = tangent * mapped.x + bitangent * mapped.y + normal * mapped.z;
        if (const double size = glm::length(bent); size > 0) normal = bent / size;
    }
    for (int i = 0; i < 3; ++i)
        out[i] = static_cast<float>(normal[i]);
}

void texcoords(const SurfacePoint& point, float* out) {
    const glm::dvec2 uv = point.texcoord(0);
    out[0] = static_cast<float>(uv.x);
    out[1] = static_cast<float>(uv.y);
}

/// Writes the direction of increasing U, and the sign with which cross(normal, tangent) points up
/// the image (surfaceTangent() of shaders/channels.frag).
void tangentOf(const SurfacePoint& point, float* out) {
    const glm::dvec3 normal = interpolatedNormal(point);
    const auto [tangent, bitangent] = tangentFrame(point, point.material.normal_texture, normal);
    const double size = glm::length(tangent);
    const glm::dvec3 unit = size > 0 ? point.side / size * tangent : glm::dvec3(0);
    const double up = glm::dot(glm::cross(normal, unit), bitangent);
    const double sign = up > 0 ? 1 : up < 0 ? -1 : 0;
    for (int i = 0; i < 3; ++i)
        out[i] = static_cast<float>(unit[i]);
    out[3] = static_cast<float>(size > 0 ? point.side * sign : 0);
}

/// Returns the base colour with straight alpha.
glm::dvec4 baseColorOf(const SurfacePoint& point) {
    const Material& material = point.material;
    glm::dvec4 color =
        glm::dvec4(material.base_color) * point.textured(material.base_color_texture, true);
    const auto& colors = point.posed.colors(point.geometry());
    if (!colors.empty()) color *= point.mean(colors);
    return color;
}

void baseColor(const SurfacePoint& point, float* out) {
    const glm::dvec4 color = baseColorOf(point);
    for (int i = 0; i < 3; ++i)
        out[i] = static_cast<float>(color[i]);
}

/// Multiplies the base colour by the volume's tint, and returns the transmitted fraction of light
/// (passingLight() of shaders/transmission.glsl).
double passingLight(const SurfacePoint& point, glm::dvec3& base) {
    const Material& material = point.material;
    const Transmission& glass = material.transmission;
    if (glass.thickness > 0 && glass.attenuation_distance > 0) {
        const glm::dmat3 to_world(point.element.instance->world);
        const double thickness = double{glass.thickness} *
                                 point.textured(glass.thickness_texture, false).g *
                                 std::cbrt(std::abs(glm::determinant(to_world)));
        const glm::dvec3 left = glm::max(glm::dvec3(glass.attenuation_color), 1e-6);
        base *= glm::pow(left, glm::dvec3(thickness / double{glass.attenuation_distance}));
    }
    double metallic = 0;
    if (!material.specular_glossiness)
        metallic = double{material.metallic} *
                   point.textured(material.metallic_roughness_texture, false).b;
    const glm::dvec3 tint = glm::clamp(base, 0.0, 1.0);
    const double share = double{glass.factor} * point.textured(glass.texture, false).r;
    return std::clamp(share * (1 - metallic) * (tint.r + tint.g + tint.b) / 3, 0.0, 1.0);
}

/// Returns the premultiplied colour without light (fragmentColor() of shaders/shade.glsl).
glm::vec4 unlitColor(const SurfacePoint& point) {
    const Material& material = point.material;
    const glm::dvec4 base = baseColorOf(point);
    glm::dvec3 rgb(base);
    const double alpha =
        material.alpha_mode == AlphaMode::kBlend ? std::clamp(base.a, 0.0, 1.0) : 1;
    const double left = isTransmissive(material) ? 1 - passingLight(point, rgb) : 1;
    constexpr double kMostHalf = 65504;
    return {glm::clamp(rgb * left * alpha, 0.0, kMostHalf), alpha * left};
}

void emissive(const SurfacePoint& point, float* out) {
    const Material& material = point.material;
    const glm::dvec3 color =
        glm::dvec3(material.emissive) * glm::dvec3(point.textured(material.emissive_texture, true));
    for (int i = 0; i < 3; ++i)
        out[i] = static_cast<float>(color[i]);
}

void roughnessMetallic(const SurfacePoint& point, float* out) {
    const Material& material = point.material;
    double roughness = 0, metallic = 0;
    if (const auto& gloss = material.specular_glossiness) {
        roughness = 1 - double{gloss->glossiness} * point.textured(gloss->texture, true).a;
    } else {
        const glm::dvec4 texel = point.textured(material.metallic_roughness_texture, false);
        roughness = double{material.roughness} * texel.g;
        metallic = double{material.metallic} * texel.b;
    }
    out[0] = static_cast<float>(std::clamp(roughness, 0.0, 1.0));
    out[1] = static_cast<float>(std::clamp(metallic, 0.0, 1.0));
}

using EvaluateSurface = void (*)(const SurfacePoint&, float*);

/// The other channels are computed from Z and primitive, or are not supported.
constexpr std::pair<Channel, EvaluateSurface> kSurfaceChannels[] = {
    {Channel::kNormal, shadingNormal}, {Channel::kUv, texcoords},
    {Channel::kTangent, tangentOf},    {Channel::kBaseColor, baseColor},
    {Channel::kEmissive, emissive},    {Channel::kRoughnessMetallic, roughnessMetallic},
};

EvaluateSurface evaluatorOf(Channel channel) {
    for (const auto& [one, evaluate] : kSurfaceChannels)
        if (one == channel) return evaluate;
    return nullptr;
}

/// Calls use(i, point) for each hit of a pixel's ray. `keys`: those of the hits.
template <class Use>
void forEachPoint(const PosedScene& posed, const View& view, const glm::ivec2& pixel,
                  std::span<const std::uint32_t> keys, const TextureLevels* levels, Use&& use) {
    if (keys.empty()) return;
    const glm::dvec2 at = glm::dvec2(pixel) + view.sample;
    const Ray ray = rayOf(view, at);
    RayDifferentials change;
    if (levels) change = differentialsOf(view, at);
    for (std::size_t i = 0; i < keys.size(); ++i) {
        WorldElement element = elementOf(posed, keys[i]);
        placeCorners(posed, element);
        use(i, surfacePoint(posed, element, ray, levels ? &change : nullptr, levels));
    }
}

}  // namespace

void checkHitSettings(const CaptureSettings& settings) {
    if (settings.hit_mode == HitMode::kNone || settings.composite || settings.samples > 1 ||
        settings.max_layers != 0 || settings.occlusion_ratio > 0 || settings.clip.active() ||
        settings.opaque_only || settings.surfaces != Surfaces::kAll) {
        throw Error(ErrorKind::kInternal, "the ray tracer does not support these capture settings");
    }
}

std::vector<float> surfaceValues(const PosedScene& posed, const View& view,
                                 const LayeredImage& band, std::span<const std::uint32_t> keys,
                                 std::span<const Channel> channels, const TextureLevels* levels) {
    struct Column {
        EvaluateSurface evaluate;
        std::size_t first;
    };
    std::vector<Column> columns;
    std::size_t floats = 0;
    for (const Channel channel : channels) {
        if (infoOf(channel).definition.empty()) continue;
        columns.push_back({evaluatorOf(channel), floats});
        floats += infoOf(channel).components.size();
    }
    std::vector<float> values(floats * keys.size());
    const auto width = static_cast<std::size_t>(band.window.width());
    parallelFor(static_cast<std::size_t>(band.window.height()), [&](std::size_t row) {
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t pixel = row * width + x, first = band.offsets[pixel];
            const glm::ivec2 at(band.window.x0 + static_cast<int>(x),
                                band.window.y0 + static_cast<int>(row));
            forEachPoint(posed, view, at, keys.subspan(first, band.count(pixel)), levels,
                         [&](std::size_t i, const SurfacePoint& point) {
                             for (const Column& column : columns)
                                 column.evaluate(
                                     point, values.data() + (first + i) * floats + column.first);
                         });
        }
    });
    return values;
}

void fillHitChannels(const PosedScene& posed, const View& view, std::span<const Channel> channels,
                     PixelType color_type, LayeredImage& band, const TextureLevels* levels,
                     const NextFrame* next) {
    const std::span<const std::uint32_t> keys = band.extra.front().as<std::uint32_t>();
    FragmentSources sources{posed, view, next, keys, {}, nullptr};
    std::vector<float> values;
    std::vector<std::uint32_t> places;
    if (shadedComponents(channels) > 0) {
        values = surfaceValues(posed, view, band, keys, channels, levels);
        places.resize(keys.size());
        std::iota(places.begin(), places.end(), 0U);
        sources.shaded = places;
        sources.values = values.data();
    }
    const PixelType before = std::exchange(band.color.type, color_type);
    fillChannels(sources, channels, band, std::span(band.extra).subspan(1));
    band.color.type = before;
}

SurfaceColors::SurfaceColors(PosedScene posed)
    : posed_(std::move(posed)), levels_(std::make_unique<TextureLevels>(posed_.scene())) {}

void SurfaceColors::ofRay(const View& view, const glm::ivec2& pixel,
                          std::span<const std::uint32_t> keys, std::span<glm::vec4> colors) const {
    forEachPoint(posed_, view, pixel, keys, levels_.get(),
                 [&](std::size_t i, const SurfacePoint& point) { colors[i] = unlitColor(point); });
}

void SurfaceColors::ofRay(const View& view, const glm::ivec2& pixel, const LayeredImage& band,
                          std::size_t first, std::span<glm::vec4> colors) const {
    const auto keys = band.extra.front().as<std::uint32_t>().subspan(first, colors.size());
    if (band.color.data.empty()) return ofRay(view, pixel, keys, colors);
    std::ranges::copy(band.color.as<glm::vec4>().subspan(first, colors.size()), colors.begin());
    for (std::size_t i = 0; i < colors.size(); ++i)
        if (colors[i].a == 0) ofRay(view, pixel, keys.subspan(i, 1), colors.subspan(i, 1));
}

void SurfaceColors::addTo(const View& view, LayeredImage& band) const {
    const std::span<const std::uint32_t> keys = band.extra.front().as<std::uint32_t>();
    FragmentArray& color = band.color;
    color.type = PixelType::kFloat;
    color.channels = colorNames(false);
    color.data.resize(keys.size() * color.stride());
    const std::span<glm::vec4> colors = color.as<glm::vec4>();
    const auto width = static_cast<std::size_t>(band.window.width());
    parallelFor(static_cast<std::size_t>(band.window.height()), [&](std::size_t row) {
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t pixel = row * width + x, first = band.offsets[pixel];
            const std::size_t hits = band.count(pixel);
            ofRay(view,
                  {band.window.x0 + static_cast<int>(x), band.window.y0 + static_cast<int>(row)},
                  keys.subspan(first, hits), colors.subspan(first, hits));
        }
    });
}

}  // namespace peeler
