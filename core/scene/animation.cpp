// SPDX-License-Identifier: Apache-2.0
#include "core/scene/posed_scene.h"

#include <algorithm>

namespace peeler {
namespace {

void slerp(const float* from, const float* to, double u, std::span<double> value) {
    const auto quaternion = [](const float* q) {
        const glm::dquat raw(double{q[3]}, double{q[0]}, double{q[1]}, double{q[2]});
        return glm::length(raw) > 0 ? glm::normalize(raw) : glm::dquat(1, 0, 0, 0);
    };
    const glm::dquat q = glm::slerp(quaternion(from), quaternion(to), u);  // along the shorter arc
    const double parts[] = {q.x, q.y, q.z, q.w};
    std::copy_n(parts, value.size(), value.begin());
}

void lerp(const float* from, const float* to, double u, std::span<double> value) {
    for (std::size_t i = 0; i < value.size(); ++i)
        value[i] = (1 - u) * double{from[i]} + u * double{to[i]};
}

/// Interpolates a cubic spline (glTF 2.0, appendix C.4). Each key holds its in-tangent, value and
/// out-tangent. The keys are `seconds` apart.
void hermite(const float* from, const float* to, double u, double seconds,
             std::span<double> value) {
    const double u2 = u * u, u3 = u2 * u;
    const std::size_t width = value.size();
    for (std::size_t i = 0; i < width; ++i) {
        const double start = double{from[width + i]}, leaving = double{from[2 * width + i]};
        const double arriving = double{to[i]}, end = double{to[width + i]};
        value[i] = (2 * u3 - 3 * u2 + 1) * start + (u3 - 2 * u2 + u) * seconds * leaving +
                   (3 * u2 - 2 * u3) * end + (u3 - u2) * seconds * arriving;
    }
}

}  // namespace

void sampleKeyframes(const Keyframes& keyframes, double time, bool rotation,
                     std::span<double> value) {
    // The times of keys are floats, so `time` is rounded to a float, too. Then frame 1 at 24 fps
    // hits the key at 1/24, which is slightly later as a float than as a double.
    time = double{static_cast<float>(time)};
    const std::vector<float>& times = keyframes.times;
    const bool cubic = keyframes.interpolation == Interpolation::kCubicSpline;
    const std::size_t width = value.size(), stride = cubic ? 3 * width : width;
    const auto key = [&](std::size_t i) { return keyframes.values.data() + i * stride; };

    const auto after = std::upper_bound(times.begin(), times.end(), time,
                                        [](double t, float at) { return t < double{at}; });
    const auto last = static_cast<std::size_t>(
        std::max<std::ptrdiff_t>(after - times.begin() - 1, 0));  // last key at or before `time`
    const double start = double{times[last]};
    if (after == times.begin() || after == times.end() || time == start ||
        keyframes.interpolation == Interpolation::kStep) {
        const float* exact = key(last) + (cubic ? width : 0);
        std::copy_n(exact, width, value.begin());
        return;
    }
    const double seconds = double{*after} - start, u = (time - start) / seconds;
    if (cubic)
        hermite(key(last), key(last + 1), u, seconds, value);
    else if (rotation)
        slerp(key(last), key(last + 1), u, value);
    else
        lerp(key(last), key(last + 1), u, value);
}

double durationOf(const Animation& animation) {
    double last = 0;
    for (const Keyframes& keyframes : animation.keyframes)
        last = std::max(last, double{keyframes.times.back()});
    return last;
}

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

/// Rows in the order of AnimatedProperty. The weights have no row.
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
