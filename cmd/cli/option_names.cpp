// SPDX-License-Identifier: Apache-2.0
#include "cmd/cli/option_names.h"

#include <algorithm>
#include <iterator>

namespace peeler::cmd {

namespace {

struct OptionName {
    Parameter parameter;
    std::string_view option;
};

/// Option names by parameter, in the order of the enumeration.
constexpr OptionName kOptionNames[] = {
    {Parameter::kAllowOutside, "--allow-outside"},
    {Parameter::kAnimations, "--animation"},
    {Parameter::kAs, "--as"},
    {Parameter::kAttenuation, "--attenuation"},
    {Parameter::kBackend, "--backend"},
    {Parameter::kBounds, "--bounds"},
    {Parameter::kCamera, "--camera"},
    {Parameter::kChannels, "--channels"},
    {Parameter::kComposite, "--as composite"},
    {Parameter::kCompression, "--compression"},
    {Parameter::kConvention, "--camera-convention"},
    {Parameter::kCrop, "--crop"},
    {Parameter::kDeepError, "--deep-error"},
    {Parameter::kDeepKeep, "--deep-keep"},
    {Parameter::kDeepMerge, "--deep-merge"},
    {Parameter::kDense, "--dense"},
    {Parameter::kDevice, "--device"},
    {Parameter::kEnvironment, "--environment"},
    {Parameter::kExclude, "--exclude"},
    {Parameter::kEye, "--eye"},
    {Parameter::kFar, "--far"},
    {Parameter::kFov, "--fov"},
    {Parameter::kIgnoredExtensions, "--ignore-extension"},
    {Parameter::kInclude, "--include"},
    {Parameter::kIntrinsics, "--intrinsics"},
    {Parameter::kLayout, "--layout"},
    {Parameter::kListDevices, "peeler devices"},
    {Parameter::kMaps, "--map"},
    {Parameter::kMaxFragments, "peeler view --max-fragments"},
    {Parameter::kMaxLayers, "--layers"},
    {Parameter::kMemory, "--memory"},
    {Parameter::kMethod, "--method"},
    {Parameter::kMetresPerUnit, "--unit"},
    {Parameter::kNear, "--near"},
    {Parameter::kNoComposite, "--no-composite"},
    {Parameter::kNormalize, "--normalize"},
    {Parameter::kOcclusionRatio, "--occlusion-ratio"},
    {Parameter::kOrthoHeight, "--ortho-height"},
    {Parameter::kPart, "--part"},
    {Parameter::kParts, "--part"},
    {Parameter::kPath, "--output"},
    {Parameter::kPointSize, "--point-size"},
    {Parameter::kPose, "--pose"},
    {Parameter::kRange, "--range"},
    {Parameter::kReadExrInfo, "peeler info"},
    {Parameter::kRenderer, "peeler render SCENE -o out.exr"},
    {Parameter::kRequireGpu, "--require-gpu"},
    {Parameter::kResolution, "--resolution"},
    {Parameter::kShadePer, "--shade-per"},
    {Parameter::kShadowSize, "--shadow-size"},
    {Parameter::kShadows, "--shadows"},
    {Parameter::kSize, "--size"},
    {Parameter::kSmoothNormals, "--smooth-normals"},
    {Parameter::kSpacing, "--spacing"},
    {Parameter::kSplatBlending, "--splat-blending"},
    {Parameter::kStrict, "--strict"},
    {Parameter::kTail, "--tail"},
    {Parameter::kTarget, "--target"},
    {Parameter::kToneMap, "--tone-map"},
    {Parameter::kUp, "--up"},
    {Parameter::kUvSet, "--uv"},
    {Parameter::kView, "--view"},
};

static_assert(std::size(kOptionNames) == static_cast<std::size_t>(Parameter::kCount) &&
              std::ranges::is_sorted(kOptionNames, {}, &OptionName::parameter));

}  // namespace

std::string_view optionOf(Parameter parameter) {
    return kOptionNames[static_cast<std::size_t>(parameter)].option;
}

std::string inOptions(const Text& text) {
    return text.spelled([](Parameter parameter) { return std::string(optionOf(parameter)); });
}

Error inOptions(const Error& error) {
    return {error.kind(), inOptions(error.whatText()), inOptions(error.whereText()),
            inOptions(error.hintText())};
}

}  // namespace peeler::cmd
