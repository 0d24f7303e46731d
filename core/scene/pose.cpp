// SPDX-License-Identifier: Apache-2.0
#include "core/scene/pose.h"

#include "core/scene/keyframes.h"

namespace peeler {
namespace {

using Values = std::vector<double>;

void setTranslation(Trs& trs, const Values& v) {
    trs.translation = {v[0], v[1], v[2]};
}
void setRotation(Trs& trs, const Values& v) {
    trs.rotation = glm::dquat(v[3], v[0], v[1], v[2]);
}
void setScale(Trs& trs, const Values& v) {
    trs.scale = {v[0], v[1], v[2]};
}

/// In the order of AnimatedProperty, but for the weights.
constexpr struct {
    std::size_t width;
    void (*set)(Trs&, const Values&);
} kTransforms[] = {{3, setTranslation}, {4, setRotation}, {3, setScale}};

std::size_t targetsOf(const Scene& scene, const Node& node) {
    if (node.mesh < 0) return 0;
    const Mesh& mesh = scene.meshes[static_cast<std::size_t>(node.mesh)];
    return mesh.primitives.empty() ? 0 : mesh.primitives.front().targets.size();
}

}  // namespace

Pose restPose(const Scene& scene) {
    Pose pose;
    pose.locals.reserve(scene.nodes.size());
    for (const Node& node : scene.nodes)
        pose.locals.push_back(node.local);
    return pose;
}

Pose poseAt(const Scene& scene, std::span<const int> animations, double time) {
    Pose pose = restPose(scene);
    std::map<int, Trs> moved;
    Values value;
    for (const int index : animations) {
        const Animation& animation = scene.animations[static_cast<std::size_t>(index)];
        for (const AnimationChannel& channel : animation.channels) {
            const Node& node = scene.nodes[static_cast<std::size_t>(channel.node)];
            const Keyframes& keyframes = animation.keyframes[channel.keyframes];
            if (channel.property == AnimatedProperty::kWeights) {
                value.resize(targetsOf(scene, node));
                sampleKeyframes(keyframes, time, false, value);
                pose.weights[channel.node] = value;
            } else if (node.trs) {
                const auto& transform = kTransforms[static_cast<std::size_t>(channel.property)];
                value.resize(transform.width);
                sampleKeyframes(keyframes, time, channel.property == AnimatedProperty::kRotation,
                                value);
                transform.set(moved.try_emplace(channel.node, *node.trs).first->second, value);
            }
        }
    }
    for (const auto& [node, trs] : moved)
        pose.locals[static_cast<std::size_t>(node)] = trs.matrix();
    return pose;
}

}  // namespace peeler
