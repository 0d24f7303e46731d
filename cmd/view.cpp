// SPDX-License-Identifier: Apache-2.0
// peeler view: reprojects the layers of a file to another camera, or makes an interactive page of
// them.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include <peeler/error.h>
#include <peeler/view.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/layered_run.h"
#include "cmd/options/object_options.h"
#include "cmd/options/output_options.h"
#include "cmd/session/progress_report.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "core/base/stage_times.h"
#include "core/image/layers.h"
#include "core/image/statistics.h"
#include "core/scene/camera_choice.h"
#include "core/views/reprojection.h"
#include "core/views/surface_cells.h"
#include "formats/exr/layered_input.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr const char* kMethod = "reprojection";

/// The camera options: move the file's camera, or replace it.
struct ViewCameraOptions {
    std::optional<glm::dvec3> eye, target, up;
    std::optional<glm::dvec2> orbit;     ///< yaw to the right and pitch upwards, degrees
    std::optional<double> fov;           ///< vertical, degrees
    std::optional<double> ortho_height;  ///< scene units
    std::optional<Size> size;
    std::optional<Window> crop;

    bool changesAnything() const {
        return eye || target || up || orbit || fov || ortho_height || size || crop;
    }
};

struct ViewOptions : LayeredRunOptions {
    fs::path input;
    ObjectOptions objects;
    std::uint32_t max_layers = 0;  ///< layers to use, nearest first; 0 = all
    /// Limit for a page; 0 = no limit, none = the default.
    std::optional<std::uint64_t> max_fragments;
    ViewCameraOptions camera;
};

glm::dvec2 parseAngles(std::string_view text) {
    const auto numbers = parseNumbers<2>(text, "yaw,pitch");
    return {numbers[0], numbers[1]};
}

/// Returns a camera rotated around a point: first to the right, about `up`, then upwards, about the
/// new right axis of the camera.
glm::dmat4 orbited(const glm::dmat4& camera, const glm::dvec3& center, const glm::dvec3& up,
                   const glm::dvec2& degrees) {
    const auto about = [&](double angle, const glm::dvec3& axis) {
        return glm::translate(glm::dmat4(1), center) *
               glm::rotate(glm::dmat4(1), glm::radians(angle), axis) *
               glm::translate(glm::dmat4(1), -center);
    };
    const glm::dmat4 yawed = about(degrees.x, up) * camera;
    return about(-degrees.y, glm::dvec3(yawed[0])) * yawed;
}

/// Returns an upper limit for the distance from the camera of `view` to the file's content, in
/// scene units.
double farthest(const LayeredImage& image, const View& own, const View& view) {
    const double depth = image.z.empty() ? 1 : *std::max_element(image.z.begin(), image.z.end());
    const double scale = own.projection.perspective ? depth : 1;
    const glm::dvec3 corner(own.projection.half_width * scale, own.projection.half_height * scale,
                            depth);
    return (own.rays ? depth : glm::length(corner)) +
           glm::length(glm::dvec3(view.camera_to_world[3] - own.camera_to_world[3]));
}

/// Declares the options in ViewCameraOptions. `options` must outlive the parse.
void addViewCameraOptions(VerbOptions& verb, ViewCameraOptions& options) {
    const auto add = [&](const char* name, const char* value, auto& target, auto parse,
                         const std::string& help, const char* group) {
        addValue(
            verb, name, value, target, [parse](const std::string& text) { return parse(text); },
            help)
            .group(group);
    };
    add("--orbit", "YAW,PITCH", options.orbit, parseAngles,
        "rotate the file's camera around the target, in degrees to the right and upwards",
        "Camera");
    add("--eye", "X,Y,Z", options.eye, parseVector,
        "position of a custom camera (default: the position of the file's camera)", "Camera");
    add("--target", "X,Y,Z", options.target, parseVector,
        "point the camera looks at (default: on the file's viewing axis, at the depth of the "
        "picture's middle)",
        "Camera");
    add("--up", "X,Y,Z", options.up, parseDirection,
        "up direction in the picture, and axis of --orbit (default: 0,1,0)", "Camera");
    add("--fov", "DEGREES", options.fov, parseFov,
        "vertical field of view (default: the file's; for a lens 40)", "Camera");
    add("--ortho-height", "H", options.ortho_height, parsePositive,
        "height of the view in scene units; makes the camera orthographic", "Camera");
    add("--size", "WxH|W", options.size, parseSize,
        "size in pixels; a width alone keeps the file's aspect ratio (default: the file's)",
        "Picture");
    add("--crop", "X,Y,W,H", options.crop, parseCrop,
        "render only this part of the picture, in pixels from the upper left corner", "Picture");
}

/// Throws Error (kUsage) if the options contradict each other. Does not need the file.
void checkViewCameraOptions(const ViewCameraOptions& options) {
    if (options.fov && options.ortho_height)
        refuse("a camera has either a field of view or an orthographic height",
               "--fov, --ortho-height", "leave one of them out");
    if (options.orbit && options.eye)
        refuse("--orbit moves the file's camera, but --eye replaces it", "--orbit, --eye",
               "leave one of them out");
    if (options.eye && options.target && *options.eye == *options.target)
        refuse("the eye is at the target, so there is no viewing direction", "--eye, --target",
               "move one of them");
}

/// Returns the default target in world space: the point on the viewing axis at medianDepth(), or at
/// depth 1 if there are no fragments.
glm::dvec3 centerOfInterest(const LayeredImage& image, const View& view) {
    const glm::dmat4& place = view.camera_to_world;
    return glm::dvec3(place[3]) - glm::dvec3(place[2]) * medianDepth(image, view).value_or(1);
}

/// Returns the file's camera `own` with the options applied; for a lens, a pinhole camera. The near
/// and far planes of a moved camera do not clip the file's content. Keeps the file's crop only if
/// neither the camera nor the size changes. Throws Error (kUsage) if the camera is invalid.
View viewFrom(const View& own, const LayeredImage& image, const ViewCameraOptions& options) {
    View view = own;
    Projection& projection = view.projection;
    if (options.size) {
        const double aspect = static_cast<double>(own.width) / own.height;
        const Size size = sizeWithAspect(*options.size, aspect);
        view.width = size.width;
        view.height = size.height;
    }
    checkPixels({view.width, view.height});
    if (own.rays) {
        view.rays.reset();
        projection.half_height = std::tan(glm::radians(kDefaultFov) / 2);
    }
    if (options.fov) {
        projection.perspective = true;
        projection.half_height = std::tan(glm::radians(*options.fov) / 2);
    } else if (options.ortho_height) {
        projection.perspective = false;
        projection.half_height = *options.ortho_height / 2;
    }
    if (options.fov || options.ortho_height || options.size || own.rays)
        projection.half_width = projection.half_height * view.width / view.height;

    const glm::dvec3 eye = options.eye.value_or(glm::dvec3(own.camera_to_world[3]));
    const glm::dvec3 target = options.target.value_or(centerOfInterest(image, own));
    const glm::dvec3 up = glm::normalize(options.up.value_or(glm::dvec3(0, 1, 0)));
    if (options.orbit) {
        view.camera_to_world = orbited(own.camera_to_world, target, up, *options.orbit);
    } else if (options.eye || options.target || options.up) {
        if (eye == target)
            refuse("the eye is at the target, so there is no viewing direction", "--eye",
                   "give --target");
        auto place = lookAlong(eye, target - eye, up);
        if (!place && !options.up)
            place = lookAlong(eye, target - eye, glm::dvec3(own.camera_to_world[1]));
        if (!place)
            refuse("the up direction is parallel to the viewing direction", "--up",
                   "give an --up that points upwards in the picture");
        view.camera_to_world = *place;
    }
    const bool moved = own.rays || view.camera_to_world != own.camera_to_world ||
                       projection.perspective != own.projection.perspective;
    if (moved) {
        view.camera_name.clear();
        // The file's content is already clipped at the planes of the file's camera. If the planes
        // moved with the camera, they would clip the content a second time.
        const double distance = glm::length(target - glm::dvec3(view.camera_to_world[3]));
        projection.near = projection.perspective ? 1e-4 * distance : 0;
        projection.far = projection.perspective ? std::numeric_limits<double>::infinity()
                                                : farthest(image, own, view);
    }
    view.crop = {0, 0, view.width, view.height};
    if (options.crop) {
        checkCrop(*options.crop, view.width, view.height);
        view.crop = *options.crop;
    } else if (!moved && !options.size) {
        view.crop = own.crop;
    }
    return view;
}

/// Chooses the output kind. Returns whether the output is a page. Throws Error (kUsage) if options
/// do not apply to the output kind.
bool chooseKind(const ViewOptions& options, OutputRequest& output) {
    const OutputFormat& format = findOutputFormat(output.path.string(), "");
    const bool page = format.holds(OutputContent::kPage);
    output.options.as = page ? format.kind : "composite";
    if (page && options.camera.changesAnything()) {
        throw Error(ErrorKind::kUsage, "an HTML page always starts at the file's camera",
                    output.path.string(),
                    "leave out --size, --crop and the camera options, or write a .png");
    }
    if (!page && options.max_fragments) {
        throw Error(ErrorKind::kUsage, "only a page has a fragment limit", "--max-fragments",
                    "leave it out, or write a .html");
    }
    return page;
}

/// Returns the fragments of the input, or only those of the nearest layers, and updates the plan
/// accordingly.
LayeredImage load(const ViewOptions& options, LayeredInput& input, Plan& plan) {
    if (!input.info().attributes().contains("peeler:cameraJson")) {
        throw Error(ErrorKind::kInput, "the file has no camera", options.input.string(),
                    "give a file of peeler render; view needs its attribute peeler:cameraJson");
    }
    LayeredImage image;
    input.read(plan.view.crop, image);
    if (options.max_layers != 0) {
        keepLayers(image, {.nearest = options.max_layers});
        plan.layers.resize(std::min<std::size_t>(plan.layers.size(), options.max_layers));
    }
    plan.fragments_stored = image.fragments();
    // Files from other programs lack the number of counted fragments.
    plan.fragments_counted = std::max(plan.fragments_counted, plan.fragments_stored);
    return image;
}

/// Reprojects an image from its own view to the view in the run's plan, band by band.
void reprojectInto(Sink& sink, const LayeredImage& image, const View& own, LayeredRun& run,
                   Reporter& reporter) {
    ProgressReport progress(reporter, "view");
    const View& view = run.plan.view;
    timed(run.result.milliseconds, "capture", [&] {
        reproject(image, own, view, [&](LayeredImage&& band) {
            const double share =
                static_cast<double>(band.window.y1 - view.crop.y0) / view.crop.height();
            sink.write(std::move(band));
            progress.update(share);
        });
    });
    // The stage "capture" does not include writing, which has its own stages.
    for (const auto& [stage, milliseconds] : sink.times())
        run.result.milliseconds["capture"] -= milliseconds;
}

void view(const ViewOptions& options, Reporter& reporter) {
    LayeredRun run(options, {options.input}, reporter);
    checkViewCameraOptions(options.camera);
    const bool page = chooseKind(options, run.output);
    run.checkFiles();
    const auto input = run.openInput(options.objects);
    LayeredImage image =
        timed(run.result.milliseconds, "load", [&] { return load(options, *input, run.plan); });
    const View own = run.plan.view;
    if (page && own.rays) {
        throw Error(ErrorKind::kUsage, "a page starts at the file's camera, which has a lens",
                    options.input.string(),
                    "write a .png; --orbit, --eye and --fov choose a camera");
    }
    if (!page) run.plan.view = viewFrom(own, image, options.camera);

    const ExrInfo& info = input->info();
    const std::string path = run.output.path.string();
    Provenance provenance = info.provenance;
    provenance.method = kMethod;
    provenance.settings_hash.clear();  // describes the input, not the new view
    provenance.settings.clear();
    OutputOptions output = run.outputOptions(provenance);
    if (page && options.max_layers == 0) {
        OutputOptions hashed = output;
        hashed.provenance = info.provenance;
        output.provenance.output_hash = outputHashFrom(info, own, path, hashed);
    }
    if (options.max_fragments) {
        output.max_fragments = *options.max_fragments == 0
                                   ? std::numeric_limits<std::uint64_t>::max()
                                   : *options.max_fragments;
    }
    const auto sink = makeSink(path, output);
    run.write(*sink, [&] {
        if (page)
            sink->write(std::move(image));
        else
            reprojectInto(*sink, image, own, run, reporter);
    });
    run.plan.samples = 1;  // also if the input has several samples per pixel
    run.report(output, provenance);
}

}  // namespace

VerbAction declareView(VerbOptions& verb) {
    const auto options = std::make_shared<ViewOptions>();
    addFile(verb, "IN", "", options->input, "a layered or deep image (.exr, .safetensors)")
        .files(".exr .safetensors")
        .required();
    addLayeredOptions(verb, options->reading);
    addViewCameraOptions(verb, options->camera);
    addOutputOptions(verb, options->output);
    verb.option("--output")
        .description(
            "the file to write: .exr, .png, .jpg, .jpeg, .tif, .tiff, or a page: .html, .htm; - "
            "writes a PNG to standard output, -.EXT another format")
        .files(".exr .png .jpg .jpeg .tif .tiff .html .htm");
    addObjectOptions(verb, options->objects);
    addValue(
        verb, "--layers", "N|all", options->max_layers,
        [](const std::string& text) { return parseLayers(text); },
        "use only the N nearest layers of every pixel (default: all)")
        .group("Layers");
    addValue(
        verb, "--max-fragments", "N|all", options->max_fragments,
        [](const std::string& text) {
            if (text == "all") return std::uint64_t{0};
            return static_cast<std::uint64_t>(parseInteger(text, 1, 1'000'000'000));
        },
        "maximum number of fragments in a page (.html) (default: 4000000)")
        .group("Layers");
    addThreadsOption(verb, options->threads);
    addReportOptions(verb, options->report);
    return [options](Session& session) {
        view(*options, session.reporter());
        return 0;
    };
}

}  // namespace peeler::cmd
