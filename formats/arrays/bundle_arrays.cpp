// SPDX-License-Identifier: Apache-2.0
#include "formats/arrays/bundle_arrays.h"

#include <array>
#include <cstdint>
#include <limits>

namespace peeler {

std::vector<NamedArray> bundleArrays(std::size_t bundles) {
    using enum NumberType;
    const std::uint64_t b = bundles;
    return {{"bundle_origin", kDouble, {b, 3}}, {"bundle_direction", kDouble, {b, 3}},
            {"bundle_right", kDouble, {b, 3}},  {"bundle_up", kDouble, {b, 3}},
            {"bundle_size", kDouble, {b, 2}},   {"bundle_resolution", kInt64, {b, 2}},
            {"bundle_window", kInt64, {b, 4}},  {"bundle_perspective", kUint8, {b}}};
}

void writeBundles(ArrayWriter& writer, std::size_t first, std::span<const Bundle> bundles,
                  bool camera_known) {
    const auto put = [&](std::size_t array, const auto& value) {
        writer.append(first + array, std::as_bytes(std::span(&value, 1)));
    };
    const auto put_known = [&](std::size_t array, auto value) {
        if (!camera_known) value = decltype(value)(std::numeric_limits<double>::quiet_NaN());
        put(array, value);
    };
    for (const Bundle& bundle : bundles) {
        put_known(0, bundle.origin());
        put_known(1, bundle.direction());
        put_known(2, bundle.right());
        put_known(3, bundle.up());
        put_known(4, bundle.size());
        const View& view = bundle.view;
        put(5, std::array<std::int64_t, 2>{view.width, view.height});
        const Window& rays = view.crop;
        put(6, std::array<std::int64_t, 4>{rays.x0, rays.y0, rays.width(), rays.height()});
        put(7, static_cast<std::uint8_t>(bundle.parallel() ? 0 : 1));
    }
}

}  // namespace peeler
