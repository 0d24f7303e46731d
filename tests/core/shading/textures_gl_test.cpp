// SPDX-License-Identifier: Apache-2.0
// Tests texture sampling texel by texel: wrap modes, filters, transforms and UV sets.
#include <gtest/gtest.h>

#include <cmath>

#include "support/capture.h"

namespace peeler::test {
namespace {

constexpr int kRepeat = 10497, kClamp = 33071, kMirror = 33648;
constexpr int kNearest = 9728, kLinear = 9729;
constexpr int kSize = 4, kPixels = 60;

/// Returns a component of a texel of a 4x4 texture. All texels differ in red and green. Stored
/// values are linear, from black to 60%.
std::uint8_t stored(int x, int y, int channel) {
    return static_cast<std::uint8_t>(channel == 0 ? 40 * x + 10 * y : 45 * y + 5 * x);
}

/// Returns the texel that a coordinate outside the texture selects (OpenGL 4.6, §8.14.2).
int wrapped(int texel, int mode) {
    if (mode == kClamp) return std::clamp(texel, 0, kSize - 1);
    const int period = ((texel % (2 * kSize)) + 2 * kSize) % (2 * kSize);
    if (mode == kMirror) return period < kSize ? period : 2 * kSize - 1 - period;
    return period % kSize;
}

double texel(int x, int y, int channel, const Sampler& s) {
    return stored(wrapped(x, s.wrap_s), wrapped(y, s.wrap_t), channel) / 255.0;
}

double sampled(const glm::dvec2& uv, int channel, const Sampler& s) {
    const glm::dvec2 at = uv * double(kSize);
    if (s.mag_filter == kNearest)
        return texel(static_cast<int>(std::floor(at.x)), static_cast<int>(std::floor(at.y)),
                     channel, s);
    const glm::dvec2 corner = glm::floor(at - 0.5), share = at - 0.5 - corner;
    const int x = static_cast<int>(corner.x), y = static_cast<int>(corner.y);
    return glm::mix(glm::mix(texel(x, y, channel, s), texel(x + 1, y, channel, s), share.x),
                    glm::mix(texel(x, y + 1, channel, s), texel(x + 1, y + 1, channel, s), share.x),
                    share.y);
}

/// A square that fills the view. Its first UV set runs from −1.03 to 1.97, its second in the
/// opposite direction. The texture is emissive (sRGB) or occlusion (linear).
class Square {
  public:
    Square() {
        const int index = builder_.lit(builder_.material({1, 1, 1, 1}, AlphaMode::kOpaque));
        builder_.rectangle(1, 1, -2, index);
        Primitive& p = scene().meshes[0].primitives[0];
        for (const glm::vec3& at : p.positions) {
            p.texcoords[0].emplace_back(at.x * 1.5F + 0.47F, 0.47F - at.y * 1.5F);
            p.texcoords[1].emplace_back(0.53F - at.x, at.y * 0.5F);
        }
        Image image{"texels", kSize, kSize, {}};
        for (int y = 0; y < kSize; ++y)
            for (int x = 0; x < kSize; ++x)
                image.rgba.insert(image.rgba.end(), {stored(x, y, 0), stored(x, y, 1), 0, 255});
        scene().images.push_back(image);
        // White light comes from all directions and is attenuated by the linear occlusion texture.
        Environment environment;
        environment.width = environment.height = 1;
        environment.radiance.assign(1, glm::vec3(1));
        scene().environment = environment;
        material().occlusion_texture.image = 0;
    }
    Scene& scene() { return builder_.scene(); }
    Material& material() { return scene().materials.back(); }
    TextureRef& texture() { return material().occlusion_texture; }

    /// Compares every pixel that is not near a texel edge with the formula for its UV. Returns the
    /// number of compared pixels.
    int check(const glm::dmat3& transform = glm::dmat3(1), bool second = false) {
        CaptureSettings s;
        s.color_type = PixelType::kFloat;
        const LayeredImage image = capture(scene(), testView(kPixels, kPixels), s).image;
        const Sampler& sampler = texture().sampler;
        int compared = 0;
        for (int y = 0; y < kPixels; ++y) {
            for (int x = 0; x < kPixels; ++x) {
                const double px = (x + 0.5) / kPixels * 2 - 1, py = 1 - (y + 0.5) / kPixels * 2;
                glm::dvec3 uv(px * 1.5 + 0.47, 0.47 - py * 1.5, 1);
                if (second) uv = {0.53 - px, py * 0.5, 1};
                const glm::dvec2 at(transform * uv);
                const glm::dvec2 edge = glm::abs(at * 4.0 - glm::round(at * 4.0));
                if (sampler.mag_filter == kNearest && std::min(edge.x, edge.y) < 1e-3) continue;
                const glm::vec4 seen = color(image, image.offsets[image.pixelIndex(x, y)]);
                const double expected = sampled(at, 0, sampler);
                if (std::abs(double(seen.r) - expected) > 6e-3) {
                    ADD_FAILURE() << x << ", " << y << ": " << seen.r << ", not " << expected;
                    return compared;
                }
                ++compared;
            }
        }
        EXPECT_GT(compared, kPixels * kPixels / 2);
        return compared;
    }

  private:
    SceneBuilder builder_;
};

TEST(Textures, WrapAsTheirSamplersSay) {
    for (const int wrap_s : {kRepeat, kClamp, kMirror}) {
        for (const int wrap_t : {kRepeat, kClamp, kMirror}) {
            for (const int filter : {kNearest, kLinear}) {
                SCOPED_TRACE(std::to_string(wrap_s) + ", " + std::to_string(wrap_t) + ", " +
                             std::to_string(filter));
                Square square;
                square.texture().sampler = {filter, filter, wrap_s, wrap_t};
                square.check();
            }
        }
    }
}

TEST(Textures, AreTransformed) {
    // The matrix is offset · rotation · scale, as in KHR_texture_transform.
    const double c = std::cos(0.6), s = std::sin(0.6);
    const glm::dmat3 rotation(c, -s, 0, s, c, 0, 0, 0, 1);
    glm::dmat3 offset(1), scale(1);
    offset[2] = {0.31, -0.17, 1};
    scale[0][0] = 0.6, scale[1][1] = 1.1;
    const glm::dmat3 transform = offset * rotation * scale;
    for (const int filter : {kNearest, kLinear}) {
        Square square;
        square.texture().sampler = {filter, filter, kRepeat, kMirror};
        square.texture().transform = glm::mat3(transform);
        square.check(transform);
    }
}

TEST(Textures, UseTheSecondUvSet) {
    for (const int filter : {kNearest, kLinear}) {
        Square square;
        square.texture().sampler = {filter, filter, kRepeat, kRepeat};
        square.texture().texcoord = 1;
        square.check(glm::dmat3(1), true);
        glm::dmat3 transform(1);
        transform[2] = {0.4, 0.2, 1};
        square.texture().transform = glm::mat3(transform);
        square.check(transform, true);
    }
}

TEST(Textures, OfOneMaterialHaveEachTheirOwnSet) {
    // Two textures share an image: occlusion with the first UV set, and emission with the second.
    Square square;
    square.texture().sampler = {kNearest, kNearest, kClamp, kClamp};
    const int alone = square.check();
    square.material().emissive = {1, 1, 1};
    square.material().emissive_texture = square.texture();
    square.material().emissive_texture.texcoord = 1;
    square.scene().environment->radiance[0] = glm::vec3(0);
    CaptureSettings s;
    s.color_type = PixelType::kFloat;
    const LayeredImage image = capture(square.scene(), testView(kPixels, kPixels), s).image;
    const Sampler& sampler = square.texture().sampler;
    int compared = 0;
    for (int y = 1; y < kPixels; y += 2) {
        for (int x = 1; x < kPixels; x += 2) {
            const double px = (x + 0.5) / kPixels * 2 - 1, py = 1 - (y + 0.5) / kPixels * 2;
            const glm::dvec2 at(0.53 - px, py * 0.5),
                edge = glm::abs(at * 4.0 - glm::round(at * 4.0));
            if (std::min(edge.x, edge.y) < 1e-3) continue;
            const double encoded = sampled(at, 1, sampler);
            const double linear =
                encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
            EXPECT_NEAR(color(image, image.offsets[image.pixelIndex(x, y)]).g, linear, 3e-3);
            ++compared;
        }
    }
    EXPECT_GT(compared, 500);
    EXPECT_GT(alone, 500);
}

TEST(Textures, ShrunkenAreFilteredOrNotAsTheirSamplersSay) {
    // At 15 texels per pixel, mipmaps give the mean; without mipmaps, single texels are visible.
    const auto deviation = [](int min_filter) {
        Square square;
        square.texture().sampler = {kNearest, min_filter, kRepeat, kRepeat};
        square.texture().transform = glm::mat3(301.37F, 0, 0, 0, 303.71F, 0, 0.1F, 0.2F, 1);
        CaptureSettings s;
        s.color_type = PixelType::kFloat;
        const LayeredImage image = capture(square.scene(), testView(20, 20), s).image;
        double mean = 0, most = 0;
        for (std::size_t f = 0; f < image.fragments(); ++f)
            mean += double(color(image, f).r) / static_cast<double>(image.fragments());
        EXPECT_NEAR(mean, 75 / 255.0, 0.04);
        for (std::size_t f = 0; f < image.fragments(); ++f)
            most = std::max(most, std::abs(double(color(image, f).r) - mean));
        return most;
    };
    EXPECT_LT(deviation(9987), 0.01);      // GL_LINEAR_MIPMAP_LINEAR
    EXPECT_LT(deviation(9984), 0.01);      // GL_NEAREST_MIPMAP_NEAREST
    EXPECT_GT(deviation(kNearest), 0.15);  // without mipmaps
}

}  // namespace
}  // namespace peeler::test
