// SPDX-License-Identifier: Apache-2.0
// peeler sheet: the composite and the layers of a picture side by side, labelled.
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <vector>

#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "cmd/options/output_options.h"
#include "cmd/sheet/sheet_cells.h"
#include "cmd/sheet/sheet_sources.h"
#include "cmd/verbs.h"
#include "core/base/error.h"
#include "formats/file/file_name.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr Choice<SheetShow> kShows[] = {
    {"color", SheetShow::kColor, "the composite, and the colour of every layer"},
    {"depth", SheetShow::kDepth, "the depth of every layer, near = white"},
};

constexpr Choice<SheetMethods> kMethodChoices[] = {
    {"unsorted", SheetMethods::kUnsorted, "blending in draw order, beside the composite"},
    {"all", SheetMethods::kAll,
     "instead of the layers every method's composite, with its geometry passes and its error "
     "against the first"},
    {"none", SheetMethods::kNone, "only what the layers tell"},
};

struct SheetOptions {
    SheetRequest request;
    std::optional<int> shadow_size;
    int columns = 0;  ///< 0 = near-square
    OutputRequest output;
    std::set<std::string> given;  ///< options for scenes that are on the command line
};

constexpr const char* kOutputHelp = "the file to write: .png, .jpg, .jpeg, .tif, .tiff";

/// One sheet. run() lists its stages.
class Sheet {
  public:
    Sheet(const SheetOptions& options, Console& console)
        : options_(options), console_(console), job_(options.request, console) {}

    void run() {
        checkOptions();
        makeCells();
        writeSheet();
        report();
    }

  private:
    void checkOptions();
    void makeCells();
    void refuseSceneOptions() const;
    void writeSheet();
    void report();

    const SheetOptions& options_;
    Console& console_;
    CaptureJob job_;
    SheetContent content_;
};

void Sheet::checkOptions() {
    const SheetRequest& request = options_.request;
    std::vector<fs::path> files{request.scene.file};
    if (const auto file = environmentFile(request.appearance)) files.push_back(*file);
    checkOutput(options_.output, files);
    const OutputFormat& format = findOutputFormat(options_.output.path.string(), "composite");
    if (!format.for_display) {
        throw Error(ErrorKind::kUsage, "a sheet is a picture to look at",
                    options_.output.path.string(), "choose one of: .png, .jpg, .tif");
    }
    files.push_back(options_.output.path);
    checkReport(request.report, files);
    const bool depth = request.cells.show == SheetShow::kDepth;
    if (request.cells.progression && depth) {
        throw Error(ErrorKind::kUsage, "a composite has no depth of its own",
                    "--progression, --show depth", "leave one of them out");
    }
    if (request.capture.tail == Tail::kBlend) {
        throw Error(ErrorKind::kUsage, "a sheet shows layers as they are found", "--tail blend",
                    "leave it out, or render a composite with it");
    }
    if (request.methods == SheetMethods::kAll &&
        (request.cells.progression || depth || request.capture.max_layers != 0 ||
         request.capture.occlusion_ratio > 0)) {
        throw Error(ErrorKind::kUsage, "methods are compared by the composites of all layers",
                    "--methods all",
                    "leave out --progression, --show depth, --layers and --occlusion-ratio");
    }
    checkCamera(request.camera);
    checkClipOptions(request.clip);
    job_.checkOptions();
}

void Sheet::makeCells() {
    const SheetRequest& request = options_.request;
    const FileKind kind = fileKind(request.scene.file.string());
    if (kind == FileKind::kGltf) {
        content_ = sheetOfScene(request, job_, console_);
    } else if (kind == FileKind::kExr) {
        refuseSceneOptions();
        content_ = sheetOfFile(request, job_, console_);
    } else {
        throw Error(ErrorKind::kInput, "neither a glTF scene nor a layered depth image",
                    request.scene.file.string(),
                    "sheet shows .gltf, .glb and the .exr of peeler render");
    }
}

void Sheet::refuseSceneOptions() const {
    if (options_.given.empty()) return;
    throw Error(ErrorKind::kUsage, "the option is for scenes, and this is an image",
                *options_.given.begin(), "leave it out, or make the sheet of the scene");
}

void Sheet::writeSheet() {
    SheetStyle style;
    style.columns = options_.columns;
    const OutputOptions& asked = options_.output.options;
    if (options_.output.isGiven("--background")) style.background = asked.background;
    // Grey means depth, so what lies behind the depths is not grey.
    constexpr std::array<float, 4> kBehindDepth{0.42F, 0.55F, 0.74F, 1};
    const bool depth = options_.request.cells.show == SheetShow::kDepth;
    if (depth && !style.background) style.background = kBehindDepth;
    style.exposure = content_.exposure.value_or(asked.exposure);
    if (options_.output.isGiven("--tone-map"))
        style.tone_map = asked.tone_map;
    else if (!depth)  // greys that mean depths stay as they are
        style.tone_map = toneMaps().front().name;
    content_.result.display = {style.tone_map, style.exposure, content_.exposure.has_value(), 0};
    const CompositeImage page = layOut(content_.cells, style);
    content_.result.width = page.window.width();
    content_.result.height = page.window.height();
    const StageTimer timer(job_.times(), "encode");
    OutputOptions output;  // the page is finished: no exposure or tone map any more
    output.provenance.version = PEELER_VERSION;
    writePicture(options_.output.path.string(), page, output);
}

void Sheet::report() {
    job_.finish(content_.result);
    content_.result.setFile(options_.output.path);
    noteDisplay(content_.result, console_);
    Json found = findingsOf(content_.result);
    found["cells"] = Json::array();
    for (const SheetCell& cell : content_.cells) {
        Json entry = {{"label", cell.label}, {"detail", cell.detail}};
        if (cell.has_error) {
            entry["max"] = cell.error.largest;
            entry["rmse"] = cell.error.rmse();
        }
        if (cell.passes != 0) entry["passes"] = cell.passes;
        found["cells"].push_back(entry);
    }
    found["cellsOmitted"] = content_.omitted;
    if (content_.omitted != 0) {
        console_.note(countText(content_.omitted, "cell") + " of " +
                      std::to_string(content_.omitted + content_.cells.size()) +
                      " left out; --cells " +
                      std::to_string(content_.omitted + content_.cells.size()) + " shows all");
    }
    reportResult(options_.request.report, toJson(content_.result, found), summary(content_.result),
                 console_);
}

void addCellOptions(VerbOptions& verb, SheetOptions& options) {
    constexpr const char* kGroup = "Cells";
    const auto within = [](int least, int most) {
        return [least, most](const std::string& text) {
            return static_cast<int>(parseInteger(text, least, most));
        };
    };
    addChoice<SheetShow>(verb, "--show", options.request.cells.show, kShows, "thing to show",
                         "what the cells show:")
        .group(kGroup);
    verb.addFlag("--progression", options.request.cells.progression,
                 "composites of the nearest 1, 2, … layers instead of the layers, each with its "
                 "error against that of all")
        .group(kGroup);
    addChoice<SheetMethods>(verb, "--methods", options.request.methods, kMethodChoices,
                            "choice of methods",
                            "of a scene, composites that methods blend while they render:")
        .group(kGroup);
    addValue(verb, "--cells", "N", options.request.cells.most_cells, within(1, 1000),
             "most cells; the rest are left out (default: 24)")
        .group(kGroup);
    addValue(verb, "--columns", "N", options.columns, within(1, 1000),
             "cells beside each other (default: near-square)")
        .group(kGroup);
    addValue(verb, "--cell-width", "PIXELS", options.request.cells.cell_width, within(16, 8192),
             "width of a cell, at most that of the picture (default: 320)")
        .group(kGroup);
}

/// The options on the command line that have a meaning for scenes only.
std::set<std::string> sceneOptionsGiven(const VerbOptions& verb) {
    const std::set<std::string> groups{"Scene",  "Animation", "Camera", "Picture",
                                       "Layers", "Clipping",  "Light",  "Machine"};
    const std::set<std::string> everywhere{"--layers", "--threads"};
    std::set<std::string> given;
    for (const Option& option : verb.given()) {
        const std::string name = option.name();
        const bool for_scenes =
            name == "--methods" || (groups.contains(option.group()) && !everywhere.contains(name));
        if (for_scenes) given.insert(name);
    }
    return given;
}

constexpr const char* kSheetFooter =
    "Of a layered file the sheet shows what is in it: options of scene, camera, clipping, light "
    "and\n"
    "machine and those of the layers but --layers are for scenes. An error is that of linear\n"
    "premultiplied R, G, B and A against the composite of all layers. A file has no draw order:\n"
    "unsorted blending is shown of scenes only, and of them beside the composite of all layers.";

}  // namespace

VerbAction declareSheet(VerbOptions& verb) {
    const auto options = std::make_shared<SheetOptions>();
    options->output.options.as = "composite";
    addFile(verb, "IN", "", options->request.scene.file,
            "a layered or deep image (.exr) or a glTF scene (.gltf, .glb)")
        .files(".exr .gltf .glb")
        .required();
    addOutputOptions(verb, options->output);
    verb.option("--output").description(kOutputHelp);
    verb.option("--background")
        .description(
            "behind every cell: transparent (default), r,g,b[,a] in linear light, or #rrggbb[aa] "
            "in sRGB; where it is transparent a checkerboard shows");
    addCellOptions(verb, *options);
    addShownOptions(verb, options->request);
    addCameraOptions(verb, options->request.camera);
    addLayerOptions(verb, options->request.capture);
    addClipOptions(verb, options->request.clip);
    addLightOptions(verb, options->request.capture, options->shadow_size);
    addAppearanceOptions(verb, options->request.appearance);
    addRunOptions(verb, options->request);
    verb.footer(kSheetFooter);
    return [options, verb](Console& console) {
        options->given = sceneOptionsGiven(verb);
        options->request.output = options->output.path;
        options->request.cells.meters = options->request.cells.show == SheetShow::kColor &&
                                        !options->output.isGiven("--exposure");
        chooseForEyes(verb, options->request.camera, options->request);
        setShadowSize(options->request.capture, options->shadow_size);
        Sheet(*options, console).run();
        return 0;
    };
}

}  // namespace peeler::cmd
