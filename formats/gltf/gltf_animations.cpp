// SPDX-License-Identifier: Apache-2.0
// The animations of a glTF file (glTF 2.0 §3.11).
#include "formats/gltf/gltf_parts.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include <peeler/error.h>
#include "formats/gltf/gltf_accessor.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

using nlohmann::json;

constexpr const char* kOutputIssue = "ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_FORMAT";
const AccessorFormat kTime = {{1}, {{5126}}, "ANIMATION_SAMPLER_INPUT_ACCESSOR_INVALID_FORMAT"};
const AccessorFormat kAnimatedVector = {{3}, {{5126}}, kOutputIssue};
const AccessorFormat kAnimatedRotation = {
    {4}, {{5126}, {5120, true}, {5121, true}, {5122, true}, {5123, true}}, kOutputIssue};
const AccessorFormat kWeight = {
    {1}, {{5126}, {5120, true}, {5121, true}, {5122, true}, {5123, true}}, kOutputIssue};

/// The names of animated properties in the JSON, in the order of AnimatedProperty.
constexpr struct {
    const char* path;
    const AccessorFormat* format;
} kProperties[] = {{"translation", &kAnimatedVector},
                   {"rotation", &kAnimatedRotation},
                   {"scale", &kAnimatedVector},
                   {"weights", &kWeight}};

std::optional<AnimatedProperty> propertyNamed(const std::string& path) {
    for (std::size_t i = 0; i < std::size(kProperties); ++i)
        if (path == kProperties[i].path) return static_cast<AnimatedProperty>(i);
    return std::nullopt;
}

Interpolation interpolationOf(const json& sampler) {
    const std::string name = sampler.value("interpolation", "LINEAR");
    if (name == "STEP") return Interpolation::kStep;
    return name == "CUBICSPLINE" ? Interpolation::kCubicSpline : Interpolation::kLinear;
}

class AnimationReader {
  public:
    AnimationReader(GltfDocument& document, const Scene& scene, SizeLimit& budget,
                    const json& source, std::string where)
        : document_(document),
          scene_(scene),
          budget_(budget),
          accessors_(document),
          source_(source),
          where_(std::move(where)) {}

    Animation read() {
        if (const auto name = source_.find("name"); name != source_.end() && name->is_string())
            result_.name = name->get<std::string>();
        const json& channels = source_["channels"];
        for (std::size_t i = 0; i < channels.size(); ++i)
            readChannel(channels[i], childPointer(where_ + "/channels", i));
        return std::move(result_);
    }

  private:
    void readChannel(const json& channel, const std::string& where) {
        const json& target = channel["target"];
        if (!target.contains("node")) return;  // §3.11: channels without a node are ignored
        const auto node = target["node"].get<std::size_t>();
        const std::string path = target["path"].get<std::string>();
        const auto property = propertyNamed(path);
        if (!property) {
            document_.warn("The animation channel " + where + " changes \"" + path +
                           "\", which is not supported; it is left out.");
            return;
        }
        const std::size_t width = widthOf(*property, node);
        if (*property != AnimatedProperty::kWeights && !scene_.nodes[node].trs) {
            document_.warn("The animation channel " + where + " moves a node with a matrix, " +
                           "which glTF forbids; it is left out.");
            return;
        }
        if (width == 0) {
            document_.warn("The animation channel " + where +
                           " changes weights of a node without morph targets; it is left out.");
            return;
        }
        const auto sampler = channel["sampler"].get<std::size_t>();
        result_.channels.push_back(
            {keyframes(sampler, *property, width), static_cast<int>(node), *property});
    }

    /// Returns the number of components of a property's value: 0 for weights without morph targets.
    std::size_t widthOf(AnimatedProperty property, std::size_t node) const {
        if (property == AnimatedProperty::kRotation) return 4;
        if (property != AnimatedProperty::kWeights) return 3;
        const int mesh = scene_.nodes[node].mesh;
        if (mesh < 0) return 0;
        const auto& primitives = scene_.meshes[static_cast<std::size_t>(mesh)].primitives;
        return primitives.empty() ? 0 : primitives.front().targets.size();
    }

    /// Returns the index in result_.keyframes of a sampler's keyframes. Channels for different
    /// properties may share a sampler, so the keyframes are read once per property.
    std::size_t keyframes(std::size_t sampler, AnimatedProperty property, std::size_t width) {
        const auto [entry, fresh] =
            read_.try_emplace({sampler, width, property}, result_.keyframes.size());
        if (fresh) result_.keyframes.push_back(readSampler(sampler, property, width));
        return entry->second;
    }

    Keyframes readSampler(std::size_t index, AnimatedProperty property, std::size_t width) {
        const json& sampler = source_["samplers"][index];
        const std::string where = childPointer(where_ + "/samplers", index);
        Keyframes result;
        result.interpolation = interpolationOf(sampler);
        const int input = sampler["input"].get<int>(), output = sampler["output"].get<int>();
        const std::size_t times = accessors_.count(input), elements = accessors_.count(output);
        if (times == 0) failGltf("there are no keys", where + "/input");
        const std::uint64_t bytes =
            (times + elements * 4) * sizeof(float);  // an element has at most 4 components
        budget_.take(bytes, where);
        document_.memory.allow(bytes, where);
        result.times = accessors_.floats(input, kTime, {0, times}, where + "/input");
        for (std::size_t i = 0; i < times; ++i)
            if (!std::isfinite(result.times[i]) || (i > 0 && result.times[i] < result.times[i - 1]))
                failGltf("key " + std::to_string(i) + " is not later than the one before it",
                         where + "/input");

        const bool cubic = result.interpolation == Interpolation::kCubicSpline;
        // Weights are stored as scalars: for each key, one per morph target.
        const std::size_t a_key =
            (property == AnimatedProperty::kWeights ? width : 1) * (cubic ? 3 : 1);
        if (elements % a_key != 0 || elements / a_key != times)
            failGltf("there are " + std::to_string(elements) + " values for " +
                         std::to_string(times) + " keys with " + std::to_string(a_key) + " each",
                     where + "/output");
        const AccessorFormat& format = *kProperties[static_cast<std::size_t>(property)].format;
        result.values = accessors_.floats(output, format, {0, elements}, where + "/output");
        for (const float value : result.values)
            if (!std::isfinite(value))
                failGltf("a value is not a finite number", where + "/output");
        return result;
    }

    GltfDocument& document_;
    const Scene& scene_;
    SizeLimit& budget_;
    AccessorReader accessors_;
    const json& source_;
    std::string where_;
    Animation result_;
    /// Index in result_.keyframes, by sampler, width and property.
    std::map<std::tuple<std::size_t, std::size_t, AnimatedProperty>, std::size_t> read_;
};

}  // namespace

std::vector<Animation> readGltfAnimations(GltfDocument& document, const GltfOptions& options,
                                          const Scene& scene) {
    std::vector<Animation> result;
    SizeLimit budget("the animations need", options.max_geometry_bytes);
    for (std::size_t i = 0; i < document.animations.size(); ++i)
        result.push_back(AnimationReader(document, scene, budget, document.animations[i],
                                         childPointer("/animations", i))
                             .read());
    return result;
}

}  // namespace peeler
