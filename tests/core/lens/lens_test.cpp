// SPDX-License-Identifier: Apache-2.0
// Tests lenses against closed forms, and against OpenCV.
#include "core/lens/lens_rays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <numbers>
#include <random>
#include <sstream>

#include <peeler/error.h>
#include "core/lens/polynomial.h"
#include "support/python.h"

namespace peeler::test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr Size kPicture{640, 480};

/// A lens whose picture has a ray in every pixel.
struct LensCase {
    const char* model;
    std::vector<double> coefficients;
    Intrinsics intrinsics{500, 510, 318.3, 241.7};
    Size size = kPicture;
};

std::vector<LensCase> lensCases() {
    const Intrinsics wide{190, 188, 318.3, 241.7}, pixels{1, 1, 318.3, 241.7};
    return {
        {"pinhole", {}},
        {"opencv", {-0.28, 0.07, 1e-3, -2e-3}},
        {"opencv", {0.2, -0.1, 1e-3, -2e-3, 0.05}},
        {"opencv", {0.2, -0.1, 1e-3, -2e-3, 0.05, 0.3, 0.02, 0.01}},
        {"opencv", {0.2, -0.1, 1e-3, 2e-3, 0.05, 0.3, 0.02, 0.01, 1e-3, 2e-3, -3e-3, 1e-3}},
        {"simple-radial", {0.1}},
        {"radial", {-0.2, 0.05}},
        {"full-opencv", {-0.3, 0.1, 1e-4, 2e-4, -0.01, 0.02, 0.01, 0.001}},
        {"opencv-fisheye", {0.03, -0.01, 0.004, -0.0006}, wide},
        {"fisheye", {}, wide},
        {"simple-radial-fisheye", {-0.01}, wide},
        {"radial-fisheye", {0.02, -0.002}, wide},
        {"thin-prism-fisheye", {0.02, -0.003, 4e-4, -3e-4, 2e-4, -1e-5, 1e-3, -2e-3}, wide},
        {"fisheye624",
         {0.03, -0.01, 0.004, -6e-4, 3e-5, -1e-6, 3e-4, -4e-4, 1e-3, -2e-4, 5e-4, 1e-4},
         wide},
        {"fov", {0.9}, {280, 290, 318.3, 241.7}},
        {"ftheta", {0, 5.3e-3, 1e-7, -2e-9, 3e-12}, pixels},
        {"ftheta", {0, 5.3e-3, 1e-7, -2e-9, 3e-12, 0, 0.999, 1e-3, -2e-3}, pixels},
        {"ftheta-forward", {0, 188, -2, 1, -0.4}, pixels},
        {"equirectangular", {}},
        {"cube", {}, {}, {600, 400}},
        {"cube", {}, {}, {100, 600}},
    };
}

LensRays raysOf(const LensCase& test) {
    return {makeLens(test.model, test.coefficients), test.intrinsics, test.size};
}

/// Calls use(x, y) for pixel centres of a picture: all of every `step`-th row and column.
void forPixels(const Size& size, int step, const std::function<void(double, double)>& use) {
    for (int y = 0; y < size.height; y += step)
        for (int x = 0; x < size.width; x += step)
            use(x + 0.5, y + 0.5);
}

TEST(Lenses, ProjectingUndoesUnprojecting) {
    for (const LensCase& test : lensCases()) {
        const LensRays rays = raysOf(test);
        double most = 0, length = 0;
        forPixels(test.size, 3, [&](double x, double y) {
            const auto ray = rays.ray({x, y});
            ASSERT_TRUE(ray) << test.model << " " << x << ", " << y;
            const auto pixel = rays.pixel(ray->direction * 3.0);
            ASSERT_TRUE(pixel) << test.model << " " << x << ", " << y;
            most = std::max(most, glm::length(*pixel - glm::dvec2(x, y)));
            length = std::max(length, std::abs(glm::length(ray->direction) - 1));
        });
        EXPECT_LT(most, 1e-9) << test.model;
        EXPECT_LT(length, 1e-15) << test.model;
    }
}

TEST(Lenses, DerivativesAreThoseOfTheDirection) {
    constexpr double kStep = 1e-4;
    for (const LensCase& test : lensCases()) {
        const LensRays rays = raysOf(test);
        double most = 0;
        forPixels(test.size, 17, [&](double x, double y) {
            const auto at = [&](double dx, double dy) {
                return rays.ray({x + dx, y + dy}).value().direction;
            };
            const LensRay ray = rays.ray({x, y}).value();
            const glm::dvec3 per_x = (at(kStep, 0) - at(-kStep, 0)) / (2 * kStep),
                             per_y = (at(0, kStep) - at(0, -kStep)) / (2 * kStep);
            most = std::max({most, glm::length(ray.per_x - per_x), glm::length(ray.per_y - per_y)});
        });
        EXPECT_LT(most, 1e-10) << test.model;
    }
}

/// A forward model as its source defines it: from x/z, y/z and the angle from the axis to the
/// picture with focal length 1.
using Forward = std::function<glm::dvec2(double x, double y, double angle)>;

TEST(Lenses, PixelsAreThoseOfTheDefinitions) {
    const double k1 = 0.02, k2 = -0.003, p1 = 4e-4, p2 = -3e-4, k3 = 2e-4, k4 = -1e-5, sx = 1e-3,
                 sy = -2e-3, omega = 0.9;
    // COLMAP, src/colmap/sensor/models.h.
    const auto equidistant = [](double x, double y, double angle) {
        return glm::dvec2(x, y) * (angle / std::hypot(x, y));
    };
    const std::tuple<const char*, std::vector<double>, Forward> models[] = {
        {"thin-prism-fisheye",
         {k1, k2, p1, p2, k3, k4, sx, sy},
         [&](double x, double y, double angle) {
             const auto [u, v] = std::pair(equidistant(x, y, angle).x, equidistant(x, y, angle).y);
             const double q = u * u + v * v;
             const double radial = 1 + k1 * q + k2 * q * q + k3 * q * q * q + k4 * q * q * q * q;
             return glm::dvec2(u * radial + 2 * p1 * u * v + p2 * (q + 2 * u * u) + sx * q,
                               v * radial + 2 * p2 * u * v + p1 * (q + 2 * v * v) + sy * q);
         }},
        {"radial-fisheye",
         {k1, k2},
         [&](double x, double y, double angle) {
             const double q = angle * angle;
             return equidistant(x, y, angle) * (1 + k1 * q + k2 * q * q);
         }},
        {"fov",
         {omega},
         [&](double x, double y, double) {
             const double r = std::hypot(x, y);
             return glm::dvec2(x, y) * (std::atan(2 * r * std::tan(omega / 2)) / omega / r);
         }},
        {"ftheta-forward",
         {0, 180, -2, 1},
         [&](double x, double y, double angle) {
             return equidistant(x, y, angle) * (180 - 2 * angle + angle * angle);
         }},
        {"simple-radial",
         {k1},
         [&](double x, double y, double) { return glm::dvec2(x, y) * (1 + k1 * (x * x + y * y)); }},
    };
    std::mt19937 random(2);
    std::uniform_real_distribution<> side(-1, 1);
    for (const auto& [model, coefficients, forward] : models) {
        const Intrinsics k{model[1] == 't' ? 1.0 : 300, model[1] == 't' ? 1.0 : 310, 320, 240};
        const LensRays rays(makeLens(model, coefficients), k, kPicture);
        for (int i = 0; i < 1000; ++i) {
            const double x = side(random), y = side(random);
            const glm::dvec2 plane = forward(x, y, std::atan(std::hypot(x, y)));
            const glm::dvec2 expected(plane.x * k.fx + k.cx + 0.5, plane.y * k.fy + k.cy + 0.5);
            const auto pixel = rays.pixel({x, -y, -1});
            ASSERT_TRUE(pixel) << model;
            EXPECT_LT(glm::length(*pixel - expected), 1e-9) << model;
        }
    }
}

TEST(Lenses, FisheyesSeeBehindThemselves) {
    // Equidistant: 1 pixel is 1/100 radian. The pixel 250 beside the axis sees 2.5 radians (143°).
    const Intrinsics k{100, 100, 299.5, 299.5};
    const glm::dvec3 expected(std::sin(2.5), 0, -std::cos(2.5));
    for (const auto& [model, coefficients, intrinsics] :
         {std::tuple("fisheye", std::vector<double>{}, k),
          std::tuple("ftheta", std::vector<double>{0, 0.01}, Intrinsics{1, 1, 299.5, 299.5}),
          std::tuple("ftheta-forward", std::vector<double>{0, 100},
                     Intrinsics{1, 1, 299.5, 299.5})}) {
        const LensRays rays(makeLens(model, coefficients), intrinsics, {600, 600});
        const auto ray = rays.ray({550, 300});
        ASSERT_TRUE(ray) << model;
        EXPECT_LT(glm::length(ray->direction - expected), 1e-15) << model;
        const auto pixel = rays.pixel(expected);
        ASSERT_TRUE(pixel) << model;
        EXPECT_LT(glm::length(*pixel - glm::dvec2(550, 300)), 1e-12) << model;
        EXPECT_FALSE(rays.ray({300 + 314.2, 300})) << model;  // beyond half a turn
        EXPECT_TRUE(rays.ray({300 + 314.1, 300})) << model;
    }
    // The largest angle of F-Theta: 2 radians.
    const LensRays narrow(makeLens("ftheta", {0, 0.01, 0, 0, 0, 0, 1, 0, 0, 2}),
                          {1, 1, 299.5, 299.5}, {600, 600});
    EXPECT_TRUE(narrow.ray({300 + 199.9, 300}));
    EXPECT_FALSE(narrow.ray({300 + 200.1, 300}));
    EXPECT_FALSE(narrow.pixel(expected));
}

TEST(Lenses, PerspectiveLensesSeeOnlyTheFront) {
    for (const auto& [model, coefficients] :
         {std::pair("opencv", std::vector<double>{0.1, 0, 0, 0}),
          std::pair("fov", std::vector<double>{1})}) {
        const LensRays rays(makeLens(model, coefficients), {300, 300, 319.5, 239.5}, kPicture);
        EXPECT_FALSE(rays.pixel({0, 0, 1})) << model;
        EXPECT_FALSE(rays.pixel({1, 0, 0})) << model;
        EXPECT_TRUE(rays.pixel({0, 0, -1})) << model;
    }
    // A FOV lens reaches 90° at the radius f π / (2 ω).
    const LensRays rays(makeLens("fov", {1}), {150, 150, 319.5, 239.5}, kPicture);
    EXPECT_TRUE(rays.ray({320 + 150 * kPi / 2 - 0.1, 240}));
    EXPECT_FALSE(rays.ray({320 + 150 * kPi / 2 + 0.1, 240}));
}

/// Returns the number of pixels of kPicture whose centre is at least `radius` from its middle.
std::uint64_t pixelsBeyond(double radius) {
    std::uint64_t count = 0;
    forPixels(kPicture, 1, [&](double x, double y) {
        if (std::hypot(x - 320, y - 240) >= radius) ++count;
    });
    return count;
}

/// Returns the number of pixels of kPicture whose centre has no ray.
std::uint64_t pixelsWithoutRay(const LensRays& rays) {
    std::uint64_t count = 0;
    forPixels(kPicture, 1, [&](double x, double y) {
        if (!rays.ray({x, y})) ++count;
    });
    return count;
}

TEST(Lenses, PixelsBeyondTheFoldAreEmpty) {
    // r (1 − k r²) has its extremum 2/3 · r at r = 1 / √(3 k).
    const double k = 0.2, fold = 1 / std::sqrt(3 * k), f = 400;
    const LensRays rays(makeLens("simple-radial", {-k}), {f, f, 319.5, 239.5}, kPicture);
    const std::uint64_t beyond = pixelsBeyond(f * fold * 2 / 3);
    EXPECT_GT(beyond, 1000U);
    EXPECT_EQ(pixelsWithoutRay(rays), beyond);
    EXPECT_FALSE(rays.pixel({fold * 1.001, 0, -1}));
    EXPECT_FALSE(rays.pixel({3 * fold, 0, -1}));  // mirrored to the other side by the polynomial
    EXPECT_TRUE(rays.pixel({fold * 0.999, 0, -1}));
    // A pole of the rational model ends its domain too: (1 + r²) / (1 − r²).
    const LensRays pole(makeLens("opencv", {1, 0, 0, 0, 0, -1, 0, 0}), {f, f, 319.5, 239.5},
                        kPicture);
    EXPECT_TRUE(pole.pixel({0.99, 0, -1}));
    EXPECT_FALSE(pole.pixel({1.01, 0, -1}));
    EXPECT_EQ(pixelsWithoutRay(pole), 0U);
    // With tangential terms the border is no circle, and every ray found still projects back.
    const LensRays tangential(makeLens("opencv", {-k, 0, 0.01, -0.02}), {f, f, 319.5, 239.5},
                              kPicture);
    std::uint64_t without = 0;
    forPixels(kPicture, 1, [&](double x, double y) {
        const auto ray = tangential.ray({x, y});
        if (!ray) {
            ++without;
            return;
        }
        if (static_cast<int>(x) % 8 != 0) return;
        const auto pixel = tangential.pixel(ray->direction);
        ASSERT_TRUE(pixel);
        EXPECT_LT(glm::length(*pixel - glm::dvec2(x, y)), 1e-9);
    });
    // A flood fill of 4000 x 4000 points of the domain reaches all pixels but 21960. At its border,
    // 404 pixels are reached, but not at their centres.
    EXPECT_GE(without, 21960U);
    EXPECT_LE(without, 21960U + 404);
}

TEST(Lenses, Panoramas) {
    const LensRays world(makeLens("equirectangular", {}), {}, {400, 200});
    const std::pair<glm::dvec2, glm::dvec3> points[] = {
        {{200, 100}, {0, 0, -1}},
        {{300, 100}, {1, 0, 0}},
        {{100, 100}, {-1, 0, 0}},
        {{200, 50}, {0, std::sqrt(0.5), -std::sqrt(0.5)}},
        {{0, 100}, {0, 0, 1}}};
    for (const auto& [pixel, direction] : points)
        EXPECT_LT(glm::length(world.ray(pixel).value().direction - direction), 1e-15);
    EXPECT_LT(glm::length(world.pixel({0, 5, 0}).value() - glm::dvec2(200, 0)), 1e-12);

    // Right, left, up, down, front, back; the right edge of the front face is the right face's
    // left.
    const LensRays cube(makeLens("cube", {}), {}, {600, 100});
    const glm::dvec3 centres[] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                  {0, -1, 0}, {0, 0, -1}, {0, 0, 1}};
    for (int face = 0; face < 6; ++face) {
        const glm::dvec2 middle(100 * face + 50, 50);
        EXPECT_EQ(cube.ray(middle).value().direction, centres[face]);
        EXPECT_EQ(cube.pixel(centres[face]).value(), middle);
    }
    const double s = std::sqrt(0.5);
    EXPECT_LT(glm::length(cube.ray({0, 50}).value().direction - glm::dvec3(s, 0, -s)), 1e-15);
    EXPECT_LT(glm::length(cube.ray({250, 99.9999999999}).value().direction - glm::dvec3(0, s, -s)),
              1e-11);  // up: the lower edge is in front
    EXPECT_LT(glm::length(cube.ray({350, 0}).value().direction - glm::dvec3(0, -s, -s)),
              1e-15);  // down: the upper edge is in front
    EXPECT_FALSE(cube.ray({601, 50}));
    EXPECT_THROW(LensRays(makeLens("cube", {}), {}, {600, 101}), Error);
}

TEST(Lenses, RandomLensesMapOneDirectionToAPixel) {
    std::mt19937_64 random(7);
    std::normal_distribution<> normal;
    std::uint64_t found = 0;
    for (int i = 0; i < 1000; ++i) {
        const LensModel& model = lensModels()[random() % lensModels().size()];
        if (model.filling || model.in_pixels || model.name == "fov") continue;
        std::vector<double> coefficients(model.counts[0]);
        for (double& k : coefficients)
            k = normal(random) * std::pow(10, -static_cast<double>(i % 4));
        const LensRays rays(makeLens(model.name, coefficients), {200, 210, 310, 245}, kPicture);
        for (int j = 0; j < 10; ++j) {
            std::uniform_real_distribution<> x(0, 640), y(0, 480);
            const glm::dvec2 pixel(x(random), y(random));
            if (const auto ray = rays.ray(pixel)) {
                const auto back = rays.pixel(ray->direction);
                ASSERT_TRUE(back) << model.name << " " << i;
                EXPECT_LT(glm::length(*back - pixel), 1e-9) << model.name << " " << i;
                ++found;
            }
            const glm::dvec3 direction =
                glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
            const auto seen = rays.pixel(direction);
            if (!seen || glm::length(*seen) > 2000) continue;
            const auto ray = rays.ray(*seen);
            ASSERT_TRUE(ray) << model.name << " " << i;
            EXPECT_LT(glm::length(ray->direction - direction), 1e-6) << model.name << " " << i;
        }
    }
    EXPECT_GT(found, 4000U);
}

TEST(Lenses, NamesAndCoefficients) {
    EXPECT_EQ(findLensModel("OPENCV_FISHEYE")->name, "opencv-fisheye");
    EXPECT_EQ(findLensModel("unknown"), nullptr);
    EXPECT_TRUE(isPinhole(makeLens("SIMPLE_PINHOLE", {})));
    EXPECT_TRUE(isPinhole(makeLens("opencv", {0, 0, 0, 0})));
    EXPECT_TRUE(isPinhole(makeLens("fov", {0})));
    EXPECT_FALSE(isPinhole(makeLens("fisheye", {})));
    EXPECT_FALSE(isPinhole(makeLens("radial", {0, 1e-9})));
    const std::tuple<const char*, std::vector<double>, const char*> wrong[] = {
        {"opencv", {1, 2, 3}, "takes 4, 5, 8, 12 or 14 coefficients, not 3"},
        {"openvc", {}, "unknown lens model"},
        {"simple-radial", {NAN}, "must be finite"},
        {"opencv", {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.1, 0}, "tilted sensor"},
        {"fov", {4}, "between 0 and pi"},
        {"ftheta", {1, 2}, "0 at the centre"},
    };
    for (const auto& [model, coefficients, what] : wrong) {
        try {
            makeLens(model, coefficients);
            ADD_FAILURE() << model;
        } catch (const Error& error) {
            EXPECT_TRUE(contains(error.whatText(), what)) << model;
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        }
    }
}

TEST(Lenses, DirectionsHaveTheSameBitsEverywhere) {
    std::uint64_t hash = 0xcbf29ce484222325U;  // FNV-1a of all bytes
    const auto add = [&](double value) {
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof bits);
        for (int byte = 0; byte < 8; ++byte)
            hash = (hash ^ (bits >> (8 * byte) & 255U)) * 0x100000001b3U;
    };
    for (const LensCase& test : lensCases()) {
        const LensRays rays = raysOf(test);
        forPixels(test.size, 7, [&](double x, double y) {
            const LensRay ray = rays.ray({x, y}).value();
            for (const glm::dvec3& v : {ray.direction, ray.per_x, ray.per_y})
                for (int i = 0; i < 3; ++i)
                    add(v[i]);
            const glm::dvec2 pixel = rays.pixel(ray.direction).value();
            add(pixel.x);
            add(pixel.y);
        });
    }
    EXPECT_EQ(hash, 0x7fa55b6a43bd187eU) << std::hex << hash;
}

TEST(Lenses, SignChangesOfPolynomials) {
    // (x − 1)(x − 2)(x − 5)
    const std::vector<double> found = signChanges({-10, 17, -8, 1}, 0, 100);
    ASSERT_EQ(found.size(), 3U);
    EXPECT_NEAR(found[0], 1, 1e-14);
    EXPECT_NEAR(found[1], 2, 1e-14);
    EXPECT_NEAR(found[2], 5, 1e-14);
    EXPECT_TRUE(signChanges({1, 0, 1}, 0, 100).empty());
    EXPECT_TRUE(signChanges({3}, 0, 100).empty());
}

/// Returns the numbers as text with all digits.
std::string digits(const std::vector<double>& numbers) {
    std::ostringstream text;
    text.precision(17);
    for (std::size_t i = 0; i < numbers.size(); ++i)
        text << (i ? "," : "") << numbers[i];
    return text.str();
}

TEST(Lenses, OpencvProjectsToTheSamePixels) {
    PEELER_REQUIRE_PYTHON("cv2");
    std::mt19937 random(3);
    std::uniform_real_distribution<> side(-0.6, 0.6);
    std::vector<double> points;
    for (int i = 0; i < 200; ++i)
        points.insert(points.end(), {side(random), side(random), 1});
    std::vector<LensCase> tests;
    std::vector<std::string> arguments{digits(points)};
    for (const LensCase& test : lensCases()) {
        const std::string model = test.model;
        if (model != "opencv" && model != "opencv-fisheye") continue;
        const Intrinsics& k = test.intrinsics;
        arguments.insert(arguments.end(),
                         {model, digits({k.fx, k.fy, k.cx, k.cy}), digits(test.coefficients)});
        tests.push_back(test);
    }
    const CommandResult result = runPython(
        "import sys, numpy as np, cv2\n"
        "numbers = lambda text: np.array(text.split(','), float)\n"
        "points, n, rest = numbers(sys.argv[1]).reshape(-1, 1, 3), np.zeros(3), sys.argv[2:]\n"
        "for model, k, d in zip(rest[::3], map(numbers, rest[1::3]), map(numbers, rest[2::3])):\n"
        "    K = np.array([[k[0], 0, k[2]], [0, k[1], k[3]], [0, 0, 1]])\n"
        "    of = cv2 if model == 'opencv' else cv2.fisheye\n"
        "    out, _ = of.projectPoints(points, n, n, K, d)\n"
        "    for x, y in out.reshape(-1, 2): print(repr(float(x)), repr(float(y)))\n",
        arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::istringstream lines(result.out);
    for (const LensCase& test : tests) {
        const LensRays rays = raysOf(test);
        double most = 0;
        for (std::size_t i = 0; i < points.size(); i += 3) {
            glm::dvec2 expected;
            ASSERT_TRUE(lines >> expected.x >> expected.y);
            const auto pixel = rays.pixel({points[i], -points[i + 1], -points[i + 2]});
            ASSERT_TRUE(pixel);
            most = std::max(most, glm::length(*pixel - 0.5 - expected));
        }
        EXPECT_LT(most, 1e-9) << test.model;
    }
}

}  // namespace
}  // namespace peeler::test
