// SPDX-License-Identifier: Apache-2.0
// Tests shaded pictures through lenses against resampled pinhole pictures of real models.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <glm/gtc/matrix_transform.hpp>
#include <optional>

#include "cmd/options/camera_options.h"
#include "core/lens/lens.h"
#include "core/scene/intrinsics.h"
#include "core/scene/view.h"
#include "formats/gltf/gltf_reader.h"
#include "support/capture.h"
#include "support/flat.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

constexpr int kFiner = 4;  // pixels of the pinhole picture per pixel that is compared, per side

/// Returns the picture's colour at a point, bilinearly; nothing near the edge of the picture.
std::optional<glm::dvec4> colorAt(const CompositeImage& image, const glm::dvec2& pixel) {
    const glm::dvec2 at = pixel - 0.5, low = glm::floor(at), share = at - low;
    const int x = static_cast<int>(low.x), y = static_cast<int>(low.y);
    if (x < 0 || y < 0 || x + 1 >= image.window.width() || y + 1 >= image.window.height())
        return {};
    const auto texel = [&](int i, int j) {
        const auto& [r, g, b, a] =
            image
                .rgba[static_cast<std::size_t>(j) * static_cast<std::size_t>(image.window.width()) +
                      static_cast<std::size_t>(i)];
        return glm::dvec4(r, g, b, a);
    };
    return glm::mix(glm::mix(texel(x, y), texel(x + 1, y), share.x),
                    glm::mix(texel(x, y + 1), texel(x + 1, y + 1), share.x), share.y);
}

/// Returns the mean of a fine picture over a pixel of another view from the same eye.
std::optional<glm::dvec4> resampled(const CompositeImage& fine, const View& fine_view,
                                    const View& view, const glm::ivec2& pixel) {
    constexpr int kGrid = 6;
    const PixelRays to_pixel(fine_view);
    const glm::dmat4 camera_from_world = glm::inverse(fine_view.camera_to_world);
    glm::dvec4 sum(0);
    for (int i = 0; i < kGrid * kGrid; ++i) {
        const glm::dvec2 within(i % kGrid + 0.5, i / kGrid + 0.5);
        const Ray ray = rayOf(view, glm::dvec2(pixel) + within / double{kGrid});
        const glm::dvec3 direction(camera_from_world * glm::dvec4(ray.direction, 0));
        if (!(direction.z < -0.05)) return {};
        const auto color = colorAt(fine, to_pixel.pixel(direction));
        if (!color) return {};
        sum += *color / double{kGrid * kGrid};
    }
    return sum;
}

CompositeImage picture(GlRenderer& renderer, const View& view, int samples) {
    CaptureSettings settings;
    settings.composite = true;
    settings.samples = samples;
    return flat(capture(renderer, view, settings).image);
}

/// The differences of a picture from a resampled one, of colours as a display shows them (0 to 1).
struct Off {
    std::size_t pixels = 0;
    double root_mean_square = 0;
};

Off offFrom(const CompositeImage& fine, const View& fine_view, const CompositeImage& image,
            const View& view) {
    Off off;
    double sum = 0;
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            const auto wanted = resampled(fine, fine_view, view, {x, y});
            if (!wanted || wanted->a == 0) continue;
            ++off.pixels;
            const auto& rgba = image.rgba[static_cast<std::size_t>(y * view.width + x)];
            for (int c = 0; c < 4; ++c) {
                const double difference =
                    std::min(1.0, (*wanted)[c]) -
                    std::min(1.0, static_cast<double>(rgba[static_cast<std::size_t>(c)]));
                sum += difference * difference;
            }
        }
    }
    off.root_mean_square = std::sqrt(sum / (4.0 * static_cast<double>(off.pixels)));
    return off;
}

/// The error of resampling is that of a pinhole picture which is turned a little: it differs from
/// the resampled one by as much as a picture through a lens of the same pixels may.
TEST(LensPictures, EqualResampledPinholePictures) {
    PEELER_REQUIRE_ASSETS(assets);
    const int side = exhaustive() ? 256 : 96, samples = kFiner * kFiner * (exhaustive() ? 4 : 1);
    for (const char* const name : {"DamagedHelmet/glTF-Binary/DamagedHelmet.glb",
                                   "2CylinderEngine/glTF/2CylinderEngine.gltf",
                                   "GlassVaseFlowers/glTF/GlassVaseFlowers.gltf",
                                   "CesiumMilkTruck/glTF/CesiumMilkTruck.gltf"}) {
        const Scene scene = readGltf(assets / "gltf-sample-assets" / name);
        const PosedScene posed(scene, 0);
        GlRenderer renderer(sharedContext(), posed);
        cmd::CameraOptions options;
        options.camera = "auto";
        options.fov = 50;
        options.size = {side, side};
        View still = cmd::makeView(posed, SceneExtent(posed), options);
        View fine = still;
        fine.width = fine.height = kFiner * side;
        fine.crop = {0, 0, fine.width, fine.height};
        const CompositeImage reference = picture(renderer, fine, exhaustive() ? 4 : 1);

        View turned = still;
        turned.camera_to_world =
            still.camera_to_world * glm::rotate(glm::dmat4(1), 0.1, glm::dvec3(0.3, 0.5, 0.8));
        View fisheye = turned;
        const double focal = side / (2 * still.projection.half_height);
        setLens(fisheye,
                {makeLens("fisheye", {}), {focal, focal, (side - 1) / 2.0, (side - 1) / 2.0}});
        View opencv = turned;
        setLens(opencv, {makeLens("opencv", {-0.2, 0.05, 0.002, -0.003}),
                         {focal, focal, (side - 1) / 2.0, (side - 1) / 2.0}});
        const Off own = offFrom(reference, fine, picture(renderer, turned, samples), turned);
        for (const View& lens : {fisheye, opencv}) {
            const Off off = offFrom(reference, fine, picture(renderer, lens, samples), lens);
            std::printf("%s through %s: %.5f RMS over %zu pixels, resampling itself %.5f\n", name,
                        lensCameraOf(lens)->lens.model.c_str(), off.root_mean_square, off.pixels,
                        own.root_mean_square);
            EXPECT_GT(off.pixels, 1'500U) << name;
            EXPECT_LT(off.root_mean_square, 1.25 * own.root_mean_square) << name;
        }
    }
}

}  // namespace
}  // namespace peeler::test
