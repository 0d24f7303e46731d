// SPDX-License-Identifier: Apache-2.0
#include "cmd/cli/api_names.h"

#include <algorithm>

#include "cmd/cli/errors.h"

namespace peeler::cmd {

namespace {

/// Fields, parameters and functions, by name. tests/texts_test.py compares them with the texts,
/// ApiNames of the tests with the options of all verbs.
constexpr ApiName kApiNames[] = {
    {"Renderer", "peeler render SCENE -o out.exr"},
    {"allow_outside", "--allow-outside"},
    {"as", "--as"},
    {"attenuation", "--attenuation"},
    {"backend", "--backend"},
    {"bounds", "--bounds"},
    {"camera", "--camera"},
    {"channels", "--channels"},
    {"chooseVariant", "--variant"},
    {"composite", "--as composite"},
    {"compression", "--compression"},
    {"convention", "--camera-convention"},
    {"crop", "--crop"},
    {"deep_merge", "--deep-merge"},
    {"dense", "--dense"},
    {"device", "--device"},
    {"environment", "--environment"},
    {"exclude", "--exclude"},
    {"eye", "--eye"},
    {"far", "--far"},
    {"fov", "--fov"},
    {"ignored_extensions", "--ignore-extension"},
    {"include", "--include"},
    {"intrinsics", "--intrinsics"},
    {"layout", "--layout"},
    {"listDevices", "peeler devices"},
    {"maps", "--map"},
    {"max_fragments", "peeler view --max-fragments"},
    {"max_layers", "--layers"},
    {"memory", "--memory"},
    {"method", "--method"},
    {"metres_per_unit", "--unit"},
    {"near", "--near"},
    {"no_composite", "--no-composite"},
    {"normalize", "--normalize"},
    {"occlusion_ratio", "--occlusion-ratio"},
    {"ortho_height", "--ortho-height"},
    {"part", "--part"},
    {"parts", "--part"},
    {"path", "--output"},
    {"point_size", "--point-size"},
    {"pose", "--pose"},
    {"range", "--range"},
    {"readExrInfo", "peeler info"},
    {"require_gpu", "--require-gpu"},
    {"resolution", "--resolution"},
    {"shadow_size", "--shadow-size"},
    {"shadows", "--shadows"},
    {"size", "--size"},
    {"smooth_normals", "--smooth-normals"},
    {"spacing", "--spacing"},
    {"strict", "--strict"},
    {"tail", "--tail"},
    {"target", "--target"},
    {"tone_map", "--tone-map"},
    {"up", "--up"},
    {"uv_set", "--uv"},
    {"view", "--view"},
};

}  // namespace

std::span<const ApiName> apiNames() {
    return kApiNames;
}

std::string inOptions(std::string_view text) {
    std::string result;
    while (true) {
        const std::size_t quote = text.find('`');
        result += text.substr(0, quote);
        if (quote == std::string_view::npos) return result;
        text.remove_prefix(quote + 1);
        const std::size_t end = text.find('`');
        const auto* const found =
            end == std::string_view::npos
                ? std::end(kApiNames)
                : std::ranges::find(kApiNames, text.substr(0, end), &ApiName::name);
        if (found == std::end(kApiNames)) {
            result += '`';
            continue;
        }
        result += found->command_line;
        text.remove_prefix(end + 1);
    }
}

}  // namespace peeler::cmd
