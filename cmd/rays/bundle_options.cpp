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
#include "core/scene/camera_choice.h"
#include "formats/file/regular_file.h"

namespace peeler::cmd {

namespace {

constexpr int kMostBundles = 1'000'000;
constexpr std::uint64_t kMostDirectionBytes = 256U << 20;

/// Returns a direction of any length as a unit vector, without underflow or overflow.
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
            "a bundle of parallel rays along this direction in world space; may be given several "
            "times")
        .group(kGroup);
    addValue(
        verb, "--directions", "N", options.count,
        [](const std::string& text) {
            return static_cast<int>(parseInteger(text, 1, kMostBundles));
        },
        "N bundles, evenly over the sphere (a spherical Fibonacci lattice)")
        .group(kGroup);
    verb.addFlag("--hemisphere", options.hemisphere, "--directions over the half around +Y only")
        .group(kGroup);
    addFile(verb, "--directions-file", "FILE", options.file,
            "a bundle for every line of a text: x y z; what follows # does not count")
        .group(kGroup);
    verb.addFlag("--axes", options.axes,
                 "bundles along +X, +Y and +Z, their rays on one lattice of cubes: a layered depth "
                 "normal image")
        .group(kGroup);
    addValue(
        verb, "--resolution", "R", options.resolution,
        [](const std::string& text) {
            return static_cast<int>(parseInteger(text, 1, kMostPictureSide));
        },
        "rays along the longer side of every bundle (default: 1024)")
        .group(kGroup);
    addValue(
        verb, "--spacing", "D", options.spacing,
        [](const std::string& text) { return parsePositive(text); },
        "distance from ray to ray instead, scene units")
        .group(kGroup);
    addValue(verb, "--bounds", "X0,Y0,Z0,X1,Y1,Z1", options.bounds, parseBounds,
             "the box that bundles cover, across their direction; along it, rays go through the "
             "whole scene (default: the scene's bounds)")
        .group(kGroup);
    addCameraOptions(verb, options.camera, reading);
    addViewOptions(verb, options.views);
    verb.option("--camera")
        .description(
            "the rays of this camera's pixels: of the scene's, by name or index; --eye and so on "
            "build one");
    verb.option("--size").description("pixels of the camera (default: 1280x720)");
}

void checkBundleOptions(const BundleOptions& options) {
    const bool parallel =
        !options.directions.empty() || options.count || options.file || options.axes;
    if (!options.asksForRays())
        refuse("no rays are asked for", "",
               "give --direction X,Y,Z, --directions N, --directions-file, --axes or --camera");
    if (parallel && options.usesCamera())
        refuse("bundles are parallel or a camera's", "--camera", "trace them one after the other");
    if (options.hemisphere && !options.count)
        refuse("there are no directions to spread", "--hemisphere", "add --directions N");
    if (options.resolution && options.spacing)
        refuse("rays are so many or so far apart", "--resolution, --spacing",
               "leave one of them out");
    if (options.usesCamera() && (options.resolution || options.spacing || options.bounds))
        refuse("a camera's rays are those of its pixels", "--resolution, --spacing, --bounds",
               "use --size and --crop");
    if (parallel && options.camera.size_given)
        refuse("the size of a camera's picture says nothing of parallel rays", "--size",
               "use --resolution or --spacing");
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
            throw Error(ErrorKind::kInput, error.what(), where, "a direction a line: x y z");
        }
        if (directions.size() > kMostBundles)
            throw Error(ErrorKind::kInput, "more directions than 1000000", where);
    }
    if (directions.empty())
        throw Error(ErrorKind::kInput, "there is no direction in it", file.string(),
                    "a direction a line: x y z");
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

}  // namespace peeler::cmd
