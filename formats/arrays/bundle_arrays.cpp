// SPDX-License-Identifier: Apache-2.0
#include "formats/arrays/bundle_arrays.h"

#include <array>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/scene/view.h"
#include "formats/file/json_text.h"
#include "formats/file/lens_json.h"

namespace peeler {
namespace {

/// The values of bundle_perspective.
enum class BundleKind : std::uint8_t { kParallel, kPinhole, kLens, kOther };

BundleKind bundleKindOf(const Bundle& bundle) {
    if (lensCameraOf(bundle.view)) return BundleKind::kLens;
    if (bundle.view.rays) return BundleKind::kOther;
    return bundle.parallel() ? BundleKind::kParallel : BundleKind::kPinhole;
}

}  // namespace

std::vector<NamedArray> bundleArrays(std::size_t bundles) {
    using enum NumberType;
    const std::uint64_t b = bundles;
    return {{"bundle_origin", kDouble, {b, 3}}, {"bundle_direction", kDouble, {b, 3}},
            {"bundle_right", kDouble, {b, 3}},  {"bundle_up", kDouble, {b, 3}},
            {"bundle_size", kDouble, {b, 2}},   {"bundle_resolution", kInt64, {b, 2}},
            {"bundle_window", kInt64, {b, 4}},  {"bundle_perspective", kUint8, {b}}};
}

ArrayTexts bundleTexts(std::span<const Bundle> bundles, const std::string& output_hash) {
    ArrayTexts texts{{"output_hash", output_hash}};
    nlohmann::json lenses;
    bool any = false;
    for (const Bundle& bundle : bundles) {
        const LensCamera* const camera = lensCameraOf(bundle.view);
        lenses.push_back(camera ? lensJson(*camera) : nlohmann::json());
        any = any || camera;
    }
    if (any) texts["bundle_lens"] = dumpJson(lenses);
    return texts;
}

void writeBundles(ArrayWriter& writer, std::size_t first, std::span<const Bundle> bundles,
                  bool camera_known) {
    const auto put = [&](std::size_t array, const auto& value) {
        writer.append(first + array, std::as_bytes(std::span(&value, 1)));
    };
    const auto put_known = [&](std::size_t array, auto value, bool has_meaning) {
        if (!camera_known || !has_meaning)
            value = decltype(value)(std::numeric_limits<double>::quiet_NaN());
        put(array, value);
    };
    for (const Bundle& bundle : bundles) {
        const View& view = bundle.view;
        const BundleKind kind = bundleKindOf(bundle);
        const bool placed = kind != BundleKind::kOther;
        put_known(0, bundle.origin(), placed);
        put_known(1, bundle.direction(), placed);
        put_known(2, bundle.right(), placed);
        put_known(3, bundle.up(), placed);
        put_known(4, bundle.size(), placed && kind != BundleKind::kLens);
        put(5, std::array<std::int64_t, 2>{view.width, view.height});
        const Window& rays = view.crop;
        put(6, std::array<std::int64_t, 4>{rays.x0, rays.y0, rays.width(), rays.height()});
        put(7, kind);
    }
}

}  // namespace peeler
