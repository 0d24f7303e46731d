// SPDX-License-Identifier: Apache-2.0
#include "cmd/rays/rays_options.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "cmd/options/appearance_options.h"
#include "cmd/options/dense_options.h"
#include "cmd/options/forecast.h"
#include "cmd/rays/bundle_options.h"
#include "cmd/rays/ray_map_options.h"
#include "cmd/session/choices.h"
#include "core/rays/voxels.h"
#include "formats/arrays/array_writer.h"
#include "formats/file/file_name.h"
#include "formats/output_hash.h"
#include "formats/rays/hit_columns.h"
#include "formats/rays/ray_output.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr Choice<ParityUse> kParityUses[] = {
    {"report", ParityUse::kReport, "warn about each, and go on"},
    {"fail", ParityUse::kFail, "end with exit code 3"},
};

constexpr Choice<Overlap> kOverlaps[] = {
    {"winding", Overlap::kWinding,
     "they are one body (default); surfaces that are open or do not face outwards follow "
     "parity, with a note, or with a warning if --overlap winding is given"},
    {"parity", Overlap::kParity, "they cancel out"},
};

constexpr const char* kRaysFooter =
    "Arrays for n hits of m rays in b bundles (names and shapes as in Open3D's\n"
    "RaycastingScene.list_intersections): ray_splits (m + 1, int64; ray r has the hits\n"
    "ray_splits[r] to ray_splits[r + 1], sorted), t_hit (n; distance along the ray), z_hit (n;\n"
    "distance along the axis; by default only if a bundle has a lens), geometry_ids\n"
    "(n; index of the placed mesh), primitive_ids (n; index of the triangle in its mesh),\n"
    "primitive_uvs (n, 2; weights of the second and third corner), facing (n; 1 = the front),\n"
    "normals (for shading) and primitive_normals (of the flat triangle) (n, 3; world space,\n"
    "pointing out of the front), node_ids, mesh_ids, instance_ids (within the node), material_ids\n"
    "(n; indices into the glTF, from 0, 0xFFFFFFFF = none); --columns chooses among these, and\n"
    "base_color (n, 4; R, G, B, A, linear, textures filtered over the footprints of pixels).\n"
    "Per bundle: bundle_origin, bundle_direction, bundle_right, bundle_up (b, 3; float64),\n"
    "bundle_size (b, 2; float64), bundle_resolution (b, 2; int64), bundle_window (b, 4; int64;\n"
    "x, y, width, height of the traced rays: all rays without --crop) and bundle_perspective (b;\n"
    "0: parallel, 1: pinhole, 2: lens, with a bundle_size of NaN, 3: moving camera or list of "
    "rays,\n"
    "with NaN for all float64). If a bundle has a lens, bundle_lens: a JSON list (uint8) of its\n"
    "model, coefficients and intrinsics, or null, for each bundle. Also arrays_version.\n"
    "With --dense N, for w x h rays per bundle, arrays of n are (h, w, N) or (h, w, N,\n"
    "components); for several bundles, which must have the same size, (b, h, w, N, ...); count\n"
    "(h, w, uint32; all hits of the ray) replaces ray_splits.\n"
    "peeler extract uses the same names. Rays are ordered by bundle, then by row from the top.\n"
    "With (W, H) = bundle_resolution and\n"
    "  p = origin + ((i + 0.5) / W - 0.5) * size[0] * right\n"
    "             - ((j + 0.5) / H - 0.5) * size[1] * up\n"
    "ray (i, j) of a parallel bundle starts at p and runs along direction; a ray of a perspective\n"
    "bundle starts at origin and runs along p + direction - origin, normalised. A .ply has one\n"
    "point per hit, an .exr one deep part per bundle (Z: distance along the axis; of lenses, "
    "moving\n"
    "cameras and lists along the ray, and of lenses the channel cameraZ along the axis).\n"
    "Maps: an .exr has one part per bundle and one channel per map; arrays are (h, w), named\n"
    "MAP.I for bundle I. A picture goes from black to yellow (transmission: from white to black,\n"
    "as on X-ray film), with a legend below.\n"
    "base-color has R, G, B and A, in arrays R.I and so on; its picture shows the colours, in\n"
    "sRGB. Its textures are filtered over the footprints of pixels.\n"
    "Maps and voxels define the inside of a closed surface by its winding number: a ray is inside\n"
    "until it has left as often as it has entered. With --overlap parity, and for --parity, the\n"
    "inside is the intervals between the first and second hit, the third and fourth, and so on.\n"
    "A closed primitive is a surface of its own; all other primitives of a mesh form one surface.\n"
    "For maps and --parity, a camera must be outside all closed surfaces.\n"
    "Rays hit triangles, not lines or points. Lists of hits, and maps other than those of solids,\n"
    "also have the Gaussian splats of parallel rays and of cameras without a lens: t is where the\n"
    "response is largest, primitive_ids is the index of the splat, base_color its colour and its\n"
    "opacity on the ray; normals are 0. Rays pass through fragments that a MASK material's\n"
    "alpha test rejects and through BLEND fragments with alpha 0; they hit everything else,\n"
    "however transparent.\n"
    "Arrays of --points, for n points and d directions: t_before and t_after (d, n; distance to\n"
    "the next hit against and along the direction, inf = none), geometry_ids_before, ..._after,\n"
    "primitive_ids_before, ..._after (d, n; 0xFFFFFFFF = none), points (n, 3) and directions\n"
    "(d, 3). If a point lies on a surface, t_before is 0.";

/// Parses a list of columns such as "t_hit,normals", or "all". Returns the columns in the order of
/// the table; empty = those by default.
std::vector<std::string> parseColumns(const std::string& text) {
    std::vector<std::string_view> names;
    for (const HitColumn& column : hitColumns())
        names.push_back(column.name);
    if (text == "all") return {};
    const std::vector<std::string_view> listed = listedNames("column", text, names);
    std::erase_if(names, [&](std::string_view name) {
        return std::ranges::find(listed, name) == listed.end();
    });
    return {names.begin(), names.end()};
}

std::vector<ChoiceDescription> columnChoices() {
    std::vector<ChoiceDescription> choices;
    for (const HitColumn& column : hitColumns())
        choices.push_back({std::string(column.name), ""});
    return choices;
}

void checkVoxels(const RaysOptions& options) {
    if (options.writesPictures() || options.double_points)
        refuse("voxels cannot be combined with maps or 64-bit points", "--voxels",
               "leave --map and --double out");
    if (options.bundles.asksForRays() || options.bundles.resolution || options.bundles.spacing)
        refuse("voxels define their own rays", "--voxels",
               "leave directions, cameras, --resolution and --spacing out");
    const std::string path = options.output.path.string();
    if (options.writesFile() && !isArrayName(path) && lowerExtension(path) != ".vdb")
        refuse("voxels cannot be written in this format", path,
               "end the name in .npz, .safetensors or .vdb");
}

void checkPoints(const RaysOptions& options) {
    if (options.voxels || options.writesPictures() || options.double_points)
        refuse("hits nearest to points cannot be combined with other outputs", "--points",
               "leave --map, --voxels and --double out");
    if (options.bundles.usesCamera() || options.bundles.rays)
        refuse("points need parallel rays", "--points", "give directions, not a camera");
    if (options.writesFile() && !isArrayName(options.output.path.string()))
        refuse("hits nearest to points are written as arrays only", options.output.path.string(),
               "end the name in .npz or .safetensors");
}

void checkOutputs(const RaysOptions& options) {
    const bool special =
        options.writesPictures() || options.voxels || options.double_points || options.points;
    if (!options.writesFile() && !options.parity)
        refuse("nothing to write", "", "add --output FILE, or --parity");
    if (!options.writesFile() && special)
        refuse("no output file is given", "--output", "add --output FILE");
    if (options.double_points && lowerExtension(options.output.path) != ".ply")
        refuse("64-bit coordinates are written to .ply only", "--double",
               "leave it out, or write a .ply");
    const bool hits = options.writesFile() && !options.writesPictures() && !options.voxels;
    if (hits) checkHitFormat(options.output.path.string());
    const bool is_arrays = hits && !options.points && isArrayName(options.output.path.string());
    checkDenseOptions(options.output, is_arrays && options.output.isGiven("--dense"));
    if (options.columns.empty()) return;
    if (!hits || options.points)
        refuse("columns apply to hits only", "--columns",
               "leave it out, or leave out --map, --voxels and --points");
    if (lowerExtension(options.output.path) == ".exr")
        refuse("a deep image always has all channels", "--columns",
               "leave it out, or write arrays or a .ply");
}

nlohmann::json bundleJson(const Bundle& bundle) {
    const auto numbers = [](const glm::dvec3& v) { return nlohmann::json{v.x, v.y, v.z}; };
    const View& view = bundle.view;
    const Projection& projection = view.projection;
    const Window& crop = view.crop;
    nlohmann::json json{{"perspective", projection.perspective},
                        {"origin", numbers(bundle.origin())},
                        {"right", numbers(bundle.right())},
                        {"up", numbers(bundle.up())},
                        {"size", {projection.half_width, projection.half_height}},
                        {"ends", {projection.near, projection.far}},  // null if infinite
                        {"resolution", {view.width, view.height}},
                        {"crop", {crop.x0, crop.y0, crop.x1, crop.y1}},
                        {"sample", {view.sample.x, view.sample.y}}};
    if (view.rays) json["rays"] = view.rays->text();
    return json;
}

/// Throws Error (kUsage) if an output needs solids but not both faces are captured. Both faces are
/// needed because a ray enters a solid through a front face and leaves it through a back face.
void checkFaces(const RaysOptions& options) {
    if (options.asksForInside() && options.chosenFaces() != Faces::kBoth)
        refuse("the inside of solids is found from both faces of surfaces", "--faces",
               "leave --faces out; or leave --voxels, --parity and maps of solids out");
}

}  // namespace

bool RaysOptions::writesInside() const {
    return voxels || std::ranges::any_of(maps.maps, [](RayMap map) { return infoOf(map).solids; });
}

bool RaysOptions::writesSplats() const {
    return writesFile() && !voxels && !points &&
           (maps.maps.empty() ||
            std::ranges::any_of(maps.maps, [](RayMap map) { return !infoOf(map).solids; }));
}

bool RaysOptions::asksForInside() const {
    return writesInside() || parity;
}

Faces RaysOptions::chosenFaces() const {
    return faces.value_or(bundles.usesCamera() && !asksForInside() ? Faces::kGltf : Faces::kBoth);
}

void addRaysOptions(VerbOptions& verb, RaysOptions& options) {
    addSceneArgument(verb, options);
    addOutputFile(verb, options.output);
    verb.option("--output")
        .required(false)
        .description(
            "file for hits: .npz or .safetensors (NumPy arrays), .ply (points), .exr (deep); for "
            "--map: .exr, arrays, .png, .jpg or .tif; for --voxels: arrays or .vdb")
        .files(".npz .safetensors .ply .exr .png .jpg .tif .vdb");
    addFile(verb, "--points", "FILE", options.points,
            "points to trace from: for each point and direction, write only the nearest hit before "
            "and the nearest hit after the point; a .ply, or a .npz with the array points (n, 3)")
        .files(".ply .npz")
        .group("Output");
    verb.addFlag("--double", options.double_points,
                 "write x, y, z of a .ply in 64 bits instead of 32")
        .group("Output");
    addValue(
        verb, "--columns", "LIST|all", options.columns, parseColumns,
        "columns of the hits, separated by commas; fewer columns are faster; besides them, arrays "
        "always have ray_splits and the bundles, and a .ply always has x, y, z and bundle "
        "(default: all, which leaves out base_color):")
        .someOf(columnChoices())
        .group("Output");
    addDenseOptions(verb, options.output);
    addBundleOptions(verb, options.bundles, &options.scene.reading);
    verb.addFlag(
            "--refine,!--no-refine", options.refine,
            "compute t from the triangle in double precision (default); --no-refine takes t from "
            "the rasteriser, which in GL has 32-bit depth and snaps corners to 1/256 pixel")
        .group("Rays");
    addRayFacesOption(verb, options.faces);
    addRayMapOptions(verb, options.maps);
    addValue(
        verb, "--voxels", "R", options.voxels,
        [](const std::string& text) { return static_cast<int>(parseInteger(text, 1, 4096)); },
        "write the cells of a lattice whose centres are inside, decided by the majority of three "
        "rays, one along each axis; the longest side of the lattice has R cells")
        .group("Inside");
    addValue(
        verb, "--parity", "NAME", options.parity,
        [](const std::string& text) {
            return choose<ParityUse>("use of parity", kParityUses, text);
        },
        "check that surfaces are closed: a ray must leave each surface that it enters; --include "
        "and --exclude choose the surfaces to check. If rays hit a surface an odd number of times:")
        .oneOf(describeChoices(kParityUses))
        .group("Inside");
    addValue(
        verb, "--overlap", "NAME", options.overlap,
        [](const std::string& text) {
            return choose<Overlap>("rule for overlaps", kOverlaps, text);
        },
        "rule for overlapping shells of one surface, in maps and voxels:")
        .oneOf(describeChoices(kOverlaps))
        .group("Inside");
    addShownOptions(verb, options);
    addNormalizeOption(verb, options.scene);
    addVariantOption(verb, options.appearance);
    addEngineOption(verb, options.engine);
    addRunOptions(verb, options, "rays are traced in bands that fit");
    addSequenceOptions(verb, options.sequence);
    addDryRunOption(verb, options.sequence.dry_run);
    verb.footer(kRaysFooter);
}

std::vector<std::filesystem::path> RaysOptions::inputs() const {
    std::vector<std::filesystem::path> files{scene.file};
    for (const auto& file :
         {bundles.file, bundles.rays, bundles.shutter, points, bundles.views.file})
        if (file) files.push_back(*file);
    return files;
}

void checkRaysOptions(const RaysOptions& options) {
    if (options.voxels)
        checkVoxels(options);
    else
        checkBundleOptions(options.bundles);
    if (options.points) checkPoints(options);
    checkRayMapFlags(options.maps);
    checkOutputs(options);
    checkFaces(options);
    if (options.overlap && !options.writesInside())
        refuse("nothing shows the inside of surfaces", "--overlap",
               "add --voxels, or a map such as --map thickness");
}

nlohmann::json raySettings(const RaysOptions& options, std::span<const Bundle> bundles) {
    nlohmann::json settings{{"refine", options.refine && !options.points}};
    for (const Bundle& bundle : bundles)
        settings["bundles"].push_back(bundleJson(bundle));
    for (const RayMap map : options.maps.maps)
        settings["maps"].push_back(infoOf(map).name);
    if (!options.maps.attenuation.empty()) settings["attenuation"] = options.maps.attenuation;
    if (!options.maps.parts.empty()) settings["parts"] = options.maps.parts;
    if (options.maps.range)
        settings["range"] = {options.maps.range->first, options.maps.range->second};
    if (!options.maps.legend) settings["legend"] = false;
    if (options.voxels) settings["voxels"] = *options.voxels;
    if (options.points) settings["points"] = true;
    if (options.writesInside())
        settings["overlap"] = nameOf<Overlap>(kOverlaps, options.overlapRule());
    if (!options.columns.empty()) settings["columns"] = options.columns;
    if (options.output.isGiven("--dense"))
        settings["planes"] = denseText(options.output.options.dense);
    return settings;
}

void checkVoxelMemory(const AxisBundles& lattice, const MemoryBudget& memory) {
    const std::uint64_t bytes = VoxelVotes::bytesOf(lattice);
    if (memory == 0 || bytes <= memory) return;
    throw Error(
        ErrorKind::kMemory,
        groupedText(VoxelVotes::cellsOf(lattice)) + " voxels do not fit into " + bytesText(memory),
        memory.where(),
        "they take " + bytesText(bytes) + "; use fewer --voxels or a higher --memory");
}

}  // namespace peeler::cmd
