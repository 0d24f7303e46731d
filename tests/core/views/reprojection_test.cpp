// SPDX-License-Identifier: Apache-2.0
// Tests new views from captured layers against analytic answers.
#include "core/views/reprojection.h"
#include "core/views/surface_cells.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include <peeler/composite.h>
#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/image/layers.h"
#include "core/scene/intrinsics.h"
#include "core/scene/view.h"
#include "support/fragment_lists.h"

namespace peeler::test {
namespace {

using Color = std::array<float, 4>;

/// Returns a view from the origin whose pixels are 0.02 wide at distance 1.
View viewOf(int width, int height, bool perspective = true) {
    View view;
    view.width = width;
    view.height = height;
    view.crop = {0, 0, width, height};
    view.projection = {perspective, 0.01 * width, 0.01 * height, 0.01,
                       perspective ? HUGE_VAL : 1000};
    return view;
}

View movedView(View view, const glm::dvec3& by) {
    view.camera_to_world = glm::translate(view.camera_to_world, by);
    return view;
}

/// Returns the view rotated about the point on the view's axis at this distance.
View orbited(View view, double distance, double degrees) {
    const glm::dvec3 center(0, 0, -distance);
    view.camera_to_world = glm::translate(glm::dmat4(1), center) *
                           glm::rotate(glm::dmat4(1), glm::radians(degrees), glm::dvec3(0, 1, 0)) *
                           glm::translate(glm::dmat4(1), -center) * view.camera_to_world;
    return view;
}

LayeredImage seenFrom(const LayeredImage& image, const View& from, const View& to) {
    LayeredImage whole;
    whole.window = to.crop;
    whole.offsets.push_back(0);
    int next = to.crop.y0;
    reproject(image, from, to, [&](const LayeredImage& band) {
        EXPECT_EQ(band.window.y0, next);
        next = band.window.y1;
        const std::uint32_t before = whole.offsets.back();
        for (std::size_t p = 1; p < band.offsets.size(); ++p)
            whole.offsets.push_back(before + band.offsets[p]);
        whole.z.insert(whole.z.end(), band.z.begin(), band.z.end());
        whole.color.type = band.color.type;
        whole.color.channels = band.color.channels;
        whole.color.data.insert(whole.color.data.end(), band.color.data.begin(),
                                band.color.data.end());
    });
    EXPECT_EQ(next, to.crop.y1);
    return whole;
}

Color onlyFragment(const LayeredImage& image, int x, int y) {
    const std::size_t pixel = image.pixelIndex(x, y);
    EXPECT_EQ(image.count(pixel), 1U) << x << ' ' << y;
    return image.count(pixel) == 1 ? colorOf(image, image.offsets[pixel]) : Color{};
}

Color paint(int x, int y) {
    return {static_cast<float>(x * 37 % 11) / 11, static_cast<float>(y * 17 % 13) / 13,
            static_cast<float>((x + y) % 7) / 7, 1};
}

void expectColor(const Color& a, const Color& b, float most = 2e-6F) {
    for (std::size_t c = 0; c < 4; ++c)
        EXPECT_NEAR(a[c], b[c], most);
}

TEST(Reprojection, APlaneMovesByTheShiftOfTheCamera) {
    for (const bool perspective : {true, false}) {
        const View from = viewOf(40, 30, perspective);
        const LayeredImage image = fragmentLists(from.crop, [](int x, int y) {
            return std::vector<TestFragment>{{4, paint(x, y)}};
        });
        const double pixel = 0.02 * (perspective ? 4 : 1);
        const LayeredImage seen = seenFrom(image, from, movedView(from, {3 * pixel, 2 * pixel, 0}));
        for (int y = 0; y < 30; ++y) {
            for (int x = 0; x < 40; ++x) {
                const bool inside = x + 3 < 40 && y - 2 >= 0;
                ASSERT_EQ(seen.count(seen.pixelIndex(x, y)), inside ? 1U : 0U) << x << ' ' << y;
                if (!inside) continue;
                expectColor(onlyFragment(seen, x, y), paint(x + 3, y - 2));
                EXPECT_NEAR(seen.z[seen.offsets[seen.pixelIndex(x, y)]], 4, 1e-6);
            }
        }
    }
}

TEST(Reprojection, BetweenPixelsColoursAreBilinear) {
    const View from = viewOf(12, 9);
    const LayeredImage image = fragmentLists(from.crop, [](int x, int y) {
        return std::vector<TestFragment>{{4, paint(x, y)}};
    });
    // The camera moves by half a pixel to the right and a quarter of a pixel up.
    const LayeredImage seen = seenFrom(image, from, movedView(from, {0.5 * 0.08, 0.25 * 0.08, 0}));
    for (int y = 1; y < 9; ++y) {
        for (int x = 0; x + 1 < 12; ++x) {
            Color mean{};
            for (std::size_t c = 0; c < 4; ++c) {
                mean[c] = 0.75F * (paint(x, y)[c] + paint(x + 1, y)[c]) / 2 +
                          0.25F * (paint(x, y - 1)[c] + paint(x + 1, y - 1)[c]) / 2;
            }
            expectColor(onlyFragment(seen, x, y), mean);
        }
    }
}

TEST(Reprojection, WhatWasHiddenComesOutFromBehind) {
    // A square at distance 2 hides part of a wall at distance 4. The camera moves by 4 pixels at
    // distance 2, which is 2 pixels at distance 4.
    constexpr Color kSquare{1, 0, 0, 1};
    const auto covered = [](int x, int y) { return x >= 10 && x < 20 && y >= 8 && y < 16; };
    const View from = viewOf(40, 24);
    LayeredImage image = fragmentLists(from.crop, [&](int x, int y) {
        std::vector<TestFragment> list;
        if (covered(x, y)) list.push_back({2, kSquare});
        list.push_back({4, paint(x, y)});
        return list;
    });
    const View to = movedView(from, {4 * 0.04, 0, 0});
    const LayeredImage seen = seenFrom(image, from, to);
    keepLayers(image, {.nearest = 1});
    const LayeredImage first_layer = seenFrom(image, from, to);
    int holes = 0;
    for (int y = 0; y < 24; ++y) {
        for (int x = 0; x < 38; ++x) {
            const bool front = covered(x + 4, y);
            expectColor(onlyFragment(seen, x, y), front ? kSquare : paint(x + 2, y));
            // If only one layer was captured, the wall has a hole at the former place of the
            // square.
            const bool known = front || !covered(x + 2, y);
            ASSERT_EQ(first_layer.count(first_layer.pixelIndex(x, y)), known ? 1U : 0U);
            holes += !known;
        }
    }
    EXPECT_EQ(holes, 2 * 8);
}

TEST(Reprojection, TransparentSurfacesAreBlendedInOrderOnce) {
    const Color near{0.3F, 0, 0, 0.5F}, far{0, 0.2F, 0, 0.25F}, wall{0, 0, 1, 1};
    const View from = viewOf(48, 32);
    const LayeredImage image = fragmentLists(from.crop, [&](int, int) {
        return std::vector<TestFragment>{{3, near}, {3.2F, far}, {4, wall}, {9, near}};
    });
    const LayeredImage seen = seenFrom(image, from, orbited(from, 3.5, 15));
    CompositeImage composite;
    compositeOver(seen, {}, composite);
    for (int y = 12; y < 20; ++y) {
        for (int x = 18; x < 30; ++x) {
            ASSERT_EQ(seen.count(seen.pixelIndex(x, y)), 3U) << "nothing behind the wall";
            expectColor(composite.rgba[seen.pixelIndex(x, y)], {0.3F, 0.5F * 0.2F, 0.5F * 0.75F, 1},
                        1e-5F);
        }
    }
}

TEST(Reprojection, ATiltedPlaneHasNoCracksAndLiesWhereItShould) {
    // The plane is n·p = −1 in the captured camera's space, tilted by 45°.
    const glm::dvec3 n = glm::normalize(glm::dvec3(std::sin(0.8), 0.2, std::cos(0.8))) / 3.0;
    const View from = viewOf(64, 64);
    const auto ray = [](double x, double y) {
        return glm::dvec3(0.02 * (x + 0.5) - 0.64, 0.64 - 0.02 * (y + 0.5), -1);
    };
    const LayeredImage image = fragmentLists(from.crop, [&](int x, int y) {
        return std::vector<TestFragment>{
            {static_cast<float>(-1 / glm::dot(n, ray(x, y))), {0.1F, 0.1F, 0.1F, 0.2F}}};
    });
    for (const double degrees : {-35.0, -10.0, 10.0, 25.0}) {
        const View to = orbited(from, 3, degrees);
        const LayeredImage seen = seenFrom(image, from, to);
        const glm::dvec3 eye(to.camera_to_world[3]);
        int covered = 0;
        for (int y = 0; y < 64; ++y) {
            for (int x = 0; x < 64; ++x) {
                const glm::dvec3 direction(to.camera_to_world * glm::dvec4(ray(x, y), 0));
                const double z = -(1 + glm::dot(n, eye)) / glm::dot(n, direction);
                // `at` is the point's position in the captured picture, in pixels.
                const glm::dvec3 point = eye + z * direction;
                const glm::dvec2 at = glm::dvec2(point.x, -point.y) / -point.z * 50.0 + 32.0;
                const double margin = std::min(std::min(at.x, at.y), 64 - std::max(at.x, at.y));
                const std::uint32_t count = seen.count(seen.pixelIndex(x, y));
                if (!(z > 0) || point.z > 0 || margin < -0.1) {
                    EXPECT_EQ(count, 0U);
                } else if (margin > 0.1) {
                    ASSERT_EQ(count, 1U) << degrees << ": " << x << ' ' << y;
                    EXPECT_NEAR(seen.z[seen.offsets[seen.pixelIndex(x, y)]], z, 3e-5 * z);
                    ++covered;
                }
            }
        }
        EXPECT_GT(covered, 1000) << degrees;
    }
}

TEST(Reprojection, EdgesDoNotGrow) {
    // A ball of radius 1 is captured at distance 4, and seen from other directions at the same
    // distance. No pixel outside the ball's silhouette may be covered, and few pixels of the
    // visible part may be missing.
    constexpr int kSize = 240;
    constexpr double kPixel = 1.6 / kSize;
    View from = viewOf(kSize, kSize);
    from.projection.half_width = from.projection.half_height = 0.8;
    const auto ray = [](int x, int y) {
        return glm::dvec3(kPixel * (x + 0.5) - 0.8, 0.8 - kPixel * (y + 0.5), -1);
    };
    const glm::dvec3 center(0, 0, -4);
    // Returns the depth of the nearer intersection with the ball, or 0.
    const auto hit = [&](const glm::dvec3& d) {
        const double b = glm::dot(d, center), c = glm::dot(center, center) - 1, a = glm::dot(d, d);
        return b * b < a * c ? 0 : (b - std::sqrt(b * b - a * c)) / a;
    };
    const LayeredImage image = fragmentLists(from.crop, [&](int x, int y) {
        const double z = hit(ray(x, y));
        std::vector<TestFragment> list;
        if (z > 0) list.push_back({static_cast<float>(z), {1, 1, 1, 1}});
        return list;
    });
    for (const double degrees : {0.0, 8.0, 20.0}) {
        const LayeredImage seen = seenFrom(image, from, orbited(from, 4, degrees));
        const double turn = glm::radians(degrees);
        int missing = 0, visible = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const double z = hit(ray(x, y));
                const std::uint32_t count = seen.count(seen.pixelIndex(x, y));
                if (count > 0) {
                    // A covered pixel may extend beyond the silhouette's tangent cone by up to half
                    // its diagonal.
                    const glm::dvec3 d = glm::normalize(ray(x, y));
                    const double angle = std::acos(-d.z) - std::asin(0.25);
                    EXPECT_LT(angle, 0.71 * kPixel) << degrees << ": " << x << ' ' << y;
                }
                if (z <= 0) continue;
                // Skip points that the captured camera did not see, or saw at less than 10° to the
                // surface.
                const glm::dvec3 normal = z * ray(x, y) - center;
                const glm::dvec3 eye(-4 * std::sin(turn), 0, 4 * std::cos(turn));
                if (glm::dot(normal, glm::normalize(eye - normal)) < 0.17) continue;
                ++visible;
                missing += count == 0;
            }
        }
        EXPECT_GT(visible, 4000);
        EXPECT_LE(missing, visible / 500) << degrees;
    }
}

/// Returns random fragment lists whose surfaces cross, touch and end anywhere.
LayeredImage noise(const Window& window) {
    std::mt19937 random(20);
    std::uniform_real_distribution<float> any(0, 1);
    return fragmentLists(window, [&](int x, int) {
        std::vector<TestFragment> list;
        const int count = static_cast<int>(any(random) * 6);
        float z = 1 + any(random);
        for (int k = 0; k < count; ++k) {
            const float alpha = 0.1F + 0.8F * any(random);
            list.push_back({z, {alpha * any(random), alpha * any(random), alpha, alpha}});
            // Every second fragment has the same depth as the next.
            if (k % 2 == x % 2) z += any(random) * any(random);
        }
        return list;
    });
}

TEST(Reprojection, TheCapturedCameraSeesTheCapture) {
    for (const bool perspective : {true, false}) {
        View from = viewOf(50, 40, perspective);
        from.camera_to_world =
            glm::rotate(glm::translate(glm::dmat4(1), {3, -2, 7}), 0.7, glm::dvec3(0.6, 0.8, 0));
        from.crop = {5, 3, 47, 39};
        const LayeredImage image = noise(from.crop);
        const LayeredImage seen = seenFrom(image, from, from);
        ASSERT_EQ(seen.offsets, image.offsets);
        EXPECT_EQ(seen.z, image.z);
        for (std::size_t f = 0; f < image.fragments(); ++f)
            expectColor(colorOf(seen, f), colorOf(image, f), 1e-6F);
    }
}

TEST(Reprojection, ThreadsAndCropsChangeNothing) {
    const View from = viewOf(70, 300);
    const LayeredImage image = noise(from.crop);
    const View to = orbited(from, 2, 12);
    setThreadCount(1);
    const LayeredImage one = seenFrom(image, from, to);
    setThreadCount(3);
    const LayeredImage three = seenFrom(image, from, to);
    setThreadCount(0);
    EXPECT_GT(one.fragments(), 10'000U);
    EXPECT_EQ(one.offsets, three.offsets);
    EXPECT_EQ(one.z, three.z);
    EXPECT_EQ(one.color.data, three.color.data);

    View part = to;
    part.crop = {11, 37, 40, 290};
    const LayeredImage cropped = seenFrom(image, from, part);
    for (int y = part.crop.y0; y < part.crop.y1; ++y) {
        for (int x = part.crop.x0; x < part.crop.x1; ++x) {
            const std::size_t here = cropped.pixelIndex(x, y), there = one.pixelIndex(x, y);
            ASSERT_EQ(cropped.count(here), one.count(there));
            for (std::uint32_t k = 0; k < one.count(there); ++k)
                EXPECT_EQ(cropped.z[cropped.offsets[here] + k], one.z[one.offsets[there] + k]);
        }
    }
}

TEST(Reprojection, WhatIsBehindTheCameraOrNoDepthIsLeftOut) {
    const View from = viewOf(6, 4);
    const std::array<float, 6> depths = {std::nanf(""), HUGE_VALF, 2, 0.5F, 0, -1};
    const LayeredImage image = fragmentLists(from.crop, [&](int x, int) {
        return std::vector<TestFragment>{{depths[static_cast<std::size_t>(x)], {1, 1, 1, 1}}};
    });
    EXPECT_EQ(seenFrom(image, from, from).fragments(), 2U * 4);
    EXPECT_EQ(seenFrom(image, from, movedView(from, {0, 0, -1})).fragments(), 2U * 4)
        << "the column at 2 is twice as wide from half as far, the one at 0.5 is behind";
    const LayeredImage nothing =
        fragmentLists(from.crop, [](int, int) { return std::vector<TestFragment>{}; });
    EXPECT_EQ(seenFrom(nothing, from, from).fragments(), 0U);
}

/// Returns a view from the origin through a lens.
View lensView(const Lens& lens, const Intrinsics& intrinsics, const Size& size) {
    View view;
    view.width = size.width;
    view.height = size.height;
    view.crop = {0, 0, size.width, size.height};
    setLens(view, {lens, intrinsics});
    return view;
}

TEST(Reprojection, APinholeSeesAWallThatAFisheyeSaw) {
    // A wall at distance 4, seen across 170 degrees.
    const auto colorOfWall = [](const glm::dvec3& at) {
        return Color{static_cast<float>(0.5 + 0.5 * std::sin(at.x)),
                     static_cast<float>(0.5 + 0.5 * std::sin(at.y)), 0.25F, 1};
    };
    const View from =
        lensView({"opencv-fisheye", {0.02, -0.003, 0, 0}}, {60, 62, 99, 101}, {200, 200});
    const LayeredImage image = fragmentLists(from.crop, [&](int x, int y) {
        const glm::dvec3 direction = rayOf(from, {x + 0.5, y + 0.5}).direction;
        std::vector<TestFragment> list;
        if (direction.z > -0.1) return list;
        const double t = 4 / -direction.z;
        list.push_back({static_cast<float>(t), colorOfWall(t * direction)});
        return list;
    });
    View to = movedView(viewOf(60, 40), {0.5, -0.25, -1});
    const LayeredImage seen = seenFrom(image, from, to);
    for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 60; ++x) {
            const Color color = onlyFragment(seen, x, y);
            if (HasFailure()) return;
            const double z = seen.z[seen.offsets[seen.pixelIndex(x, y)]];
            EXPECT_NEAR(z, 3, 2e-3) << x << ' ' << y;
            expectColor(color, colorOfWall(worldPosition(to, x + 0.5, y + 0.5, 3)), 0.01F);
        }
    }
}

TEST(Reprojection, APanoramaIsSeenInEveryDirection) {
    const View from = lensView({"equirectangular"}, {}, {96, 48});
    const LayeredImage image = fragmentLists(from.crop, [&](int x, int y) {
        return std::vector<TestFragment>{{3, paint(x, y)}};
    });
    const auto across = [](const glm::dmat4& turn) {
        View to = viewOf(40, 40);
        to.projection.half_width = to.projection.half_height = 1;
        to.camera_to_world = turn;
        return to;
    };
    for (const double degrees : {0.0, 77.0, 150.0, 180.0}) {
        for (const glm::dvec3 axis : {glm::dvec3(0, 1, 0), glm::dvec3(1, 0, 0)}) {
            const View to = across(glm::rotate(glm::dmat4(1), glm::radians(degrees), axis));
            const LayeredImage seen = seenFrom(image, from, to);
            for (int y = 0; y < 40; ++y) {
                for (int x = 0; x < 40; ++x) {
                    onlyFragment(seen, x, y);
                    if (HasFailure()) return;
                    const double z = seen.z[seen.offsets[seen.pixelIndex(x, y)]];
                    EXPECT_NEAR(glm::length(worldPosition(to, x + 0.5, y + 0.5, z)), 3, 0.02);
                }
            }
        }
    }
}

TEST(Reprojection, PixelsWithoutARayAndNeighbourlessPixelsAreLeftOut) {
    // The lens sees 180 degrees to each side, within 31 pixels of the centre.
    const View from = lensView({"fisheye"}, {10, 10, 39.5, 39.5}, {80, 80});
    const LayeredImage image = fragmentLists(from.crop, [&](int x, int y) {
        std::vector<TestFragment> list;
        if (rayOf(from, {x + 0.5, y + 0.5}).direction != glm::dvec3(0))
            list.push_back({2, paint(x, y)});
        return list;
    });
    const View to = viewOf(30, 30);
    const LayeredImage seen = seenFrom(image, from, to);
    EXPECT_EQ(seen.fragments(), 900U);
    const View cube = lensView({"cube"}, {}, {60, 40});
    EXPECT_THROW(seenFrom(image, cube, to), Error);
}

}  // namespace
}  // namespace peeler::test
