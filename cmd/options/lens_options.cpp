// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/lens_options.h"

#include <peeler/error.h>
#include <algorithm>
#include <numbers>

#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "core/base/names.h"
#include "core/lens/lens.h"
#include "core/lens/lens_rays.h"

namespace peeler::cmd {
namespace {

std::vector<double> parseCoefficients(const std::string& text) {
    std::vector<double> coefficients;
    for (std::size_t from = 0; from <= text.size();) {
        const std::size_t comma = std::min(text.find(',', from), text.size());
        coefficients.push_back(parseNumber(text.substr(from, comma - from)));
        from = comma + 1;
    }
    return coefficients;
}

/// Sets the size and the intrinsics of a lens whose pictures show all directions.
void fillPicture(CameraOptions& camera) {
    if (camera.intrinsics || camera.fov)
        refuse("a lens " + camera.lens->model + " shows all directions",
               "--lens, " + std::string(camera.fov ? "--fov" : "--intrinsics"),
               "leave one of them out");
    if (camera.size.height == 0) camera.size.height = camera.size.width / 2;
    LensRays(*camera.lens, {}, camera.size);  // checks the size
}

}  // namespace

void addLensOptions(VerbOptions& verb, LensOptions& options) {
    addValue(
        verb, "--lens", "NAME", options.model,
        [](const std::string& text) { return std::string(lensModel({text}).name); },
        "lens of the camera, with the coefficients of --distortion (default: opencv if there are "
        "any, else pinhole):")
        .oneOf(describeChoices(lensModels()))
        .group("Camera");
    addValue(verb, "--distortion", "A,B,...", options.coefficients, parseCoefficients,
             "coefficients of the lens, in the order of --lens")
        .group("Camera");
}

void warnOfThin(const PosedScene& posed, const SceneOptions& scene, const std::string& pictures,
                Reporter& reporter) {
    const bool thin = std::ranges::any_of(posed.meshes(), [&](const MeshInstance& mesh) {
        return std::ranges::any_of(posed.primitives(mesh), [](const Primitive& primitive) {
            return primitive.topology < Topology::kTriangles && !primitive.splats;
        });
    });
    if (!thin) return;
    if (scene.reading.strict)
        throw Error(ErrorKind::kInput, "rays through a lens do not hit lines and points",
                    scene.file.string(), "leave --strict out, or the nodes (--exclude)");
    reporter.warning("Rays through a lens do not hit lines and points; " + pictures +
                     " lack them.");
}

void noteWithoutRay(std::uint64_t pixels, std::uint64_t all, Reporter& reporter) {
    if (pixels > 0)
        reporter.note(countText(pixels, "pixel") + " of " + groupedText(all) +
                      " have no ray: the lens sees nothing there");
}

void takeLens(const LensOptions& options, CameraOptions& camera) {
    if (!options.isGiven()) return;
    const Lens lens = makeLens(options.model.value_or("opencv"),
                               options.coefficients.value_or(std::vector<double>()));
    if (isPinhole(lens)) return;
    camera.lens = lens;
    const LensModel& model = lensModel(lens);
    if (camera.ortho_height)
        refuse("an orthographic camera has no lens", "--lens, --ortho-height",
               "leave one of them out");
    if (model.filling) return fillPicture(camera);
    const Size size = camera.size;
    if (size.height == 0)
        refuse("a lens needs a picture size", "--size " + std::to_string(size.width),
               "give the height too: --size WxH");
    if (model.in_pixels && !camera.intrinsics && !camera.fov)
        camera.intrinsics = {1, 1, (size.width - 1) / 2.0, (size.height - 1) / 2.0};
    if (!camera.intrinsics && !camera.fov)
        refuse("the lens has no focal length", "--lens " + lens.model, "add --intrinsics or --fov");
    if (!camera.fov) return;
    if (camera.intrinsics)
        refuse("intrinsics already define the field of view", "--intrinsics, --fov",
               "leave one of them out");
    constexpr double kRadians = std::numbers::pi / 180;
    camera.intrinsics = intrinsicsOfAngle(lens, *camera.fov / 2 * kRadians, size);
    camera.fov.reset();
}

}  // namespace peeler::cmd
