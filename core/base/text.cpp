// SPDX-License-Identifier: Apache-2.0
#include <peeler/text.h>

#include <algorithm>
#include <array>

namespace peeler::inline v0 {

namespace {

/// The names of the parameters, in the order of Parameter.
constexpr auto kParameterNames = std::to_array<std::string_view>({
    "allow_outside",
    "animations",
    "as",
    "attenuation",
    "backend",
    "bounds",
    "camera",
    "channels",
    "composite",
    "compression",
    "convention",
    "crop",
    "deep_error",
    "deep_keep",
    "deep_merge",
    "dense",
    "device",
    "environment",
    "exclude",
    "eye",
    "far",
    "fov",
    "ignored_extensions",
    "include",
    "intrinsics",
    "layout",
    "listDevices",
    "maps",
    "max_fragments",
    "max_layers",
    "memory",
    "method",
    "metres_per_unit",
    "near",
    "no_composite",
    "normalize",
    "occlusion_ratio",
    "ortho_height",
    "part",
    "parts",
    "path",
    "point_size",
    "pose",
    "range",
    "readExrInfo",
    "Renderer",
    "require_gpu",
    "resolution",
    "shade_per",
    "shadow_size",
    "shadows",
    "size",
    "smooth_normals",
    "spacing",
    "splat_blending",
    "strict",
    "tail",
    "target",
    "tone_map",
    "up",
    "uv_set",
    "view",
});
static_assert(kParameterNames.size() == static_cast<std::size_t>(Parameter::kCount));

}  // namespace

std::string_view nameOf(Parameter parameter) {
    return kParameterNames.at(static_cast<std::size_t>(parameter));
}

Text::Text(Parameter parameter)
    : text_('`' + std::string(nameOf(parameter)) + '`'), named_{{0, parameter}} {}

Text& Text::operator+=(const Text& other) {
    // A copy, since `other` may be *this.
    for (const Named& named : std::vector<Named>(other.named_))
        named_.push_back({text_.size() + named.begin, named.parameter});
    text_ += std::string(other.text_);
    return *this;
}

Text Text::withoutEnd(char last) const {
    Text result = *this;
    const bool ends_named =
        !named_.empty() &&
        named_.back().begin + nameOf(named_.back().parameter).size() + 2 == text_.size();
    if (!ends_named && text_.ends_with(last)) result.text_.pop_back();
    return result;
}

void Text::visit(const std::function<void(std::string_view)>& words,
                 const std::function<void(Parameter)>& named) const {
    const std::string_view all = text_;
    std::size_t begin = 0;
    for (const Named& one : named_) {
        words(all.substr(begin, one.begin - begin));
        named(one.parameter);
        begin = one.begin + nameOf(one.parameter).size() + 2;
    }
    words(all.substr(begin));
}

std::string Text::spelled(const std::function<std::string(Parameter)>& spelling) const {
    std::string result;
    visit([&](std::string_view words) { result += words; },
          [&](Parameter parameter) { result += spelling(parameter); });
    return result;
}

}  // namespace peeler::inline v0
