// SPDX-License-Identifier: Apache-2.0
// Deep sample merging: finds runs of matching samples, counts them, and composites each run.
#include "core/image/merge.h"

#include <algorithm>
#include <cmath>
#include <locale>
#include <sstream>
#include <string>

#include <peeler/error.h>
#include <peeler/layered_image.h>
#include "core/base/parallel.h"
#include "core/image/composite.h"
#include "core/image/fragment_copies.h"

namespace peeler {
namespace {

FragmentChannel idsToMergeBy(const LayeredImage& image, const std::string& name) {
    if (const FragmentChannel ids = findIds(image, name)) return ids;
    throw Error(ErrorKind::kUsage, "the samples have no channel " + name + " to merge by",
                Parameter::kDeepMerge + " by-id",
                "add " + Parameter::kChannels + " id, or merge by-z");
}

/// The test whether a sample matches the first sample of a run.
class Matcher {
  public:
    Matcher(const LayeredImage& image, const DeepMergeSettings& settings)
        : image_(image), settings_(settings) {
        if (settings.mode != DeepMerge::kById) return;
        objects_ = idsToMergeBy(image, "id.object");
        materials_ = idsToMergeBy(image, "id.material");
    }

    bool operator()(std::size_t first, std::size_t other) const {
        const float distance = image_.z[other] - image_.z[first];
        switch (settings_.mode) {
            case DeepMerge::kExact:
                return image_.z[other] == image_.z[first];
            case DeepMerge::kByZ:
                return distance <= settings_.z_tolerance;
            case DeepMerge::kById:
                return distance <= settings_.z_tolerance &&
                       objects_.id(first) == objects_.id(other) &&
                       materials_.id(first) == materials_.id(other) &&
                       std::abs(colorOf(image_, first)[3] - colorOf(image_, other)[3]) <=
                           settings_.alpha_tolerance;
            case DeepMerge::kOff:
                break;
        }
        return false;
    }

  private:
    const LayeredImage& image_;
    DeepMergeSettings settings_;
    FragmentChannel objects_, materials_;
};

/// Returns the end of the run that begins with sample `first`. `end` is the end of the pixel's
/// samples.
std::size_t runEnd(const Matcher& together, std::size_t first, std::size_t end) {
    std::size_t next = first + 1;
    while (next < end && together(first, next))
        ++next;
    return next;
}

}  // namespace

std::string deepMergeText(const DeepMergeSettings& settings) {
    constexpr const char* kNames[] = {"off", "exact", "by-id", "by-z"};
    if (!settings.merges()) return "";
    std::ostringstream text;
    text.imbue(std::locale::classic());
    if (settings.error > 0) {
        text << "error " << settings.error << (settings.keep_ids ? " keep id" : "");
        return text.str();
    }
    text << kNames[static_cast<std::size_t>(settings.mode)];
    if (settings.mode != DeepMerge::kExact) text << " z " << settings.z_tolerance;
    if (settings.mode == DeepMerge::kById) text << " alpha " << settings.alpha_tolerance;
    return text.str();
}

void mergeDeepSamples(const LayeredImage& image, int y0, int y1, const DeepMergeSettings& settings,
                      LayeredImage& out) {
    const Matcher together(image, settings);
    out.window = {image.window.x0, y0, image.window.x1, y1};
    const std::size_t base = image.pixelIndex(image.window.x0, y0);
    const auto width = static_cast<std::size_t>(image.window.width());
    const auto height = static_cast<std::size_t>(y1 - y0);
    out.offsets.assign(width * height + 1, 0);
    parallelFor(height, [&](std::size_t row) {
        for (std::size_t p = row * width; p < (row + 1) * width; ++p) {
            const std::size_t end = image.offsets[base + p + 1];
            for (std::size_t f = image.offsets[base + p]; f < end; f = runEnd(together, f, end))
                ++out.offsets[p + 1];
        }
    });
    for (std::size_t p = 1; p < out.offsets.size(); ++p)
        out.offsets[p] += out.offsets[p - 1];

    resizeFragments(image, out.offsets.back(), out);
    parallelFor(height, [&](std::size_t row) {
        for (std::size_t p = row * width; p < (row + 1) * width; ++p) {
            const std::size_t end = image.offsets[base + p + 1];
            std::size_t target = out.offsets[p];
            for (std::size_t f = image.offsets[base + p]; f < end; ++target) {
                const std::size_t next = runEnd(together, f, end);
                copyFragments(image, f, out, target, 1);
                if (next > f + 1) {
                    TintedColor color = tintedColorOf(image, f);
                    for (++f; f < next; ++f)
                        color = over(color, tintedColorOf(image, f));
                    storeColor(color, out.color, target);
                }
                f = next;
            }
        }
    });
}

}  // namespace peeler
