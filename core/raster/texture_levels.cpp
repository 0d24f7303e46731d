// SPDX-License-Identifier: Apache-2.0
#include "core/raster/texture_levels.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <vector>

#include "core/base/cross.h"
#include "core/raster/surface_values.h"
#include "core/shading/materials.h"

namespace peeler {
namespace {

/// GL's minification filters with mipmaps; others sample the image itself.
enum : int {
    kNearestMipmapNearest = 9984,
    kLinearMipmapNearest,
    kNearestMipmapLinear,
    kLinearMipmapLinear
};
constexpr int kNearestTexel = 9728, kLinearTexels = 9729;

constexpr double kMostSamples = 16;  // along the longer axis

/// Returns the binary logarithm of a positive finite number, with the same bits on every machine.
double binaryLogarithm(double number) {
    int exponent = 0;
    const double mantissa = std::frexp(number, &exponent);  // 0.5 to 1
    // ln m = 2 artanh((m − 1) / (m + 1)); the argument is at least −1/3.
    const double s = (mantissa - 1) / (mantissa + 1), square = s * s;
    double sum = 0;
    for (int term = 25; term >= 1; term -= 2)
        sum = sum * square + 1.0 / term;
    constexpr double kPerNatural = 1.44269504088896340736;
    return exponent + 2 * kPerNatural * s * sum;
}

/// An ellipse: its longer axis, and the lengths of both.
struct Ellipse {
    glm::dvec2 axis;
    double longer, shorter;
};

/// Returns the image of the unit circle under a linear map with these columns.
Ellipse ellipseOf(const glm::dvec2& a, const glm::dvec2& b) {
    // Singular values, and the longer left singular vector.
    const double xx = a.x * a.x + b.x * b.x, yy = a.y * a.y + b.y * b.y;
    const double xy = a.x * a.y + b.x * b.y;
    const double half = (xx - yy) / 2, root = std::sqrt(half * half + xy * xy);
    const double most = (xx + yy) / 2 + root, area = std::abs(cross(a, b));
    const double longer = std::sqrt(most);
    glm::dvec2 axis = half >= 0 ? glm::dvec2(half + root, xy) : glm::dvec2(xy, root - half);
    const double length = std::sqrt(glm::dot(axis, axis));
    axis = length > 0 ? axis * (longer / length) : glm::dvec2(longer, 0);
    return {axis, longer, longer > 0 ? area / longer : 0};
}

}  // namespace

struct TextureLevels::Chain {
    std::once_flag once;
    std::vector<Image> smaller;  ///< from level 1 on
};

TextureLevels::TextureLevels(const Scene& scene)
    : scene_(scene), chains_(std::make_unique<Chain[]>(2 * scene.images.size())) {}

TextureLevels::~TextureLevels() = default;

std::uint64_t TextureLevels::mostBytes() const {
    std::uint64_t bytes = 0;
    for (const Image& image : scene_.images)
        bytes += image.rgba.size() / 2;  // at most a third, unless the image is a narrow strip
    return bytes;
}

const Image& TextureLevels::level(int image, bool srgb, int level) const {
    const Image& finest = scene_.images[static_cast<std::size_t>(image)];
    if (level == 0) return finest;
    Chain& chain = chains_[2 * static_cast<std::size_t>(image) + (srgb ? 1 : 0)];
    std::call_once(chain.once, [&] {
        const int levels = mipmapLevels(finest.width, finest.height);
        chain.smaller.reserve(static_cast<std::size_t>(levels));
        for (int i = 1; i < levels; ++i)
            chain.smaller.push_back(halved(i == 1 ? finest : chain.smaller.back(), srgb));
    });
    return chain.smaller[static_cast<std::size_t>(level) - 1];
}

glm::dvec4 TextureLevels::sample(const TextureRef& texture, const glm::dvec2& uv,
                                 const TextureFootprint& footprint, bool srgb) const {
    const Image& finest = scene_.images[static_cast<std::size_t>(texture.image)];
    const Sampler& sampler = texture.sampler;
    const glm::dmat3 moved(texture.transform);
    const glm::dvec2 at(moved * glm::dvec3(uv, 1));
    const glm::dmat2 turn(moved);
    const glm::dvec2 size(finest.width, finest.height);
    const Ellipse pixel = ellipseOf(turn * footprint.per_x * size, turn * footprint.per_y * size);
    if (!(pixel.longer > 1))  // magnification; also NaN
        return texelIn(finest, sampler, at, sampler.mag_filter == kNearestTexel, srgb);
    const int filter = sampler.min_filter;
    if (filter == kNearestTexel || filter == kLinearTexels)
        return texelIn(finest, sampler, at, filter == kNearestTexel, srgb);

    const int last = mipmapLevels(finest.width, finest.height) - 1;
    const double coarsest = std::max(size.x, size.y);
    // The longer axis is the first argument, because the shorter one may be NaN.
    const double step = std::max(pixel.longer / kMostSamples, pixel.shorter);
    const double samples =
        step < coarsest ? std::ceil(pixel.longer / std::max(step, 1.0) - 1e-3) : 1;
    const double detail = binaryLogarithm(std::clamp(step, 1.0, 2 * coarsest));
    const bool nearest = filter == kNearestMipmapNearest || filter == kNearestMipmapLinear;
    const bool one_level = filter == kNearestMipmapNearest || filter == kLinearMipmapNearest;
    const double place =
        std::clamp(one_level ? std::ceil(detail - 0.5) : detail, 0.0, static_cast<double>(last));
    const int low = std::min(static_cast<int>(place), last);
    const double share = place - low;
    const glm::dvec2 axis = pixel.axis / size;
    glm::dvec4 sum(0);
    for (double i = 0.5; i < samples; ++i) {
        const glm::dvec2 here = samples > 1 ? at + axis * (i / samples - 0.5) : at;
        const glm::dvec4 fine =
            texelIn(level(texture.image, srgb, low), sampler, here, nearest, srgb);
        sum += share > 0 ? (1 - share) * fine + share * texelIn(level(texture.image, srgb, low + 1),
                                                                sampler, here, nearest, srgb)
                         : fine;
    }
    return sum / samples;
}

}  // namespace peeler
