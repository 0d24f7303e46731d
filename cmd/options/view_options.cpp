// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/view_options.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "core/scene/frustum.h"
#include "formats/file/file_name.h"

namespace peeler::cmd {

namespace {

constexpr const char* kViewsGroup = "Views";

/// Returns the object id in a node's name: 12 for "obj_000012" and "12".
std::optional<int> objectId(std::string_view name) {
    if (name.starts_with("obj_")) name.remove_prefix(4);
    int id = 0;
    const auto [end, failure] = std::from_chars(name.data(), name.data() + name.size(), id);
    const bool whole = failure == std::errc() && end == name.data() + name.size();
    return whole && id >= 0 ? std::optional(id) : std::nullopt;
}

/// Throws Error (kUsage) if an option is given that does not apply to several views.
void refuseLoneCamera(const CameraOptions& camera, const std::string& views) {
    const std::pair<bool, const char*> lone[] = {
        {camera.camera.has_value(), "--camera"},
        {camera.eye.has_value(), "--eye"},
        {camera.target.has_value(), "--target"},
        {camera.up.has_value(), "--up"},
        {camera.ortho_height.has_value(), "--ortho-height"},
        {camera.intrinsics && !camera.lens, "--intrinsics"},
        {camera.pose.has_value(), "--pose"},
    };
    for (const auto& [given, option] : lone)
        if (given)
            refuse("every view has its own camera", std::string(option) + ", " + views,
                   "leave one of them out");
}

/// Throws Error (kUsage) if the view options contradict each other or the camera options. Does not
/// need the scene.
void checkViewOptions(const ViewListOptions& options, const CameraOptions& camera) {
    if (options.file && options.count)
        refuse("views come either from a file or from around the scene", "--cameras, --views",
               "leave one of them out");
    if (!options.count) {
        const std::pair<bool, const char*> needs_views[] = {
            {options.around.has_value(), "--around"}, {options.distance.has_value(), "--distance"}};
        for (const auto& [given, option] : needs_views)
            if (given) refuse("there are no views to place", option, "add --views N");
    }
    if (options.convention && !options.file)
        refuse("there is no camera file", "--camera-convention", "add --cameras FILE");
    if (options.seed && options.around != Around::kRandom)
        refuse("the cameras are not placed at random", "--seed", "add --around random");
    const std::pair<bool, const char*> needs_circle[] = {
        {options.elevation.has_value(), "--elevation"},
        {options.azimuth.has_value(), "--azimuth"},
        {options.clockwise, "--clockwise"}};
    for (const auto& [given, option] : needs_circle)
        if (given && !options.turns())
            refuse("the cameras are not on a circle", option,
                   "add --around turntable or --around orbit");
    if (options.first != 0 && !options.asked())
        refuse("there are no views to number", "--first-view " + std::to_string(options.first),
               "add --views N or --cameras FILE");
    if (options.cameras_out && !options.asked())
        refuse("there are no cameras of views to write", "--cameras-out",
               "add --views N or --cameras FILE");
    if (!options.asked()) return;
    refuseLoneCamera(camera, options.file ? "--cameras" : "--views");
    if (options.file && camera.lens)
        refuse("the file defines the lenses of its cameras", "--lens, --cameras",
               "leave one of them out");
    if (options.file && camera.fov)
        refuse("the file defines the field of view of its cameras", "--fov, --cameras",
               "leave one of them out");
    if (options.count && camera.size_given && camera.size.height == 0)
        refuse("views around a scene have no aspect ratio of their own",
               "--size " + std::to_string(camera.size.width), "give the height too: --size WxH");
}

/// Returns the camera options of a view: the view's own camera, with the settings common to all
/// views.
CameraOptions cameraOf(const CameraChoice& view, const CameraOptions& camera) {
    CameraOptions result;
    static_cast<CameraChoice&>(result) = view;
    if (camera.lens) {
        result.lens = camera.lens;
        result.intrinsics = camera.intrinsics;
        result.fov.reset();
    }
    if (camera.near) result.near = camera.near;
    if (camera.far) result.far = camera.far;
    result.crop = camera.crop;
    result.tile = camera.tile;
    return result;
}

}  // namespace

void addViewOptions(VerbOptions& verb, ViewListOptions& options) {
    addFile(verb, "--cameras", "FILE", options.file,
            "render a view for each camera of a file: transforms.json, BOP's scene_camera.json, a "
            "COLMAP model, .npy, .npz or .jsonl; put @@@@ into the output's name for the view's "
            "number, counted from 0")
        .group(kViewsGroup);
    addValue(
        verb, "--camera-convention", "NAME", options.convention,
        [](const std::string& text) { return cameraConvention(text); },
        "axis convention of the camera poses, required for .npy and .npz:")
        .oneOf(describeChoices(cameraConventions()))
        .group(kViewsGroup);
    addValue(
        verb, "--views", "N", options.count,
        [](const std::string& text) {
            return static_cast<int>(parseInteger(text, 1, static_cast<std::int64_t>(kMostViews)));
        },
        "number of views around the scene, all looking at its centre")
        .group(kViewsGroup);
    addValue(
        verb, "--around", "NAME", options.around,
        [](const std::string& text) { return choose<Around>("placement", kArounds, text); },
        "placement of the cameras:")
        .oneOf(describeChoices(kArounds, true))
        .group(kViewsGroup);
    addValue(
        verb, "--seed", "N", options.seed,
        [](const std::string& text) {
            return static_cast<std::uint64_t>(
                parseInteger(text, 0, std::numeric_limits<std::int64_t>::max()));
        },
        "seed of --around random (default: 0)")
        .group(kViewsGroup);
    addValue(
        verb, "--distance", "D", options.distance,
        [](const std::string& text) { return parsePositive(text); },
        "distance of the cameras from the scene's centre, in scene units (default: far enough to "
        "see the whole scene from any side; turntable: the smallest distance)")
        .group(kViewsGroup);
    addValue(
        verb, "--elevation", "DEGREES", options.elevation,
        [](const std::string& text) {
            const double degrees = parseNumber(text);
            if (!(std::abs(degrees) < 90))
                refuse("expected degrees above the horizon between -90 and 90");
            return degrees;
        },
        "height of a circle above the horizon (default: 30)")
        .group(kViewsGroup);
    addValue(
        verb, "--azimuth", "DEGREES", options.azimuth,
        [](const std::string& text) { return parseNumber(text); },
        "where a circle begins: 0 at +Z, the front; 90 at +X, the right (default: 0)")
        .group(kViewsGroup);
    verb.addFlag("--clockwise", options.clockwise,
                 "move the cameras clockwise seen from above (default: the other way, +Z to +X)")
        .group(kViewsGroup);
}

void addViewFileOptions(VerbOptions& verb, ViewListOptions& options) {
    constexpr std::int64_t kMost = 1000000000;
    addValue(
        verb, "--first-view", "N", options.first,
        [](const std::string& text) { return static_cast<int>(parseInteger(text, 0, kMost)); },
        "number of the first view in file names and results; the next views count up from it "
        "(default: 0)")
        .group(kViewsGroup);
    addFile(verb, "--cameras-out", "FILE", options.cameras_out,
            "write the cameras: transforms.json, scene_camera.json (BOP), or a folder (COLMAP "
            "model, with points of the layers)")
        .group(kViewsGroup);
}

ViewList::ViewList(const ViewListOptions& options, const CameraOptions& camera, bool strict,
                   Reporter& reporter)
    : options_(options), camera_(camera), strict_(strict), reporter_(reporter) {
    checkCamera(camera);
    checkViewOptions(options, camera);
    const Size given = camera.size_given ? camera.size : Size{0, 0};
    if (options.file) {
        ReadWarnings warnings(strict, options.file->string());
        listed_ = readCameras(*options.file, {options.convention, given, options.lenses}, warnings);
        tell(warnings);
    }
    for (const FileCamera& view : listed_)
        names_.push_back(view.name);
    for (int i = 0; i < options.count.value_or(0); ++i)
        names_.push_back(viewPath("@@@@", options.first + i));
    if (!options.asked()) cameras_ = {camera};
}

void ViewList::tell(const ReadWarnings& warnings) const {
    for (const Text& sentence : warnings.sentences())
        reporter_.warning(sentence);
}

std::size_t ViewList::size() const {
    return std::max(names_.size(), std::size_t{1});
}

std::pair<std::size_t, std::size_t> ViewList::part(const std::optional<Shard>& chunk) const {
    if (chunk && !asked())
        refuse("there are no views to divide", "--chunk " + chunk->text(),
               "add --cameras or --views");
    return chunk.value_or(Shard()).of(size());
}

void ViewList::checkName(const std::filesystem::path& output) const {
    if (size() == 1 || hasViewToken(output.string())) return;
    refuse("all " + std::to_string(size()) + " views would have the same name",
           "--output " + output.string(),
           "put @@@@ into the file's name, where the view's number goes");
}

void ViewList::place(const OpenedScene& scene) {
    const Size size = camera_.size_given ? camera_.size : CameraChoice{}.size;
    std::vector<CameraChoice> choices;
    for (const FileCamera& view : listed_)
        choices.push_back(cameraChoice(view, {.size = size}));
    if (options_.count) {
        ViewsAround around{.count = *options_.count};
        around.around = options_.around.value_or(Around::kSphere);
        around.seed = options_.seed.value_or(0);
        around.distance = options_.distance;
        around.elevation = options_.elevation.value_or(around.elevation);
        around.azimuth = options_.azimuth.value_or(0);
        around.clockwise = options_.clockwise;
        if (camera_.fov) around.fov = *camera_.fov;
        around.size = size;
        around.through_corners = options_.through_corners;
        choices = viewsAround(around, scene.extent());
    }
    placeObjects(scene.scene());
    for (const CameraChoice& choice : choices) {
        cameras_.push_back(cameraOf(choice, camera_));
        checkCamera(cameras_.back());
    }
}

void ViewList::placeObjects(const Scene& scene) {
    if (std::ranges::all_of(listed_, [](const FileCamera& view) { return view.objects.empty(); }))
        return;
    std::map<int, int> nodes;  // object id to node index
    for (std::size_t i = 0; i < scene.nodes.size(); ++i)
        if (const auto id = objectId(scene.nodes[i].name)) nodes.emplace(*id, static_cast<int>(i));
    std::set<int> ever_placed;
    for (const FileCamera& view : listed_) {
        std::vector<PlacedNode>& placed = placed_.emplace_back();
        for (const PlacedObject& object : view.objects) {
            const auto node = nodes.find(object.id);
            if (node == nodes.end())
                throw Error(ErrorKind::kInput,
                            "no node of the scene is called obj_" + std::to_string(object.id),
                            options_.file->string() + ", view " + view.name,
                            "name each object's node after its id, such as obj_000012 or 12");
            const bool again = std::ranges::any_of(
                placed, [&](const PlacedNode& one) { return one.node == node->second; });
            if (again)
                throw Error(ErrorKind::kInput,
                            "object " + std::to_string(object.id) + " has two poses in one view",
                            options_.file->string() + ", view " + view.name,
                            "remove one of the two poses");
            placed.push_back({node->second, object.to_world});
            ever_placed.insert(node->second);
        }
    }
    warnOfUnplaced(ever_placed.size());
}

/// Warns if a view places fewer than `objects` objects.
void ViewList::warnOfUnplaced(std::size_t objects) const {
    const auto lacks = [&](const auto& placed) { return placed.size() < objects; };
    const auto first = std::ranges::find_if(placed_, lacks);
    if (first == placed_.end()) return;
    ReadWarnings warnings(strict_, options_.file->string());
    warnings.warn(
        "In " +
        countText(static_cast<std::uint64_t>(std::ranges::count_if(placed_, lacks)), "view") +
        " (the first is " + listed_[static_cast<std::size_t>(first - placed_.begin())].name +
        "), some objects have no pose; they stay where the scene puts them.");
    tell(warnings);
}

void ViewList::addSettings(std::size_t index, nlohmann::json& settings) const {
    for (const PlacedNode& placed : placed(index)) {
        std::array<double, 16> numbers{};  // column by column
        for (int i = 0; i < 16; ++i)
            numbers[static_cast<std::size_t>(i)] = placed.to_world[i / 4][i % 4];
        settings["placed"].push_back({placed.node, numbers});
    }
}

View ViewList::view(const OpenedScene& scene, const PosedScene& posed, std::size_t index) const {
    View view = placed(index).empty() ? makeView(posed, scene.extent(), cameras_[index])
                                      : makeView(posed, SceneExtent(posed), cameras_[index]);
    if (asked()) view.camera_name = name(index);
    return view;
}

bool ViewList::cutsSceneOff(const View& view, const PosedScene& posed) const {
    if (asked() || camera_.camera || view.camera_name.empty()) return false;
    View whole = view;
    whole.crop = {0, 0, view.width, view.height};
    return cutsOff(whole, SceneExtent(posed));
}

}  // namespace peeler::cmd
