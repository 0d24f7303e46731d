// SPDX-License-Identifier: Apache-2.0
#include "cmd/rays/bundle_options.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <sstream>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "core/lens/picture_rays.h"
#include "core/scene/camera_choice.h"
#include "formats/file/regular_file.h"

namespace peeler::cmd {

namespace {

constexpr int kMostBundles = 1'000'000;
constexpr std::uint64_t kMostDirectionBytes = 256U << 20;

/// Parses a direction of any length into a unit vector. Scales the direction first, to avoid
/// underflow and overflow.
glm::dvec3 unitDirection(std::string_view text) {
    const glm::dvec3 direction = parseDirection(text), size = glm::abs(direction);
    return glm::normalize(direction / std::max({size.x, size.y, size.z}));
}

Bounds parseBounds(const std::string& text) {
    const auto n = parseNumbers<6>(text, "x0,y0,z0,x1,y1,z1");
    const glm::dvec3 a(n[0], n[1], n[2]), b(n[3], n[4], n[5]);
    const Bounds bounds{glm::min(a, b), glm::max(a, b)};
    const glm::dvec3 size = bounds.max - bounds.min;
    if ((size.x > 0 ? 1 : 0) + (size.y > 0 ? 1 : 0) + (size.z > 0 ? 1 : 0) < 2)
        throw Error(ErrorKind::kUsage, "expected two opposite corners of a box");
    return bounds;
}

std::string bundleName(std::size_t index) {
    char name[32];
    std::snprintf(name, sizeof name, "bundle_%03zu", index);
    return name;
}

}  // namespace

RayGrid BundleOptions::grid() const {
    RayGrid grid;
    if (resolution) grid.resolution = *resolution;
    if (spacing) grid.spacing = *spacing;
    return grid;
}

void addBundleOptions(VerbOptions& verb, BundleOptions& options, SceneReadOptions* reading) {
    constexpr const char* kGroup = "Rays";
    verb.addRepeated(
            "--direction", "X,Y,Z",
            [&options](const std::string& text) {
                options.directions.push_back(unitDirection(text));
            },
            "bundle of parallel rays along this direction in world space; may be repeated")
        .group(kGroup);
    addValue(
        verb, "--directions", "N", options.count,
        [](const std::string& text) {
            return static_cast<int>(parseInteger(text, 1, kMostBundles));
        },
        "N bundles, spread evenly over the sphere (spherical Fibonacci lattice)")
        .group(kGroup);
    verb.addFlag("--hemisphere", options.hemisphere,
                 "spread --directions over the hemisphere around +Y only")
        .group(kGroup);
    addFile(verb, "--directions-file", "FILE", options.file,
            "text file with one bundle direction per line, as x y z; # starts a comment")
        .group(kGroup);
    verb.addFlag("--axes", options.axes,
                 "bundles along +X, +Y and +Z with rays on one cubic lattice (a layered "
                 "depth-normal image)")
        .group(kGroup);
    addValue(
        verb, "--resolution", "R", options.resolution,
        [](const std::string& text) {
            return static_cast<int>(parseInteger(text, 1, kMostPictureSide));
        },
        "rays along the longer side of each bundle (default: 1024)")
        .group(kGroup);
    addValue(
        verb, "--spacing", "D", options.spacing,
        [](const std::string& text) { return parsePositive(text); },
        "distance between rays in scene units, instead of --resolution")
        .group(kGroup);
    addValue(verb, "--bounds", "X0,Y0,Z0,X1,Y1,Z1", options.bounds, parseBounds,
             "box that bundles cover, as seen along their direction; each ray still crosses the "
             "whole scene (default: the scene's bounds)")
        .group(kGroup);
    addFile(verb, "--rays", "FILE", options.rays,
            "list of rays, instead of bundles: a .npy with an array (n, 6) or (h, w, 6), origin "
            "and direction of each ray; or a .npz with rays, with origins and directions, or "
            "with the angles of LiDAR beams (azimuths and elevations, or angles) and poses")
        .files(".npy .npz")
        .group(kGroup);
    addCameraOptions(verb, options.camera, reading, true);
    addLensOptions(verb, options.lens);
    addFile(verb, "--shutter", "FILE", options.shutter,
            "poses of a camera that moves while its picture is exposed (rolling shutter), in a "
            "camera file as for --cameras: the first is that of the upper edge, the last that of "
            "the lower edge")
        .group("Camera");
    addViewOptions(verb, options.views);
    options.views.lenses = true;
    verb.option("--camera")
        .description(
            "trace one ray per pixel of a camera: a camera of the scene, by name or index, or "
            "auto, which sees the whole scene; --eye and the options below define a custom camera "
            "instead");
    verb.option("--size").description("size of the camera's picture in pixels (default: 1280x720)");
}

void checkBundleOptions(const BundleOptions& options) {
    const bool parallel =
        !options.directions.empty() || options.count || options.file || options.axes;
    if (!options.asksForRays())
        refuse("no rays are given", "",
               "give --direction X,Y,Z, --directions N, --directions-file, --axes, --camera or "
               "--rays");
    if (options.rays && (parallel || options.usesCamera()))
        refuse("a list of rays cannot be combined with bundles or cameras", "--rays",
               "trace them in separate runs");
    if (options.shutter && (options.views.file || options.views.count))
        refuse("a moving camera is a single view", "--shutter, --cameras, --views",
               "leave one of them out");
    if (parallel && options.usesCamera())
        refuse("a camera cannot be combined with parallel bundles", "--camera",
               "trace them in separate runs");
    if (options.hemisphere && !options.count)
        refuse("a hemisphere needs a number of directions", "--hemisphere", "add --directions N");
    if (options.resolution && options.spacing)
        refuse("rays have either a resolution or a spacing", "--resolution, --spacing",
               "leave one of them out");
    if (options.rays && (options.resolution || options.spacing || options.bounds))
        refuse("the file defines all rays", "--rays, --resolution, --spacing, --bounds",
               "leave one of them out");
    if (options.usesCamera() && (options.resolution || options.spacing || options.bounds))
        refuse("a camera has one ray per pixel", "--resolution, --spacing, --bounds",
               "use --size and --crop");
    if (parallel && options.camera.size_given)
        refuse("a picture size applies to cameras only", "--size", "use --resolution or --spacing");
    if (options.usesCamera()) checkCamera(options.camera);
}

std::vector<glm::dvec3> readDirections(const std::filesystem::path& file) {
    const auto bytes = readRegularFile(file, kMostDirectionBytes);
    std::istringstream text(std::string(bytes.begin(), bytes.end()));
    std::vector<glm::dvec3> directions;
    std::string line;
    for (std::size_t number = 1; std::getline(text, line); ++number) {
        line.resize(std::min(line.find('#'), line.size()));
        std::ranges::replace_if(
            line, [](char c) { return c == '\t' || c == '\r' || c == ','; }, ' ');
        std::istringstream words(line);
        std::vector<std::string> found{std::istream_iterator<std::string>(words), {}};
        if (found.empty()) continue;
        const std::string where = file.string() + ":" + std::to_string(number);
        try {
            if (found.size() != 3) throw Error(ErrorKind::kUsage, "expected three numbers");
            directions.push_back(unitDirection(found[0] + "," + found[1] + "," + found[2]));
        } catch (const Error& error) {
            throw Error(ErrorKind::kInput, error.what(), where,
                        "write one direction per line: x y z");
        }
        if (directions.size() > kMostBundles)
            throw Error(ErrorKind::kInput, "there are more than 1000000 directions", where,
                        "split the file");
    }
    if (directions.empty())
        throw Error(ErrorKind::kInput, "the file contains no directions", file.string(),
                    "write one direction per line: x y z");
    return directions;
}

std::vector<Bundle> parallelBundles(const BundleOptions& options, const Bounds& scene) {
    std::vector<glm::dvec3> directions = options.directions;
    const auto append = [&](const std::vector<glm::dvec3>& more) {
        directions.insert(directions.end(), more.begin(), more.end());
    };
    if (options.count)
        append(options.hemisphere ? hemisphereDirections(*options.count)
                                  : sphereDirections(*options.count));
    if (options.file) append(readDirections(*options.file));
    const Bounds area = options.bounds.value_or(scene);
    std::vector<Bundle> bundles;
    for (const glm::dvec3& direction : directions)
        bundles.push_back(
            parallelBundle(bundleName(bundles.size()), area, scene, direction, options.grid()));
    if (options.axes) {
        for (Bundle& bundle : axisBundles(area, scene, options.grid()).bundles)
            bundles.push_back(std::move(bundle));
    }
    return bundles;
}

Bundle shutterBundle(const BundleOptions& options, const PosedScene& posed,
                     const SceneExtent& extent, ReadWarnings& warnings) {
    const std::string where = "--shutter " + options.shutter->string();
    const Size given = options.camera.size_given ? options.camera.size : Size{0, 0};
    const std::vector<FileCamera> cameras =
        readCameras(*options.shutter, {options.views.convention, given, true}, warnings);
    if (cameras.size() < 2)
        refuse("a moving camera needs two or more poses", where,
               "give the poses of the first and of the last row");
    CameraOptions camera = options.camera;
    if (!camera.lens && !camera.intrinsics && !camera.fov)
        static_cast<CameraChoice&>(camera) = cameraChoice(cameras.front(), camera);
    // From here on, a pinhole is a lens, too.
    if (!camera.lens) {
        camera.lens = Lens{"pinhole"};
        if (camera.size.height == 0)
            refuse("a moving camera needs a picture size",
                   "--size " + std::to_string(camera.size.width),
                   "give the height too: --size WxH");
        if (!camera.intrinsics)
            camera.intrinsics = intrinsicsOfAngle(
                *camera.lens, glm::radians(camera.fov.value_or(kDefaultFov)) / 2, camera.size);
        camera.fov.reset();
    }
    camera.pose = cameras.front().camera_to_world;
    Bundle bundle{"camera", cmd::makeView(posed, extent, camera)};
    std::vector<glm::dmat4> poses;
    for (const FileCamera& row : cameras)
        poses.push_back(row.camera_to_world);
    View& view = bundle.view;
    view.camera_to_world = glm::dmat4(1);
    view.rays = shutterPicture(view.rays, std::move(poses), view.height);
    return bundle;
}

}  // namespace peeler::cmd
