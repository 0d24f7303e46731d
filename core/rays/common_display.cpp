// SPDX-License-Identifier: Apache-2.0
#include "core/rays/common_display.h"

#include <algorithm>

#include "core/base/error.h"

namespace peeler {
namespace {

/// The view in a display window of another size around it.
View placed(const Bundle& bundle, int width, int height) {
    View view = bundle.view;
    const glm::ivec2 size(view.width, view.height), room = glm::ivec2(width, height) - size;
    const glm::ivec2 left_over(room.x % 2, room.y % 2), offset = room / 2;
    if (!bundle.parallel() && left_over != glm::ivec2(0)) {
        throw Error(ErrorKind::kUsage, "pinhole bundles of such sizes do not fit into one file",
                    bundle.name, "write a file for each");
    }
    const glm::dvec2 half(view.projection.half_width, view.projection.half_height);
    // The middle of the new picture is half a pixel to the right of, and below, the old one's.
    const glm::dvec2 shift = glm::dvec2(left_over) * half / glm::dvec2(size);
    view.camera_to_world[3] +=
        shift.x * view.camera_to_world[0] - shift.y * view.camera_to_world[1];
    view.projection.half_width *= double(width) / size.x;
    view.projection.half_height *= double(height) / size.y;
    view.width = width;
    view.height = height;
    view.crop = {view.crop.x0 + offset.x, view.crop.y0 + offset.y, view.crop.x1 + offset.x,
                 view.crop.y1 + offset.y};
    return view;
}

}  // namespace

std::vector<View> withCommonDisplay(std::span<const Bundle> bundles) {
    int width = 0, height = 0;
    for (const Bundle& bundle : bundles) {
        width = std::max(width, bundle.view.width);
        height = std::max(height, bundle.view.height);
    }
    // A camera that cannot be moved has its own middle.
    for (const Bundle& bundle : bundles) {
        if (bundle.parallel()) continue;
        width += (width - bundle.view.width) % 2;
        height += (height - bundle.view.height) % 2;
        break;
    }
    std::vector<View> views;
    for (const Bundle& bundle : bundles)
        views.push_back(placed(bundle, width, height));
    return views;
}

}  // namespace peeler
