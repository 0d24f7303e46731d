// SPDX-License-Identifier: Apache-2.0
#include "cmd/extract/extract_options.h"

#include <algorithm>
#include <string>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/extract/layer_files.h"
#include "cmd/options/capture_options.h"
#include "cmd/options/dense_options.h"
#include "cmd/options/forecast.h"
#include "cmd/options/frames.h"
#include "cmd/options/output_checks.h"
#include "formats/arrays/array_writer.h"
#include "formats/file/file_name.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

/// Adds the layers in a list with the syntax of --frames. Throws Error (kUsage) if the list is
/// malformed or contains negative numbers.
void takeLayers(const std::string& text, std::vector<int>& layers) {
    std::vector<int> more;
    try {
        more = parseFrames(text);
    } catch (const Error&) {
        more = {-1};
    }
    if (std::ranges::any_of(more, [](int layer) { return layer < 0; })) {
        throw Error(ErrorKind::kUsage, "expected layer numbers, counted from 0", "",
                    "e.g. 2, 0-3 or 0,2,5-8");
    }
    layers.insert(layers.end(), more.begin(), more.end());
}

/// Returns the output request for a file other than the layers.
OutputRequest requestFor(const ExtractOptions& options, const fs::path& path) {
    OutputRequest output;
    output.path = path;
    output.no_clobber = options.output.no_clobber;
    output.no_mkdir = options.output.no_mkdir;
    return output;
}

/// Throws Error (kUsage) if `fits` is false, and Error (kOutput) if the file cannot be written.
void checkFile(const ExtractOptions& options, const fs::path& path, bool fits,
               const char* extensions) {
    if (!fits) {
        throw Error(ErrorKind::kUsage, std::string("expected a name that ends in ") + extensions,
                    path.string());
    }
    checkTarget(requestFor(options, path), {options.input});
}

constexpr const char* kExtractFooter =
    "Arrays for n fragments of a crop of w x h pixels, named as in peeler rays: ray_splits (w*h +\n"
    "1, int64; pixel p, row by row, has the fragments ray_splits[p] to ray_splits[p + 1], front\n"
    "to back), z (n; depth along bundle_direction; of a lens along the ray), rgba (n, 4; linear,\n"
    "premultiplied), opacity (n, 3; per colour channel, if the file has AR, AG and AB), layer (n,\n"
    "from 0).\n"
    "Channels, if the file has them: t_hit (n; distance along the ray), z_hit (n; of a lens:\n"
    "depth along bundle_direction), primitive_ids, node_ids, instance_ids, material_ids (n; from\n"
    "0, 0xFFFFFFFF = none), primitive_uvs (n, 2), facing (n; 1 = the front), normals and\n"
    "primitive_normals (n, 3; pointing out of the front; if the file has no facing:\n"
    "viewer_normals and viewer_primitive_normals, toward the viewer), positions (n, 3), texcoords\n"
    "(n, 2), tangents (n, 4), base_color, emissive (n, 3), roughness, metallic (n), motion (n,\n"
    "2); other channels keep their names.\n"
    "Camera: bundle_origin, bundle_direction, bundle_right, bundle_up (1, 3), bundle_size (1, 2;\n"
    "width and height of the picture, in scene units; of a perspective camera: at distance 1),\n"
    "bundle_resolution (1, 2), bundle_window (1, 4; x, y, w, h of the crop),\n"
    "bundle_perspective (1; 0 or 1; 2: a lens, in bundle_lens, as in peeler rays), near, far (NaN\n"
    "if unknown); arrays_version.\n"
    "With --dense N, arrays of n are (h, w, N) or (h, w, N, components), count (h, w, uint32; all\n"
    "fragments of the pixel) replaces ray_splits, and layer exists only with --layer.\n"
    "With (W, H) = bundle_resolution, the point behind pixel (i, j) of the picture at z is\n"
    "  origin + z * direction\n"
    "  + s * (((i + 0.5) / W - 0.5) * size[0] * right - ((j + 0.5) / H - 0.5) * size[1] * up)\n"
    "where s = z for a perspective camera, else 1. See examples/readers.";

}  // namespace

bool ExtractOptions::writesFragments() const {
    return writesLayers() && LayerFiles::needCounts(output);
}

void checkExtractOptions(const ExtractOptions& options) {
    std::vector<fs::path> outputs;
    if (options.writesLayers()) {
        if (options.writesFragments() && options.output.asksForDisplay()) {
            throw Error(ErrorKind::kUsage, "layers in an EXR are stored as rendered",
                        "--background, --exposure, --tone-map",
                        "leave them out, or write .png, .jpg or .tif");
        }
        outputs.push_back(options.output.path);
    }
    if (options.counts) {
        if (isArrayName(options.counts->string())) {
            throw Error(ErrorKind::kUsage, "a picture of counts cannot be written as arrays",
                        "--depth-complexity " + options.counts->string(),
                        "use --npz with --dense, which writes the counts as the array \"count\"");
        }
        OutputRequest output = requestFor(options, *options.counts);
        output.options.as = "composite";
        checkOutput(output, {options.input});
        outputs.push_back(*options.counts);
    }
    if (options.points) {
        outputs.push_back(*options.points);
        checkFile(options, outputs.back(), lowerExtension(outputs.back()) == ".ply", ".ply");
    }
    if (options.arrays) {
        outputs.push_back(*options.arrays);
        checkFile(options, outputs.back(), isArrayName(outputs.back().string()),
                  ".npz or .safetensors");
    }
    if (outputs.empty()) {
        throw Error(ErrorKind::kUsage, "nothing to extract", "",
                    "give one or more of --output, --depth-complexity, --points and --npz");
    }
    if (!options.layers.empty() && options.max_layers != 0) {
        throw Error(ErrorKind::kUsage, "layers can be chosen by number or from the front, not both",
                    "--layer, --layers", "leave one of them out");
    }
    if (!options.writesLayers() && options.output.asksForDisplay()) {
        throw Error(ErrorKind::kUsage, "no layer pictures are written",
                    "--background, --exposure, --tone-map", "leave them out, or add --output");
    }
    checkDenseOptions(options.output, options.arrays && options.output.isGiven("--dense"));
    if (options.double_points && !options.points) {
        throw Error(ErrorKind::kUsage, "no points are written", "--double",
                    "add --points FILE.ply");
    }
    std::vector<fs::path> others = outputs;
    others.push_back(options.input);
    checkReport(options.report, others);
}

void addExtractOptions(VerbOptions& verb, ExtractOptions& options) {
    addFile(verb, "IN", "", options.input, "a layered or deep image (.exr, .safetensors)")
        .files(".exr .safetensors")
        .required();
    addLayeredOptions(verb, options.reading);
    addOutputOptions(verb, options.output);
    verb.option("--output")
        .required(false)
        .description(
            "one file per layer: .exr or .safetensors (all channels, cropped to the layer), .npz "
            "(rgba and z), .png, .jpg, .tif; #### or %04d becomes the layer's number")
        .files(".exr .safetensors .npz .png .jpg .tif");
    const auto add = [&](const char* name, auto& target, const char* endings, const char* help) {
        addFile(verb, name, "FILE", target, help).files(endings).group("Output");
    };
    add("--depth-complexity", options.counts, ".exr .png .jpg .tif",
        "number of fragments per pixel: an .exr with the channel count, or a picture from black to "
        "yellow");
    add("--points", options.points, ".ply",
        "every fragment as a point in world space (binary .ply), with colour, layer, and the "
        "normal and ids if the file has them");
    verb.addFlag("--double", options.double_points,
                 "write x, y, z of --points in 64 bits instead of 32")
        .group("Output");
    add("--npz", options.arrays, ".npz .safetensors",
        "every fragment in NumPy arrays (.npz or .safetensors, see below)");
    addDenseOptions(verb, options.output);
    addObjectOptions(verb, options.objects);
    verb.addRepeated(
            "--layer", "K",
            [&options](const std::string& text) { takeLayers(text, options.layers); },
            "extract only these layers, e.g. 2, 0-3 or 0,2,5-8 (0 is the nearest); may be repeated")
        .group("Layers");
    addValue(
        verb, "--layers", "N|all", options.max_layers,
        [](const std::string& text) { return parseLayers(text); },
        "extract only the N nearest layers (default: all)")
        .group("Layers");
    addThreadsOption(verb, options.threads);
    addMemoryOption(verb, options.memory, "the picture is read and written in bands that fit");
    addReportOptions(verb, options.report);
    addDryRunOption(verb, options.dry_run);
    verb.footer(kExtractFooter);
}

}  // namespace peeler::cmd
