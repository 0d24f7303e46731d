// SPDX-License-Identifier: Apache-2.0
// Tests that draw order and keys are the same for instanced and individual draws.
#include "core/scene/draw_list.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include <peeler/error.h>
#include "core/scene/posed_scene.h"

namespace peeler {
namespace {

glm::dmat4 placeAt(double x, double scale = 1) {
    return glm::scale(glm::translate(glm::dmat4(1), glm::dvec3(x, 0, 0)), glm::dvec3(scale, 1, 1));
}

/// Returns a scene of two nodes that share a mesh: a strip of three triangles. The first node has
/// four instances, the third of which is mirrored; the second node has one.
Scene rowOfStrips() {
    Scene scene;
    scene.materials.resize(1);
    Primitive& strip = scene.meshes.emplace_back().primitives.emplace_back();
    strip.topology = Topology::kTriangleStrip;
    strip.positions.resize(5);
    scene.nodes.resize(2);
    scene.nodes[0].mesh = scene.nodes[1].mesh = 0;
    scene.nodes[0].instances = {placeAt(0), placeAt(1), placeAt(2, -1), placeAt(3)};
    scene.scenes = {{"", {0, 1}}};
    return scene;
}

/// Returns rowOfStrips(), with a second primitive of two triangles in the mesh.
Scene grove() {
    Scene scene = rowOfStrips();
    scene.meshes[0].primitives.emplace_back().positions.resize(6);
    return scene;
}

struct Expected {
    std::size_t instances;
    std::uint32_t first;
    bool mirrored;
    bool operator==(const Expected&) const = default;
};

std::vector<Expected> draws(const DrawList& list) {
    std::vector<Expected> result;
    for (const Draw& draw : list.draws())
        result.push_back({draw.instances, draw.first_primitive, draw.mirrored});
    return result;
}

TEST(DrawList, DrawsTheInstancesOfANodeAtOnce) {
    const Scene scene = rowOfStrips();
    const PosedScene shown(scene);
    const DrawList& list = shown.drawList();
    // A mirrored instance has the opposite winding, so it must be a separate draw.
    EXPECT_EQ(draws(list),
              (std::vector<Expected>{{2, 1, false}, {1, 7, true}, {1, 10, false}, {1, 13, false}}));
    EXPECT_EQ(list.draws()[0].instance_keys, 3U);
    EXPECT_EQ(list.geometries().size(), 1U);
    EXPECT_EQ(list.worlds(list.draws()[0])[1], placeAt(1));
    EXPECT_EQ(list.worlds(list.draws()[2])[0], placeAt(3));
}

TEST(DrawList, DrawsMeshesOfSeveralPrimitivesPlaceByPlace) {
    const Scene scene = grove();
    const PosedScene shown(scene);
    const DrawList& list = shown.drawList();
    // A single instanced draw would draw the first primitive of all instances before the second
    // primitive of the first instance. So each instance has its own draws.
    EXPECT_EQ(draws(list), (std::vector<Expected>{{1, 1, false},
                                                  {1, 4, false},
                                                  {1, 6, false},
                                                  {1, 9, false},
                                                  {1, 11, true},
                                                  {1, 14, true},
                                                  {1, 16, false},
                                                  {1, 19, false},
                                                  {1, 21, false},
                                                  {1, 24, false}}));
    EXPECT_EQ(list.geometries().size(), 2U);
}

TEST(DrawList, NumbersSurfacesInDrawOrder) {
    const Scene scene = grove();
    const PosedScene shown(scene);
    const DrawList& list = shown.drawList();
    std::vector<std::uint32_t> surfaces;
    for (std::uint32_t key = 1; key <= 25; ++key)
        surfaces.push_back(list.surfaceOf(key));
    EXPECT_EQ(surfaces, (std::vector<std::uint32_t>{0, 0, 0, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4,
                                                    5, 5, 6, 6, 6, 7, 7, 8, 8, 8, 9, 9}));
    const Scene line = rowOfStrips();
    const PosedScene line_shown(line);
    const DrawList& at_once = line_shown.drawList();
    EXPECT_EQ(at_once.surfaceOf(3), 0U);
    EXPECT_EQ(at_once.surfaceOf(4), 1U);
    EXPECT_EQ(at_once.surfaceOf(15), 4U);
}

TEST(DrawList, KnowsWhereKeysComeFrom) {
    const Scene scene = grove();  // a strip of three triangles and a list of two, in five places
    const PosedScene shown(scene);
    const DrawList& list = shown.drawList();
    for (std::uint32_t key = 1; key <= 25; ++key) {
        const std::uint32_t in_mesh = (key - 1) % 5;
        const KeyOrigin origin = list.originOf(key);
        EXPECT_EQ(origin.instance, (key - 1) / 5);
        EXPECT_EQ(origin.in_mesh, in_mesh);
        EXPECT_EQ(origin.primitive, in_mesh < 3 ? 0U : 1U);
        EXPECT_EQ(origin.element, in_mesh < 3 ? in_mesh : in_mesh - 3);
    }
}

TEST(DrawList, FindsKeysAmongSurfacesOfAnySize) {
    // The meshes: one with empty primitives before, between and after others; one with many
    // triangles; many with one triangle; and an empty mesh. Counting gives the expected origin of
    // each key.
    Scene scene;
    scene.materials.resize(1);
    const auto add = [&](const std::vector<std::size_t>& triangles, std::size_t nodes) {
        Mesh& mesh = scene.meshes.emplace_back();
        for (const std::size_t count : triangles)
            mesh.primitives.emplace_back().positions.resize(3 * count);
        for (std::size_t i = 0; i < nodes; ++i) {
            scene.scenes.resize(1);
            scene.scenes[0].roots.push_back(static_cast<int>(scene.nodes.size()));
            scene.nodes.emplace_back().mesh = static_cast<int>(scene.meshes.size()) - 1;
        }
    };
    add({0, 2, 0, 0, 3, 0}, 2);
    add({5000}, 1);
    add({1}, 700);
    add({0}, 1);
    const PosedScene shown(scene);
    const DrawList& list = shown.drawList();
    std::uint32_t key = 0, surface = 0;
    for (std::size_t instance = 0; instance < shown.meshes().size(); ++instance) {
        std::uint32_t in_mesh = 0;
        const auto& primitives = shown.primitives(shown.meshes()[instance]);
        for (std::size_t p = 0; p < primitives.size(); ++p, ++surface) {
            for (std::uint32_t e = 0; e < primitives[p].positions.size() / 3; ++e, ++in_mesh) {
                const KeyOrigin origin = list.originOf(++key);
                ASSERT_EQ(list.surfaceOf(key), surface) << key;
                ASSERT_EQ(origin.instance, instance) << key;
                ASSERT_EQ(origin.primitive, p) << key;
                ASSERT_EQ(origin.element, e) << key;
                ASSERT_EQ(origin.in_mesh, in_mesh) << key;
            }
        }
    }
    EXPECT_EQ(key, 2U * 5 + 5000 + 700);
    EXPECT_EQ(list.surfaces().size(), surface);
}

TEST(DrawList, GivesDeformedMeshesGeometriesOfTheirOwn) {
    Scene scene = rowOfStrips();
    scene.meshes[0].primitives[0].targets.resize(1);
    const PosedScene shown(scene);
    const DrawList& list = shown.drawList();
    EXPECT_EQ(list.geometries().size(), 2U);  // one geometry per node, shared by its instances
    EXPECT_EQ(list.draws()[0].instances, 2U);
}

TEST(DrawList, LeavesOutWhatAlphaRejectsButNotItsKeys) {
    Scene scene = grove();
    scene.materials.resize(2);
    scene.materials[0].alpha_mode = AlphaMode::kBlend;
    scene.materials[0].base_color.a = 0;
    scene.meshes[0].primitives[1].material = 1;
    const PosedScene shown(scene);
    const DrawList& list = shown.drawList();
    ASSERT_EQ(list.draws().size(), 5U);
    EXPECT_EQ(list.draws()[0].first_primitive, 4U);
}

TEST(DrawList, RefusesMorePrimitivesThanKeys) {
    Scene scene = grove();
    scene.meshes[0].primitives[1].positions.resize(300000);
    scene.nodes[0].instances->resize(50000, placeAt(0));
    EXPECT_THROW(PosedScene(scene).drawList(), Error);
}

}  // namespace
}  // namespace peeler
