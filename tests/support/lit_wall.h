// SPDX-License-Identifier: Apache-2.0
// A wall of one material under one lamp, and formulas for a simple reflection.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include <peeler/view.h>
#include "support/capture.h"
#include "support/numbers.h"

namespace peeler::test {

/// A wall of one material that faces the viewer. The U axis is along +X; the mesh has tangents.
/// radiance() returns the radiance at the wall's middle under one lamp, whose irradiance is 1 at
/// normal incidence. The lamp's direction is turned by `degrees` from the normal toward +X, then by
/// `azimuth` around the normal.
class LitWall {
  public:
    explicit LitWall(const Material& material) {
        const int index = builder_.material({1, 1, 1, 1}, AlphaMode::kOpaque);
        scene().materials[static_cast<std::size_t>(index)] = material;
        builder_.rectangle(4, 4, -4, index);
        Primitive& p = scene().meshes[0].primitives[0];
        for (const glm::vec3& at : p.positions) {
            p.normals.emplace_back(0, 0, 1);
            p.tangents.emplace_back(1, 0, 0, 1);
            p.texcoords[0].emplace_back(at.x / 8 + 0.5F, 0.5F - at.y / 8);
        }
        Environment black;
        black.width = black.height = 1;
        black.radiance.assign(1, glm::vec3(0));
        scene().environment = black;
    }

    Scene& scene() { return builder_.scene(); }

    glm::dvec3 radiance(double degrees, double azimuth = 0) {
        const double a = degrees * kPi / 180, b = azimuth * kPi / 180;
        const glm::dvec3 toward(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
        scene().lights.clear();
        while (scene().nodes.size() > 1) {
            scene().nodes.pop_back();
            scene().scenes[0].roots.pop_back();
        }
        builder_.light({}, *lookAlong({0, 0, 0}, -toward, {0, 1, 0.1}));
        return middle();
    }

    /// Returns the radiance at the wall's middle under the current lights.
    glm::dvec3 middle() {
        CaptureSettings s;
        s.color_type = PixelType::kFloat;
        const LayeredImage image = capture(scene(), testView(9, 9), s).image;
        EXPECT_EQ(image.fragments(), 81U);
        return color(image, 40);
    }

  private:
    SceneBuilder builder_;
};

inline Material black(float roughness = 1) {
    Material m;
    m.base_color = {0, 0, 0, 1};
    m.metallic = 0;
    m.roughness = roughness;
    return m;
}

inline Material whiteMetal(float roughness) {
    Material m = black(roughness);
    m.base_color = {1, 1, 1, 1};
    m.metallic = 1;
    return m;
}

/// Returns GGX's distribution times visibility for the view along the normal.
inline double ggxAlongNormal(double alpha, double degrees) {
    const double a2 = alpha * alpha, l = std::cos(degrees * kPi / 180);
    const double h2 = (1 + l) / 2, d = h2 * (a2 - 1) + 1;
    return a2 / (kPi * d * d) * 0.5 / (l + std::sqrt(l * l * (1 - a2) + a2));
}

/// Returns Schlick's Fresnel term for the view along the normal.
inline double fresnel(double f0, double f90, double degrees) {
    const double v_dot_h = std::cos(degrees * kPi / 360);
    return f0 + (f90 - f0) * std::pow(1 - v_dot_h, 5);
}

inline double lobe(double f0, double f90, double roughness, double degrees) {
    return fresnel(f0, f90, degrees) * ggxAlongNormal(roughness * roughness, degrees) *
           std::cos(degrees * kPi / 180);
}

}  // namespace peeler::test
