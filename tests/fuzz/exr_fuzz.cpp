// SPDX-License-Identifier: Apache-2.0
// Fuzz target: reads an OpenEXR file in every way that the commands do.
#include <peeler/camera_choice.h>
#include <peeler/composite.h>
#include "cmd/verify/verified_file.h"
#include "core/image/statistics.h"
#include "formats/layered/opened_picture.h"
#include "formats/output_hash.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

/// Returns as many top rows of a picture as can be read in 16 MiB of memory.
Window topOf(const LayeredInput& input) {
    Window window = input.info().plan.view.crop;
    window.y1 = std::min(window.y1, window.y0 + input.rowsFor(std::uint64_t{1} << 24));
    return window;
}

void takeExr(Input input) {
    const std::string path = fileOf("picture.exr", input);
    attempt([&] { cmd::verifyFile(path); });
    attempt([&] { outputHashOf(path); });
    attempt([&] {
        const auto layers = openLayered(path);
        const Window window = topOf(*layers);
        LayeredImage image;
        layers->read(window, image);
        PointStatistics points;
        if (const View& view = layers->info().plan.view; view.known) {
            addPoints(view, image, points);
            if (view.projection.perspective) attempt([&] { intrinsicsOf(view); });
        }
        CompositeImage composite;
        compositeOver(image, {}, composite);
        const ExrInfo& info = layers->info();
        if (info.composite < 0) return;
        const Window& stored = info.parts[static_cast<std::size_t>(info.composite)].data_window;
        if (intersect(window, stored) == window) layers->readComposite(window, composite);
    });
    attempt([&] {
        const auto pixels = openComposite(OpenedPicture(path));
        LayeredImage image;
        pixels->read(topOf(*pixels), image);
    });
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(exr, peeler::fuzz::takeExr)
