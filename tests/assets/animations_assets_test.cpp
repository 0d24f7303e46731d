// SPDX-License-Identifier: Apache-2.0
// Tests all animated and all skinned models of the assets: poses match keyframes exactly, and
// vertices are where the specification's formulas put them.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <set>

#include <peeler/error.h>
#include "core/scene/posed_scene.h"
#include "formats/gltf/gltf_reader.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Calls body(scene) for every readable model in both asset folders.
void forEachModel(const fs::path& assets, const std::function<void(const Scene&)>& body) {
    for (const char* folder : {"gltf-sample-assets", "gltf-asset-generator"}) {
        std::set<fs::path> files;
        for (const auto& entry : fs::recursive_directory_iterator(assets / folder))
            if (entry.path().extension() == ".gltf" || entry.path().extension() == ".glb")
                files.insert(entry.path());
        for (const fs::path& file : files) {
            SCOPED_TRACE(file.string());
            try {
                body(readGltf(file));
            } catch (const Error&) {
                // Another test covers rejected files.
            }
        }
    }
}

TEST(AnimatedAssets, MeetTheirKeysExactly) {
    PEELER_REQUIRE_ASSETS(assets);
    std::size_t models = 0, keys = 0;
    std::set<Interpolation> kinds;
    forEachModel(assets, [&](const Scene& scene) {
        models += scene.animations.empty() ? 0 : 1;
        for (const Animation& animation : scene.animations) {
            for (const AnimationChannel& channel : animation.channels) {
                const Keyframes& frames = animation.keyframes[channel.keyframes];
                kinds.insert(frames.interpolation);
                const bool cubic = frames.interpolation == Interpolation::kCubicSpline;
                const std::size_t stride = frames.values.size() / frames.times.size();
                std::vector<double> value(cubic ? stride / 3 : stride);
                for (std::size_t i = 0; i < frames.times.size(); ++i) {
                    sampleKeyframes(frames, double{frames.times[i]},
                                    channel.property == AnimatedProperty::kRotation, value);
                    const float* key =
                        frames.values.data() + i * stride + (cubic ? value.size() : 0);
                    for (std::size_t c = 0; c < value.size(); ++c)
                        ASSERT_EQ(value[c], double{key[c]});
                    ++keys;
                }
            }
        }
    });
    EXPECT_GE(models, 20U);
    EXPECT_GT(keys, 1000U);
    EXPECT_EQ(kinds.size(), 3U);
}

glm::dmat4 worldOf(const Scene& scene, const Pose& pose, int node) {
    for (std::size_t parent = 0; parent < scene.nodes.size(); ++parent)
        for (const int child : scene.nodes[parent].children)
            if (child == node)
                return worldOf(scene, pose, static_cast<int>(parent)) *
                       pose.locals[static_cast<std::size_t>(node)];
    return pose.locals[static_cast<std::size_t>(node)];
}

/// Returns the position of a vertex, computed literally by the formula in glTF §3.7.3.3.
glm::dvec3 skinned(const Primitive& p, const std::vector<glm::dmat4>& joints, std::size_t vertex) {
    glm::dvec4 sum(0);
    for (const JointSet& set : p.joint_sets)
        for (int i = 0; i < 4; ++i)
            sum += double{set.weights[vertex][i]} *
                   (joints[set.joints[vertex][i]] * glm::dvec4(p.positions[vertex], 1));
    return glm::dvec3(sum) / sum.w;
}

TEST(SkinnedAssets, AreWhereTheFormulaPutsThem) {
    PEELER_REQUIRE_ASSETS(assets);
    std::size_t models = 0, vertices = 0;
    forEachModel(assets, [&](const Scene& scene) {
        if (scene.skins.empty()) return;
        ++models;
        for (const double time : {0.0, 0.37, 1.1}) {
            const std::vector<int> playing(scene.animations.empty() ? 0 : 1, 0);
            const Pose pose = poseAt(scene, playing, time);
            const PosedScene shown(scene, scene.default_scene, pose);
            for (const MeshInstance& instance : shown.meshes()) {
                const Node& node = scene.nodes[static_cast<std::size_t>(instance.node)];
                if (node.skin < 0) continue;
                const Skin& skin = scene.skins[static_cast<std::size_t>(node.skin)];
                std::vector<glm::dmat4> joints;
                for (std::size_t j = 0; j < skin.joints.size(); ++j)
                    joints.push_back(worldOf(scene, pose, skin.joints[j]) * skin.inverse_bind[j]);
                const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
                for (std::size_t k = 0; k < mesh.primitives.size(); ++k) {
                    const Primitive& p = mesh.primitives[k];
                    if (p.joint_sets.empty()) continue;
                    const auto& positions = shown.positions(instance, k);
                    for (std::size_t v = 0; v < positions.size(); ++v, ++vertices) {
                        const glm::dvec3 expected = skinned(p, joints, v);
                        const glm::dvec3 found(instance.world * glm::dvec4(positions[v], 1));
                        ASSERT_LE(glm::length(found - expected), 1e-6 * (1 + glm::length(expected)))
                            << v;
                    }
                }
            }
        }
    });
    EXPECT_GE(models, 15U);
    EXPECT_GT(vertices, 15000U);
}

}  // namespace
}  // namespace peeler::test
