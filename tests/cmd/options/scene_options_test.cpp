// SPDX-License-Identifier: Apache-2.0
// Tests the selection of a file's scenes and of nodes.
#include "cmd/options/scene_options.h"

#include <gtest/gtest.h>

#include <peeler/error.h>
#include "core/scene/posed_scene.h"

namespace peeler::cmd {
namespace {

/// Returns a scene with these nodes: body (0) with its children arm (1) and lamp (2, a light);
/// floor (3); and an unnamed node (4).
Scene house() {
    Scene scene;
    scene.scenes = {{"", {0, 3, 4}}};
    scene.meshes.resize(5);
    scene.lights.resize(1);
    scene.nodes.resize(5);
    const char* names[] = {"body", "arm", "lamp", "floor", ""};
    for (int i = 0; i < 5; ++i) {
        scene.nodes[static_cast<std::size_t>(i)].name = names[i];
        scene.nodes[static_cast<std::size_t>(i)].mesh = i;
    }
    scene.nodes[0].children = {1, 2};
    scene.nodes[2].light = 0;
    return scene;
}

struct Shown {
    std::vector<int> meshes;
    std::size_t lights = 0;
    bool operator==(const Shown&) const = default;
};

Shown shown(const SceneOptions& options) {
    Scene scene = house();
    selectNodes(scene, options);
    const PosedScene all(scene, 0);
    Shown result;
    for (const MeshInstance& instance : all.meshes())
        result.meshes.push_back(instance.mesh);
    result.lights = all.lights().size();
    return result;
}

TEST(SceneChoice, ByNameOrIndex) {
    Scene scene = house();
    scene.scenes.push_back({"second", {}});
    scene.default_scene = 1;
    SceneOptions options;
    EXPECT_EQ(chooseScene(scene, options), 1);
    options.scene = "0";
    EXPECT_EQ(chooseScene(scene, options), 0);
    options.scene = "second";
    EXPECT_EQ(chooseScene(scene, options), 1);
    options.scene = "secnd";
    EXPECT_THROW(chooseScene(scene, options), Error);
}

TEST(NodeSelection, IncludesWhatIsNamedAndWhatIsBelow) {
    SceneOptions options;
    EXPECT_EQ(shown(options), (Shown{{0, 1, 2, 3, 4}, 1}));
    options.include = {"body"};
    EXPECT_EQ(shown(options), (Shown{{0, 1, 2}, 1}));
    options.include = {"a*", "floor"};
    EXPECT_EQ(shown(options), (Shown{{1, 3}, 1}));  // lights are not meshes, so they stay
    options.include = {"node 4"};
    EXPECT_EQ(shown(options), (Shown{{4}, 1}));
}

TEST(NodeSelection, ExcludesWhatIsNamedAndWhatIsBelow) {
    SceneOptions options;
    options.exclude = {"b?dy"};
    EXPECT_EQ(shown(options), (Shown{{3, 4}, 0}));
    options.exclude = {"[al]*"};
    EXPECT_EQ(shown(options), (Shown{{0, 3, 4}, 0}));
    options.include = {"body"};
    EXPECT_EQ(shown(options), (Shown{{0}, 0}));
}

TEST(NodeSelection, NamesMatchWithAllBelow) {
    const Scene scene = house();
    using Marks = std::vector<char>;
    EXPECT_EQ(nodesMatching(scene, {"body"}, "--part"), (Marks{1, 1, 1, 0, 0}));
    EXPECT_EQ(nodesMatching(scene, {"arm", "node*"}, "--part"), (Marks{0, 1, 0, 0, 1}));
    EXPECT_THROW(nodesMatching(scene, {"arm", "leg"}, "--part"), Error);
}

TEST(NodeSelection, RefusesWhatMatchesNothing) {
    SceneOptions options;
    options.exclude = {"flor"};
    try {
        shown(options);
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_EQ(error.where(), "--exclude flor");
        EXPECT_NE(error.hint().find("'floor'"), std::string::npos) << error.hint();
    }
}

}  // namespace
}  // namespace peeler::cmd
