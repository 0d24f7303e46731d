// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/deep_against.h"

#include <algorithm>
#include <memory>
#include <mutex>

#include <peeler/error.h>
#include "cmd/cli/report.h"
#include "core/base/parallel.h"
#include "core/base/printable.h"
#include "core/image/merge.h"
#include "formats/layered/opened_picture.h"

namespace peeler::cmd {

namespace {

/// The maximum size of a band of each file, in bytes.
constexpr std::uint64_t kAgainstBytes = std::uint64_t{128} << 20;

std::unique_ptr<LayeredInput> openSamples(const std::string& path) {
    OpenedPicture opened(path);
    if (!isLayered(opened.info()))
        throw Error(ErrorKind::kInput, "the file has no layers or deep samples", path);
    return openLayered(std::move(opened));
}

/// Reads a band that may reach beyond the picture's crop, where there are no samples.
void readBand(LayeredInput& input, const Window& band, LayeredImage& part, LayeredImage& out) {
    const Window inside = intersect(band, input.info().plan.view.crop);
    if (inside == band) return input.read(band, out);
    part = {};
    if (!inside.empty()) input.read(inside, part);
    joinTiles({&part, 1}, band, part, out);
}

/// Compares two bands with the same window.
void compareBands(const LayeredImage& image, const LayeredImage& original, DeepAgainst& against) {
    const auto width = static_cast<std::size_t>(image.window.width());
    std::mutex mutex;
    parallelFor(static_cast<std::size_t>(image.window.height()), [&](std::size_t row) {
        DeepComparison compare(image, original);
        DeepDifference worst;
        std::size_t at = 0;
        for (std::size_t p = row * width; p < (row + 1) * width; ++p) {
            const DeepDifference difference = compare(p, p);
            if (difference.error > worst.error) at = p - row * width;
            worst.add(difference);
        }
        const std::lock_guard lock(mutex);
        const int x = image.window.x0 + static_cast<int>(at);
        const int y = image.window.y0 + static_cast<int>(row);
        const bool earlier = worst.error == against.worst.error && y < against.y;
        if (!(worst.error > against.worst.error) && !earlier) return;
        against.worst = worst;
        against.x = x;
        against.y = y;
    });
}

}  // namespace

std::string DeepAgainst::text() const {
    std::string text =
        "differs from " + printable(path, kMostOfName) + " by at most " + numberText(worst.error);
    if (worst.error > 0)
        text += " (" + std::string(deepChannelName(worst.component, tinted)) + " at pixel " +
                std::to_string(x) + ", " + std::to_string(y) + ", depth " + numberText(worst.z) +
                ")";
    if (!certificate) return text;
    text += "; certified: " + numberText(certificate->error);
    return text + (is_original ? "" : ", for another original");
}

DeepAgainst compareDeep(const std::string& path, const std::string& original) {
    const auto a = openSamples(path), b = openSamples(original);
    const View &view = a->info().plan.view, &other = b->info().plan.view;
    if (view.width != other.width || view.height != other.height)
        throw Error(ErrorKind::kInput, "the files differ in size", path + ", " + original);
    DeepAgainst against;
    against.path = original;
    const auto attribute = a->info().attributes().find(kDeepCertificate);
    if (attribute != a->info().attributes().end())
        against.certificate = deepCertificateFrom(attribute->second);

    const Window all = unite(view.crop, other.crop);
    const int rows = std::min(a->rowsFor(kAgainstBytes), b->rowsFor(kAgainstBytes));
    DeepSourceHash hash;
    LayeredImage image, samples, part;
    for (int y = all.y0; y < all.y1; y += rows) {
        const Window band{all.x0, y, all.x1, std::min(y + rows, all.y1)};
        readBand(*a, band, part, image);
        readBand(*b, band, part, samples);
        against.tinted = against.tinted || image.tinted() || samples.tinted();
        against.samples += image.fragments();
        against.original_samples += samples.fragments();
        if (against.certificate) hash.add(samples, band.y0, band.y1);
        compareBands(image, samples, against);
    }
    against.is_original = against.certificate && against.certificate->source == hash.text();
    return against;
}

}  // namespace peeler::cmd
