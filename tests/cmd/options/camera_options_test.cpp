// SPDX-License-Identifier: Apache-2.0
// Tests the selection, construction and framing of cameras.
#include "cmd/options/camera_options.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <optional>
#include <random>
#include <string>

#include <peeler/error.h>
#include "core/scene/framing.h"

namespace peeler::cmd {
namespace {

Scene boxScene(const Bounds& box) {
    Scene scene;
    scene.materials.emplace_back();
    Primitive primitive;
    primitive.topology = Topology::kPoints;
    for (int i = 0; i < 8; ++i) {
        primitive.positions.emplace_back(i & 1 ? box.max.x : box.min.x,
                                         i & 2 ? box.max.y : box.min.y,
                                         i & 4 ? box.max.z : box.min.z);
    }
    scene.meshes.push_back({"box", {primitive}});
    Node node;
    node.mesh = 0;
    scene.nodes.push_back(node);
    scene.scenes.push_back({"", {0}});
    return scene;
}

void addCamera(Scene& scene, const Camera& camera, const glm::dmat4& place,
               const std::string& node_name = "") {
    Node node;
    node.name = node_name;
    node.camera = static_cast<int>(scene.cameras.size());
    node.local = place;
    scene.cameras.push_back(camera);
    scene.scenes[0].roots.push_back(static_cast<int>(scene.nodes.size()));
    scene.nodes.push_back(node);
}

View view(const Scene& scene, const CameraOptions& options = {}) {
    checkCamera(options);
    const PosedScene shown(scene, 0);
    return makeView(shown, SceneExtent(shown), options);
}

std::optional<Error> failure(const Scene& scene, const CameraOptions& options) {
    try {
        view(scene, options);
    } catch (const Error& error) {
        return error;
    }
    return std::nullopt;
}

const Bounds kUnit{glm::dvec3(-1), glm::dvec3(1)};

glm::dvec3 eyeOf(const View& v) {
    return glm::dvec3(v.camera_to_world[3]);
}
glm::dvec3 forwardOf(const View& v) {
    return -glm::dvec3(v.camera_to_world[2]);
}

void expectRigid(const glm::dmat4& m) {
    const glm::dmat3 r(m);
    const glm::dmat3 identity = glm::transpose(r) * r;
    for (int c = 0; c < 3; ++c) {
        for (int i = 0; i < 3; ++i)
            EXPECT_NEAR(identity[c][i], c == i ? 1 : 0, 1e-12);
    }
    EXPECT_NEAR(glm::determinant(r), 1, 1e-12);
}

/// Returns the share of the frame's width or height that the box fills, the larger of the two;
/// infinite if a corner is in front of the near plane or beyond the far plane.
double share(const View& v, const Bounds& box) {
    const glm::dmat4 clip = v.projection.matrix() * glm::inverse(v.camera_to_world);
    double worst = 0;
    for (int i = 0; i < 8; ++i) {
        const glm::dvec4 p =
            clip * glm::dvec4(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                              i & 4 ? box.max.z : box.min.z, 1);
        if (!(p.w > 0 && p.z >= 0 && p.z <= p.w)) return std::numeric_limits<double>::infinity();
        worst = std::max({worst, std::abs(p.x) / p.w, std::abs(p.y) / p.w});
    }
    return worst;
}

TEST(Framing, HoldsEveryCornerOfRandomScenes) {
    const unsigned seed = std::random_device{}();
    RecordProperty("seed", std::to_string(seed));
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int round = 0; round < 3000; ++round) {
        const double scale = std::pow(10, unit(random) * 24 - 12);
        glm::dvec3 extent, centre;
        for (int i = 0; i < 3; ++i) {
            extent[i] = unit(random) < 0.2 ? 0 : scale * std::pow(unit(random), 4);
            centre[i] = scale * (unit(random) - 0.5) * 10;
        }
        const Scene scene = boxScene({centre - extent, centre + extent});
        const Bounds box = *PosedScene(scene, 0).bounds();  // the bounds are in single precision
        CameraOptions options;
        const auto side = [&] { return 1 + static_cast<int>(std::pow(unit(random), 4) * 65535); };
        options.size = {side(), side()};
        if (unit(random) < 0.3) options.fov = 0.1 + 179 * unit(random);
        if (unit(random) < 0.3) {
            options.up = glm::dvec3(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
        }
        if (unit(random) < 0.2) options.target = centre + extent * 3.0;
        const View v = view(scene, options);
        expectRigid(v.camera_to_world);
        ASSERT_LT(share(v, box), 0.95)
            << "round " << round << ", size " << options.size.width << " x " << options.size.height;
        // Skips rods. A rod seen end-on may be small in the frame, because its near end limits the
        // distance of the eye.
        const glm::dvec3 sides = box.max - box.min;
        const double smallest = std::min({sides.x, sides.y, sides.z});
        const double middle =
            sides.x + sides.y + sides.z - smallest - std::max({sides.x, sides.y, sides.z});
        if (!options.target && middle > 0.3 * glm::length(sides) && !options.fov) {
            EXPECT_GT(share(v, box), 0.1) << "round " << round;
        }
    }
}

TEST(Framing, BearsEmptyFlatAndSinglePointScenes) {
    Scene empty = boxScene(kUnit);
    empty.scenes[0].roots.clear();
    expectRigid(view(empty).camera_to_world);
    for (const Bounds& box :
         {Bounds{glm::dvec3(0), glm::dvec3(0)}, Bounds{glm::dvec3(1e30), glm::dvec3(1e30)},
          Bounds{{-1, 0, -1}, {1, 0, 1}}, Bounds{{0, 0, -1e-20}, {0, 0, 1e-20}},
          Bounds{{-1e30, 0, 0}, {1e30, 0, 0}}}) {
        const Scene scene = boxScene(box);
        const View v = view(scene);
        expectRigid(v.camera_to_world);
        EXPECT_LT(share(v, *PosedScene(scene, 0).bounds()), 0.95);
        EXPECT_GT(v.projection.near, 0);
    }
}

TEST(Framing, LooksFromTheFrontAndAbove) {
    const glm::dvec3 eye = eyeOf(view(boxScene(kUnit)));
    EXPECT_GT(eye.x, 0);
    EXPECT_GT(eye.y, 0);
    EXPECT_GT(eye.z, eye.x);
    // With Z up, the camera looks from −Y.
    CameraOptions z_up;
    z_up.up = glm::dvec3(0, 0, 2);
    const glm::dvec3 other = eyeOf(view(boxScene(kUnit), z_up));
    EXPECT_GT(other.x, 0);
    EXPECT_GT(other.z, 0);
    EXPECT_LT(other.y, -other.x);
    // An up direction of −Y needs no special treatment.
    CameraOptions down;
    down.up = glm::dvec3(0, -1, 0);
    EXPECT_LT(eyeOf(view(boxScene(kUnit), down)).y, 0);
}

/// Returns the bounds of a scene's vertices in the picture, whose sides are at −1 and 1.
Bounds onScreen(const View& v, const Scene& scene) {
    const glm::dmat4 clip = v.projection.matrix() * glm::inverse(v.camera_to_world);
    Bounds reach{glm::dvec3(1e9), glm::dvec3(-1e9)};
    for (const glm::vec3& position : scene.meshes[0].primitives[0].positions) {
        const glm::dvec4 p = clip * glm::dvec4(glm::dvec3(position), 1);
        reach.min = glm::min(reach.min, glm::dvec3(p) / p.w);
        reach.max = glm::max(reach.max, glm::dvec3(p) / p.w);
    }
    return reach;
}

TEST(Framing, LeavesFivePercentFreeAtBothEnds) {
    for (const Bounds& box : {kUnit, Bounds{{3, 0, -2}, {9, 1, 4}}, Bounds{{0, 0, 0}, {1, 7, 1}},
                              Bounds{{-5, -2, 0}, {5, 2, 0}}, Bounds{{-1, 0, -1}, {1, 0, 2}}}) {
        for (const Size size : {Size{1280, 720}, Size{300, 300}, Size{200, 900}}) {
            const Scene scene = boxScene(box);
            CameraOptions options;
            options.size = size;
            const Bounds reach = onScreen(view(scene, options), scene);
            // The scene fills the limiting side of the frame from 5 % to 95 %, i.e. ±0.9, and the
            // other side less.
            const bool wide = reach.max.x - reach.min.x > reach.max.y - reach.min.y;
            const int side = wide ? 0 : 1;
            EXPECT_NEAR(reach.min[side], -0.9, 1e-6);
            EXPECT_NEAR(reach.max[side], 0.9, 1e-6);
            EXPECT_LE(reach.max[1 - side], 0.9 + 1e-6);
            EXPECT_GE(reach.min[1 - side], -0.9 - 1e-6);
            EXPECT_NEAR(reach.min[1 - side], -reach.max[1 - side], 1e-3);
        }
    }
}

TEST(Framing, LooksAtFlatScenesFromTheFront) {
    const auto forward = [](const Bounds& box) { return forwardOf(view(boxScene(box))); };
    const auto expect = [](const glm::dvec3& found, const glm::dvec3& wanted) {
        EXPECT_LT(glm::length(found - wanted), 1e-12)
            << found.x << ' ' << found.y << ' ' << found.z;
    };
    expect(forward({{-2, -1, 0}, {2, 1, 0}}), {0, 0, -1});
    // The depth is less than 1/20 of the height, 2.
    expect(forward({{-2, -1, 0}, {2, 1, 0.098}}), {0, 0, -1});
    expect(forward({{0, -1, -2}, {0, 1, 2}}), {-1, 0, 0});
    expect(forward({{-2, 0, -1}, {2, 0, 1}}), {0, -1, 0});  // the camera sees a floor from above
    EXPECT_GT(view(boxScene({{-2, 0, -1}, {2, 0, 1}})).camera_to_world[1].z, -1.001);
    expect(glm::dvec3(view(boxScene({{-2, 0, -1}, {2, 0, 1}})).camera_to_world[1]), {0, 0, -1});
    // Thicker boxes, a rod and a point are not flat.
    for (const Bounds& box : {Bounds{{-2, -1, 0}, {2, 1, 0.102}}, Bounds{{-2, 0, 0}, {2, 0, 0}},
                              Bounds{{1, 1, 1}, {1, 1, 1}}, kUnit})
        expect(forward(box), pleasingForward({0, 1, 0}));
    // With Z up, a floor is in the XY plane, and the top of the picture is +Y.
    CameraOptions z_up;
    z_up.up = glm::dvec3(0, 0, 1);
    const View map = view(boxScene({{-2, -1, 0}, {2, 1, 0}}), z_up);
    expect(forwardOf(map), {0, 0, -1});
    expect(glm::dvec3(map.camera_to_world[1]), {0, 1, 0});
}

TEST(Framing, LooksAtFlatScenesFromTheSideThatTheyShow) {
    const auto forward = [](std::vector<std::uint32_t> indices, bool mirrored) {
        Scene scene = boxScene({{-2, -1, 0}, {2, 1, 0}});
        Primitive& primitive = scene.meshes[0].primitives[0];
        primitive.topology = Topology::kTriangles;
        primitive.indices = std::move(indices);
        if (mirrored) scene.nodes[0].local = glm::scale(glm::dmat4(1), glm::dvec3(-1, 1, 1));
        return forwardOf(view(scene));
    };
    EXPECT_EQ(forward({0, 1, 3, 0, 3, 2}, false).z, -1);
    EXPECT_EQ(forward({0, 3, 1, 0, 2, 3}, false).z, 1);
    EXPECT_EQ(forward({0, 1, 3, 0, 3, 2}, true).z, -1);
    // If as many triangles face backwards as forwards, the camera looks at the front.
    EXPECT_EQ(forward({0, 1, 3, 3, 1, 0}, false).z, -1);
}

TEST(Framing, OrthographicIsPlacedInFront) {
    CameraOptions options;
    options.ortho_height = 5;
    const View v = view(boxScene(kUnit), options);
    EXPECT_FALSE(v.projection.perspective);
    EXPECT_DOUBLE_EQ(v.projection.half_height, 2.5);
    EXPECT_LT(share(v, kUnit), 1);
}

TEST(BuiltCamera, StandsAndLooksAsAsked) {
    CameraOptions options;
    options.eye = glm::dvec3(0, 0, 10);
    options.fov = 90;
    options.size = {200, 100};
    const View v = view(boxScene(kUnit), options);
    EXPECT_EQ(eyeOf(v), glm::dvec3(0, 0, 10));
    EXPECT_NEAR(glm::length(forwardOf(v) - glm::dvec3(0, 0, -1)), 0, 1e-12);
    EXPECT_NEAR(v.projection.half_height, 1, 1e-12);
    EXPECT_NEAR(v.projection.half_width, 2, 1e-12);
    EXPECT_TRUE(std::isinf(v.projection.far));
    EXPECT_EQ(v.camera_name, "");
    EXPECT_EQ(v.crop, (Window{0, 0, 200, 100}));
}

TEST(BuiltCamera, MayLookStraightDown) {
    CameraOptions options;
    options.eye = glm::dvec3(0, 10, 0);
    const View v = view(boxScene(kUnit), options);
    EXPECT_NEAR(glm::length(glm::dvec3(v.camera_to_world[1]) - glm::dvec3(0, 0, -1)), 0, 1e-12);
}

TEST(BuiltCamera, RefusesWhatCannotBe) {
    const Scene scene = boxScene(kUnit);
    CameraOptions parallel;
    parallel.eye = glm::dvec3(0, 10, 0);
    parallel.up = glm::dvec3(0, -3, 0);
    // By default the target is the centre, which is straight below the eye.
    EXPECT_EQ(failure(scene, parallel)->kind(), ErrorKind::kUsage);
    parallel.target = glm::dvec3(0, 0, 0);
    // With an explicit target, the error is found without the scene.
    EXPECT_EQ(failure(scene, parallel)->kind(), ErrorKind::kUsage);
    CameraOptions inside;
    inside.eye = glm::dvec3(0);
    EXPECT_EQ(failure(scene, inside)->kind(), ErrorKind::kUsage);
    CameraOptions both;
    both.fov = 40;
    both.ortho_height = 1;
    EXPECT_EQ(failure(scene, both)->kind(), ErrorKind::kUsage);
    CameraOptions crossed;
    crossed.near = 2;
    crossed.far = 1;
    EXPECT_EQ(failure(scene, crossed)->kind(), ErrorKind::kUsage);
    CameraOptions mixed;
    mixed.camera = "0";
    mixed.fov = 40;
    EXPECT_EQ(failure(scene, mixed)->kind(), ErrorKind::kUsage);
}

TEST(SceneCamera, KeepsItsVerticalFieldOfView) {
    Scene scene = boxScene(kUnit);
    Camera camera;
    camera.yfov = 1;
    camera.aspect_ratio = 2;
    camera.znear = 0.5;
    camera.zfar = 50;
    addCamera(scene, camera, glm::translate(glm::dmat4(1), glm::dvec3(0, 0, 5)));
    for (const Size size : {Size{1280, 720}, Size{100, 1000}, Size{640, 0}}) {
        CameraOptions options;
        options.size = size;
        const View v = view(scene, options);
        EXPECT_DOUBLE_EQ(v.projection.half_height, std::tan(0.5));
        EXPECT_DOUBLE_EQ(v.projection.half_width, std::tan(0.5) * v.width / v.height);
        EXPECT_EQ(v.projection.near, 0.5);
        EXPECT_EQ(v.projection.far, 50);
        // A height of 0 means the camera's aspect ratio.
        EXPECT_EQ(v.height, size.height == 0 ? 320 : size.height);
    }
    CameraOptions planes;
    planes.near = 1e-3;
    planes.far = std::numeric_limits<double>::infinity();
    EXPECT_EQ(view(scene, planes).projection.near, 1e-3);
    EXPECT_TRUE(std::isinf(view(scene, planes).projection.far));
}

TEST(SceneCamera, OrthographicKeepsItsHeight) {
    Scene scene = boxScene(kUnit);
    Camera camera;
    camera.perspective = false;
    camera.xmag = 6;
    camera.ymag = 3;
    camera.znear = 0;
    camera.zfar = 20;
    addCamera(scene, camera, glm::translate(glm::dmat4(1), glm::dvec3(0, 0, 5)));
    CameraOptions options;
    options.size = {1000, 0};
    const View v = view(scene, options);
    EXPECT_EQ(v.projection.half_height, 3);
    EXPECT_EQ(v.projection.half_width, 6);
    EXPECT_EQ(v.height, 500);
}

TEST(SceneCamera, IsPlacedWithoutScaleAndNeverMirrored) {
    for (const glm::dvec3 scale : {glm::dvec3(1), glm::dvec3(2, 3, 4), glm::dvec3(-1, 1, 1),
                                   glm::dvec3(1e-200), glm::dvec3(1e200), glm::dvec3(-1, -1, -1)}) {
        Scene scene = boxScene(kUnit);
        const glm::dmat4 turned = glm::rotate(glm::dmat4(1), 0.3, glm::dvec3(0, 1, 0));
        addCamera(scene, Camera{}, glm::scale(glm::translate(turned, glm::dvec3(0, 0, 5)), scale));
        const View v = view(scene);
        expectRigid(v.camera_to_world);
        const double sign = scale.z < 0 ? -1 : 1;
        const glm::dvec3 expected = glm::dvec3(turned * glm::dvec4(0, 0, -sign, 0));
        EXPECT_NEAR(glm::length(forwardOf(v) - expected), 0, 1e-12);
    }
    Scene flat = boxScene(kUnit);
    addCamera(flat, Camera{}, glm::scale(glm::dmat4(1), glm::dvec3(1, 1, 0)));
    EXPECT_EQ(failure(flat, {})->kind(), ErrorKind::kInput);
}

TEST(SceneCamera, IsChosenByNameOrIndex) {
    Scene scene = boxScene(kUnit);
    Camera main, top, unnamed;
    main.name = "Main";
    top.name = "Top";
    addCamera(scene, main, glm::translate(glm::dmat4(1), glm::dvec3(0, 0, 5)), "main node");
    addCamera(scene, top, glm::translate(glm::dmat4(1), glm::dvec3(0, 0, 6)));
    addCamera(scene, unnamed, glm::translate(glm::dmat4(1), glm::dvec3(0, 0, 7)));
    const auto distance = [&](const char* name) {
        CameraOptions options;
        if (name) options.camera = name;
        return eyeOf(view(scene, options)).z;
    };
    EXPECT_EQ(distance(nullptr), 5);
    EXPECT_EQ(distance("Main"), 5);
    EXPECT_EQ(distance("main node"), 5);
    EXPECT_EQ(distance("Top"), 6);
    EXPECT_EQ(distance("1"), 6);
    EXPECT_EQ(distance("2"), 7);
    EXPECT_EQ(distance("camera 2"), 7);

    CameraOptions wrong;
    for (const char* name : {"3", "-1", "", "Topp", "99999999999999999999999"}) {
        wrong.camera = name;
        EXPECT_EQ(failure(scene, wrong)->kind(), ErrorKind::kUsage) << name;
    }
    wrong.camera = "top1";
    const Error error = *failure(scene, wrong);
    EXPECT_NE(error.hint().find("did you mean 'Top'?"), std::string::npos) << error.hint();
    EXPECT_NE(error.hint().find("Main, Top, camera 2"), std::string::npos) << error.hint();
    wrong.camera = "Main";
    EXPECT_NE(failure(boxScene(kUnit), wrong)->hint().find("no camera"), std::string::npos);
}

TEST(SceneCamera, RefusesOneWithoutExtent) {
    for (const double yfov : {0.0, -1.0, 3.2, std::nan("")}) {
        Scene scene = boxScene(kUnit);
        Camera camera;
        camera.yfov = yfov;
        addCamera(scene, camera, glm::dmat4(1));
        EXPECT_EQ(failure(scene, {})->kind(), ErrorKind::kInput) << yfov;
    }
}

TEST(Picture, CropMustLieInside) {
    CameraOptions options;
    options.size = {100, 50};
    options.crop = Window{90, 40, 100, 50};
    EXPECT_EQ(view(boxScene(kUnit), options).crop, (Window{90, 40, 100, 50}));
    options.crop = Window{90, 40, 101, 50};
    EXPECT_EQ(failure(boxScene(kUnit), options)->kind(), ErrorKind::kUsage);
    options.size = {100, 0};  // the aspect ratio 16:9 gives 56 rows
    options.crop = Window{0, 0, 1, 57};
    EXPECT_EQ(failure(boxScene(kUnit), options)->kind(), ErrorKind::kUsage);
}

}  // namespace
}  // namespace peeler::cmd
