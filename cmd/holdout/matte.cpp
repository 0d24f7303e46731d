// SPDX-License-Identifier: Apache-2.0
#include "cmd/holdout/matte.h"

#include <string>

#include <peeler/error.h>
#include "cmd/options/differences.h"
#include "cmd/options/layered_options.h"

namespace peeler::cmd {

namespace {

/// Throws Error (kInput) if `strict`, otherwise prints a warning.
void warnOrRefuse(bool strict, const std::string& what, const std::string& where,
                  Reporter& reporter) {
    if (strict) throw Error(ErrorKind::kInput, what, where, "leave --strict out to accept this");
    reporter.warning("The matte \"" + where + "\": " + what + ".");
}

}  // namespace

Matte::Matte(const CaptureJobOptions& options, const ExrInfo& picture,
             const LayeredReadOptions& reading, Session& session)
    : options_(options), session_(session) {
    if (isPictureFile(options_.scene.file.string()))
        open(picture, reading);
    else
        render(picture);
}

void Matte::open(const ExrInfo& picture, const LayeredReadOptions& reading) {
    const std::string path = options_.scene.file.string();
    Reporter& reporter = session_.reporter();
    input_ = openInput(path, {.strict = reading.strict}, reporter);
    const View &asked = picture.plan.view, &view = input_->info().plan.view;
    if (const auto sizes = sizeDifferences(view, asked); !sizes.empty())
        throw Error(ErrorKind::kUsage, "the matte has another size: " + differencesText(sizes),
                    path, "render it with the size of the picture");
    if (asked.known && view.known)
        if (const auto cameras = cameraDifferences(view, asked); !cameras.empty())
            warnOrRefuse(reading.strict, "it has another camera: " + differencesText(cameras), path,
                         reporter);
    if (intersect(view.crop, asked.crop) != asked.crop)
        warnOrRefuse(reading.strict, "it covers only a part of the picture", path, reporter);
}

void Matte::render(const ExrInfo& picture) {
    const std::string path = options_.scene.file.string();
    const View& view = picture.plan.view;
    if (!view.known)
        throw Error(ErrorKind::kUsage, "the picture has no camera to render a scene with",
                    "--by " + path, "give a layered file");
    if (picture.provenance.time != 0) options_.animation.time = picture.provenance.time;
    options_.capture.samples = picture.plan.samples;
    options_.capture.color_type = PixelType::kFloat;
    CaptureJob job(options_, session_);
    job.checkOptions();
    job.openScene();
    const PosedScene posed = job.pose();
    options_.capture.tinted = job.wantsTint(posed);
    GlRenderer& renderer = job.openRenderer(posed);
    const CapturePlan plan = renderer.plan(view, options_.capture);
    renderer.capture(plan, rendered_);
}

const LayeredImage& Matte::read(const Window& window) {
    if (!input_) return rendered_.image;
    const Window inside = intersect(window, input_->info().plan.view.crop);
    if (inside.empty())
        band_ = {};
    else
        input_->read(inside, band_);
    return band_;
}

}  // namespace peeler::cmd
